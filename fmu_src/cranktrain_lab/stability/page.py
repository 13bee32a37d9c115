"""Markdown page of all maps, with explanations, sources of curves, and deviations from theory."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from cranktrain_lab.stability.stability_map import Boundary, StabilityMap

HEAD = """\
# Where methods fail

Made by

    cranktrain stability --output docs/stability --page docs/stability.md

Each map sets what the running model's own kernels and integrators do, found by bisection, beside theory in plain
NumPy: closed forms, and eigenvalues and stability functions from the films' tangents and the methods' tables.
Deviations are relative, in the parameter that was bisected. `cranktrain stability --map NAME` makes one map,
`--quick` coarse ones; computed maps are kept, so that an interrupted run goes on. All data comes as JSON with
`--json`; the method of each map stands in its module under `fmu_src/cranktrain_lab/stability/`.
"""


def page(maps: Sequence[StabilityMap], pictures: Sequence[str]) -> str:
    """Return the Markdown page of some maps; ``pictures`` are the pictures' paths relative to the page."""
    parts = [HEAD]
    parts.append("| map | largest difference of what was found from theory |\n| --- | --- |")
    for found in maps:
        parts[-1] += f"\n| [{found.name}](#{found.name}) | {shown_deviation(found)} |"
    for found, picture in zip(maps, pictures, strict=True):
        parts.append(f"## {found.name}\n\n![{found.title}]({picture})")
        parts.append("\n".join(f"* {line.strip()}" for line in found.explanation.strip().splitlines()))
        rows = [("theory", b) for b in found.theory] + [("found", b) for b in found.numerical]
        table = "| curve | | from |\n| --- | --- | --- |"
        for kind, boundary in rows:
            table += f"\n| {_cell(boundary.label)} | {kind} | {_cell(boundary.source + _verdicts(boundary))} |"
        parts.append(table)
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _verdicts(boundary: Boundary) -> str:
    """Return a text on points of the curve without a value: verdicts and their numbers."""
    counts = Counter(verdict for verdict in boundary.verdicts if " " in verdict)
    return "".join(f"; {verdict}: {count} of {len(boundary.verdicts)}" for verdict, count in sorted(counts.items()))


def shown_deviation(found: StabilityMap) -> str:
    """Return a map's largest deviation between theory and product as text."""
    return "no theory" if found.max_deviation is None else f"{100.0 * found.max_deviation:.2g} %"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
