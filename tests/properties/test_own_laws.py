"""Laws of connections that are functions of Python: equal to built-in ones, closed forms, energy, and what is told."""

import math
import subprocess
import sys
from dataclasses import replace

import numba
import numpy as np
import pytest
from one_line import one_line
from scipy.special import ellipk
from tests.rods import beside, part

import cranktrain as ct
from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.reduced_body import rigid_body

SPEED = 200.0
K, C = 2e6, 300.0


@ct.law(axes="x y")
def own_spring(x, v, k, c=0.0):
    return -k * x[0] - c * v[0], -k * x[1] - c * v[1]


def _slopes(x, v, k, c=0.0):
    return ((-k, 0.0), (0.0, -k)), ((-c, 0.0), (0.0, -c))


OWN = {
    "differences": own_spring,
    "tangents": ct.law(own_spring.function, axes="x y", tangent=_slopes, name="with_tangents"),
    "compiled before": ct.law(numba.njit(own_spring.function), axes=("x", "y"), name="compiled_before"),
    "Python": ct.law(own_spring.function, axes="x y", compiled=False, name="in_python"),
    "Python, tangents": ct.law(own_spring.function, axes="x y", tangent=_slopes, compiled=False, name="python_slopes"),
}


@ct.law(axes="rz")
def turning(turn, rate, k, c):
    return -k * turn - c * rate


@ct.law(axes="rz")
def fan(turn, rate, speed, drag):
    return -drag * speed * abs(speed)


@ct.law(axes="x")
def hardening(x, v, k, cubic):
    return -k * x - cubic * x**3


def rotor(law, data):
    """A rotor with an unbalance that a law holds across its axis."""
    body = rigid_body("r", 3.0, np.diag([0.02, 0.02, 0.03]), (1e-4, 0, 0), {"m": (0, 0, 0)})
    rest = {"stiffness": (0, 0, 1e8), "damping": (0, 0, 1e3), "turning_stiffness": (1e6, 1e6, 1e5),
            "turning_damping": (1e2, 1e2, 1e2)}  # fmt: skip
    ends = ct.End("r", "m"), ct.End("ground")
    links = ct.Connection("c", law, ends, data), ct.Connection("rest", "spring", ends, rest)
    return ct.Topology((ct.Frame("f", 2.0, axis=(0.3, 0.0)),), (ct.Body("r", body, "f"),), links)


def motion(law, data, cycles=2):
    run = beside(rotor(law, data), SPEED)
    rows = np.zeros((288 * cycles, run.outputs.size))
    assert run.series(4.0 * math.pi / SPEED / 288, 1, rows) == len(rows)
    return dict(zip(run.output_names, rows.T, strict=True))


@pytest.mark.filterwarnings("ignore:own law")
@pytest.mark.parametrize("kind", OWN)
def test_a_linear_own_law_is_the_built_in_spring(kind):
    """Trajectories and forces to rounding, however tangents are found and whoever calls the function."""
    theirs = motion("spring", {"stiffness": (K, K, 0.0), "damping": (C, C, 0.0)})
    ours = motion(OWN[kind], {"k": K, "c": C})
    for name in ("r.position.x", "r.position.y", "connection[c].force.x", "connection[c].force.y"):
        assert np.ptp(theirs[name]) > 0.0
        np.testing.assert_allclose(ours[name], theirs[name], rtol=0, atol=1e-9 * np.abs(theirs[name]).max())


TWISTS = {"crank": "torsional", "bearings": "held", "inherit": False, "load": 1.0, "settle": 1e-6}


ENDS = ("crank.pulley", "ground")


def on_pulley(law, name="single_petrol", **data):
    """An engine with a law between its pulley and the ground."""
    return ct.load_engine(name).connected("t", law, ENDS, **data)


def steady(engine, rpm):
    return ct.simulate(engine, speed_rpm=rpm, integrator="esdirk4", **TWISTS)


ENGINES = [("single_petrol", 4000), ("four_petrol", 3000), ("diesel_i6", 2000), ("v12_petrol", 5000)]


@pytest.mark.parametrize(("name", "rpm"), ENGINES)
def test_in_an_engine_too_it_is_the_built_in_spring(name, rpm):
    ours = steady(on_pulley(turning, name, k="2 kN m/rad", c=3.0), rpm)
    spring = {"turning_stiffness": (0.0, 0.0, 2e3), "turning_damping": (0.0, 0.0, 3.0)}
    theirs = steady(on_pulley("spring", name, **spring), rpm)
    for output in ("pulley.torsion", "shaft.torque", "connection[t].moment.z"):
        assert np.std(theirs[output]) > 0.0
        assert np.abs(ours[output] - theirs[output]).max() < 1e-7 * np.std(theirs[output]), output


@pytest.mark.parametrize(("name", "rpm"), ENGINES)
def test_energy_closes_with_an_own_law(name, rpm):
    """What a fan takes is its mean torque times speed, and gas, losses and shaft balance."""
    speed = rpm * math.pi / 30.0
    drag = 20.0 / speed**2
    run = steady(on_pulley(fan, name, drag=drag), rpm)
    energy = run.summary("")["energy"]
    assert abs(energy["residual_of_gas_work"]) < 2e-5
    torque = -np.asarray(run["connection[t].moment.z"])[-run.per_cycle :]
    power = float(np.mean(torque * np.sqrt(torque / drag)))
    others = steady(ct.load_engine(name), rpm).summary("")["energy"]["losses_j"]["connections"]
    taken = energy["losses_j"]["connections"] - others
    assert taken == pytest.approx(power * 4.0 * math.pi / speed, rel=2e-3)
    assert float(torque.mean()) == pytest.approx(20.0, rel=1e-2)


BALL = rigid_body("r", 2.0, np.diag([0.02, 0.02, 0.02]), (0, 0, 0), {"m": (0, 0, 0)})


@pytest.mark.parametrize("amplitude", [1e-4, 5e-4, 1e-3])
def test_a_cubic_spring_vibrates_on_its_backbone(amplitude):
    """m ẍ + k x + β x³ = 0 from rest at A: ω = π √(α + γA²)/(2 K(m)), m = γA²/(2(α + γA²)) (Duffing)."""
    mass, k, cubic = 2.0, 2e6, 4e12
    ends = ct.End("r", "m"), ct.End("ground")
    held = {"stiffness": (0, 1e8, 1e8), "turning_stiffness": (1e6, 1e6, 1e6)}
    law = ct.Connection("c", hardening, ends, {"k": k, "cubic": cubic})
    topology = ct.Topology((), (ct.Body("r", BALL),), (law, ct.Connection("rest", "spring", ends, held)))
    run = beside(topology, SPEED, step=math.radians(0.25), gravity=0.0)
    state = run.state
    moved = part(run, state, "r")[0]
    part(run, state, "r")[:2] = 0.0
    moved[0] = 1.0
    run.state = state
    unit = run.outputs[run.output_names.index("r.position.x")]
    moved[0] = amplitude / unit
    run.state = state
    h = math.radians(0.25) / SPEED
    rows = np.zeros((4000, run.outputs.size))
    assert run.series(h, 1, rows) == len(rows)
    x = np.append(amplitude, rows[:, run.output_names.index("r.position.x")])
    k_at = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    crossings = (k_at - x[k_at] / (x[k_at + 1] - x[k_at])) * h
    found = 2.0 * math.pi * (crossings.size - 1) / (crossings[-1] - crossings[0])
    square = k / mass + cubic / mass * amplitude**2
    exact = 0.5 * math.pi * math.sqrt(square) / ellipk(0.5 * cubic / mass * amplitude**2 / square)
    assert found == pytest.approx(exact, rel=1e-3)
    assert exact > (1.0 + 0.7 * cubic * amplitude**2 / k / 8.0) * math.sqrt(k / mass)


def test_modes_take_a_law_linearised_at_rest():
    law = ct.Connection("c", hardening, (ct.End("r", "m"), ct.End("ground")), {"k": "2 kN/mm", "cubic": 1e15})
    found = ct.topology_modes(ct.Topology((), (ct.Body("r", BALL),), (law,))).frequencies_hz
    assert found.max() == pytest.approx(math.sqrt(2e6 / 2.0) / (2.0 * math.pi), rel=1e-5)
    assert np.sort(found)[-2] == pytest.approx(0.0, abs=1e-3)


def test_a_law_knows_the_crank_angle_and_runs_up():
    """A torque at the second order of the crank angle is the built-in load of that order."""

    @ct.law(axes="rz", name="second_order")
    def second_order(turn, rate, angle, torque):
        return torque * math.cos(2.0 * angle)

    ours, theirs = on_pulley(second_order, torque=5.0), on_pulley("load", torque=(0.0, 0.0, 5.0), order=2.0)
    speeds = {"from_rpm": 3000, "to_rpm": 3500, "step_rpm": 500, "crank": "torsional", "inherit": False}
    one, two = (ct.runup(made, **speeds)["pulley.torsion", 2.0] for made in (ours, theirs))
    assert np.all(one > 0.0)
    np.testing.assert_allclose(one, two, rtol=1e-6)


def test_a_function_of_python_is_told_to_be_slow_once():
    @ct.law(axes="rz", name="not_for_numba")
    def not_for_numba(turn, rate, k):
        return -k * float(str(turn))

    made = on_pulley(not_for_numba, k=1e3)
    with pytest.warns(UserWarning, match=r"own law 'not_for_numba' runs in Python because numba.*us a call") as told:
        steady(made, 4000)
        steady(made, 4000)
    assert sum("not_for_numba" in str(one.message) for one in told) == 1
    with pytest.raises(InputError, match="numba cannot compile it"):
        strict = ct.law(not_for_numba.function, axes="rz", compiled=True, name="strict")
        steady(on_pulley(strict, k=1e3), 4000)


def test_what_is_changed_in_memory_goes_through_a_file():
    engine = on_pulley(turning, k=1.25e3, c=0.1)
    assert ct.load_engine(engine) == engine
    (table,) = engine.connection
    assert dict(zip(table.own.parameters, table.own.values, strict=True)) == {"k": 1.25e3, "c": 0.1}
    softer = replace(engine, connection=(replace(table, own=turning.stated({"k": "1 N m/deg", "c": 0.0}, "")),))
    assert softer.connection[0].own.values[0] == pytest.approx(180.0 / math.pi)


# What is told ---------------------------------------------------------------------------------------------------------


@ct.law(axes="rz")
def fails_late(turn, rate, angle, k):
    return math.nan if angle > 3.0 else -k * turn


@ct.law(axes="rz", compiled=False)
def raises_late(turn, rate, angle, k):
    if angle > 3.0:
        raise ValueError("beyond\nthe table")
    return -k * turn


@pytest.mark.filterwarnings("ignore:own law")
@pytest.mark.parametrize(
    ("law", "said"), [(fails_late, "gives no finite force at rz ="), (raises_late, r"raises ValueError: .* at rz =")]
)
def test_a_law_that_fails_is_named_in_one_line(law, said):
    engine = on_pulley(law, k=1e3)
    with pytest.raises(SolverError, match=rf"crank angle 1\d\d.*connection 't': own law '{law.name}' {said}") as caught:
        steady(engine, 4000)
    assert "\n" not in str(caught.value) and steady(ct.load_engine("single_petrol"), 4000).complete


def wrong(*arguments, **named):
    return lambda: ct.load_engine("single_petrol").connected(*arguments, **named)


def law_of(function, **named):
    return lambda: steady(on_pulley(ct.law(function, name="u", **named)), 4000)


WRONG = [
    (wrong("t", turning, ENDS, k=1.0), "connection 't': law 'turning' needs 'c'"),
    (wrong("t", turning, ENDS, k=1.0, c=1.0, kk=1.0), "connection 't': law 'turning' has no 'kk'; did you mean 'k'"),
    (wrong("t", turning, ENDS, k="soft", c=0), "connection 't': k: 'soft' is no number with a unit"),
    (wrong("t", turning, ENDS, k=math.nan, c=0), "k is nan; give a finite number"),
    (wrong("t", turning, ("cranky.pulley", "ground"), k=1, c=1), "no body 'cranky'; did you mean 'crank'"),
    (wrong("t", "sprin", ENDS), "connection 't': no law 'sprin'; did you mean 'spring'"),
    (wrong("t", len, ENDS), "no law <built-in function len>; give a name, or a function with @ct.law"),
    (law_of(lambda x: 0.0), r"law 'u': takes \(x\); write def f\(displacement, velocity, parameters...\)"),
    (law_of(lambda x, v: 0.0, axes="x q"), "law 'u': no axis 'q'; valid: x, y, z, rx, ry, rz"),
    (law_of(lambda x, v: 0.0, axes="x x"), "axes x, x; give one to four different ones"),
    (law_of(lambda x, v: 0.0, scale=-1.0), "scale -1.0 is not positive"),
    (law_of(lambda x, v: (0.0, 1.0)), "own law 'u' raises TypeError at rest"),
    (law_of(lambda x, v: (0.0,), axes="x y"), "own law 'u' returns 1 forces for 2 axes"),
    (law_of(lambda x, v: math.inf), r"own law 'u' gives \[inf\] at rest"),
    (law_of(lambda x, v: x[3], axes="x y"), "own law 'u' raises IndexError at rest"),
    (law_of(lambda x, v, k: 0.0), "law 'u' needs 'k'"),
]


@pytest.mark.parametrize(("call", "said"), WRONG)
def test_wrong_laws_are_told_in_one_line(call, said):
    with one_line(match=said):
        call()


def test_what_cannot_have_an_own_law_says_so(tmp_path):
    engine = on_pulley(turning, k=1e3, c=0.1)
    with pytest.raises(InputError, match="connection 't': an FMU cannot carry the own law 'turning'"):
        ct.build_fmu(engine, tmp_path)
    with pytest.raises(InputError, match="connection 't': law 'own' is not linear in the motion"):
        ct.runup(engine, from_rpm=3000, to_rpm=4000, step_rpm=500, crank="torsional", method="linear", inherit=False)
    assert not list(tmp_path.iterdir())
    (tmp_path / "own.toml").write_text(engine.to_toml(), "utf-8")
    command = [sys.executable, "-m", "cranktrain.cli.main", "simulate", "own.toml", "--speed", "4000"]
    done = subprocess.run([*command, "--crank", "torsional"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "connection 't': no own law 'turning' in this process" in done.stderr
