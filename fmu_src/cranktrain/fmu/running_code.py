"""Python code contained in an FMU: all modules that a running model needs, in a package named after the FMU."""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from cranktrain.core.errors import InputError
from cranktrain.dynamics.outputs.register import FAMILIES as OUTPUT_FAMILIES
from cranktrain.dynamics.time.integrators import FAMILIES as INTEGRATOR_FAMILIES
from cranktrain.film.laws.register import forms

SOURCES = Path(__file__).resolve().parents[2]
"""Folder that contains the package."""
RUNNING = "cranktrain.fmu.running"
"""Module used by the FMU slave (Python class) of a cranktrain; other modules have their own running module."""
FOREIGN = {"numpy", "numba", "llvmlite"} | set(sys.stdlib_module_names)


def registered_modules() -> list[str]:
    """Names of the package's modules to which registers of the running model refer."""
    references = [entry for form in forms() for entry in (form.kernel, form.record, form.memory)]
    references += [family.kernel for family in OUTPUT_FAMILIES.values()]
    references += [entry for family in INTEGRATOR_FAMILIES.values() for entry in (family.step, family.difference)]
    names = {entry.partition(":")[0] for entry in references if isinstance(entry, str)}
    return sorted(name for name in names if name.startswith("cranktrain."))


def running_code(running: str = RUNNING) -> dict[str, bytes]:
    """Source of every module that a running model imports, by path inside the package.

    The search follows module-level imports from ``running``, for the cranktrain also modules named in registers, and
    texts of the form ``"package.module:name"``. Modules that an FMU cannot contain are refused.
    """
    found: dict[str, bytes] = {}
    waiting = [running, *(registered_modules() if running == RUNNING else [])]
    while waiting:
        module = waiting.pop()
        place = SOURCES / Path(*module.split("."))
        file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
        if not file.is_file():
            raise InputError(f"{module}: no such module; the running model imports it")
        name = file.relative_to(SOURCES / "cranktrain").as_posix()
        if name in found:
            continue
        found[name] = file.read_bytes()
        waiting += re.findall(r'"(cranktrain\.[.\w]+):\w+"', found[name].decode())
        waiting += [".".join(module.split(".")[:n]) for n in range(1, module.count(".") + 1)]
        for imported in _imports(found[name], module):
            top = imported.split(".")[0]
            if top == "cranktrain":
                waiting.append(imported)
            elif top not in FOREIGN:
                raise InputError(f"{module} imports {top}; the FMU carries numpy and numba only, import it where used")
    return dict(sorted(found.items()))


def _imports(source: bytes, module: str) -> Iterator[str]:
    """Names of modules imported at module level; names imported from a package count if they are modules."""
    blocks: list[ast.stmt] = list(ast.parse(source).body)
    while blocks:
        node = blocks.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.If | ast.Try | ast.With):
            blocks += [child for child in ast.walk(node) if isinstance(child, ast.Import | ast.ImportFrom)]
        elif isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.startswith("cranktrain") and alias.asname is None:
                    raise InputError(f"{module}: write 'import {alias.name} as ...'; the FMU renames the package")
                yield alias.name
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                raise InputError(f"{module}: relative import; name the package in full")
            yield str(node.module)
            for alias in node.names:
                inside = SOURCES / Path(*str(node.module).split(".")) / alias.name
                if inside.is_dir() or inside.with_suffix(".py").is_file():
                    yield f"{node.module}.{alias.name}"


def renamed(source: bytes, package: str) -> bytes:
    """Source whose imports of cranktrain refer to the package of this FMU."""
    return re.sub(rb"(?m)^(\s*(?:from|import)\s+)cranktrain\b", rb"\1" + package.encode(), source)
