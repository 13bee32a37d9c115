"""The verb ``stability``: maps of where methods fail, computed, drawn and explained."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

from cranktrain.cli.console import Interrupted, bars, number, one_of, show
from cranktrain.core.errors import InputError
from cranktrain.results.columns import NOTHING
from cranktrain.results.tables import Table
from cranktrain.store.whole_file import check_place, marked, whole_file

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


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("--map", metavar="NAME", action="append", help="this map only (may be given more than once)")
    add("--quick", action="store_true", help="coarse maps: all of them within three minutes")
    add("--output", metavar="FOLDER", default="out/stability", help="folder for pictures (default out/stability)")
    add("--page", metavar="FILE.md", help="also write the maps with their explanations as one page")
    add("--rebuild", action="store_true", help="compute even maps that are kept")
    add("--jobs", type=number(1, 256, "processes", int), metavar="N", help="processes (default: as many as processors)")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Compute or read the maps, draw them, and print a table unless JSON is wanted."""
    from cranktrain.results.figures import check_folder
    from cranktrain_lab.stability import MAPS

    names = list(dict.fromkeys(options.map or MAPS))
    for name in names:
        one_of("--map", name, MAPS)
    if options.page is not None and not Path(options.page).parent.is_dir():
        raise InputError(f"--page {options.page}: there is no folder {Path(options.page).parent}; make it first")
    if options.page is not None:
        check_place(options.page, PAGE)
    folder = Path(options.output)
    check_folder(folder, "--output", [f"{name}{ending}" for name in names for ending in (".png", ".svg")])
    from cranktrain_lab.stability.draw import save_map
    from cranktrain_lab.stability.kept_maps import maps
    from cranktrain_lab.stability.page import shown_deviation
    from cranktrain_lab.stability.stability_map import as_record

    found, pictures, records = {}, {}, {}
    try:
        with bars("stability", names) as tell:
            computed = maps(names, options.quick, rebuild=options.rebuild, workers=options.jobs, progress=tell)
            for one, seconds in computed:
                tell(one.name, f"{seconds:.0f} s" if seconds else "kept", 1.0)
                found[one.name] = one
                pictures[one.name] = save_map(folder, one)
    except KeyboardInterrupt:
        raise Interrupted("interrupted; finished maps are kept, repeat the command to continue") from None
    if options.page is not None:
        _write_page(Path(options.page), [found[name] for name in names], [pictures[name][0] for name in names])
    for name in names:
        records[name] = {**as_record(found[name]), "picture": str(pictures[name][0])}
    if not options.json:
        rows = []
        for name in names:
            one = found[name]
            bounds = "; ".join(b.label for b in one.theory) or NOTHING
            rows.append((name, f"{one.columns.label} x {one.rows.label}", bounds, shown_deviation(one)))
        show(Table("Where methods fail", ("map", "of", "theory", "found against theory"), tuple(rows)))
        for name in names:
            print(f"\n{found[name].title} ({pictures[name][0]})")
            print(found[name].explanation.strip())
    return {"maps": records}


def _write_page(path: Path, maps: list[Any], pictures: list[Path]) -> None:
    """Write the page."""
    from cranktrain_lab.stability.page import page

    places = [os.path.relpath(picture, path.parent) for picture in pictures]
    with whole_file(path, PAGE) as file:
        file.write_text(page(maps, places), encoding="utf-8")
