"""Whether films whose edges close are converged: ``python -m benchmarks.edges [--speeds N …] [--bearings LEVEL]``.

The six, on the grid of the loop and on one twice as fine both ways. The fine run starts from the state of the usual one
after its cycles (``reynolds`` keeps nothing of the grid in the state; ``ehd`` does, and starts afresh), and both go on
for one cycle (``--horizon``), in which are compared: torsion's peak to peak, largest force of every main, friction peak
of the most tilted main, least gap, largest film pressure, share of films in which it exceeds the oil's 1/alpha and,
with the contact law of the run, largest contact pressure. With ``table`` the usual run reads the table, the other
solves ``reynolds`` on the fine grid. ``--straight`` leaves the shells unrelieved. What tilt changes is told by torsion
at level ``impedance``. Prints one JSON object;
limits: torsion 0.3 %, every main's force 1 %.

One cycle, because from 2260 rev/min on the collar of this crank crosses its clearance with no period
(docs/theory/settling.md): two runs that differ by a rounding then part within some cycles, on one grid as on two. A
cycle is enough for the grid to show: films have no memory, and the torsional mode that answers to them (240 to 250 Hz,
2 % of damping) forgets a state within half of it.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import keep_record
from cranktrain.dynamics.simulation import Parts, Settings, Simulation
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.film.contact.gap import least_gap
from cranktrain.film.contact.journal import N_OUT, PRESSURE_MAX, bearing_contact, journal_contact
from cranktrain.film.elastic.grid import ElasticGrid
from cranktrain.film.laws import ehd
from cranktrain.film.laws.films import COS, SIN
from cranktrain.film.laws.rigid_bore import IN_LOOP, rigid_bore
from cranktrain.structure import assembly
from cranktrain.structure.crank.reduction import running_body

Array = NDArray[np.float64]
PER_CYCLE = 720
FINE = (2 * IN_LOOP[0], 2 * IN_LOOP[1])
FINE_ELASTIC = ElasticGrid(2 * ehd.FINE.n_phi, 2 * ehd.FINE.n_z, ehd.FINE.edge)


def parts_of(engine: Engine, level: str) -> Parts:
    """Table or bore that a level needs."""
    table = assembly.main_table(engine) if level == "table" else None
    bore = assembly.elastic_bore(engine, flexible=False) if level.startswith("ehd") else None
    return Parts(table=table, bore=bore)


def cycles(simulation: Simulation, count: float, say: str) -> tuple[Array, Array]:
    """Outputs and places of journals (over time) in the last of so many cycles; places in space, m."""
    begin, h = simulation.time, 4.0 * math.pi / simulation.inputs[0] / PER_CYCLE
    shown, places = [], []
    for k in range(round(count * PER_CYCLE)):
        simulation.step(begin + (k + 1) * h)
        if (k + 1) % PER_CYCLE == 0:
            print(f"edges: {say}, cycle {(k + 1) // PER_CYCLE} of {count:g}", file=sys.stderr, flush=True)
        if k >= (count - 1) * PER_CYCLE:
            films = simulation.model.films
            cos, sin = films.numbers[COS], films.numbers[SIN]
            turned = films.place.reshape(-1, 2, 2) @ np.array([[cos, sin], [-sin, cos]])
            places.append(turned.reshape(-1, 4))
            shown.append(simulation.outputs.copy())
    return np.array(shown), np.array(places)


def figures(simulation: Simulation, shown: Array, places: Array) -> dict[str, Any]:
    """What is compared, of one cycle."""
    bearing = simulation.engine.plain_mains
    at = {name: k for k, name in enumerate(simulation.output_names)}
    mains = range(1, places.shape[1] + 1)

    def of(name: str) -> Array:
        return np.array([shown[:, at[f"bearing[{i}].{name}"]] for i in mains])

    contact, out, highest = bearing_contact(bearing), np.zeros(N_OUT), 0.0
    profile = tuple(map(float, bearing.relief))
    least = math.inf
    for place in places.reshape(-1, 4):
        journal_contact(*place, 0.0, contact, out)
        highest = max(highest, float(out[PRESSURE_MAX]))
        least = min(least, least_gap(tuple(place), bearing.clearance, profile)[0])
    if simulation.settings.bearings.startswith("ehd"):
        least = float(of("film_thickness_min").min())
    return {
        "torsion_mdeg": 1e3 * math.degrees(np.ptp(shown[:, at["pulley.torsion"]])),
        "force_kn": (1e-3 * np.hypot(of("force.x"), of("force.y")).max(axis=1)).tolist(),
        "friction_nm": of("friction_torque").max(axis=1).tolist(),
        "contact_mpa": 1e-6 * highest if not simulation.settings.bearings.startswith("ehd") else None,
        "tilt_um": (1e6 * np.hypot(places[..., 2], places[..., 3]).max(axis=0)).tolist(),
        "least_gap_um": 1e6 * least,
        "film_pressure_mpa": 1e-6 * float(of("pressure_max").max()),
        "share_beyond_barus_limit": float((of("pressure_max") > 1.0 / simulation.engine.oil.pressure_viscosity).mean()),
        "online_films": float(simulation.model.laws.solved[0]),
    }


def compared(engine: Engine, level: str, speed: float, count: float, horizon: float) -> dict[str, Any]:
    """One speed on both grids."""
    body, parts = running_body(engine), parts_of(engine, level)

    def started(bearings: str, parts: Parts = parts) -> Simulation:
        simulation = Simulation(engine, body, Settings(bearings=bearings), parts=parts)
        simulation.inputs[0] = speed * math.pi / 30.0
        simulation.initialize()
        return simulation

    usual = started(level)
    cycles(usual, count, f"{speed:g} rev/min, {level}")
    if level.startswith("ehd"):
        fine = started(level, parts._replace(bore=replace(parts.bore, grid=FINE_ELASTIC)))
        cycles(fine, count, f"{speed:g} rev/min, {level}, fine")
    else:
        fine = started("reynolds")
        bore = rigid_bore(engine.plain_mains, fine.model.bearings, None, fine.model.laws.solved, size=FINE)
        fine.model.films.entry[:, 1] = keep_record(bore, fine.model.laws.entry)
        fine.state = usual.state
    aligned = started("impedance")
    shown, _ = cycles(aligned, 2 * count, f"{speed:g} rev/min, impedance")
    torsion = 1e3 * math.degrees(np.ptp(shown[:, aligned.output_names.index("pulley.torsion")]))
    ours = figures(usual, *cycles(usual, horizon, f"{speed:g} rev/min, {level}"))
    finer = figures(fine, *cycles(fine, horizon, f"{speed:g} rev/min, fine"))
    forces = np.array(ours["force_kn"]) / np.array(finer["force_kn"]) - 1.0
    return {
        "loop": ours,
        "fine": finer,
        "torsion_of_impedance_mdeg": torsion,
        "tilt_changes_torsion": ours["torsion_mdeg"] / torsion - 1.0,
        "torsion_error": ours["torsion_mdeg"] / finer["torsion_mdeg"] - 1.0,
        "largest_force_error": float(np.abs(forces).max()),
        "contact_within_hardness": (ours["contact_mpa"] or 0.0) <= 1e-6 * engine.plain_mains.hardness,
    }


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.edges", description=__doc__)
    parser.add_argument("--speeds", type=float, nargs="+", default=[1000.0, 1600.0, 2000.0, 2380.0], metavar="N")
    parser.add_argument("--bearings", choices=("table", "reynolds", "ehd", "ehd:fine"), default="reynolds")
    parser.add_argument("--cycles", type=float, default=4.0, help="run before")
    parser.add_argument("--horizon", type=float, default=1.0, metavar="CYCLES", help="on both grids, last is compared")
    parser.add_argument("--straight", action="store_true", help="shells without relief")
    chosen = parser.parse_args()
    engine = load_engine("diesel_i6")
    if chosen.straight:
        engine = replace(engine, main_bearing=replace(engine.plain_mains, relief_depth=0.0))
    result = {f"{n:g}": compared(engine, chosen.bearings, n, chosen.cycles, chosen.horizon) for n in chosen.speeds}
    print(json.dumps({"bearings": chosen.bearings, "straight": chosen.straight, **result}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
