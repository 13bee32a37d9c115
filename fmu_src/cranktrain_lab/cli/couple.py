"""The verb ``couple``: the FMUs of the virtual engine under the reference master."""

from __future__ import annotations

import argparse
import math
import tempfile
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import Interrupted, bar, number, say, show_rows, word
from cranktrain.cli.result_names import result_name
from cranktrain.cli.run_options import add_source_options, engine_of, option_of, pressures_text
from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.units import RPM
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, RECONSTRUCTIONS, STAGES, VALVETRAIN
from cranktrain_lab.coupling.schemes import INSIDE, SCHEMES

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain_lab.coupling.run import Coupled, Steps
    from cranktrain_lab.coupling.supervised import System
    from cranktrain_lab.coupling.trace_unit import MeasuredPressures
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


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("engine", metavar="ENGINE", help="name of a shipped engine (diesel_i6) or path of a .toml file")
    add(
        "--speed",
        dest="speed_rpm",
        type=number(SLOWEST_RPM, FASTEST_RPM, "rev/min"),
        required=True,
        metavar="RPM",
        help="rev/min",
    )
    add("--cycles", type=number(1, 10000, "cycles", int), default=10, metavar="N", help="of 720 degrees (10)")
    add("--scheme", type=word(SCHEMES), default="gauss-seidel", metavar="NAME", help=", ".join(SCHEMES))
    add("--reconstruction", type=word(RECONSTRUCTIONS), default="own", metavar="NAME", help=", ".join(RECONSTRUCTIONS))
    add("--step-deg", type=number(1e-3, 90.0, "degrees"), default=1.0, metavar="ANGLE", help="communication step (1)")
    add("--error", type=number(1e-9, 0.5, "of an output's range"), metavar="SHARE", help="adapt the step to this error")
    add_source_options(parser)
    add("--cranktrain", metavar="FILE.fmu", help="use this FMU instead of building one")
    add("--combustion", metavar="FILE.fmu", help="use this FMU instead of building one")
    valves = parser.add_mutually_exclusive_group()
    valves.add_argument("--valvetrain", metavar="FILE.fmu", help="use this FMU instead of building one")
    valves.add_argument(
        "--no-valvetrain", action="store_true", help="no valve train: built-in valve lifts, no torque of cams"
    )
    add(
        "--set", dest="values", action="append", default=[], metavar="UNIT.NAME=VALUE",
        help="start value of a unit, e.g. cranktrain.crank.level=torsional; may be given several times",
    )  # fmt: skip
    add("--export-ssp", metavar="FILE.ssp", help="write the coupled system for other masters, and do not run it")
    add(
        "--output",
        metavar="FILE.h5",
        help="result file (default: ENGINE_SPEEDrpm_coupled.h5, with options other than the default in its name)",
    )


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Run the coupled units, write every output that was read, and summarise the last cycle; or export them."""
    from cranktrain.results.files import check_target
    from cranktrain_lab.coupling.ssp import check_target as check_ssp
    from cranktrain_lab.coupling.virtual_engine import Partners, summary, virtual_engine

    output = Path(options.output or result_name(Path(options.engine).stem, options, add_options, "coupled"))
    if options.export_ssp is None:
        check_target(output)
    elif options.scheme == STAGES:
        raise InputError("--export-ssp: other masters give no inputs at stages; take another --scheme")
    else:
        check_ssp(Path(options.export_ssp))
    values, speed = start_values(options.values), options.speed_rpm * RPM
    with tempfile.TemporaryDirectory(prefix="cranktrain-couple-") as folder:
        cranktrain, combustion, valvetrain = fmus(options, Path(folder))
        partners = Partners(cranktrain, combustion, values, valvetrain)
        longest = steps_of(options, speed).longest
        make = partial(virtual_engine, partners, speed, options.scheme, options.reconstruction, longest)
        engine = make()
        if options.export_ssp is not None:
            return _export(Path(options.export_ssp), engine, speed, options)
        found = _run_into(output, make, speed, options)
    result = summary(found, speed) | {"result": str(output)}
    if engine.one_angle is not None:
        say(_loss(engine.one_angle, result["coupling_residual_fraction"]))
    if not options.json:
        _show(result, options)
    return result


def fmus(options: argparse.Namespace, folder: Path) -> tuple[Path, Path | MeasuredPressures, Path | None]:
    """Cranktrain, combustion and valve train: FMUs that are named, and those that are not, built into a folder.

    Measured pressures take the place of the combustion.
    """
    from cranktrain.fmu.build import build_fmu
    from cranktrain.modules.register import module_of_engine
    from cranktrain_lab.coupling.fmu_unit import described

    engine = engine_of(options)
    if options.drive_line is not None and options.cranktrain:
        raise InputError("--drive-line goes into a cranktrain that is built; leave out --cranktrain, or --drive-line")
    measured = _measured(options, engine)
    # What cannot be had is told before a crankshaft is meshed.
    for given in filter(None, (options.cranktrain, options.combustion, options.valvetrain)):
        described(Path(given))
    named = {COMBUSTION: options.combustion, VALVETRAIN: options.valvetrain}
    left_out = {COMBUSTION: measured is not None, VALVETRAIN: options.no_valvetrain}
    wanted = [name for name in named if not left_out[name]]
    try:
        own = {name: module_of_engine(name, engine.name) for name in wanted if not named[name]}
    except InputError as error:
        if options.no_valvetrain:
            raise InputError(f"{error}; or give measured pressures with --pressure") from None
        raise InputError(f"{error}; or leave the valve train out with --no-valvetrain") from None
    modules = {name: build_fmu(own[name], folder, say=say) if name in own else Path(named[name]) for name in wanted}
    if options.cranktrain:
        cranktrain = Path(options.cranktrain)
    else:
        inside = options.scheme in INSIDE and options.export_ssp is None
        fmi = "3.0" if inside else "2.0"
        cranktrain = build_fmu(engine, folder, film_table=False, block=False, say=say, fmi=fmi)
    return cranktrain, measured or modules[COMBUSTION], modules.get(VALVETRAIN)


def _measured(options: argparse.Namespace, engine: Engine) -> MeasuredPressures | None:
    """Measured pressures at the speed of the run, told of; None for a combustion. ``InputError``."""
    from cranktrain.studies.constant_speed import Request
    from cranktrain_lab.coupling.trace_unit import MeasuredPressures

    choices = {key: getattr(options, key) for key in ("speed_rpm", "pressure", "pressure_unit", "pressure_tdc_deg")}
    request = Request(**choices)
    gas = request.gas(engine, option_of)
    if gas is None:
        return None
    if options.combustion:
        raise InputError("--pressure takes the place of the combustion; leave out --combustion")
    if options.export_ssp is not None:
        raise InputError("--export-ssp writes FMUs, which measured pressures are not; leave out --pressure")
    trace = gas.at(request.speed, request.load)
    say(f"{trace.source}; {pressures_text(trace)}")
    return MeasuredPressures(engine, trace)


def start_values(texts: list[str]) -> dict[str, dict[str, Any]]:
    """Start values by unit and name; ``InputError`` for what is none."""
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


def steps_of(options: argparse.Namespace, speed: float) -> Steps:
    """Communication steps; ``InputError``."""
    from cranktrain_lab.coupling.run import Steps

    size = math.radians(options.step_deg) / speed
    return Steps(size, options.error, 1e-3 * size, 20.0 * size) if options.error else Steps(size)


def _run_into(output: Path, make: Callable[[], System], speed: float, options: argparse.Namespace) -> Coupled:
    """Run in a process of its own; the result file keeps what there is however the run ends."""
    from cranktrain_lab.coupling.run import keep_run
    from cranktrain_lab.coupling.supervised import run_supervised
    from cranktrain_lab.coupling.unit import EndingError

    stop = options.cycles * 4.0 * math.pi / speed
    steps = steps_of(options, speed)
    ended: BaseException | None = None
    try:
        with bar(f"{options.engine}, {options.speed_rpm:g} rev/min") as advance:
            found = run_supervised(make, stop, steps, progress=advance)
    except (CranktrainError, KeyboardInterrupt) as error:
        if not hasattr(error, "found"):
            raise
        found, ended = error.found, error
        if isinstance(error, EndingError):  # the results are complete
            warnings.warn(str(error), stacklevel=2)
            ended = None
    keep_run(output, found, {
        "engine": Path(options.engine).stem, "speed_rpm": options.speed_rpm, "scheme": options.scheme,
        "reconstruction": _reconstruction(options), "step_deg": options.step_deg, "ended": found.ended,
    })  # fmt: skip
    if ended is None:
        return found
    kept = f"{output} keeps {found.times[-1] * speed / (4.0 * math.pi):.2f} cycles"
    if isinstance(ended, KeyboardInterrupt):
        raise Interrupted(f"interrupted; {kept}")
    raise type(ended)(f"{ended}; {kept}")


def _reconstruction(options: argparse.Namespace) -> str:
    """Who reconstructs: nobody with scheme ``stages``."""
    return "none" if options.scheme == STAGES else str(options.reconstruction)


def _export(path: Path, engine: VirtualEngine, speed: float, options: argparse.Namespace) -> dict[str, Any]:
    """Write the system as an SSP in place of running it."""
    from cranktrain_lab.coupling.ssp import write_ssp
    from cranktrain_lab.coupling.trace_unit import TraceUnit

    units = {name: (unit, unit.path) for name, unit in engine.units.items() if not isinstance(unit, TraceUnit)}
    stop = options.cycles * 4.0 * math.pi / speed
    write_ssp(path, path.stem, units, engine.connections, engine.values, engine.outputs, stop)
    if not options.json:
        print(f"SSP: {path}")
    return {"ssp": str(path)}


def _mean_residual(result: dict[str, Any]) -> str:
    """Mean power that the gas gives and the pistons do not take, in W and as a percentage of the indicated power."""
    fraction = result["coupling_residual_fraction"]
    percent = "" if fraction is None else f" ({100.0 * fraction:.2g} % of the indicated power)"
    return f"{result['coupling_residual_mean_w']:.3g} W{percent}"


def _loss(combustion: str, fraction: float | None) -> str:
    """What coupling to a combustion that knows one crank angle costs, in a sentence."""
    cost = ""
    if fraction is not None:
        cost = f"; given and taken power differ by {abs(100.0 * fraction):.2g} % of the indicated power"
    return (
        f"{combustion} takes no volume deviations: it computes all volumes at one crank angle, and the cranktrain "
        f"moves each pressure to its own pin{cost}"
    )


def _show(result: dict[str, Any], options: argparse.Namespace) -> None:
    """Print the summary for people."""
    torsion, axial = result["pulley"]["torsion_deg"], result["pulley"]["axial_um"]
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
        ("power residual of the coupling, mean", _mean_residual(result)),
        *(
            (("torque of the valve train, mean", f"{result[VALVETRAIN]['torque_nm']:.1f} N m"),)
            if VALVETRAIN in result
            else ()
        ),
        ("real-time factor", f"{result['real_time_factor']:.2f}"),
    ]
    title = (
        f"{options.engine}, {options.speed_rpm:g} rev/min: {options.scheme}, reconstruction {_reconstruction(options)}"
    )
    show_rows(title, ("of the last cycle", "value"), rows)
    print(f"{result['steps']} communication steps, {result['refused_steps']} repeated; {result['sweeps']} sweeps")
    print(f"Result: {result['result']}")
