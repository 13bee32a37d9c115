"""Torsional mode of the six by the mean stiffness of its films: ``python benchmarks/film_modes.py [RPM …]``.

The settled cycle at level ``impedance`` gives each film's tangents by place and velocity; their means over the cycle,
in axes of the crank, take the place of the springs and dampers of level ``linear``. The thrust bearing is closed as at
that level, or open: its collar floats between films. Modes with more than a tenth of their energy in torsion, 200 to
300 Hz; beside them the mode in motion, of which nothing is averaged. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.linear import SmallMotions
from cranktrain.dynamics.model.arrays import build_model
from cranktrain.dynamics.model.records import dimensions
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.tangents import tangents_in_rotation
from cranktrain.engine.file import load_engine
from cranktrain.film.laws.films import PLANE_BY_PLACE, PLANE_BY_VELOCITY
from cranktrain.film.laws.impedance import MapFilm, impedance_map, journal_force
from cranktrain.film.laws.parameters import CLEARANCE, CONTACT_HEIGHT, CONTACT_LOAD, FACTOR, KAPPA2
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.assembly import Assembly, assemble
from cranktrain.structure.crank.modal import KINDS, at_largest, energy_shares, main_springs
from cranktrain.studies.run_up.steady import Job, SteadyRuns
from cranktrain.studies.torsion.damped_modes import damped_modes

RPM = math.pi / 30.0
SPEEDS = (1240.0, 1660.0, 1980.0)
ACROSS = np.array([[0.0, -1.0], [1.0, 0.0]])
"""e_z × in the plane."""
RANGE, SHARE = (200.0, 300.0), 0.1


def tangents(simulation: Simulation, bearing: int, speed: float, rows: dict[str, Array]) -> tuple[Array, Array]:
    """Tangents (samples, 2, 2) of a film by place and velocity, in axes at rest, at samples of a cycle."""
    own = simulation.model.bearings[bearing]
    film = MapFilm(own[CLEARANCE], own[FACTOR], own[CONTACT_HEIGHT], own[CONTACT_LOAD], impedance_map(own[KAPPA2]))
    motion = [
        rows[f"bearing[{bearing + 1}].{name}"] for name in ("position.x", "position.y", "velocity.x", "velocity.y")
    ]
    out = np.zeros(16)
    found = np.zeros((motion[0].size, 2, 4))
    for k, (x, y, vx, vy) in enumerate(zip(*motion, strict=True)):
        journal_force(x, y, vx, vy, 0.5 * speed, film, out)
        found[k] = out[PLANE_BY_PLACE : PLANE_BY_PLACE + 4], out[PLANE_BY_VELOCITY : PLANE_BY_VELOCITY + 4]
    return found[:, 0].reshape(-1, 2, 2), found[:, 1].reshape(-1, 2, 2)


def mean_films(simulation: Simulation, speed: float) -> tuple[Array, Array, list[list[float]]]:
    """Means of all films' tangents (b, 2, 2) in axes of the crank, and their stiffness at x and y over the springs'."""
    rows, angle = cycle_of(simulation, speed)
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.stack((np.stack((cos, -sin), axis=-1), np.stack((sin, cos), axis=-1)), axis=-2)
    back = turn.transpose(0, 2, 1)
    place, velocity, over = [], [], []
    for i, springs in enumerate(main_springs(simulation.engine)):
        by_place, by_velocity = tangents(simulation, i, speed, rows)
        damping = back @ by_velocity @ turn
        place.append((back @ by_place @ turn + speed * damping @ ACROSS).mean(axis=0))
        velocity.append(damping.mean(axis=0))
        over.append([float(-by_place[:, k, k].mean() / springs[k]) for k in (0, 1)])
    return np.array(place), np.array(velocity), over


def cycle_of(simulation: Simulation, speed: float) -> tuple[dict[str, Array], Array]:
    """Outputs of the next cycle, without its start, and the shaft's angles."""
    count = math.ceil(4.0 * math.pi / simulation.settings.step - 1e-9)
    rows = np.empty((count, simulation.outputs.size))
    simulation.series(4.0 * math.pi / speed / count, 1, rows)
    return dict(zip(simulation.output_names, rows.T, strict=True)), 4.0 * math.pi / count * np.arange(1, count + 1)


def measured(made: Assembly, runs: SteadyRuns, rpm: float) -> dict[str, Any]:
    """Figures at one speed."""
    speed = rpm * RPM
    learned = runs.at(speed).start.learned
    place, velocity, over = mean_films(runs.simulation, speed)
    settings = Settings(bearings="linear", block="ground")
    plain = replace(made.engine, axial_path=None)
    model = build_model(plain, made.body, settings, speed, GasTrace.from_engine(made.engine))
    motions, springs, thrust = SmallMotions(model), tangents_in_rotation(model, speed).mean(), dimensions(model).thrust
    found: dict[str, Any] = {"films_over_springs": over}
    for films in (0.0, 1.0):
        for closed in (1.0, 0.0):
            laws = springs._replace(place=springs.place.copy(), velocity=springs.velocity.copy())
            if films:
                laws.place[: len(place), :2, :2], laws.velocity[: len(place), :2, :2] = place, velocity
            laws.place[thrust] *= closed
            laws.velocity[thrust] *= closed
            mass, damping, stiffness = motions.equations(speed, laws)
            modes = damped_modes(stiffness, damping, mass)
            shown = (modes.hz > RANGE[0]) & (modes.hz < RANGE[1])
            shares = energy_shares(made.engine, made.body, at_largest(modes.shapes[:, shown]), rods=True)
            torsion = shares[:, KINDS.index("torsional")]
            name = f"{'films' if films else 'springs'}, thrust {'closed' if closed else 'open'}"
            found[name] = [
                {"hz": float(hz), "torsion": float(share)}
                for hz, share in zip(modes.hz[shown], torsion, strict=True)
                if share > SHARE
            ]
    if learned is not None:
        found["mode_in_motion_hz"] = learned.free.decay.imag / (2.0 * math.pi)
    return found


def main() -> None:
    """Print one JSON object."""
    made = assemble(load_engine("diesel_i6"), Settings(bearings="impedance"))
    runs = SteadyRuns(Job(made, None, 1e-6, 24.0, ("pulley.torsion",)))
    chosen = [float(word) for word in sys.argv[1:]] or SPEEDS
    print(json.dumps({f"{rpm:g}": measured(made, runs, rpm) for rpm in chosen}, indent=1))


if __name__ == "__main__":
    main()
