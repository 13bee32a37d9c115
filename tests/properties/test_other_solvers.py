"""Solvers to compare with: first-order equations are those of the stage solver, fixed steps have their orders."""

import math

import entry
import numpy as np
import pytest
from benchmarks.other_solvers.first_order import FirstOrder
from benchmarks.other_solvers.fixed_step import METHODS, OK, ORDERS, UNBOUNDED, Equations, FixedStep
from bodies import whole_six
from scipy.linalg import expm
from started import at_speed, shown

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel_address, law_kernel
from cranktrain.dynamics.model.state import TIME
from cranktrain.dynamics.simulation import Settings

SPEED = 2000.0 * math.pi / 30.0


def started(settings):
    return at_speed(SPEED, *whole_six(), settings)


@pytest.mark.parametrize("bearings", ["linear", "impedance"])
def test_accelerations_are_those_of_the_stage_solver(bearings):
    simulation = started(
        Settings(bearings=bearings, integrator="sdirk4", step=math.radians(0.5), newton_tolerance=1e-8)
    )
    equations = FirstOrder(simulation)
    n = equations.modes
    for k in range(1, 25):
        simulation.step(k * math.radians(15.0) / SPEED)
        state = simulation.state
        own = equations(state[TIME], equations.start(state))[n : 2 * n]
        a = entry.motion(simulation, state)[2]
        assert np.abs(own - a).max() < 1e-5 * np.abs(a).max()
        torsion, axial, film = equations.quantities(equations.start(state)[:, None])[:3, 0]
        assert torsion == pytest.approx(shown(simulation)["pulley.torsion"], rel=1e-12)
        assert axial == pytest.approx(shown(simulation)["pulley.axial"], rel=1e-12)
        assert film == pytest.approx(shown(simulation)["bearing[1].film_thickness_min"], rel=1e-9, abs=1e-12)


def test_the_jacobian_is_the_derivative_of_the_rate():
    simulation = started(Settings())
    simulation.step(0.003)
    equations = FirstOrder(simulation)
    y = equations.start(simulation.state)
    equations.increments[:] = 1e-9
    jacobian = equations.jacobian(0.003, y)
    direction = np.random.default_rng(1).standard_normal(y.size)
    h = 1e-9
    slope = (equations(0.003, y + h * direction) - equations(0.003, y - h * direction)) / (2 * h)
    assert np.abs(jacobian @ direction - slope).max() < 1e-3 * np.abs(slope).max()


@pytest.mark.parametrize("choice", [{"crank": "rigid", "bearings": "held"}, {"boundary": "torque"}])
def test_other_models_are_refused(choice):
    with pytest.raises(InputError, match="first-order equations know"):
        FirstOrder(started(Settings(**choice)))


DAMPING, STIFFNESS, PUSH, TURN = 0.3, np.array([1.0, 6.0]), 0.7, 1.3


@law_kernel
def oscillators(stiffness, damping, push, turn, t, y, out):
    n = stiffness.shape[0]
    for i in range(n):
        out[i] = y[n + i]
        out[n + i] = push * math.cos(turn * t) - damping * y[n + i] - stiffness[i] * y[i]
    return 0


@law_kernel
def slopes(stiffness, damping, push, turn, t, y, out):
    """Transposed Jacobian."""
    n = stiffness.shape[0]
    for i in range(2 * n):
        for j in range(2 * n):
            out[i, j] = 0.0
    for i in range(n):
        out[n + i, i] = 1.0
        out[n + i, n + i] = -damping
        out[i, n + i] = -stiffness[i]
    return 0


def system(method, stiffness=STIFFNESS, damping=DAMPING, push=PUSH, start=None):
    data = (stiffness, damping, push, TURN)
    n = stiffness.size
    y = np.ones(2 * n) if start is None else start
    rate = kernel_address(oscillators, *data, 0.0, y, np.zeros(2 * n))
    jacobian = kernel_address(slopes, *data, 0.0, y, np.zeros((2 * n, 2 * n)))
    return FixedStep(method, Equations(rate, data, jacobian), y, n, tolerance=1e-14)


def exact(t):
    """y(t) from y(0) = 1, by the exponential of the oscillators and of the cosine that drives them."""
    n, drive = STIFFNESS.size, np.array([[0.0, -TURN], [TURN, 0.0]])
    none, push = np.zeros((2, 2 * n)), np.outer(np.repeat([0.0, PUSH], n), [1.0, 0.0])
    own = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(STIFFNESS), -DAMPING * np.eye(n)]])
    return (expm(t * np.block([[own, push], [none, drive]])) @ [*np.ones(2 * n), 1.0, 0.0])[: 2 * n]


@pytest.mark.parametrize("method", METHODS)
def test_order_of_convergence(method):
    end, counts = 2.0, (20, 40, 80)
    errors = []
    for count in counts:
        run = system(method)
        assert run.advance(end / count, count) == OK
        errors.append(np.abs(run.y - exact(end)).max())
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates[-1] == pytest.approx(ORDERS[method], abs=0.25), (errors, rates)


@pytest.mark.parametrize(("method", "limit"), [("central-differences", 2.0), ("runge-kutta-4", 2.0 * math.sqrt(2.0))])
def test_explicit_methods_fail_where_theory_says(method, limit):
    """Undamped and unforced, ω = 1: bounded just below the limit of h ω, beyond all bounds just above it."""
    start = np.array([1.0, 0.0])
    for share, status in ((0.99, OK), (1.01, UNBOUNDED)):
        run = system(method, np.array([1.0]), 0.0, 0.0, start)
        assert run.advance(share * limit, 4000, bound=100.0) == status


def test_radau_damps_what_it_cannot_resolve():
    """L-stable: a stiff oscillation is gone after a few steps of any length."""
    run = system("radau-5", np.array([1e10]), 0.0, 0.0, np.array([1.0, 0.0]))
    assert run.advance(1.0, 5) == OK and abs(run.y[0]) < 1e-8
