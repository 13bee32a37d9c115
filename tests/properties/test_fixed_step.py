"""The study's own fixed-step integrators: their orders on a smooth linear system, and where explicit ones fail."""

import math

import numpy as np
import pytest
from benchmarks.other_solvers.fixed_step import METHODS, OK, ORDERS, UNBOUNDED, Equations, FixedStep

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel_address, law_kernel

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
    """y(t) from y(0) = 1: particular solution of the forced oscillators plus their free motion."""
    result = []
    for k in STIFFNESS:
        forced = PUSH / (k - TURN**2 + 1j * DAMPING * TURN)
        decay = complex(-DAMPING / 2, math.sqrt(k - DAMPING**2 / 4))
        q0, v0 = 1.0 - forced.real, 1.0 - (1j * TURN * forced).real
        b = (v0 - decay.real * q0) / decay.imag
        free = complex(q0, -b)
        motion = forced * np.exp(1j * TURN * t), free * np.exp(decay * t)
        result.append(((motion[0] + motion[1]).real, (1j * TURN * motion[0] + decay * motion[1]).real))
    return np.array(result).T.ravel()


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
    assert run.advance(1.0, 5) == OK
    assert abs(run.y[0]) < 1e-8


def test_radau_keeps_its_factors_on_a_linear_system():
    run = system("radau-5")
    assert run.advance(0.1, 50) == OK
    assert run.jacobians == 1


def test_an_unknown_method_names_the_nearest():
    with pytest.raises(InputError, match="did you mean 'radau-5'"):
        FixedStep("radau5", Equations(0, ()), np.zeros(2))
