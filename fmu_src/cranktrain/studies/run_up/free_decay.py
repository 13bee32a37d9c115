"""Torsional mode in motion of a running crank, measured by the decay of a small motion about its steady cycle.

The mode is measured by running a cycle twice from one start, once with a small push on the pulley. The difference is a
free decay of the running model, with loaded films and turning rods. The coefficients are periodic over a cycle, so the
decay is a sum of

    Σ_k a_k exp(λ_k t),   frequency |Im λ|/2π,   damping ratio −Re λ/|λ|

with Floquet's exponents, each accompanied by exponents shifted by multiples of half the speed. The largest in the twist
from flywheel to pulley is the torsional mode; a peak of torsion lies where an order meets it.
"""

import cmath
import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import hankel

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.cycle_run import row_step
from cranktrain.dynamics.model.state import VELOCITY, offset
from cranktrain.dynamics.settled.cycles import Recorder
from cranktrain.dynamics.settled.free_mode import FreeMode, complex_place
from cranktrain.dynamics.settled.motion import motion_of
from cranktrain.dynamics.settled.slow_modes import SlowModes
from cranktrain.dynamics.simulation import Simulation, fitted_engine
from cranktrain.structure.crank.modal import LISTED_HZ, cranktrain_modes, torsional_frequencies
from cranktrain.structure.in_motion.eigenproblem import SLOWEST_HZ, slowest_hz

NONE = complex(math.nan, math.nan)
PULLEY = 1
"""Row of ``ModelArrays.ends`` for the pulley's rotation."""
PUSH = 1.0e-2
"""Push: change of the pulley's angular velocity, rad/s. It causes 7e-6 rad at 240 Hz, a thousandth of torsion at a
resonance."""
HIGHEST_SHARE = 1.5
"""Highest frequency of the sought mode over the first torsional frequency at rest, if this exceeds 1000 Hz."""
MOST, NOISE = 24, 1.0e-5
"""Largest number of oscillations into which a decay is split, and their least singular value over the largest."""


def torsional_mode(simulation: Simulation) -> FreeMode | None:
    """Torsional mode about the cycle that begins at a simulation's state; the state is not changed.

    Returns None if nothing twists. Raises ``SolverError`` for a step that fails.
    """
    speed, state = float(simulation.inputs[0]), simulation.state
    step = row_step(simulation)
    recorder = Recorder(simulation, step, round(4.0 * math.pi / speed / step))
    ends = [simulation.output_names.index(f"{end}.torsion") for end in ("pulley", "flywheel")]
    row = simulation.model.ends[PULLEY]
    velocity = offset(VELOCITY, simulation.model.omega2.size)
    twists, ends_of_cycles = [], []
    for push in (PUSH, 0.0):
        start = state.copy()
        start[velocity : velocity + simulation.model.ports.shape[1]] += push / float(row @ row) * row
        simulation.state = start
        twists.append(recorder.cycles(1)[:, ends] @ (1.0, -1.0))
        ends_of_cycles.append(motion_of(simulation.state, simulation.model.omega2.size))
    simulation.state = state
    engine = fitted_engine(simulation.engine, simulation.settings)
    highest = engine.reduction.running_cutoff_hz
    at_rest = torsional_frequencies(*cranktrain_modes(engine, simulation.body), highest)[0]
    decay = largest_decay(
        twists[0] - twists[1], step, *(slowest_hz(at_rest), max(LISTED_HZ, HIGHEST_SHARE * (at_rest or 0.0)))
    )
    if not cmath.isfinite(decay):
        return None
    # One cycle after the push, the difference of two runs consists almost only of the torsional mode.
    left = SlowModes(simulation.model, speed).rest(ends_of_cycles[0].minus(ends_of_cycles[1]))
    z = complex_place(left, decay)
    return FreeMode(decay, z / np.linalg.norm(z))


def largest_decay(signal: Array, step: float, lowest_hz: float = SLOWEST_HZ, highest_hz: float = LISTED_HZ) -> complex:
    """Exponent (1/s) of the largest oscillation between two frequencies in a free decay (N,) sampled at ``step`` (s).

    Returns NaN if there is no oscillation.
    """
    if not np.any(signal):
        return NONE
    exponents, energies = decaying_parts(signal, step)
    hz = exponents.imag / (2.0 * math.pi)
    energies = np.where((hz > lowest_hz) & (hz < highest_hz) & (exponents.real < 0.0), energies, 0.0)
    return complex(exponents[np.argmax(energies)]) if energies.any() else NONE


def decaying_parts(signal: Array, step: float) -> tuple[NDArray[np.complex128], Array]:
    """Exponents (k,), 1/s, of the exponentials whose sum is a signal (N,), and the energy of each.

    By the matrix pencil of Hua and Sarkar (IEEE Trans. Acoust. Speech Signal Process. 38, 1990): leading singular
    vectors of the signal's Hankel matrix go over into one another, shifted by a sample, by the factors exp(λ step).
    """
    half = signal.size // 2
    left, sizes, _ = np.linalg.svd(hankel(signal[:half], signal[half - 1 :]), full_matrices=False)
    left = left[:, : min(MOST, int(np.count_nonzero(sizes > NOISE * sizes[0])))]
    factors = np.linalg.eigvals(np.linalg.lstsq(left[:-1], left[1:], rcond=None)[0])
    factors = np.asarray(factors[np.abs(factors) > 0.0], dtype=np.complex128)
    powers = factors ** np.arange(signal.size)[:, None]
    amplitudes = np.linalg.lstsq(powers, signal.astype(complex), rcond=None)[0]
    return np.asarray(np.log(factors) / step), np.sum(np.abs(powers * amplitudes) ** 2, axis=0)
