"""The house keeps its order: what the tree of sources promises its reader, counted."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from some import some

import cranktrain

ROOT = Path(cranktrain.__file__).parent
SOURCES, LAB = ROOT.parent, "cranktrain_lab"
FILES = dict.fromkeys(
    sorted(path.relative_to(SOURCES).as_posix() for name in (ROOT.name, LAB) for path in (SOURCES / name).rglob("*.py"))
)
KERNELS = ("kernel", "inlined_kernel", "law_kernel")  # decorators of cranktrain.core.kernel


@cache
def tree_of(file: str) -> ast.Module:
    """Syntax of a file; only the process that counts here holds the millions of its objects."""
    return ast.parse((SOURCES / file).read_text("utf-8"))


def functions(file: str) -> Iterator[ast.FunctionDef]:
    return (node for node in ast.walk(tree_of(file)) if isinstance(node, ast.FunctionDef))


def kernels(file: str) -> Iterator[ast.FunctionDef]:
    for function in functions(file):
        if any(ast.unparse(decorator) in KERNELS for decorator in function.decorator_list):
            yield function


def imports(file: str) -> Iterator[str]:
    """Files of the packages that a file imports, those inside functions as well."""
    for node in ast.walk(tree_of(file)):
        if not isinstance(node, ast.ImportFrom) or not str(node.module).startswith("cranktrain"):
            continue
        parts = str(node.module).split(".")
        for place in [parts, *([*parts, alias.name] for alias in node.names)]:
            name = "/".join(place) + ".py"
            if name in FILES:
                yield name


def test_imports_go_round_in_no_circle():
    """Not even through imports inside functions."""
    known = {file: set(imports(file)) for file in FILES}
    while leaves := [file for file, others in known.items() if not others]:
        for leaf in leaves:
            del known[leaf]
        for others in known.values():
            others.difference_update(leaves)
    assert not known


CONTRACTS = tomllib.loads((SOURCES.parent / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
LAYERS = {contract["containers"][0]: contract["layers"] for contract in CONTRACTS if contract["type"] == "layers"}
"""Which folder of a package is above which, the highest first, as the contracts say."""


def rank(package: str, layer: str) -> int:
    """Place of a folder of a package among its layers, 0 the lowest."""
    rows = [row.replace("|", " ").split() for row in LAYERS[package]]
    return next(k for k, row in enumerate(reversed(rows)) if layer in row)


def assigned(statement: ast.stmt) -> list[str]:
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        return [statement.name]
    if not isinstance(statement, ast.Assign | ast.AnnAssign):
        return []
    return [node.id for node in ast.walk(statement) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]


def test_no_module_gives_an_imported_name_another_meaning():
    """A fixture that took the later one ran for none of its engines, and passed."""
    sources = [path for folder in (SOURCES, Path(__file__).parents[1]) for path in folder.rglob("*.py")]
    for path in some(sources):
        statements = ast.parse(path.read_text("utf-8")).body
        imports = [name for one in statements if isinstance(one, ast.Import | ast.ImportFrom) for name in one.names]
        names = {(name.asname or name.name).partition(".")[0] for name in imports}
        assert not names & {name for one in statements for name in assigned(one)}, path.name


def test_no_layer_is_jumped_by_a_string():
    """Rows of registers may name functions of their own layer, or of a lower one, which an import contract never sees.

    A register whose functions are in a higher layer is filled from there. One file of the core names the laboratory, in
    code, that is: comments and docstrings may send a reader there.
    """
    jumps, of_lab = [], set()
    for file in FILES:
        package, *place = file.split("/")
        strings = {str(node.value) for node in ast.walk(tree_of(file)) if isinstance(node, ast.Constant)}
        if package != LAB and any(re.match(rf"{LAB}\.[\w.:]+$", one) for one in strings):
            of_lab.add(file)
        for one in strings if len(place) > 1 else ():
            if re.fullmatch(r"cranktrain(_lab)?(\.\w+)+(:\w+)?", one):
                top, other = one.partition(":")[0].split(".")[:2]
                if (SOURCES / top / other).is_dir() and (
                    top == LAB if top != package else rank(top, other) > rank(top, place[0])
                ):
                    jumps.append((file, one))
    assert not jumps and of_lab == {"cranktrain/lab.py"}


MAKERS = {entry.stem for entry in (ROOT / "studies").iterdir()} - {
    "__init__", "__pycache__", "output_levels", "planning", "requests", "scene", "total_error",
}  # fmt: skip
"""Folders and files of ``studies`` that make studies, as the contract in pyproject.toml lists them."""


@pytest.mark.parametrize("start", ["fmu", "cli/plan", "studies/planning", "studies/total_error"])
def test_plans_and_fmus_reach_no_maker_of_studies(start):
    """Imports inside functions and names in strings count too: a shipped figure has a reader apart from its maker."""
    found = {file for file in FILES if file.startswith((f"cranktrain/{start}/", f"cranktrain/{start}.py"))}
    waiting = list(found)
    while waiting:
        file = waiting.pop()
        strings = re.findall(r'"(cranktrain[\w.]*):\w+"', (SOURCES / file).read_text("utf-8"))
        new = {*imports(file), *(f"{name.replace('.', '/')}.py" for name in strings)} & set(FILES) - found
        found |= new
        waiting += new
    assert not any(file.startswith(LAB) for file in found)
    reached = {Path(file).parts[2].removesuffix(".py") for file in found if file.startswith("cranktrain/studies/")}
    assert {"output_levels", "total_error"} <= reached and not reached & MAKERS
    named = next(c["forbidden_modules"] for c in CONTRACTS if "makes studies" in c["name"])
    assert {name.rpartition(".")[2] for name in named} == MAKERS


RUN = """
import json, sys
from cranktrain.cli.main import main
main(sys.argv[1:])
print("\\n", json.dumps({name: getattr(module, "__file__", None) or "" for name, module in sys.modules.items()}))
"""


def test_a_run_imports_what_it_runs(tmp_path):
    """No finite elements, no readers of meshes, tables or scenes, no films of other levels; less than 50,000 lines."""
    options = ["--speed=2000", "--cycles=1", "--crank=rigid", "--bearings=impedance", "--output=run.h5"]
    command = [sys.executable, "-c", RUN, "simulate", "diesel_i6", *options]
    done = subprocess.run(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True, check=True)
    places = json.loads(done.stdout.splitlines()[-1])
    own = {name: Path(place) for name, place in places.items() if name.split(".")[0] in ("cranktrain", LAB)}
    assert sum(len(path.read_text("utf-8").splitlines()) for path in own.values() if path.suffix == ".py") < 50_000
    of_others = ("core.text_table", "film.elastic", "film.table", "structure.fem.mesh", "structure.fem.superelement")
    found = {name for name in own if name.removeprefix("cranktrain.").startswith((*of_others, "studies.scene"))}
    assert not found and not {"skfem", "netgen", "matplotlib", "pandas"} & places.keys()


def literal(index: ast.AST) -> bool:
    """True if a subscript states an integer of 3 or more by itself."""
    if isinstance(index, ast.Constant):
        return isinstance(index.value, int) and index.value >= 3
    ends = (index.lower, index.upper) if isinstance(index, ast.Slice) else getattr(index, "elts", ())
    return any(literal(one) for one in ends if one is not None)


LEVELS = {"LAW", "LINEAR", "IMPEDANCE", "TABLE", "REYNOLDS", "EHD", "ROLLER", "IS_LINEAR"}


def test_slots_have_names_and_no_kernel_asks_which_law_it_is():
    """A law is chosen where the model is made: no kernel compares with a law's or a level's number."""
    nodes = [(file, node) for file in FILES for function in kernels(file) for node in ast.walk(function)]
    slots = [(file, node.lineno) for file, node in nodes if isinstance(node, ast.Subscript) and literal(node.slice)]
    compared = [(file, node) for file, node in nodes if isinstance(node, ast.Compare)]
    asked = [(file, node.lineno) for file, node in compared if LEVELS & {getattr(n, "id", "") for n in ast.walk(node)}]
    assert nodes and slots == [] and asked == []


def asserts(node: ast.AST) -> bool:
    """True if a statement has an ``assert``, ``np.testing.assert_…``, or an error that is expected, in it."""
    calls = [one.func for one in ast.walk(node) if isinstance(one, ast.Call)]
    names = [call.attr if isinstance(call, ast.Attribute) else getattr(call, "id", "") for call in calls]
    known = any(name.startswith("assert_") or name in ("raises", "warns", "fail", "one_line") for name in names)
    return known or any(isinstance(one, ast.Assert) for one in ast.walk(node))


def written_out(items: ast.expr, constants: set[str]) -> bool:
    """True if the items of a loop stand in the file, or are taken by ``some``, which fails where there is none."""
    if isinstance(items, ast.Tuple | ast.List | ast.Set | ast.Dict | ast.Constant):
        return True
    if isinstance(items, ast.Name):
        return items.id.isupper() or items.id in constants
    if isinstance(items, ast.Attribute):
        return items.attr.isupper() or written_out(items.value, constants)
    if not isinstance(items, ast.Call):
        return False
    of = [items.func.value] if isinstance(items.func, ast.Attribute) else []
    return getattr(items.func, "id", "") == "some" or any(written_out(one, constants) for one in [*of, *items.args])


def certain(body: list[ast.stmt], constants: set[str]) -> bool:
    """True if one of the statements asserts whatever the data are."""
    for statement in body:
        if isinstance(statement, ast.For):
            found = written_out(statement.iter, constants) and certain(statement.body, constants)
        elif isinstance(statement, ast.If):
            found = certain(statement.body, constants) and certain(statement.orelse, constants)
        elif isinstance(statement, ast.With):
            found = any(map(asserts, statement.items)) or certain(statement.body, constants)
        elif isinstance(statement, ast.Try):
            ends = [[*statement.body, *statement.orelse], *(handler.body for handler in statement.handlers)]
            found = all(certain(end, constants) for end in ends) or certain(statement.finalbody, constants)
        else:
            found = asserts(statement)
        if found:
            return True
    return False


def test_no_test_passes_on_nothing():
    """A loop over data that may be empty, or a condition that may not hold, is no assertion; ``some`` makes it one."""
    found = []
    for path in sorted(Path(__file__).parents[1].rglob("test_*.py")):
        for test in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not (isinstance(test, ast.FunctionDef) and test.name.startswith("test_") and asserts(test)):
                continue
            constants = {name for node in ast.walk(test) for name in assigned_literally(node)}
            if not certain(test.body, constants):
                found.append(f"{path.name}:{test.lineno}")
    assert found == []


def assigned_literally(node: ast.AST) -> list[str]:
    """Names that a statement gives items which stand in it."""
    if not (isinstance(node, ast.Assign) and written_out(node.value, set())):
        return []
    return [target.id for target in node.targets if isinstance(target, ast.Name)]
