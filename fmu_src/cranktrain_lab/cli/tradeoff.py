"""The verb ``tradeoff``: cost and error of each choice of method, level and resolution."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Any

from cranktrain.cli.console import Interrupted, labelled_bar, show_rows
from cranktrain.cli.functions import verb_alone
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question
from cranktrain.studies.scene import Scene

DESCRIPTION = """\
Accuracy against speed: error over cost of methods, levels and resolutions, with the Pareto front.

Without SCENE: the six at 2000 and at 2200 rev/min (near its resonance) and the V8 at 1800; --quick: the six at 2000.

families   integrators, adaptive, modes, ladder, bearings, coupling, schemes, mesh, pressure
error      RMS of the difference over the last cycle, over the RMS of the reference's alternating part; for pulley
           torsion, pulley axial motion and the least film of the worst main bearing (null if a model has none).
           error_kind names the reference: numerical (same model, finer step), model (next level up), top (highest
           level, or finest resolution), input (inputs known exactly)
settling   how much the last cycle still changed the output that changed most; counted separately from the error
start      runs begin in a settled motion; one that did not settle is named with what is left (start_unsettled, of the
           reference reference_start_unsettled)
cost       processor seconds per simulated second, median of three interleaved runs (--quick: one)

--total    measure total errors instead of the families: crank x bearings x block x step, each against the best model
           (top crank and bearings, flexible block, fine grid and step, settled). Errors of torsion, axial motion,
           forces and least films of the mains, and cover, each split in model, numerical and settling part; and which
           model to choose for 10 %, 3 % and 1 %. The cost is that of a settled cycle. Without SCENE: the six at 1000
           and 2000 rev/min (--quick: 2000, without films solved online, reference at the usual grid and step)

Comparison with other solvers (explicit, Radau, SciPy's): python benchmarks/tradeoff.py in the repository.
Finished runs are kept in the cache; repeat the command to continue after an interruption.
"""


@dataclass(frozen=True)
class TradeOff(Question):
    """Question of :func:`tradeoff`."""

    scene: Annotated[
        words.File | Scene | None, Option("SCENE", "scene file (.toml) in place of the usual scenes", place=True)
    ] = None
    _: KW_ONLY
    family: Annotated[
        Sequence[str] | None, Option("NAME", "measure this family only; may be given several times", repeated=True)
    ] = None
    total: Annotated[bool, Option(help="total error of levels and steps against the best model, and its parts")] = False
    quick: Annotated[bool, Option(help="fewer points, one scene, one run each: under three minutes")] = False
    output: Annotated[words.File, Option("FOLDER", "charts and tables (out/tradeoff)")] = "out/tradeoff"


@verb_alone(TradeOff, DESCRIPTION)
def tradeoff(ask: TradeOff) -> VerbResult:
    """Measure errors and costs, and write the files."""
    from cranktrain.core.errors import InputError
    from cranktrain.core.threads import one_thread
    from cranktrain.results.figures import check_folder
    from cranktrain_lab.tradeoff.choice import choice_text
    from cranktrain_lab.tradeoff.files import write_files
    from cranktrain_lab.tradeoff.study import chosen_families, default_scenes, scenes_of, study, total_study
    from cranktrain_lab.tradeoff.total_choice import total_choice_text

    if ask.total and ask.family:
        raise InputError("--family does not go with --total; leave one out")
    families = chosen_families(ask.family)
    scenes = default_scenes(ask.quick, ask.total) if ask.scene is None else scenes_of(ask.scene, ask.quick)
    folder = Path(ask.output)
    check_folder(folder, "--output")
    found: Any
    with _counted() as (say, advance), one_thread():
        if ask.total:
            found = total_study(scenes, ask.quick, say=say, progress=advance)
        else:
            found = study(scenes, families, ask.quick, say=say, progress=advance)
    said = {**found.as_dict(), "files": [str(path) for path in write_files(found, folder)]}
    if ask.total:
        return VerbResult.of(said, "tradeoff", text=total_choice_text(found))
    return VerbResult.of(said, "tradeoff", text=choice_text(found), points=found.points, scenes=scenes)


def show(said: VerbResult) -> None:
    """Print the Pareto fronts, the recommended choices, and the files."""
    for scene in said.beside.get("scenes", ()):
        points = [one for one in said.beside["points"] if one.pareto and one.parameters["scene"] == scene.name]
        header = ("choice", "error against", "s/s", "torsion", "axial", "film")
        show_rows(f"{scene.name}: Pareto fronts", header, [_row(point) for point in points])
    print(said.beside["text"], end="")
    print("Written: " + ", ".join(said["files"]))


@contextmanager
def _counted() -> Iterator[tuple[Callable[[str], None], Callable[[float], None]]]:
    """Show a progress bar with the current run; the message of an interrupt gives the number of finished runs."""
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
    doubt = "" if point.unsettled is None else ", start not settled"
    return [
        f"{point.family}: {point.label}{doubt}", kind[point.parameters["error_kind"]],
        f"{point.seconds_per_simulated_second:.3g}", *errors,
    ]  # fmt: skip
