"""The verb ``couple``: the FMUs of the virtual engine under the reference master."""

from __future__ import annotations

import math
import tempfile
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cranktrain.cli.console import Interrupted, bar, say, show_rows
from cranktrain.cli.functions import verb, verb_of
from cranktrain.cli.result_names import result_name
from cranktrain.cli.run_options import engine_of, option_of, pressures_text
from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.typed_file import between
from cranktrain.core.units import RPM
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, RECONSTRUCTIONS, STAGES, VALVETRAIN
from cranktrain_lab.coupling.schemes import INSIDE, SCHEMES

if TYPE_CHECKING:
    from cranktrain_lab.coupling.recording_unit import MeasuredPressures
    from cranktrain_lab.coupling.run import Coupled, Steps, System
    from cranktrain_lab.coupling.virtual_engine import VirtualEngine

DESCRIPTION = """Couple cranktrain, combustion and valve train as FMUs, and run cycles at constant speed.

FMUs that are not named are built first; a cranktrain built this way has no film table and no flexible block. With
--scheme jacobi all units step at once, with gauss-seidel one after the other, with iterative repeatedly until they
agree. With intermediate the cranktrain, an FMU of FMI 3.0, calls for new pressures at points inside its step, with
stages it asks for those at the stages of its integrator, and nothing is reconstructed. With
--reconstruction own the cranktrain itself interpolates pressures between communication points, because it
knows the crank angle of each; with hold, linear and quadratic the master does. With --pressure, measured pressures take
the place of the combustion. --json prints {"pulley", "imep_pa",
"indicated_torque_nm", "coupling_residual_w", "coupling_residual_mean_w", "coupling_residual_fraction",
"real_time_factor", "seconds", "result", "valvetrain"}."""


UNITS = CRANKTRAIN, COMBUSTION, VALVETRAIN


BUILT = Annotated[words.File, Option("FILE.fmu", "use this FMU instead of building one")]


@dataclass(frozen=True, kw_only=True)
class Couple(words.Pressures):
    """Question of :func:`couple`."""

    apart = (("valvetrain", "no_valvetrain"),)
    speed_rpm: Annotated[words.Rpm, Option("RPM", "rev/min", "--speed")]
    cycles: Annotated[int, between(1, 10000, "cycles"), Option("N", "of 720 degrees (10)")] = 10
    scheme: Annotated[
        Literal["jacobi", "gauss-seidel", "iterative", "intermediate", "stages"],
        Option("NAME", ", ".join(SCHEMES), words=tuple(SCHEMES)),
    ] = "gauss-seidel"
    reconstruction: Annotated[
        Literal["own", "hold", "linear", "quadratic"],
        Option("NAME", ", ".join(RECONSTRUCTIONS), words=tuple(RECONSTRUCTIONS)),
    ] = "own"
    step_deg: Annotated[float, between(1e-3, 90.0, "degrees"), Option("ANGLE", "communication step (1)")] = 1.0
    error: Annotated[
        float | None, between(1e-9, 0.5, "of an output's range"), Option("SHARE", "adapt the step to this error")
    ] = None
    cranktrain: BUILT | None = None
    combustion: BUILT | None = None
    valvetrain: BUILT | None = None
    no_valvetrain: Annotated[bool, Option(help="no valve train: built-in valve lifts, no torque of cams")] = False
    values: Annotated[
        Sequence[str],
        Option(
            "UNIT.NAME=VALUE",
            "start value of a unit, e.g. cranktrain.crank.level=torsional; may be given several times",
            "--set",
            repeated=True,
        ),
    ] = ()
    export_ssp: Annotated[
        words.File | None, Option("FILE.ssp", "write the coupled system for other masters, and do not run it")
    ] = None
    output: Annotated[
        words.File | None,
        Option(
            "FILE.h5",
            "result file (default: ENGINE_SPEEDrpm_coupled.h5, with options other than the default in its name)",
        ),
    ] = None


@verb(Couple, DESCRIPTION)
def couple(named: str | Path | Engine, ask: Couple) -> VerbResult:
    """Run the coupled units, write every output that was read, and summarise the last cycle; or export them."""
    from cranktrain.results.files import check_target
    from cranktrain_lab.coupling.ssp import check_target as check_ssp
    from cranktrain_lab.coupling.virtual_engine import Partners, summary, virtual_engine

    if ask.export_ssp is None:
        if ask.output is not None:
            check_target(Path(ask.output))
    elif ask.scheme == STAGES:
        raise InputError("--export-ssp: other masters give no inputs at stages; take another --scheme")
    else:
        check_ssp(Path(ask.export_ssp))
    name = load_engine(named).name if isinstance(named, Engine) else Path(named).stem
    values, speed = start_values(ask.values), ask.speed_rpm * RPM
    with tempfile.TemporaryDirectory(prefix="cranktrain-couple-") as folder:
        cranktrain, combustion, valvetrain = fmus(named, ask, Path(folder))
        partners = Partners(cranktrain, combustion, values, valvetrain)
        longest = steps_of(ask, speed).longest
        make = partial(virtual_engine, partners, speed, ask.scheme, ask.reconstruction, longest)
        engine = make()
        if ask.export_ssp is not None:
            return _export(Path(ask.export_ssp), engine, speed, ask)
        found = _run_into(name, make, speed, ask)
    result = summary(found, speed)
    if ask.output is not None:
        result["result"] = str(ask.output)
    if engine.one_angle is not None:
        fraction, cost = result["coupling_residual_fraction"], ""
        if fraction is not None:
            cost = f"; given and taken power differ by {abs(100.0 * fraction):.2g} % of the indicated power"
        say(
            f"{engine.one_angle} takes no volume deviations: it computes all volumes at one crank angle, and the "
            f"cranktrain moves each pressure to its own pin{cost}"
        )
    return VerbResult.of(result, "couple", name=name, ask=ask)


def answer(engine: str, ask: Couple) -> VerbResult:
    """Run :func:`couple` with a result file, which is named after the options if no name is given."""
    usual = ask.output or result_name(Path(engine).stem, ask, "coupled")
    return verb_of(couple).function(engine, replace(ask, output=usual))


def fmus(named: str | Path | Engine, ask: Couple, folder: Path) -> tuple[Path, Path | MeasuredPressures, Path | None]:
    """FMUs of cranktrain, combustion and valve train: given paths, or FMUs that are built into a folder.

    Measured pressures take the place of the combustion.
    """
    from cranktrain.fmu.build import build_fmu
    from cranktrain.modules.register import module_of_engine
    from cranktrain_lab.coupling.fmu_unit import described
    from cranktrain_lab.coupling.modules import combustion_of

    engine = engine_of(named, ask)
    if ask.drive_line is not None and ask.cranktrain:
        raise InputError("--drive-line goes into a cranktrain that is built; leave out --cranktrain, or --drive-line")
    measured = _measured(ask, engine)
    # What cannot be had is told before a crankshaft is meshed.
    for given in (ask.cranktrain, ask.combustion, ask.valvetrain):
        if given:
            described(Path(given))
    own_fmus = {VALVETRAIN: ask.valvetrain, COMBUSTION: ask.combustion}
    left_out = {VALVETRAIN: ask.no_valvetrain, COMBUSTION: measured is not None}
    wanted = [name for name in own_fmus if not left_out[name]]
    file = "" if isinstance(named, Engine) else named
    try:
        own = {
            name: combustion_of(engine, file) if name == COMBUSTION else module_of_engine(name, engine.name, file)
            for name in wanted if not own_fmus[name]
        }  # fmt: skip
    except InputError as error:
        if ask.no_valvetrain:
            raise InputError(f"{error}; or give measured pressures with --pressure") from None
        raise InputError(f"{error}; or leave the valve train out with --no-valvetrain") from None
    modules = {
        name: build_fmu(own[name], folder, say=say) if name in own else Path(str(own_fmus[name])) for name in wanted
    }
    if ask.cranktrain:
        cranktrain = Path(ask.cranktrain)
    else:
        inside = ask.scheme in INSIDE and ask.export_ssp is None
        fmi = "3.0" if inside else "2.0"
        cranktrain = build_fmu(engine, folder, film_table=False, block=False, say=say, fmi=fmi)
    return cranktrain, measured or modules[COMBUSTION], modules.get(VALVETRAIN)


def _measured(ask: Couple, engine: Engine) -> MeasuredPressures | None:
    """Measured pressures at the speed of the run, which are printed; None if a combustion is simulated."""
    from cranktrain.studies.constant_speed import Request
    from cranktrain_lab.coupling.recording_unit import MeasuredPressures

    choices = {key: getattr(ask, key) for key in ("speed_rpm", "pressure", "pressure_unit", "pressure_tdc_deg")}
    request = Request(**choices)
    gas = request.gas(engine, option_of)
    if gas is None:
        return None
    if ask.combustion:
        raise InputError("--pressure takes the place of the combustion; leave out --combustion")
    if ask.export_ssp is not None:
        raise InputError("--export-ssp writes FMUs, which measured pressures are not; leave out --pressure")
    trace = gas.at(request.speed, request.load)
    say(f"{trace.source}; {pressures_text(trace)}")
    return MeasuredPressures(engine, trace)


def start_values(texts: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Start values by FMU and variable, from texts ``unit.name=value``; ``InputError`` for other texts."""
    found: dict[str, dict[str, Any]] = {}
    for text in texts:
        place, _, value = text.partition("=")
        unit, _, name = place.partition(".")
        if unit not in UNITS or not name or not value:
            raise InputError(f"--set {text}: write UNIT.NAME=VALUE; units: {', '.join(UNITS)}")
        try:
            found.setdefault(unit, {})[name] = float(value)
        except ValueError:
            found.setdefault(unit, {})[name] = value
    return found


def steps_of(ask: Couple, speed: float) -> Steps:
    """Communication steps, checked; ``InputError``."""
    from cranktrain_lab.coupling.run import Steps

    size = math.radians(ask.step_deg) / speed
    return Steps(size, ask.error, 1e-3 * size, 20.0 * size) if ask.error else Steps(size)


def _run_into(name: str, make: Callable[[], System], speed: float, ask: Couple) -> Coupled:
    """Run in a separate process; the result file keeps the samples so far, however the run ends."""
    from cranktrain_lab.coupling.run import keep_run
    from cranktrain_lab.coupling.supervised import run_supervised
    from cranktrain_lab.coupling.unit import EndingError

    stop = ask.cycles * 4.0 * math.pi / speed
    steps = steps_of(ask, speed)
    ended: BaseException | None = None
    try:
        with bar(f"{name}, {ask.speed_rpm:g} rev/min") as advance:
            found = run_supervised(make, stop, steps, progress=advance)
    except (CranktrainError, KeyboardInterrupt) as error:
        if not hasattr(error, "found"):
            raise
        found, ended = error.found, error
        if isinstance(error, EndingError):  # the results are complete
            warnings.warn(str(error), stacklevel=2)
            ended = None
    if ask.output is not None:
        keep_run(Path(ask.output), found, {
            "engine": name, "speed_rpm": ask.speed_rpm, "scheme": ask.scheme,
            "reconstruction": _reconstruction(ask), "step_deg": ask.step_deg, "ended": found.ended,
        })  # fmt: skip
    if ended is None:
        return found
    cycles = f"{found.times[-1] * speed / (4.0 * math.pi):.2f} cycles"
    kept = f"{ask.output} keeps {cycles}" if ask.output is not None else f"after {cycles}; nothing was kept"
    if isinstance(ended, KeyboardInterrupt):
        raise Interrupted(f"interrupted; {kept}")
    raise type(ended)(f"{ended}; {kept}")


def _reconstruction(ask: Couple) -> str:
    """Name of the reconstruction of inputs between points; none with scheme ``stages``."""
    return "none" if ask.scheme == STAGES else str(ask.reconstruction)


def _export(path: Path, engine: VirtualEngine, speed: float, ask: Couple) -> VerbResult:
    """Write the system as an SSP file instead of running it."""
    from cranktrain_lab.coupling.recording_unit import TraceUnit
    from cranktrain_lab.coupling.ssp import write_ssp

    units = {name: (unit, unit.path) for name, unit in engine.units.items() if not isinstance(unit, TraceUnit)}
    stop = ask.cycles * 4.0 * math.pi / speed
    write_ssp(path, path.stem, units, engine.connections, engine.values, engine.outputs, stop)
    return VerbResult.of({"ssp": str(path)}, "couple")


def show(result: VerbResult) -> None:
    """Print the summary."""
    if "ssp" in result:
        print(f"SSP: {result['ssp']}")
        return
    ask: Couple = result.beside["ask"]
    torsion, axial = result["pulley"]["torsion_deg"], result["pulley"]["axial_um"]
    # Mean power that is lost between gas and pistons, W, and as a percentage of the indicated power.
    fraction = result["coupling_residual_fraction"]
    percent = "" if fraction is None else f" ({100.0 * fraction:.2g} % of the indicated power)"
    rows = [
        ("pulley torsion, peak to peak", f"{torsion['peak_to_peak']:.4f} deg"),
        ("pulley axial motion, peak to peak", f"{axial['peak_to_peak']:.1f} um"),
        (
            "indicated mean effective pressure",
            "–" if result["imep_pa"] is None else f"{1e-5 * result['imep_pa']:.2f} bar",
        ),
        ("indicated torque, mean", f"{result['indicated_torque_nm']:.1f} N m"),
        ("torque of the shaft, mean", f"{result['shaft_torque_nm']:.1f} N m"),
        ("power residual of the coupling, RMS", f"{result['coupling_residual_w']:.3g} W"),
        ("power residual of the coupling, mean", f"{result['coupling_residual_mean_w']:.3g} W{percent}"),
    ]
    if VALVETRAIN in result:
        rows.append(("torque of the valve train, mean", f"{result[VALVETRAIN]['torque_nm']:.1f} N m"))
    rows.append(("real-time factor", f"{result['real_time_factor']:.2f}"))
    title = f"{result.beside['name']}, {ask.speed_rpm:g} rev/min: {ask.scheme}, reconstruction {_reconstruction(ask)}"
    show_rows(title, ("of the last cycle", "value"), rows)
    print(f"{result['steps']} communication steps, {result['refused_steps']} repeated; {result['sweeps']} sweeps")
    print(f"Result: {result['result']}")
