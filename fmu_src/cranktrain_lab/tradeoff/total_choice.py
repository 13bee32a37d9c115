"""Recommended choice for an accuracy: the cheapest one whose total error in an output family is within it."""

from collections.abc import Iterable, Sequence

from cranktrain.studies.total_error.families import FAMILIES
from cranktrain.studies.total_error.point import PARTS, TotalPoint, at_scene, shown
from cranktrain_lab.tradeoff.study import TotalStudy

ACCURACIES = (0.1, 0.03, 0.01)
NONE = "–"


def cheapest(points: Iterable[TotalPoint], accuracies: dict[str, float]) -> TotalPoint | None:
    """Return the cheapest point whose total errors are within the accuracy of each family; None if there is none."""
    within = []
    for point in points:
        totals = {family: total for family in accuracies if (total := point.total(family)) is not None}
        if len(totals) == len(accuracies) and all(total <= accuracies[name] for name, total in totals.items()):
            within.append((point.cost or 0.0, max(totals.values(), default=0.0), point))
    return min(within, key=lambda entry: entry[:2], default=(0.0, 0.0, None))[2]


def closest(points: Iterable[TotalPoint], family: str) -> TotalPoint | None:
    """Return the point with the least total error in a family; None if no point has outputs of this family."""
    return min(shown(points, family), key=lambda p: p.total(family) or 0.0, default=None)


def table_rows(points: Sequence[TotalPoint]) -> list[list[str]]:
    """Return a row for each measured family: its title, and the recommended choice for each of ``ACCURACIES``."""
    rows = []
    for name, family in FAMILIES.items():
        best = closest(points, name)
        if best is None:
            continue
        row = [family.title]
        for accuracy in ACCURACIES:
            found = cheapest(points, {name: accuracy})
            row.append(said(found, name) if found is not None else f"none; closest {said(best, name)}")
        rows.append(row)
    return rows


def said(point: TotalPoint, family: str) -> str:
    """Format a choice as text with its cost and its total error in a family."""
    return f"{point.label}: {rate(point.cost)}, {percent(point.total(family))}"


def rate(cost: float | None) -> str:
    """Format a cost (processor seconds per simulated second) with two digits and no exponent."""
    value = float(f"{cost or 0.0:.2g}")
    return f"{value:.0f} s/s" if value >= 10.0 else f"{value:g} s/s"


def percent(value: float | None) -> str:
    """Format a relative error in per cent with two digits."""
    if value is None:
        return NONE
    shown = 100.0 * value
    return f"{shown:.0f} %" if shown >= 9.95 else f"{shown:.1f} %" if shown >= 0.995 else f"{shown:.2g} %"


def default_rows(points: Sequence[TotalPoint]) -> list[list[str]]:
    """Return a row per family on the default choice: its errors, and a cheaper choice that is as accurate, if any.

    The last row is for all families together, with the cheapest choice that is as accurate in each of them.
    """
    rows = []
    own = next((p for p in points if p.default), None)
    totals: dict[str, float] = {}
    for name, family in FAMILIES.items():
        total = None if own is None else own.total(name)
        if own is None or total is None:
            continue
        totals[name] = total
        other = cheapest(points, {name: total})
        on = name in own.front
        better = "on the front" if on or other is None else f"{said(other, name)}"
        parts = [percent(getattr(own.errors[name], part, None)) for part in PARTS]
        rows.append([family.title, percent(total), *parts, better])
    other = cheapest(points, totals)
    if own is not None and other is not None:
        better = "on the front" if other == own else f"{other.label}: {rate(other.cost)}"
        rows.append(["all of these together", *[NONE] * 4, better])
    return rows


HEADER = ("outputs", *(f"for {100 * accuracy:g} %" for accuracy in ACCURACIES))


def total_choice_text(study: TotalStudy) -> str:
    """Return a text on each scene: best model, recommended choice for each accuracy, and errors of the default."""
    lines = [
        "What to choose for a total error, from the measured points. Errors are RMS of the difference over the last",
        "cycle over the RMS of the alternating part, against the best model there is; cost is in processor seconds per",
        "simulated second of a settled cycle.",
    ]
    for scene in study.scenes:
        points, best = at_scene(study.points, scene.name), study.best[scene.name]
        grid = ", fine grid" if best.fine_grid else ""
        lines += ["", f"{scene.name}, against {best.name}, {best.integrator} {best.step_deg:g} deg{grid}"]
        for title, *cells in table_rows(points):
            lines.append(f"  {title}")
            lines += [f"    {what}  {cell}" for what, cell in zip(HEADER[1:], cells, strict=True)]
        own = next((p for p in points if p.default), None)
        if own is not None:
            lines.append(f"  the default, {own.label} at {rate(own.cost)}")
            for title, total, model, numerical, settling, better in default_rows(points):
                parts = f"{total} (model {model}, numerical {numerical}, settling {settling}); "
                lines.append(f"    {title}: {parts if total != NONE else ''}{better}")
    return "\n".join(lines) + "\n"
