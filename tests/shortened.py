"""Start a script as ``python SCRIPT ARGUMENTS`` does, with other values of its constants.

    python tests/shortened.py SCRIPT CONSTANTS [ARGUMENTS …]

CONSTANTS is a JSON object of module constants by name. They are set after the definitions of the script and before its
last block, ``if __name__ == "__main__"``. A name that the script does not define is refused, so that a constant that is
renamed is noticed. Lists become tuples, or arrays where the constant was one; of a table a
list names the entries to keep. The script may not write into the sources or the documentation.
"""

from __future__ import annotations

import ast
import json
import os
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
COMMITTED = tuple(str(ROOT / name) + os.sep for name in ("benchmarks", "docs", "examples", "fmu_src", "tests"))


def keep_committed(event: str, arguments: tuple[object, ...]) -> None:
    """Audit hook: refuse to open a file of these folders for writing, byte code excepted."""
    if event != "open" or not isinstance(arguments[0], (str, os.PathLike)) or not isinstance(arguments[2], int):
        return
    path = os.path.abspath(os.fspath(arguments[0]))
    if arguments[2] & (os.O_WRONLY | os.O_RDWR) and path.startswith(COMMITTED) and "__pycache__" not in path:
        raise PermissionError(f"{path} is part of the sources; a benchmark does not write there")


def main(script: str, constants: str, *arguments: str) -> None:
    """Run the script in this process as its main program."""
    sys.addaudithook(keep_committed)
    path = Path(script).resolve()
    tree = ast.parse(path.read_text("utf-8"), str(path))
    block = tree.body.pop()
    if not (isinstance(block, ast.If) and "__main__" in ast.unparse(block.test)):
        sys.exit(f"{path.name}: the last block is not if __name__ == '__main__'")
    sys.argv = [str(path), *arguments]
    sys.path[0] = str(path.parent)
    names = sys.modules["__main__"].__dict__
    names["__file__"] = str(path)
    names["__doc__"] = ast.get_docstring(tree, clean=False)
    exec(compile(tree, str(path), "exec"), names)
    for name, value in json.loads(constants).items():
        if name not in names:
            sys.exit(f"{path.name} has no constant '{name}'")
        names[name] = _like(names[name], value)
    exec(compile(ast.Module([block], []), str(path), "exec"), names)


def _like(former: object, value: object) -> object:
    """The value as an array where the former one was; of a table the entries named; lists as tuples."""
    if isinstance(former, np.ndarray):
        return np.asarray(value)
    if isinstance(former, dict) and isinstance(value, list):
        return {name: former[name] for name in value}
    return tuple(_like(None, each) for each in value) if isinstance(value, list) else value


if __name__ == "__main__":
    main(*sys.argv[1:])
