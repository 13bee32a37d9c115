"""The verb ``campbell``: natural frequencies over the speed, and the speeds at which orders excite them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cranktrain.cli.bodies import own_mesh
from cranktrain.cli.console import show_rows, stages
from cranktrain.cli.functions import verb
from cranktrain.cli.run_options import engine_of
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.core.units import RPM
from cranktrain.engine.levels import crank_level
from cranktrain.engine.quantities import FASTEST_RPM
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
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


@dataclass(frozen=True, kw_only=True)
class CampbellDiagram(words.CrankLevel, words.DriveLine, words.Meshes):
    """Question of :func:`campbell`."""

    from_rpm: words.FirstSpeed | None = None
    to_rpm: Annotated[
        words.Rpm | None, Option("RPM", "last speed, rev/min (default: a quarter above the engine's highest)", "--to")
    ] = None
    step_rpm: Annotated[
        float | None,
        between(0.01, 10000.0, "rev/min"),
        Option("RPM", f"distance between speeds, rev/min (default: {SPEEDS} speeds)", "--step"),
    ] = None
    damper: words.Fitted = False
    highest_hz: Annotated[
        float | None,
        between(1.0, 1e5, "Hz"),
        Option("HZ", "modes up to this frequency (default: 1000, or the first torsional one)"),
    ] = None
    orders: Annotated[
        words.OrdersOf,
        Option(
            "LIST",
            "orders whose crossings are listed and drawn, e.g. 3,6 (default: those that excite torsion)",
            convert=words.order_list,
        ),
    ] = ()
    output: Annotated[words.File | None, Option("FILE", "picture of the diagram, ending in .png or .svg")] = None


@verb(CampbellDiagram, DESCRIPTION)
def campbell(named: str | Path | Engine, ask: CampbellDiagram) -> Campbell:
    """Compute the modes over the speed, and draw the diagram if a path is given."""
    return _found(named, ask)[1]


def answer(engine: str, ask: CampbellDiagram) -> VerbResult:
    """Frequencies over the speed and their crossings with orders, for the command line."""
    name, found, orders = _found(engine, ask)
    met = sorted(found.crossings(orders), key=lambda one: one.kind != "torsional")
    said: dict[str, Any] = {
        "engine": name,
        "speeds_rpm": found.speeds_rpm.tolist(),
        "modes": [
            {"name": name, "kind": kind, "hz": found.hz[:, k].tolist()}
            for k, (name, kind) in enumerate(zip(found.names, found.kinds, strict=True))
        ],
        "orders": orders,
        "crossings": [{"order": one.order, "mode": one.mode, "rpm": one.speed / RPM, "hz": one.hz} for one in met],
    }
    if ask.output is not None:
        said["output"] = ask.output
    return VerbResult.of(said, "campbell", met=met)


def show(said: VerbResult) -> None:
    """Print the modes, and the speeds at which orders excite them."""
    engine, speeds = said["engine"], said["speeds_rpm"]
    first, last = (f"Hz at {speeds[at]:.5g} rev/min" for at in (0, -1))
    rows = [(str(one["name"]), f"{one['hz'][0]:.1f}", f"{one['hz'][-1]:.1f}") for one in said["modes"]]
    show_rows(f"{engine}: modes at rest over speed", ("mode", first, last), rows)
    print(WHY)
    for what, those in (("torsional", True), ("other", False)):
        places = [
            (f"{one.order:g}", one.mode, f"{one.speed / RPM:.0f}", f"{one.hz:.1f}")
            for one in said.beside["met"]
            if (one.kind == "torsional") is those
        ]
        show_rows(f"{engine}: orders meet {what} modes", ("order", "mode", "rev/min", "Hz"), places)


def _found(named: str | Path | Engine, ask: CampbellDiagram) -> tuple[str, Campbell, list[float]]:
    """Name of the engine, modes over speed, and orders that are drawn."""
    import numpy as np

    from cranktrain.dynamics.model.settings import Settings
    from cranktrain.dynamics.simulation import fitted_engine
    from cranktrain.loads.damper import required_damper
    from cranktrain.results.figures import PICTURE
    from cranktrain.results.views.over_speed import Campbell
    from cranktrain.store.whole_file import check_place
    from cranktrain.structure.assembly import check_mesh, running_crank
    from cranktrain.structure.crank.critical_speeds import REACH, exciting_orders
    from cranktrain.studies import campbell as study
    from cranktrain.studies.run_up.plan import run_up_speeds

    engine = engine_of(named, ask)
    if not crank_level(ask.crank).elastic:
        raise InputError(f"--crank {ask.crank} has no natural frequencies of its own; take torsional, beam or solid")
    if ask.damper:
        required_damper(engine)
    mesh = own_mesh(ask.mesh, ask.mesh_unit)
    if ask.output is not None:
        check_place(Path(ask.output), PICTURE)
    check_mesh(mesh, "journal surfaces")
    lowest, highest = engine.speeds
    low = lowest / RPM if ask.from_rpm is None else ask.from_rpm
    high = min(REACH * highest / RPM, FASTEST_RPM) if ask.to_rpm is None else ask.to_rpm
    if not low < high:
        raise InputError(f"--from {low:g} is not below --to {high:g} rev/min; a diagram takes two speeds or more")
    speeds = np.linspace(low, high, SPEEDS) * RPM
    if ask.step_rpm is not None:
        speeds = np.array(run_up_speeds(low, high, ask.step_rpm))
    fitted = fitted_engine(engine, Settings(crank=ask.crank, damper="fitted" if ask.damper else "none"))
    with stages(f"{engine.name}: Campbell diagram") as tell:
        # Frequencies are those of the undamped crank, so no damping is inherited from the level above.
        body = running_crank(fitted, ask.crank, say=tell, mesh=mesh, inherit=False)
        found = Campbell(*study.campbell(fitted, body, speeds, ask.crank, ask.highest_hz, ask.damper, tell))
        orders = list(words.orders_of(ask.orders)) or [one.order for one in exciting_orders(fitted, body)]
    if ask.output is not None:
        found.plot(orders, str(ask.output), engine.name)
    return engine.name, found, orders
