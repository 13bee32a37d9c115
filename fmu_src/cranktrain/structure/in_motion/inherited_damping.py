"""Torsional damping that a crank of level ``torsional`` takes from the next finer crank level.

A crank with held journals has no films and only structural damping, so its resonance is several times too high. A real
crank is damped because it bends as it twists, and the bending squeezes the films of its main bearings. The next higher
level models both. It runs at full load at the speed where a firing order excites the first torsional mode. From several
instants of a cycle the run is continued twice, once with a small impulse in the shape of a torsional mode in motion
with its films and floating collar (:mod:`cranktrain.studies.in_motion`). With the mode's coordinate η in the difference
of both runs, the energy of the impulse is E = η̇² + ω²η², and it falls as exp(−2ζωt). This is a free decay about the
periodic motion; its rate is the mean over the cycle. The first and second torsional mode of the cranktrain are
measured, if modes up to the cut-off have these names (:mod:`cranktrain.structure.crank.modal`).

The modal damping c_i (1/s) of the first two elastic modes of the lower level is set so that the modes φ_k of its
cranktrain have the same decay, Σ_i c_i φ_ki² = 2 ζ_k ω_k. All other modes keep the engine's structural damping, which
is also the lower limit of each mode's damping. The records of the body store the result: ``inherited_damping`` (modes,
2) frequency in Hz and ζ of the level above, ``inherited_at`` speed in rad/s and load.

Sources: D. J. Ewins, *Modal Testing* (2000), free decay; W. Ker Wilson, *Practical Solution of Torsional Vibration
Problems*, vol. 2 (1963), equivalent damping per cylinder.
"""

import math
from dataclasses import replace
from hashlib import sha256
from itertools import takewhile
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model.arrays import structural_damping
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.model.state import POSITION, VELOCITY, offset
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import NOTHING_PUBLISHED
from cranktrain.structure.crank.modal import at_largest, cranktrain_matrices, cranktrain_modes, torsional_frequencies
from cranktrain.structure.in_motion.eigenproblem import modes_in_motion

MODES = 2
"""Number of torsional modes whose damping is inherited."""
SETTLING = 6
"""Number of cycles that the next finer crank level runs before the impulse."""
STEP = math.radians(1.0)
KICK = 1.0e-4
"""Largest rotation of an interface in response to the impulse, rad; the films respond linearly to it."""
STARTS, PERIODS = 8, 5
"""Number of instants of a cycle at which an impulse is given, and number of periods of the mode over which its decay
is observed."""


class Decay(NamedTuple):
    """Frequencies (Hz) and damping ratios of up to MODES torsional modes of a crank in motion at ``speed`` (rad/s)."""

    hz: Array
    ratio: Array
    speed: float


def with_damping(engine: Engine, body: ReducedBody, above: str, found: Decay) -> ReducedBody:
    """Running ``body`` with the damping ``found`` in a run of crank level ``above``; its records state the damping."""
    damping = equivalent_damping(engine, body, found.ratio)
    return replace(
        body,
        damping=damping,
        digest=sha256(repr((body.digest, above, damping.tolist())).encode()).hexdigest(),
        records={
            **body.records,
            "inherited_damping": np.stack((found.hz, found.ratio), axis=1),
            "inherited_at": np.array([found.speed, 1.0]),
        },
    )


def with_stated_damping(engine: Engine, body: ReducedBody) -> ReducedBody:
    """Running ``body`` with the damping ratios ``damping.torsional_ratios`` of the engine file."""
    damping = equivalent_damping(engine, body, np.array(engine.damping.torsional_ratios), structural=False)
    return replace(
        body, damping=damping, digest=sha256(repr((body.digest, "stated", damping.tolist())).encode()).hexdigest()
    )


def equivalent_damping(engine: Engine, body: ReducedBody, ratios: Array, structural: bool = True) -> Array:
    """Modal damping (n,), 1/s, of a torsional body that gives the first modes of its cranktrain the ``ratios`` (k,).

    With ``structural`` the structural damping is the lower limit of each mode's damping.
    """
    own = structural_damping(engine, body)
    # Coordinates of torsion: rotation about the axis, and the elastic modes.
    twists = slice(5, body.n_modes)
    stiffness, mass = (matrix[twists, twists] for matrix in cranktrain_matrices(engine, body))
    squares, shapes = eigh(stiffness, mass)
    count = min(ratios.size, body.n_modes - 6)
    at = slice(1, 1 + count)
    wanted = 2.0 * ratios[:count] * np.sqrt(squares[at])
    shares = shapes[:, at].T ** 2
    wanted -= shares[:, 1 + count :] @ own[6 + count :]
    damping = own.copy()
    least = own[6 : 6 + count] if structural else 0.0
    damping[6 : 6 + count] = np.maximum(np.linalg.solve(shares[:, at], wanted), least)
    return damping


def resonance_speed(engine: Engine, torsional_hz: float | None) -> float:
    """Highest speed (rad/s) in the oil's table at which a multiple of the firing order excites first torsion.

    Without such a mode the result is the last speed of the table.
    """
    firing = engine.firings
    highest = 1.05 * engine.oil.temperature_speeds[-1]
    if torsional_hz is None:
        return engine.oil.temperature_speeds[-1]
    speed = 2.0 * math.pi * torsional_hz / firing
    return speed / math.ceil(speed / highest)


def felt(engine: Engine) -> Engine:
    """Engine for the run that measures torsional damping, without data that do not influence this damping.

    Names, published values, limits and strength do not influence motion. The level above runs on ground at the speed
    and load of :func:`measured_decay`, without damper (the housing is part of the pulley), and with rigid pistons on
    their axes. A chain of the drive line is left out, because the mode is that of the crank and a chain with a free end
    has no given speed. Block and mounts are kept if the engine file adds bodies, because these may be connected to
    them.
    """
    apart = replace(
        engine,
        name="engine",
        title="",
        published=NOTHING_PUBLISHED,
        reduction=replace(engine.reduction, torsional_source="ker-wilson"),
        bearing_limits=None,
        limits=None,
        crank_strength=None,
        damper=None,
        damping=replace(engine.damping, torsional_ratios=()),
        load=None,
        drive_line_chain=None,
    )
    if engine.additions.body or engine.additions.connection:
        return apart
    return replace(apart, block=None, mounts=None, piston_guidance=None)


def settings_above(crank: str) -> Settings:
    """Settings of a run at the next finer crank level: its default bearings, full load, block on ground."""
    return Settings(crank=crank, block="ground", integrator="esdirk4", step=STEP)


def measured_decay(simulation: Simulation) -> Decay:
    """Free decay of the first torsional modes, measured in a simulation that is not yet initialised."""
    engine, highest = simulation.engine, simulation.engine.reduction.running_cutoff_hz
    speed = resonance_speed(engine, torsional_frequencies(*cranktrain_modes(engine, simulation.body), highest)[0])
    simulation.inputs[0] = speed
    simulation.initialize()
    body = simulation.body
    _, mass = cranktrain_matrices(engine, body)
    h = communication_step(speed, STEP)
    cycle = round(4.0 * math.pi / speed / h)
    rows = np.zeros((SETTLING * cycle, simulation.outputs.size))
    done = simulation.series(h, 1, rows)
    modes = modes_in_motion(simulation)
    numbers = (modes.twisting(number) for number in range(1, MODES + 1))
    chosen = list(takewhile(lambda k: k >= 0, numbers))
    shapes = at_largest(modes.shapes[: body.n_modes])
    rates = np.zeros((STARTS, len(chosen)))
    for start in range(STARTS):
        state = simulation.state
        for k, mode in enumerate(chosen):
            frequency = float(modes.hz[mode])
            count = math.ceil(PERIODS / frequency / h)
            rates[start, k] = _rate(simulation, state, mass, shapes[:, mode], frequency, (h, done, count))
        simulation.state = state
        done += simulation.series(h, done + 1, rows[: cycle // STARTS])
    hz = modes.hz[chosen]
    return Decay(hz, rates.mean(axis=0) / (4.0 * math.pi * hz), speed)


def _rate(
    simulation: Simulation, state: Array, mass: Array, shape: Array, hz: float, steps: tuple[float, int, int]
) -> float:
    """Decay rate (1/s) of the energy of an impulse in a mode's shape (n,) given at ``state``.

    ``steps`` are the step (s), the number of steps before observation, and the number of observed steps. Rotating
    bodies other than the crank get no impulse.
    """
    omega, (h, done, count) = 2.0 * math.pi * hz, steps
    first = [offset(part, simulation.model.omega2.size) for part in (POSITION, VELOCITY)]
    place, speed = (slice(at, at + shape.size) for at in first)
    shape = shape / math.sqrt(shape @ mass @ shape)
    turns = simulation.body.shapes[:, 5] @ shape
    turned = -turns[np.abs(turns).argmax()]  # eigenvectors have any sign, and films resist a little more one way
    kicked = state.copy()
    kicked[speed] += shape * (KICK * omega / turned)
    motions = np.zeros((2, count, 2))
    for motion, start in zip(motions, (state, kicked), strict=True):
        simulation.state = start
        for k in range(count):
            simulation.step((done + k + 1) * h)
            now = simulation.state
            motion[k] = now[place] @ mass @ shape, now[speed] @ mass @ shape
    eta, rate = (motions[1] - motions[0]).T
    return -float(np.polyfit(h * np.arange(count), np.log(rate**2 + (omega * eta) ** 2), 1)[0])
