"""The verb ``stress``: stresses of the crankshaft over a cycle at constant speed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cranktrain.cli.console import show_rows, stages
from cranktrain.cli.fillets import chosen_throws, fillet_help, fillets_of
from cranktrain.cli.functions import verb, verb_of
from cranktrain.cli.result_names import result_name
from cranktrain.cli.run_options import engine_of, gas_of, option_of, request_of
from cranktrain.engine.file import load_engine
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.strength.fillet_histories import FilletPeak
    from cranktrain.results.strength.stress import CrankStress

DESCRIPTION = """\
Stress tensor and von Mises stress of the solid crankshaft's surface over a cycle.

Stresses are superposed from the stresses of the crank's modes; the first call computes these, and the cache keeps them.
--json prints {"angles_deg", "max_von_mises_mpa", "location", "static_check_relative", "hot_spots", "result"}: the
largest von Mises stress of the surface at each angle; where the largest of the cycle occurs; and the relative
difference of superposed stresses from direct finite-element solutions under the same loads and accelerations. With
--fillets also "fillets": [{"name", "von_mises_mpa", "by_motion_mpa", "angle_deg", "place_mm", "free_surface",
"converged"}]: stresses under the resultants on a throw's cuts, and under the motion of these.
"""
_SPOTS = 12
"""Number of hot spots in the table."""
Throws = Annotated[str, Option("THROWS", fillet_help("also the peaks in fillets and at oil bores"))]
REFUSED = "refused: stresses need finite elements; give their mesh by --mesh"
FiniteElements = Annotated[
    words.File,
    Option(
        "FILE", words.OWN_MESH, also=(("--body", "refused: stresses need finite elements; give their mesh by --mesh"),)
    ),
]


@dataclass(frozen=True, kw_only=True)
class Stress(
    words.Settled, words.Levels, words.PistonLevel, words.Load, words.Pressures, words.Encoder, words.Meshes
):  # fmt: skip
    """Question of :func:`stress`."""

    speed_rpm: words.Speed
    fillets: Throws | None = None
    check: Annotated[bool, Option(help="no comparison with direct solutions, which takes half a minute")] = True
    mesh: FiniteElements | None = None
    plots: Annotated[
        words.File | None, Option("FOLDER", "folder for pictures: surface at 0, 90 … 630 degrees, envelope")
    ] = None
    output: Annotated[
        words.File | None,
        Option(
            "FILE.h5",
            "result file (default: ENGINE_SPEEDrpm_stress.h5, with options other than the default in its name)",
        ),
    ] = None


@verb(Stress, DESCRIPTION)
def stress(named: str | Path | Engine, ask: Stress) -> VerbResult:
    """Run until a cycle repeats, superpose its stresses, check them, and list the places of the largest ones."""
    from cranktrain.results.figures import check_folder
    from cranktrain.results.files import check_target
    from cranktrain.results.strength.fillet_histories import fillet_runs
    from cranktrain.results.strength.stress import static_check
    from cranktrain.results.strength.stress_figures import STRESS_PICTURES, save_stress_pictures
    from cranktrain.structure.crank.reduction import reduced_crankshaft
    from cranktrain.structure.stress.stress_modes import ShapedCrank
    from cranktrain.studies.stressed_run import check_stressed, stressed_run

    engine = engine_of(named, ask)
    request = request_of(ask, ask.speed_rpm)
    settings = request.settings(engine, option_of)
    check_stressed(request, settings)
    gas = gas_of(request, engine)
    if ask.output is not None:
        check_target(Path(ask.output))
    if ask.plots is not None:
        check_folder(Path(ask.plots), pictures=STRESS_PICTURES)
    throws = chosen_throws(ask.fillets, ask.mesh, engine)
    with stages(engine.name) as tell:
        # The reduction is repeated once, where anything needs its shapes.
        shaped = cache(lambda: ShapedCrank.of(engine, request.mesh, tell))
        if ask.check:
            shaped()  # before the run, as it may make the kept body anew
        fillets = fillets_of(engine, throws, shaped, tell)
        made, found = stressed_run(engine, request, settings, tell, shaped, gas)
        check = static_check(found, shaped(), tell) if ask.check else None
        report = _report(found, check.relative if check else None)
        if throws:
            tell("stresses of the fillets")
            bare = reduced_crankshaft(engine, request.mesh)
            peaks = [run.peak for run in fillet_runs(bare, found.cycle, fillets)]
            report["fillets"] = [_fillet(peak) for peak in sorted(peaks, key=lambda peak: -peak.von_mises)]
        if ask.output is not None:
            from cranktrain import __version__

            checked = {} if check is None else {"static_check_relative": check.relative}
            attributes = {**request.attributes(made), **checked, "version": __version__}
            report["result"] = str(found.save(Path(ask.output), {"engine": made.engine.name, **attributes}))
        if ask.plots is not None:
            tell("pictures")
            title = f"{engine.title}, {request.speed_rpm:g} rev/min"
            report["plots"] = [str(path) for path in save_stress_pictures(Path(ask.plots), found, title)]
    return VerbResult.of(report, "stress")


def answer(engine: str, ask: Stress) -> VerbResult:
    """Run :func:`stress` with a result file, which is named after the options if no name is given."""
    usual = ask.output or result_name(load_engine(engine).name, ask, "stress")
    return verb_of(stress).function(engine, replace(ask, output=usual))


def _fillet(peak: FilletPeak) -> dict[str, Any]:
    """Largest stress of a fillet, as a dictionary in MPa, mm and deg."""
    return {
        "name": peak.name,
        "von_mises_mpa": 1e-6 * peak.von_mises,
        "by_motion_mpa": 1e-6 * peak.by_motion,
        "angle_deg": math.degrees(peak.angle[peak.peak]),
        "place_mm": [round(1e3 * x, 2) for x in peak.place.tolist()],
        "free_surface": peak.free_surface,
        "converged": peak.converged,
    }


def _report(stress: CrankStress, check: float | None) -> dict[str, Any]:
    """Report of the cycle's stresses in engineering units."""
    spots = [
        {
            "feature": spot.feature,
            "place_mm": [round(1e3 * x, 2) for x in spot.place.tolist()],
            "von_mises_mpa": 1e-6 * spot.stress,
            "angle_deg": math.degrees(spot.angle),
        }
        for spot in stress.hot_spots()
    ]
    return {
        "angles_deg": [math.degrees(angle) for angle in stress.angle],
        "max_von_mises_mpa": [1e-6 * float(value) for value in stress.greatest[0]],
        "location": spots[0],
        "static_check_relative": check,
        "hot_spots": spots,
    }


def show(report: VerbResult) -> None:
    """Print the hot spots and the check."""
    rows = [
        (
            spot["feature"], ", ".join(f"{x:.1f}" for x in spot["place_mm"]), f"{spot['von_mises_mpa']:.0f}",
            f"{spot['angle_deg']:.0f}",
        )
        for spot in report["hot_spots"][:_SPOTS]
    ]  # fmt: skip
    show_rows("Greatest von Mises stress over the cycle", ("part", "x, y, z (mm)", "MPa", "at (deg)"), rows)
    if report["static_check_relative"] is not None:
        print(
            f"Direct finite-element solutions under the same loads and accelerations differ by "
            f"{100.0 * report['static_check_relative']:.2g} % of the greatest stress at most"
        )
    if "fillets" in report:
        fillets = [
            (
                peak["name"],
                ", ".join(f"{x:.1f}" for x in peak["place_mm"]),
                *(f"{peak[key]:.0f}" for key in ("von_mises_mpa", "by_motion_mpa", "angle_deg")),
                f"{peak['free_surface']:.3f}" + ("" if peak["converged"] else " (coarse)"),
            )
            for peak in report["fillets"]
        ]
        header = ("part", "x, y, z (mm)", "MPa", "by motion", "at (deg)", "least over largest principal")
        show_rows("Fillets by sub-models", header, fillets)
    else:
        print("The crank's mesh underestimates the peak stress of a fillet; --fillets THROWS resolves it")
    print(f"Result: {report['result']}")
    if "plots" in report:
        print("Pictures: " + ", ".join(report["plots"]))
