"""The reference master: order of convergence, agreement of the iterative scheme, power, controlled steps, refusals."""

import math

import numpy as np
import pytest
from one_line import one_line
from scipy.linalg import expm
from two_mass_units import Mass, units

from cranktrain.core.errors import SolverError
from cranktrain_lab.coupling.connections import Connection, by_name, conversion
from cranktrain_lab.coupling.master import Exchange, Master
from cranktrain_lab.coupling.reconstruction import Samples
from cranktrain_lab.coupling.run import Bond, Steps, run
from cranktrain_lab.coupling.unit import Port, UnitError
from cranktrain_lab.stability.two_mass import TwoMass

FORCE, SHARED = "force/displacement", "displacement/displacement"
MASSES = TwoMass()
STOP = 2.0
SPRING = Bond("spring", [(("second", "force"), ("first", "v1"))], [(("first", "force"), ("first", "v1"))])
MOTION = "first.x1", "second.x2", "first.v1", "second.v2"


def coupled(decomposition, scheme, reconstruction, masses=MASSES, **more):
    read = {"first": ["x1", "v1"], "second": ["x2", "v2"]}
    return begun(*units(masses, decomposition), Exchange(scheme, reconstruction, **more), read)


def begun(*arguments):
    """A master of these arguments at its start."""
    master = Master(*arguments)
    master.initialize()
    return master


def exact(masses=MASSES, time=STOP):
    m = masses
    k = np.array([[m.c1 + m.cc, -m.cc], [-m.cc, m.c2 + m.cc]]) / np.array([[m.m1], [m.m2]])
    d = np.array([[m.d1 + m.dc, -m.dc], [-m.dc, m.d2 + m.dc]]) / np.array([[m.m1], [m.m2]])
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-k, -d]])
    return expm(system * time) @ [1.0, 0.0, 0.0, 0.0]


def error(step, *arguments, **more):
    found = run(coupled(*arguments, **more), STOP, Steps(step))
    return np.linalg.norm([found.of(name)[-1] for name in MOTION] - exact())


@pytest.mark.parametrize("decomposition", [FORCE, SHARED])
@pytest.mark.parametrize("scheme", ["jacobi", "gauss-seidel", "iterative"])
@pytest.mark.parametrize(("reconstruction", "order"), [("hold", 1), ("linear", 2)])
def test_order_of_convergence_in_the_communication_step(decomposition, scheme, reconstruction, order):
    coarse, fine = (error(h, decomposition, scheme, reconstruction) for h in (0.02, 0.01))
    assert math.log2(coarse / fine) == pytest.approx(order, abs=0.12)


@pytest.mark.parametrize("decomposition", [FORCE, SHARED])
def test_a_parabola_is_better_than_a_line(decomposition):
    """Held means leave second order whatever is drawn, with less in front of it."""
    for scheme in ("jacobi", "gauss-seidel"):
        assert error(0.05, decomposition, scheme, "quadratic") < 0.5 * error(0.05, decomposition, scheme, "linear")


def test_iterated_units_agree_beyond_the_critical_step_of_one_by_one():
    """At twice the critical step of Jacobi's scheme the iterated one is stable, and its sweeps are few."""
    grown = run(coupled(FORCE, "jacobi", "hold"), 80.0, Steps(0.8)).of("first.x1")
    made = coupled(FORCE, "iterative", "linear")
    calm = run(made, 80.0, Steps(0.8)).of("first.x1")
    assert np.abs(grown[-10:]).max() > 10.0
    assert np.abs(calm[-10:]).max() < 0.1
    assert made.sweeps < 6 * 100


def test_a_stiff_coupling_that_no_sweep_alone_settles_is_found_by_differences():
    """With a coupling spring so stiff that plain repetition diverges, quasi-Newton converges."""
    stiff = TwoMass(cc=400.0, dc=2.0)
    made = coupled(FORCE, "iterative", "linear", stiff)
    found = run(made, STOP, Steps(0.1)).of("first.x1")
    assert made.sweeps < 12 * 20 and np.abs(found).max() < 1.5
    with pytest.raises(SolverError, match="do not agree"):
        run(coupled(FORCE, "iterative", "linear", TwoMass(cc=400.0), sweeps=2), STOP, Steps(0.1))


def test_power_of_the_coupling_closes_with_the_step():
    """What one mass gives is what the other takes, but for what the step delays: of second order."""

    def residual(step):
        found = run(coupled(FORCE, "gauss-seidel", "linear"), STOP, Steps(step), [SPRING])
        return float(np.sqrt(np.mean(found.residuals["spring"] ** 2)))

    assert residual(0.02) < 0.6 * residual(0.04)


def test_controlled_steps_follow_the_error():
    for tolerance in (1e-2, 1e-3, 1e-4):
        found = run(coupled(FORCE, "gauss-seidel", "linear"), STOP, Steps(0.2, tolerance, 1e-4, 0.5))
        assert abs(found.of("first.x1")[-1] - exact()[0]) < 3.0 * tolerance
        assert found.times[-1] == STOP
    loose, tight = (run(coupled(FORCE, "jacobi", "linear"), STOP, Steps(0.2, e, 1e-4, 0.5)) for e in (1e-2, 1e-4))
    assert tight.steps > 4 * loose.steps and tight.refused > 0


def test_polynomials_are_exact_for_what_they_are():
    places, curve = [0.0, 0.7, 1.1], np.array([[2.0, -1.0, 0.5], [0.0, 3.0, -2.0]])
    samples = Samples(2)
    for place in places:
        samples.add(place, curve @ [1.0, place, place**2])
    ahead = 1.9
    assert samples.at(ahead, 2) == pytest.approx(curve @ [1.0, ahead, ahead**2])
    area = [1.0, 0.5 * (ahead + 1.1), (ahead**3 - 1.1**3) / 3.0 / (ahead - 1.1)]
    assert samples.mean(1.1, ahead, 2) == pytest.approx(curve @ area)
    end = curve @ [1.0, ahead, ahead**2]
    assert samples.mean_to(ahead, end, slice(0, 2), 2) == pytest.approx(curve @ area)


def test_units_are_converted_or_refused():
    speed = (0, 0, -1, 0, 0, 0, 0, 1)
    turns = Port("rev/min", math.pi / 30.0, 0.0, speed)
    assert conversion(turns, Port("rad/s", 1.0, 0.0, speed), "") == pytest.approx((math.pi / 30.0, 0.0))
    warm, cold = Port("degC", 1.0, 273.15, (0, 0, 0, 0, 1, 0, 0, 0)), Port("K", 1.0, 0.0, (0, 0, 0, 0, 1, 0, 0, 0))
    assert conversion(warm, cold, "") == pytest.approx((1.0, 273.15))
    assert conversion(turns, Port(), "") == pytest.approx((math.pi / 30.0, 0.0))
    for other, said in ((cold, "from unit 'rev/min' to 'K'"), (Port("furlong"), "cannot be converted")):
        with one_line(said):
            conversion(turns, other, "a.b -> c.d")


def test_connections_by_name_take_the_one_unit_that_has_it():
    made, _ = units(MASSES, SHARED)
    found = {c.text for c in by_name({unit.name: unit for unit in made})}
    assert found == {*(f"first.{n} -> second.{n}" for n in ("x1", "v1")),
                     *(f"second.{n} -> first.{n}" for n in ("x2", "v2"))}  # fmt: skip


@pytest.mark.parametrize(("link", "said"), [
    (Connection(("frist", "x1"), ("second", "x1")), "no unit 'frist'; did you mean 'first'"),
    (Connection(("first", "x2"), ("second", "x1")), "first has no output 'x2'; did you mean"),
    (Connection(("first", "x1"), ("second", "x3")), "second has no input 'x3'"),
    (Connection(("first", "x1"), ("second", "x1"), "middle"), "valid: mean, newest, start"),
    (Connection(("first", "v1"), ("second", "x1")), "is taken by first.x1 -> second.x1"),
])  # fmt: skip
def test_connections_that_cannot_be_are_refused(link, said):
    made, links = units(MASSES, FORCE)
    with one_line(said):
        Master(made, [*links[1:], link], Exchange())


class Broken(Mass):
    """A mass that fails at a time, or answers with no number."""

    fails, spoils = math.inf, math.inf

    def step(self, time, size):
        if time >= self.fails:
            raise UnitError("bearing seized")
        super().step(time, size)
        if time >= self.spoils:
            self.x[:] = math.nan


@pytest.mark.parametrize(("kind", "time", "said", "points"), [
    ("fails", 0.5 - 1e-9, "second, step from 0.5 s to 0.6 s: bearing", 6), ("spoils", 0.5 - 1e-9, "second: ", 6),
    ("fails", 0.0, "second, step from 0 s", 1),
])  # fmt: skip
def test_a_unit_that_fails_is_named_and_the_run_is_kept(kind, time, said, points):
    made, links = units(MASSES, FORCE)
    made[1].__class__ = Broken
    setattr(made[1], kind, time)
    with pytest.raises(UnitError, match=said) as caught:
        run(begun(made, links, Exchange("jacobi", "hold")), STOP, Steps(0.1), [SPRING])
    found = caught.value.found
    assert found.steps == points - 1
    assert found.times == pytest.approx(np.arange(points) * 0.1)
    assert np.all(np.isfinite(found.values))


def test_steps_taken_again_know_the_angle_that_they_start_from():
    """Over another output's value as over the time: what a refused step has seen is forgotten."""
    found = []
    for abscissa in (None, ("second", "x2")):
        made, links = units(MASSES, FORCE)
        clock = Mass("clock", [[0.0]], np.zeros((1, 0)), [[1.0]], np.zeros((1, 0)), [], ["time"], [0.0])
        clock.step = lambda time, size, clock=clock: clock.x.__iadd__(size)
        over = None if abscissa is None else ("clock", "time")
        master = begun([*made, clock], links, Exchange("jacobi", "linear", over), {"clock": ["time"]})
        found.append(run(master, STOP, Steps(0.2, 1e-3, 1e-4, 0.5)))
    assert found[0].refused > 0
    assert found[1].of("first.x1")[-1] == pytest.approx(found[0].of("first.x1")[-1], rel=1e-9)


def test_the_iterative_scheme_needs_states():
    made, links = units(MASSES, FORCE)
    made[0].restorable = False
    with one_line("first cannot keep and restore its state"):
        Master(made, links, Exchange("iterative"))


def test_what_is_written_may_be_modified():
    """A drop-out: from a time on the spring's force is not handed on, and the first mass swings alone."""
    made, links = units(MASSES, FORCE)
    links[0] = Connection(links[0].source, links[0].target, modify=lambda time, value: 0.0)
    found = run(begun(made, links, Exchange("gauss-seidel", "hold")), STOP, Steps(0.01)).of("first.x1")
    alone = expm(np.array([[0.0, 1.0], [-1.0, -0.1]]) * STOP) @ [1.0, 0.0]
    assert found[-1] == pytest.approx(alone[0], abs=1e-9)
