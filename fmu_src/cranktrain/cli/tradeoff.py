"""The verb ``tradeoff``: what each choice of method, level and resolution costs, and how far it is off."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cranktrain.cli.console import Interrupted, labelled_bar, show_rows

DESCRIPTION = """\
Accuracy against speed: error over cost of methods, levels and resolutions, with the Pareto front.

Without SCENE: the six at 2000 and at 2200 rev/min (near its resonance) and the V8 at 1800; --quick: the six at 2000.

families   integrators, adaptive, modes, ladder, bearings, coupling, schemes, mesh, pressure
error      RMS of the difference over the last cycle over the RMS of the reference's alternating part, of pulley
           torsion, pulley axial motion and the least film of the worst main bearing (null where there is none);
           error_kind says against what: numerical (same model, finer step), model (the next level up), top (the top of
           a ladder, or the finest of what is varied), input (inputs known exactly)
settling   what the last cycle still changed of that output which changed most: an error of its own
cost       processor seconds per simulated second, median of three interleaved runs (--quick: one)

--total    total error against cost, in place of the families: crank x bearings x block x step, all against the best
           model there is (top crank and bearings, flexible block, fine grid and step, settled), by torsion, axial
           motion, forces and least films of the mains, and cover; each error in its model, numerical and settling
           parts, and what to take for 10 %, 3 % and 1 %; cost is of a settled cycle. Without SCENE: the six at 1000
           and 2000 rev/min (--quick: 2000, without films that are solved online, reference at usual grid and step)

Other solvers beside ours (explicit, Radau, SciPy's): python benchmarks/tradeoff.py in the repository.
Every run is kept in the cache as it ends: after an interruption the same command goes on where it stopped.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("scene", nargs="?", metavar="SCENE", help="scene file (.toml) in place of the usual scenes")
    add("--family", action="append", metavar="NAME", help="measure this family only; may be given several times")
    add("--total", action="store_true", help="total error of levels and steps against the best model, and its parts")
    add("--quick", action="store_true", help="fewer points, one scene, one run each: under three minutes")
    add("--output", default="out/tradeoff", metavar="FOLDER", help="charts and tables (out/tradeoff)")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Measure, write the files, and print a table unless JSON is wanted."""
    if options.total:
        return _total(options)
    from cranktrain.results.figures import check_folder
    from cranktrain.structure.fem.factor import one_thread
    from cranktrain.studies.tradeoff.choice import choice_text
    from cranktrain.studies.tradeoff.files import write_files
    from cranktrain.studies.tradeoff.study import chosen_families, default_scenes, scenes_of, study

    families = chosen_families(options.family, options.quick)
    scenes = default_scenes(options.quick) if options.scene is None else scenes_of(options.scene, options.quick)
    folder = Path(options.output)
    check_folder(folder, "--output")
    with _counted() as (say, advance), one_thread():
        found = study(scenes, families, options.quick, say=say, progress=advance)
    written = write_files(found, folder)
    if not options.json:
        for scene in scenes:
            rows = [_row(point) for point in found.points if point.pareto and point.parameters["scene"] == scene.name]
            show_rows(
                f"{scene.name}: Pareto fronts", ("choice", "error against", "s/s", "torsion", "axial", "film"), rows
            )
        print(choice_text(found), end="")
        print("Written: " + ", ".join(str(path) for path in written))
    return {**found.as_dict(), "files": [str(path) for path in written]}


def _total(options: argparse.Namespace) -> dict[str, Any]:
    """Measure total errors, write the files, and print the tables unless JSON is wanted."""
    from cranktrain.core.errors import InputError
    from cranktrain.results.figures import check_folder
    from cranktrain.structure.fem.factor import one_thread
    from cranktrain.studies.tradeoff.study import scenes_of
    from cranktrain.studies.tradeoff.total.choice import choice_text
    from cranktrain.studies.tradeoff.total.files import document, write_files
    from cranktrain.studies.tradeoff.total.study import total_scenes, total_study

    if options.family:
        raise InputError("--family does not go with --total; leave one out")
    scenes = total_scenes(options.quick) if options.scene is None else scenes_of(options.scene, options.quick)
    folder = Path(options.output)
    check_folder(folder, "--output")
    with _counted() as (say, advance), one_thread():
        found = total_study(scenes, options.quick, say=say, progress=advance)
    written = write_files(found, folder)
    if not options.json:
        print(choice_text(found), end="")
        print("Written: " + ", ".join(str(path) for path in written))
    return {**document(found), "files": [str(path) for path in written]}


@contextmanager
def _counted() -> Iterator[tuple[Callable[[str], None], Callable[[float], None]]]:
    """A bar with what is at work; an interrupt says how many runs are kept."""
    measured = 0
    try:
        with labelled_bar("tradeoff") as (say, advance):

            def count(stage: str) -> None:
                nonlocal measured
                measured += 1
                say(stage)

            yield count, advance
    except KeyboardInterrupt:
        raise Interrupted(
            f"interrupted after {max(0, measured - 1)} runs, which are kept; repeat the command to continue"
        ) from None


def _row(point: Any) -> list[str]:
    errors = ["" if value is None else f"{value:.1e}" for value in point.error.values()]
    kind = {"numerical": "same model, finer", "top": "top level", "input": "exact inputs"}
    return [
        f"{point.family}: {point.label}", kind[point.parameters["error_kind"]],
        f"{point.seconds_per_simulated_second:.3g}", *errors,
    ]  # fmt: skip
