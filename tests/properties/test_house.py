"""The house keeps its order: what the tree of sources promises its reader, counted.

Kernels are the functions under the decorators of :mod:`cranktrain.core.kernel`.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import cranktrain

ROOT = Path(cranktrain.__file__).parent
FILES = dict.fromkeys(sorted(path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*.py")))
LONG, MANY = 80, 8
KERNELS = ("kernel", "inlined_kernel", "law_kernel")
REASON = "# In one piece:"
"""A comment that begins so, above a function or within its first lines, says why it is long or takes much."""


@cache
def tree_of(file: str) -> ast.Module:
    """Syntax of a file; only the process that counts here holds the millions of its objects."""
    return ast.parse((ROOT / file).read_text("utf-8"))


def functions(file: str) -> Iterator[ast.FunctionDef]:
    return (node for node in ast.walk(tree_of(file)) if isinstance(node, ast.FunctionDef))


def kernels(file: str) -> Iterator[ast.FunctionDef]:
    for function in functions(file):
        if any(ast.unparse(decorator) in KERNELS for decorator in function.decorator_list):
            yield function


def entries(folder: Path) -> list[str]:
    return [entry.name for entry in folder.iterdir() if entry.name != "__pycache__"]


def test_a_reader_finds_a_thing_where_its_name_says():
    of_tools = {"__init__.pyi", "py.typed", "__main__.py"}  # of editors, and of python -m
    assert len(set(entries(ROOT)) - of_tools) <= 15
    assert len(entries(ROOT / "film")) <= 9


def imports(file: str) -> Iterator[str]:
    """Files of the package that a file imports, those inside functions as well."""
    for node in ast.walk(tree_of(file)):
        if not isinstance(node, ast.ImportFrom) or not str(node.module).startswith("cranktrain"):
            continue
        parts = str(node.module).split(".")[1:]
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


LAYERS = tomllib.loads((ROOT.parents[1] / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"][0]
"""The contract that says which folder is above which, the highest first."""


def rank(layer: str) -> int:
    """Place of a folder of the package among the layers, 0 the lowest."""
    rows = [row.replace("|", " ").split() for row in LAYERS["layers"]]
    return next(k for k, row in enumerate(reversed(rows)) if layer in row)


def imported(statement: ast.stmt) -> list[str]:
    if isinstance(statement, ast.Import | ast.ImportFrom):
        return [(name.asname or name.name).partition(".")[0] for name in statement.names]
    return []


def assigned(statement: ast.stmt) -> list[str]:
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        return [statement.name]
    if not isinstance(statement, ast.Assign | ast.AnnAssign):
        return []
    return [node.id for node in ast.walk(statement) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]


def test_no_module_gives_an_imported_name_another_meaning():
    """A fixture that took the later one ran for none of its engines, and passed."""
    sources = [path for folder in (ROOT, Path(__file__).parents[1]) for path in folder.rglob("*.py")]
    for path in sources:
        statements = ast.parse(path.read_text("utf-8")).body
        names = {name for one in statements for name in imported(one)}
        assert not names & {name for one in statements for name in assigned(one)}, path.name


def test_no_layer_is_jumped_by_a_string():
    """Rows of registers may name functions of their own layer, or of a lower one, which an import contract never sees.

    A register whose functions are in a higher layer is filled from there.
    """
    jumps = []
    for file in FILES:
        if "/" not in file:
            continue
        for node in ast.walk(tree_of(file)):
            if isinstance(node, ast.Constant) and re.fullmatch(r"cranktrain(\.\w+)+(:\w+)?", str(node.value)):
                other = str(node.value).split(".")[1].partition(":")[0]
                if (ROOT / other).is_dir() and rank(other) > rank(file.split("/")[0]):
                    jumps.append((file, node.value))
    assert not jumps


MAKERS = {entry.stem for entry in (ROOT / "studies").iterdir()} - {
    "__init__", "__pycache__", "answers", "planning", "scene", "total_error",
}  # fmt: skip
"""Folders and files of ``studies`` that make studies, as the contract in pyproject.toml lists them."""


@pytest.mark.parametrize("start", ["fmu", "cli/plan", "studies/planning", "studies/total_error"])
def test_plans_and_fmus_reach_no_maker_of_studies(start):
    """Imports inside functions and names in strings count too: a shipped figure has a reader apart from its maker."""
    found = {file for file in FILES if file.startswith((f"{start}/", f"{start}.py"))}
    waiting = list(found)
    while waiting:
        file = waiting.pop()
        strings = re.findall(r'"cranktrain\.([\w.]+):\w+"', (ROOT / file).read_text("utf-8"))
        new = {*imports(file), *(f"{name.replace('.', '/')}.py" for name in strings)} & set(FILES) - found
        found |= new
        waiting += new
    reached = {Path(file).parts[1].removesuffix(".py") for file in found if file.startswith("studies/")}
    assert {"answers", "total_error"} <= reached and not reached & MAKERS


def test_the_contract_names_every_maker_of_studies():
    contracts = tomllib.loads((ROOT.parents[1] / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]
    named = next(c["forbidden_modules"] for c in contracts["contracts"] if "makes studies" in c["name"])
    assert {name.rpartition(".")[2] for name in named} == MAKERS


def reasoned(file: str, function: ast.FunctionDef) -> bool:
    """Whether a function says why it is longer, or takes more, than others."""
    lines = (ROOT / file).read_text("utf-8").splitlines()
    first = min([function.lineno, *(decorator.lineno for decorator in function.decorator_list)]) - 1
    above = []
    while first > 0 and lines[first - 1].lstrip().startswith("#"):
        first -= 1
        above.append(lines[first])
    inside = lines[function.lineno - 1 : function.end_lineno]
    return any(line.lstrip().startswith(REASON) for line in above + inside)


def test_a_function_does_one_thing_on_one_page():
    long = [(file, f) for file in FILES for f in functions(file) if f.end_lineno - f.lineno + 1 > LONG]
    assert len(long) <= 5, [(file, f.name) for file, f in long]
    assert [(file, f.name) for file, f in long if not reasoned(file, f)] == []


def test_what_belongs_together_travels_in_one_record():
    many = [(file, f) for file in FILES for f in functions(file) if len(f.args.args) + len(f.args.kwonlyargs) > MANY]
    assert [(file, f.name) for file, f in many if not reasoned(file, f)] == []


def literals(index: ast.expr) -> Iterator[int]:
    """Integers of 3 and more that a subscript states by themselves."""
    if isinstance(index, ast.Constant) and isinstance(index.value, int) and index.value >= 3:
        yield index.value
    elif isinstance(index, ast.Tuple):
        for element in index.elts:
            yield from literals(element)
    elif isinstance(index, ast.Slice):
        for end in (index.lower, index.upper):
            if end is not None:
                yield from literals(end)


def test_slots_have_names():
    found = [
        f"{file}:{node.lineno}"
        for file in FILES
        for function in kernels(file)
        for node in ast.walk(function)
        if isinstance(node, ast.Subscript) and any(literals(node.slice))
    ]
    assert found == []


@pytest.mark.parametrize("folder", ["dynamics", "loads", "film"])
def test_no_kernel_asks_which_law_it_is(folder):
    """A law is chosen where the model is made: no kernel compares with a law's or a level's number."""
    names = {"LAW", "LINEAR", "IMPEDANCE", "TABLE", "REYNOLDS", "EHD", "ROLLER", "IS_LINEAR"}
    found = [
        f"{file}:{test.lineno}"
        for file in FILES
        if file.startswith(f"{folder}/")
        for function in kernels(file)
        for test in ast.walk(function)
        if isinstance(test, ast.Compare) and names & {name.id for name in ast.walk(test) if isinstance(name, ast.Name)}
    ]
    assert found == []
