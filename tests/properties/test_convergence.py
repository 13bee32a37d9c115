"""Convergence of the real stepping: each method's order on smooth data, and an independent right-hand side.

Order is read at small steps from a run of the elastic six (coarse mesh, linear bearings, built-in gas trace; the rods
make the mass matrix vary), started from a settled state, over all modal coordinates. At working steps stiff films
reduce the orders; there the level of the error counts, which the slow test holds.
"""

import math
from functools import cache

import numpy as np
import pytest
from bodies import six
from plain_model import PlainModel
from scipy.integrate import solve_ivp

from cranktrain.core.reduced_body import truncate
from cranktrain.dynamics.model import state as layout
from cranktrain.dynamics.simulation import Settings, Simulation, simulate

SPEED = 2000 * math.pi / 30
TIGHT = 1e-12


def started(body, bearings, integrator, step_deg):
    simulation = Simulation(
        six()[0],
        body,
        Settings(bearings=bearings, integrator=integrator, step=math.radians(step_deg), newton_tolerance=TIGHT),
    )
    simulation.inputs[0] = SPEED
    simulation.initialize()
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
    n = simulation.body.n_modes
    return simulation.state[layout.offset(0, n) : layout.offset(4, n)].reshape(4, n)


@cache
def settled(bearings, cutoff_hz=None):
    """Body and the state (header, modal) half a turn after the start."""
    body = six()[1] if cutoff_hz is None else truncate(six()[1], cutoff_hz)
    return body, advance(started(body, bearings, "sdirk4", 0.5), 180, 0.5).state


def carried_on(bearings, integrator, step_deg, span_deg, cutoff_hz=None):
    """Simulation that goes on from the settled state with another method, its multi-step memory consistent."""
    body, start = settled(bearings, cutoff_hz)
    n = body.n_modes
    simulation = started(body, bearings, integrator, step_deg)
    state = simulation.state
    state[: layout.offset(3, n)] = start[: layout.offset(3, n)]
    state[layout.offset(3, n) : layout.offset(4, n)] = start[layout.offset(2, n) : layout.offset(3, n)]
    state[layout.STEP_REFERENCE], state[layout.STEP_LAST] = -1.0, 0.0
    state[layout.METHOD] = 0.0  # the blocks above are made to suit any method
    simulation.state = state
    return advance(simulation, span_deg, step_deg)


@pytest.mark.parametrize(
    ("integrator", "steps", "low", "high"),
    [
        ("backward-euler", (0.25, 0.125, 0.0625), 0.85, 1.15),
        ("generalised-alpha", (0.5, 0.25, 0.125), 1.85, 2.15),
        ("generalised-alpha:0.9", (0.5, 0.25, 0.125), 1.85, 2.15),
        ("sdirk2", (0.5, 0.25, 0.125), 1.85, 2.15),
        ("tr-bdf2", (0.5, 0.25, 0.125), 1.85, 2.15),
        ("sdirk3", (0.5, 0.25, 0.125), 2.7, 3.3),
        ("sdirk4", (1.0, 0.5, 0.25), 3.3, 5.0),
        ("trapezoidal", (0.5, 0.25, 0.125), 1.85, 2.15),
        ("hht", (0.5, 0.25, 0.125), 1.85, 2.15),
        ("bdf2", (0.25, 0.125, 0.0625), 1.8, 2.2),
        ("esdirk3", (0.5, 0.25, 0.125), 2.7, 3.3),
        ("esdirk4", (1.0, 0.5, 0.25), 3.3, 5.0),
        ("esdirk5", (2.0, 1.0, 0.5), 4.0, 6.0),
    ],
)
def test_order_on_smooth_data_with_a_mass_that_varies(integrator, steps, low, high):
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
    begin = np.concatenate(
        [start[layout.offset(0, n) : layout.offset(2, n)], start[[layout.LEAD_ANGLE, layout.LEAD_SPEED]]]
    )
    # Tolerances per unknown: micrometres and what they move by at a kilohertz.
    scale = np.concatenate([np.full(n, 1e-5), np.full(n, 1e-2), [1e-4, 1e-2]])
    solution = solve_ivp(
        plain.rate,
        (0.0, math.radians(span) / SPEED),
        begin,
        method="Radau",
        rtol=1e-9,
        atol=1e-7 * scale,
        args=(start[layout.SHAFT_ANGLE],),
    )
    assert solution.success
    ours = modal(carried_on(bearings, "sdirk4", 0.1, span, cutoff))
    for mine, theirs in ((ours[0], solution.y[:n, -1]), (ours[1], solution.y[n : 2 * n, -1])):
        assert np.linalg.norm(mine - theirs) < 1e-5 * np.linalg.norm(theirs)


@cache
def last_cycle(integrator, step_deg, tolerance=1e-6):
    """Pulley torsion and axial motion (2, 180), each 4 degrees back from the sixth cycle's end; impedance bearings."""
    settings = Settings(integrator=integrator, step=math.radians(step_deg), newton_tolerance=tolerance)
    outputs = simulate(*six(), settings, SPEED, 6).outputs
    count = round(720 / step_deg)
    return np.array([outputs[name][::-1][: count : count // 180] for name in ("pulley.torsion", "pulley.axial")])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("integrator", "step_deg", "axial", "torsion"),
    [
        pytest.param(
            "sdirk3",
            2.0,
            5e-3,
            2.5e-3,
            marks=pytest.mark.xfail(strict=True, reason="axial 5.6e-3 since the thrust pads follow Reynolds in 2-D"),
        ),
        ("sdirk3", 1.0, 1e-3, 4e-4),
        ("sdirk4", 2.0, 2e-3, 2e-4),
        ("sdirk4", 1.0, 3e-4, 5e-5),
        ("sdirk4", 0.5, 4e-5, 3e-5),
    ],
)
def test_error_at_working_steps(integrator, step_deg, axial, torsion):
    # Axial motion at the levels that the design's feasibility study reached. Its torsion (9e-4, 2e-4; 1e-4, 2e-5, 4e-6)
    # is missed by factors of 1.3 to 2 and, at 0.5 degrees, by Newton's tolerance: those bounds are our own.
    reference, found = last_cycle("sdirk4", 0.25, 1e-10), last_cycle(integrator, step_deg)
    error = np.sqrt(np.mean((found - reference) ** 2, axis=1)) / np.std(reference, axis=1)
    assert error[1] < axial
    assert error[0] < torsion
