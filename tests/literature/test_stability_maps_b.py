"""Stability maps against theory: co-simulation, varying inertia, mode truncation, cold start.

Values: tests/data/cosimulation.json (derived by exact propagation: radii to 1e-6, critical steps to 0.1 %, trajectory
to 5e-12) and tests/data/integrators.json (Floquet bands, to 1e-3).
"""

import json
import math
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from expected import cases, data
from scipy.linalg import expm
from some import some

from cranktrain.core.reduced_body import check
from cranktrain_lab.stability import MAPS
from cranktrain_lab.stability.cold_start import MASS, film_rotor, plain_newton, reynolds_equilibrium, start
from cranktrain_lab.stability.mode_truncation import (
    TORQUE,
    cut,
    limits,
    receptances,
    shaft_error,
    shaft_limit,
    truncation_error,
    uniform_shaft,
)
from cranktrain_lab.stability.stability_map import as_record, curve, from_record
from cranktrain_lab.stability.two_mass import (
    DECOMPOSITIONS,
    RECONSTRUCTIONS,
    SEQUENCES,
    Coupling,
    TwoMass,
    amplification,
    critical_step,
    growth,
    simulated_onset,
    spectral_radius,
)
from cranktrain_lab.stability.variable_inertia import SingleCrank, exact_band, floquet, found_band

COUPLED = data("cosimulation")[0]["expected"]
BANDS = cases("integrators")["variable_inertia_floquet"]["expected"]["unstable_bands"]
SHORT = {
    "FD": "force/displacement", "DD": "displacement/displacement",
    "J": "jacobi", "GS12": "gauss-seidel 1-2", "GS21": "gauss-seidel 2-1", "GS": "gauss-seidel 1-2",
}  # fmt: skip
COUPLINGS = [Coupling(d, s, r) for d in DECOMPOSITIONS for s in SEQUENCES for r in RECONSTRUCTIONS]


def starting_state(masses, coupling, motion):
    """Coupled state whose inputs have been what they are."""
    to_first = np.array(motion[2:])
    if coupling.decomposition == "force/displacement":
        to_first = np.array([masses.cc * (motion[2] - motion[0]) + masses.dc * (motion[3] - motion[1]), 0.0])
    return np.concatenate((motion, np.tile(to_first, 3), np.tile(motion[:2], 3)))


def published(case):
    return TwoMass(**case["par"]), Coupling(SHORT[case["decomp"]], SHORT[case["scheme"]])


@pytest.mark.parametrize("case", COUPLED["cases"], ids=lambda case: f"{case['decomp']} {case['scheme']}")
def test_coupled_masses_grow_and_set_in_as_derived(case):
    masses, coupling = published(case)
    for step, radius in case["rho"].items():
        assert spectral_radius(masses, coupling, float(step)) == pytest.approx(radius, abs=1e-6)
    step = critical_step(masses, coupling, 10.0)
    if case["H_crit"] is None:
        assert math.isinf(step)
        assert growth(masses, coupling, 5.0) < 0.0
        return
    assert step == pytest.approx(case["H_crit"], rel=1e-3)
    # Slaves that integrate by themselves, coupled by the minimal master, begin to grow at that step.
    assert simulated_onset(masses, coupling, 0.8 * step, 1.2 * step) == pytest.approx(case["H_crit"], rel=1e-3)


def test_onset_is_found_below_the_first_step_that_is_tried_and_a_map_says_where_none_is():
    """What a held spring feeds in grows with H: weak dampers bear little, here 0.1 % of the longest step."""
    weak = TwoMass(d1=3e-3, d2=3e-3, dc=0.0)
    step = critical_step(weak, Coupling(), 4.0)
    assert step.found
    assert step / 4.0 == pytest.approx(1e-3, rel=0.01)
    assert spectral_radius(weak, Coupling(), 0.99 * step) < 1.0 < spectral_radius(weak, Coupling(), 1.01 * step)
    # The search does not depend on how far it looks, and the slaves that integrate agree.
    assert step == pytest.approx(critical_step(weak, Coupling(), 0.1), rel=1e-9)
    assert simulated_onset(weak, Coupling(), 3.0 * step, 4.0 * step) == pytest.approx(step, rel=1e-3)
    none = critical_step(TwoMass(d1=0.0, d2=0.0, dc=0.0), Coupling(), 4.0)
    assert none.below
    assert str(none) == "below 4e-06"
    holds = critical_step(TwoMass(), Coupling("displacement/displacement", "gauss-seidel 1-2"), 4.0)
    assert str(holds) == "stable to 4"
    drawn = curve("onset", [none, critical_step(TwoMass(), Coupling(), 4.0), holds], np.arange(3.0), "test")
    assert drawn.points.shape == (1, 2)
    assert drawn.verdicts == (str(none), drawn.verdicts[1], str(holds))


@pytest.mark.parametrize("inner_step", [None, 0.004])
def test_coupled_steps_follow_the_derived_trajectory(inner_step):
    step = amplification(TwoMass(), Coupling(), 0.2, inner_step)
    start_of = starting_state(TwoMass(), Coupling(), np.array([1.0, 0.0, 0.0, 0.0]))
    motion = (np.linalg.matrix_power(step, 20) @ start_of)[:4]
    assert motion == pytest.approx(np.array(COUPLED["trajectory_A_FD_J_H0p2_20steps_from_x1_1"]), abs=5e-12)


@pytest.mark.parametrize("coupling", COUPLINGS, ids=lambda c: f"{c.decomposition} {c.sequence} {c.reconstruction}")
@pytest.mark.parametrize("inner_step", [None, 1e-3])
def test_coupling_converges_with_the_order_of_its_inputs(coupling, inner_step):
    """A polynomial of degree p through the past misses an input by H^(p+1): order p + 1 of the coupled motion."""
    m = TwoMass()
    force = np.array([[-m.cc, -m.dc, m.cc, m.dc], [m.cc, m.dc, -m.cc, -m.dc]])
    system = np.zeros((4, 4))
    system[0, 1] = system[2, 3] = 1.0
    system[1] = force[0] / m.m1 - np.array([m.c1, m.d1, 0.0, 0.0]) / m.m1
    system[3] = force[1] / m.m2 - np.array([0.0, 0.0, m.c2, m.d2]) / m.m2
    # Both start at rest with no force on them, so that the past they are given is true to second order.
    end, start_of = 2.0, np.array([1.0, 0.0, 1.0, 0.0])
    errors = []
    for count in (200, 400):
        h = end / count
        # The exact motion of the first steps is history.
        z = starting_state(m, coupling, start_of)
        past = [expm(system * h * k) @ start_of for k in range(3)]
        z[:4] = past[2]
        for k in range(3):
            x = past[2 - k]
            pull = m.cc * (x[2] - x[0]) + m.dc * (x[3] - x[1])
            z[4 + 2 * k : 6 + 2 * k] = (pull, 0.0) if coupling.decomposition == "force/displacement" else x[2:]
            z[10 + 2 * k : 12 + 2 * k] = x[:2]
        z = np.linalg.matrix_power(amplification(m, coupling, h, inner_step), count - 2) @ z
        errors.append(np.abs(z[:4] - expm(system * end) @ start_of).max())
    degree = RECONSTRUCTIONS[coupling.reconstruction]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(degree + 1, abs=0.35)


@pytest.mark.parametrize(("share", "centre", "low", "high"), [band for band in BANDS if band[2] is not None])
def test_floquet_bands_of_varying_inertia_are_the_derived_ones(share, centre, low, high):
    assert exact_band(share, int(centre)) == pytest.approx((low, high), abs=1e-6)
    assert floquet(share, np.array([low, high]))[1] == pytest.approx(np.ones(2), abs=1e-9)


@cache
def single_crank(share):
    return SingleCrank.of(share)


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_rod_of_the_running_model_grows_in_the_derived_bands(share):
    crank = single_crank(share)
    for _, centre, low, high in some(band for band in BANDS if band[0] == share):
        found = found_band(crank, (low, high))
        # The bands are narrow: what counts is their edges against their width too.
        assert found == pytest.approx((low, high), rel=1e-3)
        assert found[1] - found[0] == pytest.approx(high - low, rel=0.05)
        assert np.linalg.det(crank.monodromy(centre)) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    ("band", "about", "expected"),
    [
        ((0.7, 1.02), (0.9, 1.0), (0.7, 1.02)),  # much wider than theory says
        ((0.0, 2.0), (0.9, 1.0), (np.nan, np.nan)),
        ((0.5, 0.6), (0.9, 1.0), (np.nan, np.nan)),
        ((0.9, 1.0), (np.nan, np.nan), (np.nan, np.nan)),
    ],
)
def test_a_band_is_found_where_it_is_or_is_no_number(band, about, expected):
    crank = SimpleNamespace(growth=lambda nu: 1.5 if band[0] < nu < band[1] else 1.0)
    assert found_band(crank, about) == pytest.approx(expected, abs=1e-4, nan_ok=True)


def test_crank_grows_from_nothing_inside_a_band_whose_width_is_of_first_order():
    """Outside it swings on under the little that is left of its torque; the classical width errs by its square."""
    crank = single_crank(0.3)
    inside, below, above = (np.hypot(*crank.after(nu, 1e-5, 0.0, half_turns=30)) for nu in (0.96, 0.85, 1.06))
    # Some 1.27 a half turn; outside it swings on as it began and under the little that is left of its torque.
    assert inside > 0.05
    assert max(below, above) < 0.01
    misses = [np.abs(np.subtract(exact_band(e, 1), (1.0 - 0.25 * e, 1.0 + 0.25 * e))).max() for e in (0.02, 0.04)]
    assert misses[1] / misses[0] == pytest.approx(4.0, rel=0.05)


@cache
def shaft():
    return uniform_shaft()


def test_ritz_shaft_is_the_uniform_shaft():
    body = shaft()
    check(body)
    assert body.omega[6:106] / body.omega[6] == pytest.approx(np.arange(1, 101), rel=1e-9)
    # Static receptance of a free end with its rigid rotation left out: L/(3 G J).
    stiffness = 80.8e9 * math.pi * 0.06**4 / 32.0
    assert receptances(body, TORQUE, TORQUE, 0.0)[0, 0] == pytest.approx(0.8 / (3.0 * stiffness), rel=1e-9)


@pytest.mark.parametrize("complete", [True, False])
def test_cut_shaft_errs_as_the_omitted_modes_say(complete):
    body = shaft()
    # Between resonances of the modes that are kept: on one of them both receptances are without bound.
    for modes, x in ((1, 0.7), (4, 2.5), (12, 11.5), (70, 30.5)):
        error = truncation_error(body, cut(body, modes, TORQUE, complete), TORQUE, None)
        assert error(x * body.omega[6]) == pytest.approx(shaft_error(modes, x, complete), rel=1e-3)
    # The closed form is the sum it stands for.
    n = np.arange(5, 2_000_001.0)
    omitted, s2, s4 = (1.0 / (n * n - 6.25)).sum(), (1.0 / n**2).sum(), (1.0 / n**4).sum()
    kept = s2 / (1.0 - 6.25 * s4 / s2) if complete else 0.0
    assert shaft_error(4, 2.5, complete) == pytest.approx(abs(omitted - kept) / (math.pi**2 / 6.0), rel=1e-5, abs=1e-6)


def test_the_error_has_its_limit_at_a_resonance_of_what_is_kept():
    """Body and cut body are infinite there, their difference is not."""
    body = shaft()
    error = truncation_error(body, cut(body, 7, TORQUE, True), TORQUE, None)
    for mode in (0, 3, 6):
        at = float(body.omega[6 + mode])
        assert error(at) == pytest.approx(error((1.0 + 1e-5) * at), rel=1e-3)


def test_limits_of_the_cut_shaft_are_those_of_theory():
    counts = np.array([1.0, 3.0, 10.0, 40.0, 70.0, 100.0])
    for complete in (True, False):
        found = limits(shaft(), counts, TORQUE, None, complete)
        theory = np.array([shaft_limit(int(m), complete) for m in counts])
        assert found == pytest.approx(theory, rel=1e-4, nan_ok=True)
        assert all(value.found for value in found) == complete


def test_statically_complete_modes_leave_the_fourth_power_of_frequency():
    body = shaft()
    error = truncation_error(body, cut(body, 5, TORQUE, True), TORQUE, None)
    small, large = (error(x * body.omega[6]) for x in (0.4, 0.8))
    assert math.log2(large / small) == pytest.approx(4.0, abs=0.1)
    # Without attachment statics are wrong by the tail of 1/n².
    bare = truncation_error(body, cut(body, 5, TORQUE, False), TORQUE, None)
    assert bare(0.0) == pytest.approx(1.0 - 6.0 / math.pi**2 * sum(1.0 / n**2 for n in range(1, 6)), rel=1e-6)


@cache
def rotor(speed):
    return film_rotor(MASS, 5000.0, speed)


@pytest.mark.parametrize("speed", [20.0, 200.0])
@pytest.mark.parametrize("size", [0.0, 0.6, 0.999])
def test_starts_from_everywhere_reach_the_equilibrium_of_the_reynolds_equation(speed, size):
    exact = reynolds_equilibrium(rotor(speed), speed)
    for direction in some(np.radians([0.0, 100.0, 190.0, 270.0])):
        run = start(rotor(speed), size, direction)
        assert run.succeeded
        assert run.released
        assert abs(run.place - exact).max() < 0.02 * abs(exact)


def test_starts_at_standstill_end_low_in_the_bore_and_plain_newton_steps_lose_journals():
    """The start finds journals that plain steps of Newton lose."""
    for size, direction in ((0.0, 0.0), (0.99, 90.0), (0.999, 180.0)):
        run = start(rotor(0.0), size, math.radians(direction))
        assert run.succeeded
        assert run.place.imag == pytest.approx(-0.978, abs=0.01)
    assert not plain_newton(rotor(200.0), 0.3, 0.5 * math.pi)
    exact = reynolds_equilibrium(rotor(200.0), 200.0)
    assert plain_newton(rotor(200.0), abs(exact), math.atan2(exact.imag, exact.real))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["variable_inertia", "cosimulation", "combustion_steps", "mode_truncation", "cold_start"]
)
def test_quick_maps_hold_theory_to_two_per_cent_and_survive_keeping(name):
    stages = []
    found = MAPS[name](True, lambda stage, share: stages.append(share))
    assert found.max_deviation < 0.02
    assert found.stable.shape == (found.rows.values.size, found.columns.values.size)
    assert stages == sorted(stages)
    assert 0.0 <= stages[0] <= stages[-1] < 1.0
    again = from_record(name, json.loads(json.dumps(as_record(found))))
    assert np.array_equal(again.stable, found.stable)
    assert [b.label for b in again.numerical] == [b.label for b in found.numerical]
