"""What a reader may find too much: functions of more than a page, of many parameters, folders of many entries.

    python tests/advice.py

Advice, not a rule: a function in one piece may be plainer than its parts.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

SOURCES = Path(__file__).parents[1] / "fmu_src"
LINES, PARAMETERS, ENTRIES = 80, 8, 15
SHOWN = 5


def found() -> Iterator[tuple[int, str]]:
    """How much, and of what."""
    for folder in sorted({path.parent for path in SOURCES.rglob("*.py")}):
        entries = sum(entry.name != "__pycache__" for entry in folder.iterdir())
        if entries > ENTRIES:
            yield entries, f"entries {folder.relative_to(SOURCES)}"
    for path in sorted(SOURCES.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.FunctionDef):
                where = f"{path.relative_to(SOURCES)}:{node.lineno} {node.name}"
                lines, parameters = (node.end_lineno or 0) - node.lineno + 1, len(node.args.args + node.args.kwonlyargs)
                if lines > LINES:
                    yield lines, f"lines {where}"
                if parameters > PARAMETERS:
                    yield parameters, f"parameters {where}"


if __name__ == "__main__":
    for what in ("lines", "parameters", "entries"):
        rows = sorted((row for row in found() if row[1].startswith(what)), reverse=True)
        print(
            f"advice: {len(rows)} of many {what}, most: "
            + ", ".join(f"{text.partition(' ')[2]} ({n})" for n, text in rows[:SHOWN])
        )
