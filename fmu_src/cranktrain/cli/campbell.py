"""The verb ``campbell``: natural frequencies over the speed, and where orders meet them."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.bodies import own_meshes
from cranktrain.cli.console import number, of_words, one_of, show_rows, stages
from cranktrain.cli.plot_runup import order_list
from cranktrain.cli.run_options import engine_of
from cranktrain.core.errors import InputError
from cranktrain.engine.levels import CRANKS, crank_level, described
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM

if TYPE_CHECKING:
    from cranktrain.results.views.over_speed import Campbell

DESCRIPTION = """\
Campbell diagram: frequencies of the cranktrain at rest over the speed, modes followed through crossings.

At rest is the state of the bearings: stand-in springs and a closed thrust bearing. --json prints {"speeds_rpm",
"modes": [{"name", "kind", "hz"}], "crossings": [{"order", "mode", "rpm", "hz"}]}, torsional crossings first.
"""
WHY = (
    "Lines are those of the turning crank: in its axes the bearings' springs across and upwards act by their mean, and "
    "gyroscopic and centrifugal terms split bending with the speed, which moves torsion where lines come near one "
    "another. cranktrain modal has the crank at standstill in one position, so it has one number."
)
"""Why a line moves where a list of modes has one number."""
SPEEDS = 21
"""Speeds where no distance is given."""
RPM = math.pi / 30.0


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options to those that all verbs of an engine have."""
    add = parser.add_argument
    rpm = number(SLOWEST_RPM, FASTEST_RPM, "rev/min")
    add("--from", dest="from_rpm", type=rpm, metavar="RPM",
        help="first speed, rev/min (default: the engine's lowest)")  # fmt: skip
    add("--to", dest="to_rpm", type=rpm, metavar="RPM",
        help="last speed, rev/min (default: a quarter above the engine's highest)")  # fmt: skip
    add("--step", dest="step_rpm", type=number(0.01, 10000.0, "rev/min"), metavar="RPM",
        help=f"distance between speeds, rev/min (default: {SPEEDS} speeds)")  # fmt: skip
    level = add("--crank", default="solid", metavar="LEVEL", help=f"{described(CRANKS.values())}; default solid")
    of_words(level, CRANKS)
    add("--damper", action="store_true", help="with the engine's torsional damper on the pulley")
    add("--highest-hz", type=number(1.0, 1e5, "Hz"), metavar="HZ",
        help="modes up to this frequency (default: 1000, or the first torsional one)")  # fmt: skip
    add("--orders", type=order_list, default=[], metavar="LIST",
        help="orders whose crossings are listed and drawn, e.g. 3,6 (default: those that excite torsion)")  # fmt: skip
    add(
        "--drive-line",
        metavar="TABLE",
        help="discs and shafts (TOML or CSV) from 'flywheel' to 'dynamometer' in place of the connecting shaft",
    )
    add("--output", metavar="FILE", help="picture of the diagram, ending in .png or .svg")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Frequencies over the speed and their crossings with orders."""
    engine, found, orders = _found(options)
    met = sorted(found.crossings(orders), key=lambda one: one.kind != "torsional")
    crossings: list[dict[str, Any]] = [
        {"order": one.order, "mode": one.mode, "rpm": one.speed / RPM, "hz": one.hz} for one in met
    ]
    said: dict[str, Any] = {
        "engine": engine,
        "speeds_rpm": found.speeds_rpm.tolist(),
        "modes": [
            {"name": name, "kind": kind, "hz": found.hz[:, k].tolist()}
            for k, (name, kind) in enumerate(zip(found.names, found.kinds, strict=True))
        ],
        "orders": orders,
        "crossings": crossings,
    }
    if options.output is not None:
        said["output"] = options.output
    if not options.json:
        first, last = (f"Hz at {found.speeds_rpm[at]:.5g} rev/min" for at in (0, -1))
        rows = [(str(one["name"]), f"{one['hz'][0]:.1f}", f"{one['hz'][-1]:.1f}") for one in said["modes"]]
        show_rows(f"{engine}: modes at rest over speed", ("mode", first, last), rows)
        print(WHY)
        for what, those in (("torsional", True), ("other", False)):
            places = [
                (f"{one.order:g}", one.mode, f"{one.speed / RPM:.0f}", f"{one.hz:.1f}")
                for one in met
                if (one.kind == "torsional") is those
            ]
            show_rows(f"{engine}: orders meet {what} modes", ("order", "mode", "rev/min", "Hz"), places)
    return said


def answer(options: argparse.Namespace) -> Campbell:
    """The modes over speed themselves, for the library."""
    return _found(options)[1]


def _found(options: argparse.Namespace) -> tuple[str, Campbell, list[float]]:
    """The engine's name, modes over speed, and the orders that are drawn."""
    import numpy as np

    from cranktrain.dynamics.model.settings import Settings
    from cranktrain.dynamics.simulation import fitted_engine
    from cranktrain.loads.damper import required_damper
    from cranktrain.results.figures import PICTURE
    from cranktrain.results.views.over_speed import Campbell
    from cranktrain.store.whole_file import check_place
    from cranktrain.structure.assembly import check_mesh, running_crank
    from cranktrain.structure.crank.critical_speeds import REACH, exciting_orders
    from cranktrain.studies.campbell import campbell
    from cranktrain.studies.run_up.plan import run_up_speeds

    one_of("--crank", options.crank, CRANKS)
    engine = engine_of(options)
    if not crank_level(options.crank).elastic:
        raise InputError(
            f"--crank {options.crank} has no natural frequencies of its own; take torsional, beam or solid"
        )
    if options.damper:
        required_damper(engine)
    own_meshes(options)
    if options.output is not None:
        check_place(Path(options.output), PICTURE)
    check_mesh(options.mesh, "journal surfaces")
    lowest, highest = engine.speeds
    low = lowest / RPM if options.from_rpm is None else options.from_rpm
    high = min(REACH * highest / RPM, FASTEST_RPM) if options.to_rpm is None else options.to_rpm
    if not low < high:
        raise InputError(f"--from {low:g} is not below --to {high:g} rev/min; a diagram takes two speeds or more")
    speeds = np.linspace(low, high, SPEEDS) * RPM
    if options.step_rpm is not None:
        speeds = np.array(run_up_speeds(low, high, options.step_rpm))
    fitted = fitted_engine(engine, Settings(crank=options.crank, damper="fitted" if options.damper else "none"))
    with stages(f"{engine.name}: Campbell diagram") as tell:
        # Frequencies are those of the undamped crank, so no damping is inherited from the level above.
        body = running_crank(fitted, options.crank, say=tell, mesh=options.mesh, inherit=False)
        found = Campbell(*campbell(fitted, body, speeds, options.crank, options.highest_hz, options.damper, tell))
        orders = options.orders or [one.order for one in exciting_orders(fitted, body)]
    if options.output is not None:
        found.plot(orders, options.output, engine.name)
    return engine.name, found, orders
