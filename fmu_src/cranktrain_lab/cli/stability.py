"""The verb ``stability``: maps of the limits of stability of methods, with explanations."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cranktrain.cli import console
from cranktrain.cli.console import Interrupted, bars
from cranktrain.cli.functions import verb_alone
from cranktrain.core.errors import InputError
from cranktrain.results.columns import NOTHING
from cranktrain.results.tables import Table
from cranktrain.results.views.found import VerbResult
from cranktrain.store.whole_file import check_place, marked, whole_file
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question
from cranktrain_lab.stability import MAPS

PAGE = marked("page of cranktrain's stability maps", "cranktrain stability")
DESCRIPTION = """\
Maps of where numerical methods become unstable or inaccurate, beside theory, drawn and explained.

Each boundary is found by bisection with the kernels of the running model, and compared with theory. One picture (PNG
and SVG) of each map is written to the output folder. Finished maps are kept in the cache, so an interrupted run can be
continued.

max_deviation   largest relative difference between measured boundary and theory, in the bisected parameter; null where
                no theory exists, "inf" where only one of the two has a boundary
points          points of a boundary: [column value, row value]
"""


@dataclass(frozen=True, kw_only=True)
class Stability(Question):
    """Question of :func:`stability`."""

    map: Annotated[
        Sequence[str] | None,
        Option("NAME", "this map only (may be given more than once)", words=MAPS.keys, repeated=True),
    ] = None
    quick: Annotated[bool, Option(help="coarse maps: all of them within three minutes")] = False
    output: Annotated[words.File, Option("FOLDER", "folder for pictures (default out/stability)")] = "out/stability"
    page: Annotated[words.File | None, Option("FILE.md", "also write the maps with their explanations as one page")] = (
        None
    )
    anew: Annotated[bool, Option(help="compute even maps that are kept", was="--rebuild")] = False
    workers: words.Workers | None = None


@verb_alone(Stability, DESCRIPTION)
def stability(ask: Stability) -> VerbResult:
    """Compute the stability maps or read them from the cache, and draw them."""
    from cranktrain.results.figures import check_folder

    names = list(dict.fromkeys(ask.map or MAPS))
    if ask.page is not None and not Path(ask.page).parent.is_dir():
        raise InputError(f"--page {ask.page}: there is no folder {Path(ask.page).parent}; make it first")
    if ask.page is not None:
        check_place(ask.page, PAGE)
    folder = Path(ask.output)
    check_folder(folder, "--output", [f"{name}{ending}" for name in names for ending in (".png", ".svg")])
    from cranktrain_lab.stability.draw import page, save_map
    from cranktrain_lab.stability.kept_maps import maps
    from cranktrain_lab.stability.stability_map import as_record

    found, pictures, records = {}, {}, {}
    try:
        with bars("stability", names) as tell:
            computed = maps(names, ask.quick, rebuild=ask.anew, workers=ask.workers, progress=tell)
            for one, seconds in computed:
                tell(one.name, f"{seconds:.0f} s" if seconds else "kept", 1.0)
                found[one.name] = one
                pictures[one.name] = save_map(folder, one)
    except KeyboardInterrupt:
        raise Interrupted("interrupted; finished maps are kept, repeat the command to continue") from None
    if ask.page is not None:
        places = [os.path.relpath(pictures[name][0], Path(ask.page).parent) for name in names]
        with whole_file(ask.page, PAGE) as file:
            file.write_text(page([found[name] for name in names], places), encoding="utf-8")
    for name in names:
        records[name] = {**as_record(found[name]), "picture": str(pictures[name][0])}
    return VerbResult.of({"maps": records}, "stability", shown=[found[name] for name in names])


def show(said: VerbResult) -> None:
    """Print a table of all maps, with the explanation of each."""
    from cranktrain_lab.stability.draw import shown_deviation

    found = said.beside["shown"]
    rows = []
    for one in found:
        bounds = "; ".join(b.label for b in one.theory) or NOTHING
        rows.append((one.name, f"{one.columns.label} x {one.rows.label}", bounds, shown_deviation(one)))
    console.show(Table("Where methods fail", ("map", "of", "theory", "found against theory"), tuple(rows)))
    for one in found:
        print(f"\n{one.title} ({said['maps'][one.name]['picture']})")
        print(one.explanation.strip())
