"""Convergence of the real stepping: each method's order on smooth data, and an independent right-hand side.

Order is read at small steps from a run of the elastic six (coarse mesh, linear bearings, built-in gas trace; the rods
make the mass matrix vary), started from a settled state, over all modal coordinates. At working steps stiff films
reduce the orders; there the level of the error counts, which a slow test holds, and at a resonance the damping that a
method adds, which another tells from its stability function.
"""

import math
from functools import cache

import entry
import numpy as np
import pytest
from bodies import six
from plain_model import PlainModel
from scipy.integrate import solve_ivp
from started import at_speed

from cranktrain.core.reduced_body import truncate
from cranktrain.dynamics.model import state as layout
from cranktrain.dynamics.simulation import Settings, simulate
from cranktrain.dynamics.time.integrators import INTEGRATORS, integrator_table
from cranktrain.dynamics.time.table import FIRST_STAGE, HEAD, STAGES

RPM = math.pi / 30
SPEED = 2000 * RPM
TIGHT = 1e-12


def started(body, bearings, integrator, step_deg):
    simulation = at_speed(
        SPEED,
        six()[0],
        body,
        Settings(bearings=bearings, integrator=integrator, step=math.radians(step_deg), newton_tolerance=TIGHT),
    )
    return simulation


def advance(simulation, span_deg, step_deg):
    count = round(span_deg / step_deg)
    h = math.radians(span_deg) / SPEED / count
    begin = simulation.time
    for k in range(1, count + 1):
        simulation.step(begin + k * h)
    return simulation


def modal(simulation):
    """Modal position, velocity, acceleration and auxiliary acceleration, (4, n)."""
    return entry.motion(simulation, blocks=4)


@cache
def settled(bearings, cutoff_hz=None):
    """Body and the run half a turn after the start."""
    body = six()[1] if cutoff_hz is None else truncate(six()[1], cutoff_hz)
    return body, advance(started(body, bearings, "sdirk4", 0.5), 180, 0.5)


def carried_on(bearings, integrator, step_deg, span_deg, cutoff_hz=None):
    """Simulation that goes on from the settled state with another method, its multi-step memory consistent."""
    body, start = settled(bearings, cutoff_hz)
    simulation = started(body, bearings, integrator, step_deg)
    state = simulation.state
    state[: layout.BODY] = start.state[: layout.BODY]
    own = entry.motion(simulation, state, 4)
    own[:3], own[3] = entry.motion(start), entry.motion(start)[2]
    state[layout.STEP_REFERENCE], state[layout.STEP_LAST] = -1.0, 0.0
    state[layout.METHOD] = 0.0  # the blocks above are made to suit any method
    simulation.state = state
    return advance(simulation, span_deg, step_deg)


STEPS = {"backward-euler": 0.25, "bdf2": 0.25, "sdirk4": 1.0, "esdirk4": 1.0, "esdirk5": 2.0, "esdirk47": 2.0,
         "esdirk57": 4.0}  # fmt: skip
"""Longest of three steps, degrees, at which a method's own order shows; 0.5 of the others."""


@pytest.mark.parametrize("integrator", [*INTEGRATORS, "generalised-alpha:0.9"])
def test_order_on_smooth_data_with_a_mass_that_varies(integrator):
    order = INTEGRATORS[integrator.partition(":")[0]].order
    low, high = {1: (0.85, 1.15), 2: (1.8 if integrator == "bdf2" else 1.85, 2.15), 3: (2.7, 3.3), 4: (3.3, 5.0),
                 5: (4.0, 6.0)}[order]  # fmt: skip
    steps = STEPS.get(integrator, 0.5) / np.array([1.0, 2.0, 4.0])
    reference = modal(reference_run("linear"))[0]
    errors = [np.linalg.norm(modal(carried_on("linear", integrator, h, 40))[0] - reference) for h in steps]
    orders = np.diff(-np.log2(errors))
    assert ((orders > low) & (orders < high)).all(), (errors / np.linalg.norm(reference), orders)


@cache
def reference_run(bearings):
    return carried_on(bearings, "sdirk4", 0.05, 40)


@pytest.mark.parametrize("bearings", ["linear", "impedance"])
def test_an_independent_right_hand_side_integrated_by_radau_agrees(bearings):
    cutoff, span = 700.0, 40.0
    body, start = settled(bearings, cutoff)
    n = body.n_modes
    plain = PlainModel(six()[0], body, Settings(bearings=bearings), SPEED)
    lead = start.state[[layout.LEAD_ANGLE, layout.LEAD_SPEED]]
    begin = np.concatenate([*entry.motion(start)[:2], lead])
    # Tolerances per unknown: micrometres and what they move by at a kilohertz.
    scale = np.concatenate([np.full(n, 1e-5), np.full(n, 1e-2), [1e-4, 1e-2]])
    ends = (0.0, math.radians(span) / SPEED)
    tight = {"rtol": 1e-9, "atol": 1e-7 * scale}
    solution = solve_ivp(plain.rate, ends, begin, method="Radau", **tight, args=(start.state[layout.SHAFT_ANGLE],))
    assert solution.success
    ours = modal(carried_on(bearings, "sdirk4", 0.1, span, cutoff))
    for mine, theirs in ((ours[0], solution.y[:n, -1]), (ours[1], solution.y[n : 2 * n, -1])):
        assert np.linalg.norm(mine - theirs) < 1e-5 * np.linalg.norm(theirs)


@cache
def last_cycle(integrator, step_deg, tolerance, rpm, load=1.0):
    """Pulley torsion and axial motion (2, 180), each 4 degrees back from the sixth cycle's end; impedance bearings."""
    settings = Settings(integrator=integrator, step=math.radians(step_deg), newton_tolerance=tolerance, gas_load=load)
    outputs = simulate(*six(), settings, rpm * RPM, 6).outputs
    count = round(720 / step_deg)
    return np.array([outputs[name][::-1][: count : count // 180] for name in ("pulley.torsion", "pulley.axial")])


RESONANT = 7.5
PEAK = 1905.0
"""Speed (rev/min) at which that order meets the first torsional mode, 238 Hz."""
LIGHT = 0.1
"""Share of the full gas load at which the mode is nearly linear."""


def resonant_torsion(integrator, step_deg, rpm):
    """Order 7.5 of the pulley's torsion, complex; the samples go back in time."""
    return np.conj(np.fft.rfft(last_cycle(integrator, step_deg, 1e-8, rpm, LIGHT)[0])[round(2 * RESONANT)])


@cache
def first_torsional_mode():
    """Eigenvalue (1/s) of the running crank's first torsional mode, from the resonance curve of order 7.5."""
    speeds = PEAK + np.array([-150.0, -75.0, -25.0, 25.0, 100.0])
    s = 1j * RESONANT * speeds * RPM
    curve = np.array([resonant_torsion("sdirk4", 1.0, rpm) for rpm in speeds])
    # (s² + b s + c) y = d + e s with b, c real and d, e complex, in units of the middle frequency.
    s = s / abs(s[2])
    terms = np.column_stack([s * curve, curve, -np.ones(5), -1j * np.ones(5), -s, -1j * s])
    known = -(s**2) * curve
    size = np.abs(curve)[:, None]
    rows = np.concatenate(((terms / size).real, (terms / size).imag))
    sides = np.concatenate(((known / size[:, 0]).real, (known / size[:, 0]).imag))
    b, c = np.linalg.lstsq(rows, sides, rcond=None)[0][:2]
    pole = np.roots([1.0, b, c])
    return complex(pole[pole.imag > 0.0][0]) * RESONANT * speeds[2] * RPM


BEYOND = pytest.mark.xfail(strict=True, reason="axial 5.8e-3, torsion 2.6e-3: beyond the range of order three")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("integrator", "step_deg", "axial", "torsion"),
    [
        pytest.param("sdirk3", 2.0, 5e-3, 2.5e-3, marks=BEYOND),
        ("sdirk3", 1.0, 1e-3, 4e-4),
        ("sdirk4", 2.0, 2e-3, 2e-4),
        ("sdirk4", 1.0, 3e-4, 5e-5),
        ("sdirk4", 0.5, 4e-5, 3e-5),
    ],
)
def test_error_at_working_steps(integrator, step_deg, axial, torsion):
    """Midway between the speeds at which orders 9 and 12 meet the first torsional mode, 1587 and 1190 rev/min.

    At 1905 rev/min order 7.5 meets that mode; there the error is the method's damping over that of the mode, not the
    bound of a method: see the next test.
    """
    hertz = abs(first_torsional_mode()) / (2 * math.pi)
    midway = 0.5 * (60 * hertz / 9 + 60 * hertz / 12)
    # Axial motion at the levels that the design's feasibility study reached. Its torsion (9e-4, 2e-4; 1e-4, 2e-5, 4e-6)
    # is missed by factors of 1.3 to 2 and, at 0.5 degrees, by Newton's tolerance: those bounds are our own.
    reference, found = last_cycle("sdirk4", 0.25, 1e-10, midway), last_cycle(integrator, step_deg, 1e-6, midway)
    error = np.sqrt(np.mean((found - reference) ** 2, axis=1)) / np.std(reference, axis=1)
    assert error[1] < axial
    assert error[0] < torsion


def forced(integrator, eigenvalue, omega, h):
    """What a Runge-Kutta method makes of the steady motion of ẏ = λ y + exp(iωt), over its exact one."""
    table = integrator_table(integrator)
    stages = int(table[HEAD, STAGES])
    a = table[FIRST_STAGE : FIRST_STAGE + stages, :stages]
    weights = np.linalg.solve(np.eye(stages) - h * eigenvalue * a.T, a[-1])
    stability = 1.0 + h * eigenvalue * weights.sum()
    load = h * weights @ np.exp(1j * omega * h * a.sum(axis=1))
    return load / (np.exp(1j * omega * h) - stability) * (1j * omega - eigenvalue)


@pytest.mark.slow
def test_at_a_resonance_the_error_is_the_damping_of_the_method():
    """Order 7.5 and the first torsional mode, whose frequency and damping are read from the run's resonance curve.

    A mode that is alone explains the error of order 7.5 at its peak (2.1e-3 for SDIRK3 at 1 degree) to an eighth; other
    modes, the rods' varying mass and the films' own errors are not in it. So it is at a tenth of the gas load: at full
    load films damp the more the larger the motion, and the peak's error is a quarter less than that of a linear mode.
    """
    eigenvalue = first_torsional_mode()
    assert 230.0 < abs(eigenvalue) / (2 * math.pi) < 246.0
    assert 0.01 < -eigenvalue.real / abs(eigenvalue) < 0.04
    exact = resonant_torsion("sdirk4", 0.5, PEAK)
    for integrator, step_deg in (("sdirk3", 2.0), ("sdirk3", 1.0), ("sdirk3", 0.5)):
        told = forced(integrator, eigenvalue, RESONANT * PEAK * RPM, math.radians(step_deg) / (PEAK * RPM)) - 1.0
        error = resonant_torsion(integrator, step_deg, PEAK) / exact - 1.0
        assert abs(error - told) < 0.15 * abs(told), (integrator, step_deg, error, told)
