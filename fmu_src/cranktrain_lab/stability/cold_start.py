"""Stability map of the cold start from all positions of the journals in their bores.

A run begins at the static equilibrium of films and loads (:func:`cranktrain.dynamics.start.settling.settle`), which is
searched from any position of the journals. Here the journals are placed at eccentricities of 0 to 0.999 of the
clearance in every direction, at speeds from standstill on. The start must find its equilibrium, and the first cycle
must run. The same test is made without the search, with the journals released at rest from these positions.

Theory: a rigid rotor's equilibrium at each speed, from the two-dimensional Reynolds equation with Reynolds rupture
(:class:`cranktrain.film.steady.bearing.SteadyBearing`), while the running model's film is the one with a parabolic
profile. For comparison, plain Newton steps on the same static equation, from the same places.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.model.records import ModelArrays
from cranktrain.dynamics.model.state import POSITION, offset
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.dynamics.start.mean_motion import rigid_start
from cranktrain.dynamics.start.settling import settle
from cranktrain.dynamics.time.status import OK
from cranktrain.dynamics.time.step_control import STEPPING_SPEED
from cranktrain.engine.file import load_engine
from cranktrain.engine.lubricant import oil_temperature, viscosity
from cranktrain.film.laws.impedance import journal_force
from cranktrain.film.laws.parameters import CLEARANCE, RADIUS, WIDTH
from cranktrain.film.steady.bearing import Journal, SteadyBearing, bearing_grid
from cranktrain_lab.stability.rotor import film_law, film_rotor, resting_state
from cranktrain_lab.stability.stability_map import Axis, Progress, StabilityMap, curve

MASS, LOAD = 10.0, 5000.0
"""Mass (kg) and load (N) of the rotor for each bearing."""
SAME = 0.01
"""Tolerance, in clearances, between final positions of all starts at a speed."""
COARSE = 0.025
"""Mesh size of the six's crankshaft in a quick map, m."""
NEWTON_STEPS = 60


@dataclass(frozen=True, eq=False)
class Start:
    """Result of one cold start: success, steps of the search, failed sub-steps, and the journals' final position.

    ``released`` and ``released_rejected`` are success and failed sub-steps of the cycle without a search. ``place``
    (b,) is the complex position of each main journal in space over its clearance after the cycle.
    """

    succeeded: bool
    search: int
    rejected: int
    released: bool
    released_rejected: int
    place: np.ndarray


def journals(simulation: Simulation, state: Array, angle: float = 0.0) -> np.ndarray:
    """Return positions x + iy of the b main journals in space, divided by their clearance, (b,)."""
    model, n = simulation.model, simulation.model.omega2.size
    u = journal_shapes(model) @ state[offset(POSITION, n) : offset(POSITION, n) + model.ports.shape[1]]
    return np.asarray((u[::2] + 1j * u[1::2]) / model.bearings[:, CLEARANCE] * np.exp(1j * angle))


def journal_shapes(model: ModelArrays) -> Array:
    """Return shapes (2b, n_t) of x and y of the main journals."""
    mains = model.connections[: model.bearings.shape[0], slots.FIRST].astype(int)
    return model.ports[np.add.outer(mains, (0, 1)).ravel()]


def placed(simulation: Simulation, eccentricity: float, direction: float) -> Array:
    """Return the state of a crank at rest in its frame, moved as a rigid body to the wanted journal position."""
    model, n = simulation.model, simulation.model.omega2.size
    unit = np.array([math.cos(direction), math.sin(direction)])
    wanted = (eccentricity * model.bearings[:, CLEARANCE, None] * unit).ravel()
    state = np.zeros_like(simulation.state)
    state[offset(POSITION, n) : offset(POSITION, n) + 6] = np.linalg.pinv(journal_shapes(model)[:, :6]) @ wanted
    return state


def start(simulation: Simulation, eccentricity: float, direction: float) -> Start:
    """Start with the journals at a position and run a cycle, then run a second cycle without a search."""
    model, work, inputs = simulation.model, simulation.work, simulation.inputs
    begin = rigid_start(model, float(inputs[0])) if simulation.settings.gas_source == "builtin" else None
    state = placed(simulation, eccentricity, direction)
    work.counters[:] = 0.0
    about = (begin.windup, begin.rotation, begin.rate) if begin else (0.0, 0.0, 0.0)
    found = settle(model, work, state, inputs, *about) == OK
    search = int(work.counters[slots.N_FACTORS])
    done, rejected = _cycle(simulation, state) if found else (False, 0)
    place = journals(simulation, simulation.state, simulation.outputs[0])
    at_rest = placed(simulation, eccentricity, direction)
    released, released_rejected = _cycle(simulation, at_rest + resting_state(simulation, float(inputs[0])))
    return Start(found and done, search, rejected, released, released_rejected, place)


def _cycle(simulation: Simulation, state: Array) -> tuple[bool, int]:
    """Run two revolutions from a state. Return True on success, and the number of failed (halved) sub-steps."""
    work = simulation.work
    simulation.state = state
    work.counters[:] = 0.0
    work.key[:] = -1.0
    step = simulation.settings.step
    h = step / max(float(simulation.inputs[0]), STEPPING_SPEED)
    begin = simulation.time
    try:
        for k in range(round(4.0 * math.pi / step)):
            simulation.step(begin + (k + 1) * h)
    except SolverError:
        return False, int(work.counters[slots.N_REJECTED])
    return bool(np.isfinite(simulation.outputs).all()), int(work.counters[slots.N_REJECTED])


def reynolds_equilibrium(simulation: Simulation, speed: float) -> complex:
    """Return the position x + iy of the rotor's journals at a speed (rad/s) over the clearance, load downwards.

    From the two-dimensional Reynolds equation, with the bearing of the simulation and the oil of the speed.
    """
    law, oil = simulation.model.bearings[0], simulation.engine.oil
    warm = viscosity(oil, oil_temperature(oil, speed))
    journal = Journal(2.0 * law[RADIUS], law[WIDTH], law[CLEARANCE], warm, speed)
    along, ahead = SteadyBearing(bearing_grid("none")).state(journal, LOAD).eccentricity
    # In the bearing's axes x is along the load, y is rotated by 90 degrees.
    return complex(ahead, -along)


def plain_newton(simulation: Simulation, eccentricity: float, direction: float) -> bool:
    """True if undamped Newton steps on the static equation lead from a position to an equilibrium in the bore."""
    law, out = film_law(simulation.model.bearings[0]), np.zeros(16)
    c = law.clearance
    place = eccentricity * c * np.array([math.cos(direction), math.sin(direction)])
    for _ in range(NEWTON_STEPS):
        if not np.hypot(*place) < c:
            return False
        journal_force(*place, 0.0, 0.0, 0.5 * float(simulation.inputs[0]), law, out)
        tangent = out[2:6].reshape(2, 2)
        if not np.isfinite(out[:6]).all() or abs(np.linalg.det(tangent)) == 0.0:
            return False
        move = -np.linalg.solve(tangent, out[:2] + np.array([0.0, -LOAD]))
        place = place + move
        if np.hypot(*move) < 1.0e-9 * c:
            return bool(np.hypot(*place) < c)
    return False


def six(speed: float, quick: bool, progress: Progress) -> Simulation:
    """Return the in-line six with elastic crankshaft, started at a speed (rad/s) in the usual way."""
    from cranktrain.structure.crank.reduction import running_body

    engine = load_engine("diesel_i6")
    if quick:
        engine = replace(engine, crankshaft=replace(engine.crankshaft, mesh_size=COARSE))
    body = running_body(engine, progress=lambda stage: progress(f"crankshaft: {stage}", 0.5))
    simulation = Simulation(engine, body, Settings(bearings="impedance", gas_source="builtin"))
    simulation.inputs[0] = speed
    simulation.initialize()
    return simulation


def compute(quick: bool, progress: Progress) -> StabilityMap:
    """Compute the map of the journals' eccentricity over its direction, for all speeds together."""
    sizes = np.append(np.linspace(0.0, 0.9, 3 if quick else 10), [0.99, 0.999])
    directions = np.linspace(0.0, 2.0 * math.pi, 9 if quick else 25)
    speeds = (0.0, 20.0, 200.0) if quick else (0.0, 5.0, 20.0, 60.0, 200.0, 400.0)
    cases = [(f"rotor at {speed:g} rad/s", speed, False) for speed in speeds]
    at = (200.0,) if quick else (0.0, 100.0, 250.0)
    cases += [(f"in-line six at {speed:g} rad/s", speed, True) for speed in at]
    shape = (sizes.size, directions.size)
    stable, search = np.ones(shape, dtype=bool), np.zeros(shape)
    lost: set[tuple[int, int]] = set()
    reached: list[complex] = []
    runs: list[Start] = []
    away, still = 0.0, 0.0
    for number, (name, speed, engine) in enumerate(cases):
        simulation = six(speed, quick, progress) if engine else film_rotor(MASS, LOAD, speed)
        places = np.zeros((*shape, simulation.model.bearings.shape[0]), dtype=complex)
        for i, size in enumerate(sizes):
            progress(name, (number + i / sizes.size) / len(cases))
            for j, direction in enumerate(directions[:-1]):
                run = start(simulation, float(size), float(direction))
                runs.append(run)
                stable[i, j] &= run.succeeded
                search[i, j] = max(search[i, j], run.search)
                places[i, j] = run.place
                if not engine and speed > 0.0 and not plain_newton(simulation, float(size), float(direction)):
                    lost.add((i, j))
        places = places[:, :-1]
        middle = np.median(places.real, axis=(0, 1)) + 1j * np.median(places.imag, axis=(0, 1))
        spread = np.abs(places - middle).max(axis=2)
        if speed > 0.0:
            # All starts at a speed must reach one position; at standstill the journal slides slowly along the wall.
            stable[:, :-1] &= spread < SAME
        else:
            still = max(still, float(spread.max()))
        if not engine:
            reached.append(complex(middle[0]))
            if speed > 0.0:
                exact = reynolds_equilibrium(simulation, speed)
                away = max(away, abs(reached[-1] - exact) / abs(exact))
    # The last direction of the map equals the first direction.
    stable[:, -1], search[:, -1] = stable[:, 0], search[:, 0]
    lost |= {(i, directions.size - 1) for i, j in lost if j == 0}
    rotor = film_rotor(MASS, LOAD, speeds[-1])
    fine = np.geomspace(min(speeds[1:]), speeds[-1], 25)
    theory = [reynolds_equilibrium(rotor, float(speed)) for speed in fine]
    places_lost = np.array([(math.degrees(directions[j]), sizes[i]) for i, j in sorted(lost)]).reshape(-1, 2)

    def locus(points: list[complex]) -> tuple[Array, Array]:
        values = np.array(points)
        return np.degrees(np.angle(values)) % 360.0, np.abs(values)

    return StabilityMap(
        name="cold_start",
        title="Cold start: from every position of the journals, at speeds from standstill on",
        rows=Axis("eccentricity at the start over the clearance", "", sizes),
        columns=Axis("its direction, down at 270", "deg", np.degrees(directions)),
        stable=stable,
        measure=search,
        measure_label="steps of the search for equilibrium, at most",
        theory=(curve("equilibria by speed, 2-D Reynolds equation", *locus(theory), "film.bearing.SteadyBearing"),),
        numerical=(
            curve("places reached from everywhere, by speed", *locus(reached), "start and first cycle, running model"),
            curve("plain Newton steps fail from here at some speed", places_lost[:, 0], places_lost[:, 1], "undamped"),
        ),
        max_deviation=away,
        explanation=_explanation(stable, runs, len(lost), [name for name, _, _ in cases], still),
        failure="start fails",
    )


def _explanation(stable: np.ndarray, runs: list[Start], lost: int, cases: list[str], still: float) -> str:
    """Return the explanation of the map, with its numbers."""
    without = sum(run.released for run in runs)
    most = max(run.search for run in runs), max(run.rejected for run in runs)
    jolts = max(run.released_rejected for run in runs)
    return (
        f"From {int(stable.sum())} of {stable.size} places the start finds its equilibrium and the first cycle runs, "
        f"with at most {most[0]} steps of search and {most[1]} failed sub-steps: {', '.join(cases)}.\n"
        f"Plain Newton steps on the same film lose the journal from {100.0 * lost / stable.size:.0f} % of the places "
        "at some speed: its force fades towards the centre and rises without bound at the wall, so straight steps "
        "overshoot the clearance. The start descends instead: backward-Euler steps, velocity dropped after each, "
        "doubled while the films allow, quartered where they fail.\n"
        f"Released at rest without that search, {without} of {len(runs)} first cycles run, with at most {jolts} failed "
        "sub-steps; they begin with a jolt instead.\n"
        "At standstill no film carries: the journal sinks by squeeze until roughness carries it or half a second has "
        f"passed, and places differ by up to {still:.2f} of the clearance along the wall. Start at speed."
    )
