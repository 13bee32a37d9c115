"""Convergence of the real stepping: each method's order on smooth data, and an independent right-hand side.

Order is read at small steps from a run of the elastic six (coarse mesh, linear bearings, built-in gas trace; the rods
make the mass matrix vary), started from a settled state, over all modal coordinates. Errors at working steps:
test_default_steps.py; damping at a resonance: literature/test_integrators.py.
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
from cranktrain.dynamics.simulation import Settings
from cranktrain.dynamics.time.integrators import INTEGRATORS

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
