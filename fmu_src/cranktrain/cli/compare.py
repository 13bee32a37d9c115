"""The verb ``compare``: differences of two results, or of a result and measured orders, within tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cranktrain.cli import console
from cranktrain.cli.functions import Subject, verb
from cranktrain.core.user_file import file_exists, user_path
from cranktrain.results.compared.comparison import Comparison
from cranktrain.results.compared.tolerances import QUANTITIES, USUAL, tolerance_list, tolerances_of
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.results.views.time_series import TimeSeries
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question

if TYPE_CHECKING:
    from cranktrain.results.compared.comparison import Compared

DESCRIPTION = f"""\
Differences of a result from another or from measured orders, by cycle, orders and peaks, with a verdict.

A and B are results of simulate or couple, or of runup, or one of them is a file of measured orders (table or UFF 58),
which always counts as A. Differences are B less A, relative:

{chr(10).join(f"{name:<12}{text}" for name, text in QUANTITIES.items())}

--json prints {{"passed", "a", "b", "tolerances", "differences": [{{"quantity", "output", "unit", "a", "b",
"difference", "order", "speed_rpm", "rms", "phase_deg", "tolerance", "passed"}}], "settings": [{{"name", "a", "b"}}],
"left_out"}}.
Exit code 0: all differences are within their tolerances, 1: some are not, 2: the files cannot be compared.
"""
KINDS = ("TimeSeries", "RunUp")
FILE = Subject("a", "A", "reference: result of simulate, couple or runup, or measured orders", KINDS)
Tolerances = str | float | Sequence[str]


@dataclass(frozen=True)
class Compare(Question):
    """Question of :func:`compare`."""

    b: Annotated[
        words.File | TimeSeries | RunUp, Option("B", "result of the same kind, or measured orders", place=True)
    ]  # fmt: skip
    _: KW_ONLY
    tolerance: Annotated[
        Tolerances,
        Option(
            "LIST",
            "tolerance of all quantities, or QUANTITY=tolerance, separated by commas, e.g. 0.01,damping=0.1 "
            f"(default {USUAL:g})",
            convert=tolerance_list,
        ),
    ] = ()
    outputs: Annotated[
        str | None, Option("NAMES", "outputs to be compared, separated by commas (default: all that both have)")
    ] = None
    picture: Annotated[
        words.File | None, Option("FILE.png", "picture of both and their difference, of the output that differs most")
    ] = None


@verb(Compare, DESCRIPTION, FILE)
def compare(a: str | Path | TimeSeries | RunUp, ask: Compare) -> Comparison:
    """Read both sides, compare them, and draw the picture."""
    from cranktrain.results.compared.comparison import compared
    from cranktrain.results.figures import PICTURE
    from cranktrain.store.whole_file import check_place

    if ask.picture is not None:
        check_place(user_path(ask.picture), PICTURE)
    names = [str(one) if isinstance(one, str | Path) else letter for one, letter in ((a, "A"), (ask.b, "B"))]
    names[1] += " (B)" if names[0] == names[1] else ""
    sides = dict(zip(names, map(_read, (a, ask.b)), strict=True))
    assert isinstance(ask.tolerance, tuple)  # as tolerance_list has made it
    found = compared(sides, [name for name in (ask.outputs or "").split(",") if name], tolerances_of(ask.tolerance))
    if ask.picture is not None:
        found.plot(ask.picture)
        found["picture"] = str(ask.picture)
    return found


def _read(side: str | Path | TimeSeries | RunUp) -> Compared:
    """A result, or measured orders if the file is no result."""
    from cranktrain.results.orders.measured import read_measured_orders
    from cranktrain.results.views.loaded import load_run
    from cranktrain.store.hdf5 import RESULT, RUN_UP

    if not isinstance(side, str | Path):
        return side
    path = user_path(side)
    if path.suffix == ".h5" or (file_exists(path) and (RESULT.includes(path) or RUN_UP.includes(path))):
        return load_run(path)
    return read_measured_orders(path)


def show(found: Comparison) -> None:
    """Print settings that both have and that differ, the largest differences, and the verdict."""
    from cranktrain.results.overlays import setting_text

    for one in (one for one in found["settings"] if None not in one.values()):
        a, b = (setting_text(one["name"], one[side])[:24] for side in "ab")
        print(f"{one['name'].replace('_', ' ')}: {a} | {b}")
    console.show(found.table())
    count = sum(one["passed"] for one in found["differences"])
    verdict = "passed" if found.within else "FAILED"
    print(f"{verdict}: {count} of {len(found['differences'])} differences are within their tolerances")
    if "picture" in found:
        print(found["picture"])
