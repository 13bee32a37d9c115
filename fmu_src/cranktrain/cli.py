"""The command ``cranktrain``: one verb per question, a readable table for people or one JSON object for machines.

Progress and errors go to stderr. Wrong input ends with exit code 2 and one line.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table as RichTable

from cranktrain import __version__, film_commands, film_table_command
from cranktrain.engine import Engine, engine_provenance, load_engine
from cranktrain.errors import CranktrainError, InputError, nearest

if TYPE_CHECKING:
    from cranktrain.engine import PlainBearing
    from cranktrain.film.bore_compliance import BoreCompliance
    from cranktrain.film.database import FilmTable

RPM = math.pi / 30.0
_LEFT = ("shape", "to which number", "value", "unit or norm")


class _Parser(argparse.ArgumentParser):
    """Parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0, or 2 for input that cannot be used."""
    options = _parser().parse_args(arguments)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = lambda message, *_: _say(f"cranktrain: warning: {message}")
            result = options.verb(options)
    except CranktrainError as error:
        print(f"cranktrain: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("cranktrain: interrupted; nothing was written", file=sys.stderr)
        return 130
    if options.json:
        print(json.dumps(_finite(result), indent=2, allow_nan=False))
    return 0


def _parser() -> _Parser:
    parser = _Parser(prog="cranktrain", description="Crankshaft dynamics of an engine.")
    parser.add_argument("--version", action="version", version=f"cranktrain {__version__}")
    verbs = parser.add_subparsers(metavar="VERB", required=True, parser_class=_Parser)

    def verb(name: str, run: Callable[[argparse.Namespace], Any], text: str) -> argparse.ArgumentParser:
        sub = verbs.add_parser(name, help=text, description=text)
        sub.add_argument(
            "engine", metavar="ENGINE", help="name of a shipped engine (diesel_i6) or path of a .toml file"
        )
        sub.add_argument("--mesh", metavar="FILE", help="own mesh (.msh, .inp, .bdf) with named journal surfaces")
        sub.add_argument(
            "--json", action="store_true", help="print one JSON object; keys carry their unit (_hz, _um, …)"
        )
        sub.set_defaults(verb=run)
        return sub

    verb("modal", modal, "Free crankshaft and cranktrain frequencies beside the reference's, and critical speeds.")
    reduced = verb("reduce", reduce, "Make and check the reduced crankshaft; it is kept in the cache.")
    reduced.add_argument("--rebuild", action="store_true", help="compute even where a stored model exists")
    run = verb("simulate", simulate, "Run cycles at constant speed; write an HDF5 result and print a summary.")
    run.add_argument("--speed", type=float, required=True, metavar="RPM", help="rev/min, at least 100")
    run.add_argument(
        "--cycles", type=int, default=6, help="cycles of 720 degrees (default 6); the last one is evaluated"
    )
    run.add_argument("--crank", default="solid", metavar="LEVEL", help="rigid or solid (default)")
    run.add_argument(
        "--bearings", default="impedance", metavar="LEVEL", help="linear, impedance (default), table, reynolds or ehd"
    )
    run.add_argument("--big-ends", default="rigid", metavar="LEVEL", help="rigid (default); films: impedance, table")
    run.add_argument(
        "--film-temperature",
        default="engine",
        metavar="SOURCE",
        help="of the main bearings' oil: engine (default), by its speed; or heat-balance, each film warmer than that "
        "by its own friction (the run repeats, at most 6 times; big ends and thrust bearing stay with the engine's)",
    )
    run.add_argument("--integrator", metavar="NAME", help="e.g. sdirk3 (default sdirk4; at level ehd sdirk2)")
    run.add_argument("--step-deg", type=float, metavar="DEG", help="internal step in degrees of crank angle")
    run.add_argument("--load", type=float, default=1.0, metavar="SHARE", help="share of the full-load burn (default 1)")
    run.add_argument("--pressure", metavar="FILE.csv", help="measured trace: angle in degrees; pressure")
    run.add_argument("--pressure-unit", metavar="UNIT", help="Pa, kPa, bar or MPa; else by header or size of the peak")
    run.add_argument(
        "--pressure-tdc-deg", type=float, metavar="DEG", help="angle in the file that is firing dead centre"
    )
    run.add_argument("--plots", metavar="FOLDER", help="also draw journal orbits and least films as pictures there")
    run.add_argument("--output", metavar="FILE.h5", help="result file (default: ENGINE_SPEEDrpm.h5)")
    film_commands.register(verbs, _show_rows)
    film_table_command.register(verbs)
    return parser


def modal(options: argparse.Namespace) -> dict[str, Any]:
    """Frequencies of the free crankshaft and the cranktrain, critical speeds, quality of the reduction."""
    from cranktrain.results.tables import Table, frequency_tables
    from cranktrain.structure.modal import modal_report

    engine = load_engine(options.engine)
    body, seconds = _reduced(engine, options)
    start = time.perf_counter()
    report = modal_report(engine, body)
    report["seconds"] = {**report.get("seconds", {}), "reduction": seconds, "modal": time.perf_counter() - start}
    if not options.json:
        quality = report["reduction"]
        for table in frequency_tables(engine, report):
            _show(table)
        print(
            f"Reduction: {quality['dofs_full']} degrees of freedom to {quality['modes']} modes, largest error against "
            f"the full model {100.0 * quality['max_relative_error']:.2g} % (to 1000 Hz)"
        )
        rows = tuple((key, f"{value} {unit}", note) for key, value, unit, origin, note in _calibrated(options.engine))
        if rows:
            _show(Table("Calibrated values", ("value", "", "to which number"), rows))
    return dict(report)


def reduce(options: argparse.Namespace) -> dict[str, Any]:
    """Make the reduced crankshaft where it is not stored yet, and report its quality."""
    from cranktrain.structure.reduction import stored_path

    engine = load_engine(options.engine)
    body, seconds = _reduced(engine, options, options.rebuild)
    result = {
        "path": str(stored_path(engine, options.mesh)),
        "modes": body.n_modes,
        "mass_kg": body.mass,
        "elastic_hz": body.frequencies_hz[6:16].tolist(),
        "quality": dict(body.quality),
        "seconds": seconds,
    }
    if not options.json:
        quality = body.quality
        print(f"{body.name}: {body.mass:.1f} kg, {quality['dofs_full']:.0f} degrees of freedom, {body.n_modes} modes")
        print("first elastic modes / Hz: " + ", ".join(f"{hz:.1f}" for hz in result["elastic_hz"]))
        print(f"reduced against full to 1000 Hz: {100.0 * quality['max_relative_error']:.2g} %")
        print(f"static stiffness of the interfaces: {100.0 * quality['static_error']:.2g} %")
        print(
            f"rigidly tied journals (RBE2) would raise the first mode by {100.0 * quality['tied_raises_first']:.0f} %"
        )
        other = "lumped" if engine.reduction.consistent_mass else "consistent"
        print(f"{other} mass would shift the first mode by {100.0 * quality['other_mass_shifts_first']:+.2f} %")
        print(f"kept in {result['path']}")
    return result


def simulate(options: argparse.Namespace) -> dict[str, Any]:
    """Run cycles at constant speed, write the result, summarise the last cycle."""
    from cranktrain.dynamics import simulation
    from cranktrain.dynamics.integrators import integrator_table
    from cranktrain.dynamics.model import CRANK_LEVELS, resolved
    from cranktrain.dynamics.warm_films import FILM_TEMPERATURES, check_level
    from cranktrain.film.laws import BIG_END_LEVELS, LAWS
    from cranktrain.loads.gas_pressure import GasTrace
    from cranktrain.results.figures import check_folder, save_film_pictures
    from cranktrain.results.result_file import check_target, save_run
    from cranktrain.results.summary import online_films, run_summary
    from cranktrain.results.tables import online_text, run_tables
    from cranktrain.structure.reduction import running_body

    # everything that can be refused is refused before the minute that a crankshaft may take
    engine = load_engine(options.engine)
    _within("--speed", options.speed, 100.0, 20000.0, "rev/min; for less use the FMU, which takes any speed from 0")
    _within("--cycles", options.cycles, 1, 10000, "cycles")
    _within("--load", options.load, 0.0, 2.0, "of the full-load burn")
    _one_of("--crank", options.crank, CRANK_LEVELS)
    _one_of("--bearings", options.bearings, tuple(LAWS))
    _one_of("--big-ends", options.big_ends, BIG_END_LEVELS)
    _one_of("--film-temperature", options.film_temperature, FILM_TEMPERATURES)
    balance = options.film_temperature == "heat-balance"
    if balance:
        check_level(options.bearings)
    choices: dict[str, Any] = {
        "crank": options.crank,
        "bearings": options.bearings,
        "big_ends": options.big_ends,
        "gas_load": options.load,
    }
    if options.integrator is not None:
        integrator_table(options.integrator)
        choices["integrator"] = options.integrator
    if options.step_deg is not None:
        _within("--step-deg", options.step_deg, 0.001, 30.0, "deg of crank angle")
        choices["step"] = math.radians(options.step_deg)
    if options.pressure is None and (options.pressure_unit or options.pressure_tdc_deg is not None):
        raise InputError("--pressure-unit and --pressure-tdc-deg need --pressure FILE.csv")
    gas = None
    if options.pressure is not None:
        gas = GasTrace.from_csv(options.pressure, engine, options.pressure_unit, options.pressure_tdc_deg)
        _say(f"{gas.source}; {_pressures(gas)}")
    output = Path(options.output or f"{engine.name}_{options.speed:g}rpm.h5")
    check_target(output)
    if options.plots is not None:
        check_folder(Path(options.plots))

    settings = resolved(simulation.Settings(**choices))
    bare, _ = _reduced(engine, options)
    body = running_body(engine, bare)
    films = _film_table(engine.main_bearing) if settings.bearings == "table" else None
    floating = None
    if settings.big_ends == "table" and engine.big_end_bearing is not None:
        floating = _film_table(engine.big_end_bearing, tilt=False)
    bore = _elastic_bore(engine) if settings.bearings == "ehd" else None
    with _bar(f"{options.speed:g} rev/min, {options.cycles} cycles") as advance:
        speed = options.speed * RPM
        run = simulation.simulate(
            engine, body, settings, speed, options.cycles, gas, advance, films, bore, balance, floating
        )
    attributes = {
        "engine": engine.name,
        "body_digest": body.digest,
        "speed": options.speed * RPM,
        "cycles": options.cycles,
        "crank": settings.crank,
        "bearings": settings.bearings,
        "big_ends": settings.big_ends,
        "film_temperature": options.film_temperature,
        "integrator": settings.integrator,
        "step": settings.step,
        "gas": gas.source if gas else "built-in Wiebe cycle",
        "version": __version__,
    }
    save_run(output, run, attributes)
    summary = run_summary(run, str(output))
    summary["film_temperature"] = {"source": options.film_temperature, "passes": run.passes}
    used = gas or GasTrace.from_engine(engine)
    summary["gas"] = {"source": used.source, "peak_mpa": 1e-6 * used.peak, "imep_mpa": 1e-6 * used.imep}
    if settings.bearings == "table":
        summary["online_films"] = online_films(run.angle, run.outputs)
    if options.plots is not None:
        level = settings.bearings + (f", big ends {settings.big_ends}" if settings.big_ends != "rigid" else "")
        title = f"{engine.title}, {options.speed:g} rev/min, {settings.crank} crank, films by {level}"
        pictures = save_film_pictures(Path(options.plots), run, engine, title)
        summary["plots"] = [str(path) for path in pictures]
    if not options.json:
        print(f"Gas trace at full load: {used.source}; {_pressures(used)}")
        for table in run_tables(summary):
            _show(table)
        if balance:
            print(f"Film temperatures by heat balance: {run.passes} runs of {options.cycles} cycles; the last is shown")
        if "online_films" in summary:
            print(online_text(summary["online_films"]))
        print(
            f"{summary['steps']} steps, {summary['newton_iterations']} Newton iterations, {summary['rejected_steps']} "
            f"rejected; real-time factor {summary['real_time_factor']:.2f} ({settings.integrator}, "
            f"{math.degrees(settings.step):g} deg)"
        )
        print(f"Result: {output}")
        if options.plots is not None:
            print("Pictures: " + ", ".join(summary["plots"]))
    return summary


def _reduced(engine: Engine, options: argparse.Namespace, rebuild: bool = False) -> tuple[Any, float]:
    """Bare reduced crankshaft and the seconds it took, with the stages shown."""
    from cranktrain.structure.reduction import reduced_crankshaft

    if options.mesh is not None and not Path(options.mesh).is_file():
        raise InputError(
            f"{options.mesh}: no such mesh file; give a .msh, .inp or .bdf file with named journal surfaces"
        )
    start = time.perf_counter()
    with _stages(f"{engine.name}: crankshaft") as say:
        body = reduced_crankshaft(engine, options.mesh, progress=say, rebuild=rebuild)
    return body, time.perf_counter() - start


def _film_table(bearing: PlainBearing, tilt: bool = True) -> FilmTable:
    """Film table of a bearing, from the cache, else made now."""
    from cranktrain.film.database import TableSettings
    from cranktrain.film_table import film_table

    ratio = bearing.width / bearing.diameter
    with _bar(f"film table, L/D {ratio:.4g}") as advance:

        def shown(done: int, count: int) -> None:
            if advance is not None:
                advance(done / count)

        table, _, _ = film_table(TableSettings(ratio, bearing.groove, tilt=tilt), progress=shown, say=_say)
    return table


def _elastic_bore(engine: Engine) -> BoreCompliance:
    """Elastic bore of the main bearings, from the cache, else made now."""
    from cranktrain.film.elastic_law import SHAPES
    from cranktrain.structure.saddle import bore_compliance

    with _stages(f"{engine.name}: main bore") as say:
        return bore_compliance(engine, SHAPES, with_motion=True, progress=say)


def _calibrated(engine: str) -> list[tuple[str, Any, str, str, str]]:
    return [row for row in engine_provenance(engine) if row[3] == "calibrated"]


def _pressures(gas: Any) -> str:
    return (
        f"peak {1e-6 * gas.peak:.2f} MPa at {math.degrees(gas.peak_angle):.1f} deg, "
        f"mean effective pressure {1e-6 * gas.imep:.2f} MPa"
    )


def _within(option: str, value: float, low: float, high: float, what: str) -> None:
    if not (math.isfinite(value) and low <= value <= high):
        raise InputError(f"{option} {value:g} is not within {low:g} to {high:g} {what}")


def _one_of(option: str, value: str, valid: Sequence[str]) -> None:
    if value not in valid:
        raise InputError(f"{option} '{value}' does not exist; {nearest(value, valid)}")


def _finite(value: Any) -> Any:
    """``value`` with what JSON cannot say (not finite) as null, and NumPy scalars as plain ones."""
    if isinstance(value, dict):
        return {str(key): _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    if hasattr(value, "tolist"):
        return _finite(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _show(table: Any) -> None:
    """Print a table of texts on stdout."""
    _show_rows(table.title, table.header, table.rows)


def _show_rows(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    shown = RichTable(title=title, title_justify="left", title_style="bold")
    for column in header:
        shown.add_column(column, justify="left" if column in _LEFT else "right")
    for row in rows:
        shown.add_row(*row)
    Console(width=None if sys.stdout.isatty() else 120).print(shown)


@contextmanager
def _stages(title: str) -> Iterator[Callable[[str], None]]:
    """Show the stage at work on stderr; lines where stderr is no terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda stage: _say(f"{title}: {stage}")
        return
    with Progress(SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=console) as progress:
        task = progress.add_task(title, total=None)
        yield lambda stage: progress.update(task, description=f"{title}: {stage}")


@contextmanager
def _bar(title: str) -> Iterator[Callable[[float], None] | None]:
    """Show a bar on stderr that follows a share in [0, 1]; nothing where stderr is no terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        task = progress.add_task(title, total=1.0)
        yield lambda share: progress.update(task, completed=share)


if __name__ == "__main__":
    sys.exit(main())
