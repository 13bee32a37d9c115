"""The verb ``explore``: a local page where knobs turn an engine's torsional vibration."""

from __future__ import annotations

import argparse
import signal
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import number, say, stages
from cranktrain.core.errors import InputError
from cranktrain.core.user_file import ending
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM

if TYPE_CHECKING:
    from pathlib import Path

    from cranktrain_lab.explore.page import Explored

DESCRIPTION = """\
A local page where knobs turn an engine's torsional vibration, and curves follow at once.

Knobs of load, firing order, damper, pulley, flywheel and shafts, as the engine file has them. Orders of the pulley's
torsion, twist, Campbell diagram and damper heat follow as a knob moves (linear run-up of a torsional crank), harmonic
balance when it rests. A full model runs in the background. What was changed is written into a new engine file.

The page is served to this machine alone (127.0.0.1), at an address with a token that is printed; it asks nothing of any
network. Ctrl-C ends it (exit code 0). Needs the extra explore: pip install cranktrain[explore].
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("engine", metavar="ENGINE", help="name of a shipped engine (diesel_i6) or path of a .toml file")
    rpm = number(SLOWEST_RPM, FASTEST_RPM, "rev/min")
    add("--from", dest="from_rpm", type=rpm, metavar="RPM",
        help="first speed, rev/min (default: the engine's lowest)")  # fmt: skip
    add("--to", dest="to_rpm", type=rpm, metavar="RPM", help="last speed, rev/min (default: the engine's highest)")
    add("--measured", metavar="FILE", help="measured orders, laid over the computed ones; table of 'cranktrain "
        "measured' or UFF 58")  # fmt: skip
    add("--compare", metavar="OTHER", help="engine or result file of runup (.h5) that is shown beside")
    add("--inside", metavar="FILE", help="cycle to look into: saved by the page, or a result file of simulate (.h5)")
    add("--no-balance", dest="balance", action="store_false", help="without harmonic balance when a knob rests")
    add("--port", type=number(0, 65535, "", int), default=0, metavar="N", help="port (default: a free one)")
    add("--browser", action="store_true", help="open the page in the browser")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Serve the page until Ctrl-C ends it, which is how it is meant to end."""
    explored = explored_of(options.engine, options)
    from cranktrain_lab.explore.server import serve

    address = ""

    def started(found: str) -> None:
        nonlocal address
        address = found
        if options.json:
            say(found)
        else:
            print(f"{found}\nCtrl-C ends it.", flush=True)
        if options.browser:
            import webbrowser

            webbrowser.open(found)

    try:
        serve(explored, options.port, started)
    except KeyboardInterrupt as stop:
        if signal.SIGTERM in stop.args:
            raise
    say("cranktrain: explore ended")  # Panel may take the signal, and end the server by itself
    return {"address": address}


def explored_of(source: str | Path | Engine, options: argparse.Namespace) -> Explored:
    """All that a page shows, with input checked before work; ``InputError``."""
    engine = load_engine(source)
    if isinstance(source, Engine):
        source = engine
    try:
        from cranktrain_lab.explore.page import Explored
    except ImportError as error:
        missing = (error.name or "panel").partition(".")[0]
        raise InputError(f"explore needs {missing}; pip install cranktrain[explore]") from None
    from cranktrain.results.orders.deviations import check_speeds_measured
    from cranktrain.results.orders.measured import read_measured_orders
    from cranktrain_lab.explore.balance import Balance
    from cranktrain_lab.explore.live import LiveTorsion, checked_speeds

    ends = checked_speeds(engine, options.from_rpm, options.to_rpm)
    measured = None if options.measured is None else read_measured_orders(options.measured)
    if measured is not None:
        check_speeds_measured(measured, *ends)
    other = _other(options.compare, ends)
    from cranktrain_lab.explore.inside.cycle import InsideCycle

    inside = None if options.inside is None else InsideCycle.load(options.inside, engine)
    with stages(engine.name) as tell:
        live = LiveTorsion(engine, *ends, say=tell)
        for note in live.notes:
            say(f"cranktrain: note: {note}")
        beside = other if other is None or not isinstance(other[1], Engine) else (
            other[0], LiveTorsion(other[1], *ends, say=tell).answer(_nothing()))  # fmt: skip
    return Explored(source, live, measured, Balance(live) if options.balance else None, beside, inside)


def _nothing() -> Any:
    from cranktrain_lab.explore.knobs import Chosen

    return Chosen()


def _other(given: str | None, ends: tuple[float, float]) -> Any:
    """Title, and engine or run-up, of what is compared."""
    if given is None:
        return None
    if ending(given) != ".h5":
        engine = load_engine(given)
        return engine.title, engine
    from cranktrain.results.run_up.run_up import RunUp

    found = RunUp.load(given)
    inside = (found.speeds >= ends[0]) & (found.speeds <= ends[1])
    if not inside.any():
        raise InputError(f"--compare {given}: has no speed within those of the page; give --from and --to")
    return f"{found.attributes.get('engine', given)}, {given}", found
