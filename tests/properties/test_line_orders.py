"""Drive lines by frequency and in time: two masses in closed form, couplings over torque, friction, linear dampers.

Two masses J₁ (crank and rods), J₂ on a shaft of complex stiffness κ: a torque T on J₁ puts
κ T/J₁/(κ (1/J₁ + 1/J₂) − ω²) into the shaft. Damper: a hub J₁ on k with a ring J₂ = μ J₁ coupled by c alone has the
amplitude (1 + 2/μ) T/k at ω² = 2/(2 + μ) k/J₁ for every c (Houdaille; Den Hartog, Mechanical Vibrations, 4th ed., 3.3).
"""

import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from bodies import rigid_crank
from one_line import one_line
from refusals import refused_files

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation, simulate
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.drive_line_chain import DriveLineChain
from cranktrain.engine.file import load_engine
from cranktrain.engine.line_elements import element_values, tangent_stiffness, torque_curve
from cranktrain.engine.model import engine_from_dict, engine_to_dict
from cranktrain.engine.parts import Damper, MeanLoad
from cranktrain.engine.torsional_chain import Chain, Disc, Shaft
from cranktrain.loads.damper import damper_parameters, damper_torque, with_damper_housing
from cranktrain.loads.gas_pressure import CYCLE, GasTrace
from cranktrain.loads.mean_load import balancing_load, mean_torques
from cranktrain.loads.torsional_line import torsional_line
from cranktrain.results.orders.harmonics import order_amplitudes
from cranktrain.results.orders.resonances import peaks
from cranktrain.structure.assembly import assemble
from cranktrain.studies.run_up.steady import Job, SteadyRuns
from cranktrain.studies.torsion import frequency_run_up as run_ups
from cranktrain.studies.torsion.frequency_run_up import _Transfer, frequency_run_up
from cranktrain.studies.torsion.line_link import LineLink, linear_engine, mean_shares
from cranktrain.studies.torsion.shaft_orders import ShaftOrders

SIX = load_engine("diesel_i6")
RIGID = Settings(crank="rigid", bearings="held")
SPEEDS, SPEED = np.array([700.0, 1450.0]) * RPM, 1500.0 * RPM
J2 = 0.8


def shaft(between, **values):
    return Shaft(between, **element_values("shaft", values))


FREQUENCIES = (10.0, 60.0, 200.0)
DRIVEN, HEAVY = (Disc("driven", J2),), (Disc("driven", 2.0),)


def behind(*shafts, discs=DRIVEN, engine=SIX):
    engine = replace(engine, drive_line_chain=DriveLineChain.of(Chain(tuple(discs), shafts)))
    check_engine(engine)
    return engine


def orders_of(engine, settings=RIGID):
    return ShaftOrders(engine, rigid_crank(engine), settings, GasTrace.from_engine(engine), 24.0)


def steady(engine, speeds=SPEED, orders=(3.0, 6.0), method="harmonic-balance", settings=RIGID, **more):
    """Orders of a rigid crank's run-up by frequency."""
    return frequency_run_up(engine, rigid_crank(engine), settings, np.atleast_1d(speeds), orders, method, **more)


@pytest.mark.parametrize(
    "values",
    [
        {"stiffness": 2e4, "damping": 6.0},
        {"stiffness": 2e4, "loss_factor": 0.15},
        {"stiffness": (1e4, 2e4, 5e4), "damping": (9.0, 5.0, 2.0), "frequencies": FREQUENCIES, "frequency": 30.0},
    ],
)
def test_the_shaft_of_two_free_masses_carries_the_closed_form(values):
    engine = behind(shaft(("flywheel", "driven"), **values))
    found = steady(engine, SPEEDS, 0.5 * np.arange(1, 25), "linear")
    structure = orders_of(engine)
    j1 = 1.4 + structure.inertia[0].real.sum()
    torque = structure.known(SPEEDS)[:, 1:25].sum(axis=2)
    omega = SPEEDS[:, None] * structure.orders[1:25]
    if "frequencies" in values:
        hz = omega / (2.0 * math.pi)
        k, c = (np.interp(hz, values["frequencies"], values[key]) for key in ("stiffness", "damping"))
        kappa = k + 1j * omega * c
    else:
        kappa = 2e4 * (1.0 + 1j * values.get("loss_factor", 0.0)) + 1j * omega * values.get("damping", 0.0)
    expected = kappa * torque / j1 / (kappa * (1.0 / j1 + 1.0 / J2) - omega**2)
    ours = found.amplitudes["shaft[flywheel to driven].torque"]
    assert np.abs(ours - expected).max() < 1e-9 * np.abs(expected).max()


def test_a_coupling_over_torque_has_the_stiffness_at_the_mean_torque_of_each_speed():
    """Full burn, so mean torques differ with the speed: each speed is that of a linear shaft of its own."""
    points = {"stiffness": (1e4, 2e4, 6e4), "torques": (0.0, 400.0, 1600.0)}
    engine = behind(shaft(("flywheel", "driven"), **points))
    gas = GasTrace.from_engine(engine)
    motored, full = mean_torques(engine, gas)
    found = steady(engine, SPEEDS)
    stiffnesses = []
    for k, speed in enumerate(SPEEDS):
        mean = motored + max(1.0 - gas.falloff * (speed / gas.best_speed - 1.0) ** 2, 0.0) * (full - motored)
        stiffnesses.append(np.interp(mean, points["torques"], points["stiffness"]))
        linear = behind(shaft(("flywheel", "driven"), stiffness=stiffnesses[-1]))
        own = steady(linear, np.array([speed]))
        for name in ("pulley.torsion", "shaft[flywheel to driven].torque"):
            assert found.amplitudes[name][k] == pytest.approx(own.amplitudes[name][0], rel=1e-3)
    assert stiffnesses[1] > 1.05 * stiffnesses[0]


def test_mean_torques_follow_gears_and_branches():
    """A branch that nothing loads carries none; behind a gear of ratio r the torque is 1/r."""
    discs = (Disc("a", 0.2), Disc("fan", 0.1), Disc("g", 0.1))
    shafts = (
        Shaft(("flywheel", "a"), 3e4), Shaft(("a", "fan"), 2e3), Shaft(("a", "g"), 0.0, ratio=-2.5),
        Shaft(("g", "dynamometer"), 1e4),
    )  # fmt: skip
    assert mean_shares(torsional_line(behind(*shafts, discs=discs))) == pytest.approx([1.0, 0.0, -0.4], abs=1e-9)
    free = behind(*shafts[:3], discs=discs)
    assert mean_shares(torsional_line(free)) == pytest.approx([1.0, 0.0], abs=1e-9)


def test_torque_over_torque_points_integrates_to_the_curve():
    """Stages: straight pieces through the knees; a slope of stiffness over torque: ψ = ln(k/k₀) ΔT/(k − k₀)."""
    stages = shaft(("flywheel", "driven"), stiffness=(2e4, 3e4, 6e4), torques=(500.0, 1500.0))
    twists, torques = torque_curve(stages)
    knees = np.array([500.0 / 2e4, 500.0 / 2e4 + 1000.0 / 3e4])
    assert np.interp([-knees[1], -knees[0], 0.0, *knees], twists, torques) == pytest.approx([-1500, -500, 0, 500, 1500])
    assert tangent_stiffness(stages, np.array([-100.0, 1000.0, 9e3])) == pytest.approx([2e4, 3e4, 6e4])
    slope = shaft(("flywheel", "driven"), stiffness=(1e4, 4e4), torques=(0.0, 900.0))
    twists, torques = torque_curve(slope)
    assert np.interp(900.0, torques, twists) == pytest.approx(900.0 * math.log(4.0) / 3e4)
    curve = shaft(("flywheel", "driven"), twists=(0.0, 0.1, 0.2), torques=(0.0, 1e3, 4e3))
    assert np.interp([-0.15, 0.05], *torque_curve(curve)) == pytest.approx([-2500.0, 500.0])


def test_friction_dissipates_as_coulomb_s_does():
    """One mass on a spring with friction under F cos ωt: c = 4 T_f/(π ω A) where the slip speed is small."""
    friction, k, j, force = 30.0, 4e3, 0.5, 200.0
    engine = behind(Shaft(("flywheel", "driven"), k, friction=friction, slip_speed=1e-3))
    link = LineLink(torsional_line(engine))
    omega = np.array([[0.0, 80.0]])
    phase = np.arange(512) * (2.0 * math.pi / 512)

    def twists(damping):
        answer = force / (k - omega**2 * j + 1j * omega * damping[:, :1])
        return np.where(omega > 0.0, answer, 0.0)[..., None]

    def signal(spectrum):
        return (spectrum[:, 1, None] * np.exp(1j * phase)).real

    damping = link.settled_friction(twists, omega, signal, 1)
    amplitude = abs(twists(damping)[0, 1, 0])
    assert damping[0, 0] == pytest.approx(4.0 * friction / (math.pi * 80.0 * amplitude), rel=1e-3)


def test_a_speed_that_fails_is_lost_alone(monkeypatch):
    engine = behind(Shaft(("flywheel", "driven"), 2e4, 6.0))
    speeds = np.linspace(600.0, 1600.0, 6) * RPM
    whole = steady(engine, speeds)
    solve = run_ups._balanced

    def failing(structure, damper, own):
        if np.any(np.abs(own - speeds[2]) < 1.0):
            raise SolverError("the orders do not settle at 1000 rev/min")
        return solve(structure, damper, own)

    monkeypatch.setattr(run_ups, "_balanced", failing)
    failed = []
    found = steady(engine, speeds, failed=failed)
    assert [(one.speed, one.reason) for one in failed] == [(speeds[2], "the orders do not settle at 1000 rev/min")]
    kept = np.arange(6) != 2
    assert np.isnan(found.torsion[2]).all() and np.isnan(found.extremes["pulley.torsion"][2]).all()
    assert found.torsion[kept] == pytest.approx(whole.torsion[kept], rel=1e-9)
    assert all(math.isfinite(peak.amplitude) for peak in peaks(found))
    with pytest.raises(SolverError, match="do not settle"):
        steady(engine, speeds)


TABLE = {"frequencies": (20.0, 60.0), "stiffnesses": (3e3, 5e3), "dampings": (4.0, 2.0)}


@pytest.mark.parametrize(("mu", "law"), [(0.2, {"damping": 9.0}), (1.0, {"damping": 90.0}), (0.3, TABLE)])
def test_linear_dampers_have_stiffness_and_damping_of_each_frequency(mu, law):
    """(k₁ − ω² J₁) θ + κ (θ − ψ) = T, κ (ψ − θ) = ω² J₂ ψ: of damping alone, κ = iωc, and of steel springs.

    The mean gas tangents of a rigid crank cancel, so this is the textbook's system. Whatever c is, the first meets the
    fixed point.
    """
    engine, k1 = replace(SIX, drive_line=replace(SIX.drive_line, damping=0.0)), SIX.drive_line.stiffness
    j1 = 1.4 + orders_of(engine).inertia[0].real.sum()
    fixed = math.sqrt(k1 / j1 * 2.0 / (2.0 + mu)) / 3.0
    speeds, ring = np.array([0.9, 1.0, 1.1]) * fixed, mu * j1
    own = {"frequency": 40.0, **law} if law is TABLE else law
    fitted, settings = (
        replace(engine, damper=Damper(kind="linear", ring_inertia=ring, **own)), replace(RIGID, damper="fitted"),
    )  # fmt: skip
    check_engine(fitted)
    structure = orders_of(with_damper_housing(fitted), settings)
    known, order = structure.known(speeds), 6
    transfer = _Transfer.of(structure, (fitted, settings), speeds, known)
    moved = transfer.respond(known, np.zeros(known.shape[:2], dtype=complex))[:, order, structure.at.pulley]
    found, omega = moved / known[:, order].sum(axis=1) * k1, 3.0 * speeds
    hz = omega / (2.0 * math.pi)
    k, c = (
        (np.interp(hz, TABLE["frequencies"], TABLE[key]) for key in ("stiffnesses", "dampings"))
        if law is TABLE else (0.0, law["damping"])
    )  # fmt: skip
    kappa = k + 1j * omega * c
    expected = k1 / (k1 - omega**2 * j1 - kappa * omega**2 * ring / (kappa - omega**2 * ring))
    assert found == pytest.approx(expected, rel=1e-6)
    assert law is TABLE or abs(found[1]) == pytest.approx(1.0 + 2.0 / mu, rel=1e-6)
    # In time steel springs have those at their frequency: k ψ + c ψ̇.
    out = np.zeros(4)
    damper_torque(damper_parameters(fitted.damper, 300.0), 0.01, 2.0, out)
    k, c = (4e3, 3.0) if law is TABLE else (0.0, law["damping"])
    assert out[:3] == pytest.approx([-(k * 0.01 + c * 2.0), -k, -c])


@pytest.mark.parametrize(
    ("load", "expected"),
    [
        (MeanLoad(kind="propeller", speed=200.0, torque=1200.0), [300.0, 1200.0 * 0.5625]),
        (MeanLoad(kind="power", speed=200.0, power=9e4), [900.0, 600.0]),
        (MeanLoad(kind="torque", speed=200.0, torque=700.0), [700.0, 700.0]),
    ],
)
def test_the_burn_balances_the_load_at_each_speed(load, expected):
    engine = replace(behind(Shaft(("flywheel", "driven"), 2e4, 6.0)), load=load)
    check_engine(engine)
    speeds = np.array([100.0, 150.0])
    structure = ShaftOrders(engine, rigid_crank(engine), RIGID, GasTrace.from_engine(engine), 12.0, balanced=True)
    assert structure.mean_torque(speeds) == pytest.approx(expected, rel=1e-3)
    found = steady(engine, speeds, [3.0], "linear", balanced=True)
    assert found.extremes["shaft[flywheel to driven].torque"][:, 1] == pytest.approx(expected, rel=1e-3)


def with_damper(**values):
    return replace(SIX, damper=Damper(kind="linear", ring_inertia=0.1, **values))


def burn_of(load):
    return lambda: balancing_load(replace(SIX, load=load), GasTrace.from_engine(SIX), 100.0)


POINTS = {"frequencies": (1.0,), "stiffnesses": (1.0,), "dampings": (1.0,)}
REFUSED = [
    (lambda: check_engine(replace(SIX, load=MeanLoad(kind="power", speed=200.0))),
     r"load\.power: is missing; a load of kind power needs it"),
    (lambda: check_engine(with_damper()), r"damper\.damping: is missing; a linear damper needs damping or stiffness"),
    (lambda: check_engine(with_damper(frequencies=(1.0, 2.0), frequency=1.0)), r"stiffnesses: 0 values for 2 freq"),
    (lambda: check_engine(with_damper(**POINTS)), r"damper\.frequency: is missing"),
    (burn_of(MeanLoad(kind="torque", speed=200.0, torque=1e5)),
     r"\[load\] asks for 1e\+05 N m at 954.9 rev/min, where the engine gives 0 to"),
    (burn_of(None), r"has no \[load\]; add that table"),
]  # fmt: skip


@pytest.mark.parametrize(("made", "says"), REFUSED)
def test_a_load_or_linear_damper_that_lacks_something_is_refused(made, says):
    with one_line(match=says):
        made()


@pytest.mark.parametrize(("values", "says"), refused_files()["elements"]["shaft"])
def test_elements_that_contradict_themselves_are_refused(values, says):
    with one_line(says):
        element_values("shaft", {key: tuple(one) if isinstance(one, list) else one for key, one in values.items()})


def test_an_engine_with_all_of_it_survives_its_dictionary():
    engine = behind(
        shaft(("flywheel", "driven"), stiffness=(2e4, 3e4), torques=(100.0, 900.0), diameter=0.06, strength=6e8),
        shaft(("driven", "dynamometer"), stiffness=(1e4, 2e4), damping=4.0, frequencies=(5.0, 50.0), frequency=20.0),
    )
    engine = replace(engine, load=MeanLoad(kind="propeller", speed=200.0, torque=500.0))
    again = engine_from_dict(engine_to_dict(engine))
    assert again == engine
    assert again.drive_line_chain.chain.shafts == engine.drive_line_chain.chain.shafts
    [coupling] = again.connections
    assert coupling.ends == ("crank.flywheel", "crank.line[driven]")


# In time the mean torque of the gas winds up each shaft; small oscillations about it are those of its tangent.


def last_cycle(engine, settings=RIGID):
    """Outputs of the last of the cycles that repeat."""
    run = simulate(engine, rigid_crank(engine), settings, SPEED)
    assert run.settling.repeats == 1
    return {name: values[-run.per_cycle :] for name, values in run.outputs.items()}


def order(values, number):
    orders, amplitudes = order_amplitudes(values, 12.0, 1)
    return abs(amplitudes[list(orders).index(number)])


def test_a_progressive_coupling_winds_up_by_its_curve_and_swings_on_its_tangent():
    stages = element_values("shaft", {"stiffness": (2e4, 3e4, 6e4), "torques": (500.0, 1500.0), "damping": 20.0})
    engine = behind(Shaft(("flywheel", "driven"), **stages), Shaft(("driven", "dynamometer"), 5e4, 20.0), discs=HEAVY)
    found = last_cycle(engine)
    twist = found["connection[line[1]].twist"]
    mean = mean_torques(engine, GasTrace.from_engine(engine))[1]
    twists, torques = torque_curve(engine.drive_line_chain.chain.shafts[0])
    # The whole oscillation stays on the second stage.
    assert torques[2] < 500.0 < np.interp(twist.min(), twists, torques)
    assert np.interp(twist.max(), twists, torques) < 1500.0
    assert np.interp(twist.mean(), twists, torques) == pytest.approx(mean, rel=5e-3)
    # What the shaft's law carries, less what the connection pushes the flywheel by, is the torque of the curve.
    whole = found["shaft.torque"] - found["connection[line[1]].torque"]
    assert whole.mean() == pytest.approx(np.interp(twist, twists, torques).mean(), rel=1e-6)
    balanced = steady(engine)
    for number in (3.0, 6.0):
        expected = abs(balanced.order(number, "shaft[flywheel to driven].torque")[0])
        assert order(whole, number) == pytest.approx(expected, rel=5e-3)


def test_friction_of_bow_springs_is_that_of_its_equivalent_damping():
    """Order 3 dominates the twist, so equivalent damping errs by the square of what the other orders have."""
    rubbing = Shaft(("flywheel", "driven"), 6e3, 5.0, friction=40.0, slip_speed=0.5)
    engine = behind(rubbing, Shaft(("driven", "dynamometer"), 2e4, 40.0), discs=(Disc("driven", 0.5),))
    found = last_cycle(engine)
    assert not linear_engine(engine).connections
    free = replace(engine, drive_line_chain=replace(engine.drive_line_chain, frictions=(0.0, 0.0)))
    ours = order(found["shaft.torque"] - found["connection[line[1]].torque"], 3.0)
    rubbed, smooth = (
        abs(steady(one, orders=[3.0]).order(3.0, "shaft[flywheel to driven].torque")[0]) for one in (engine, free)
    )
    assert ours == pytest.approx(rubbed, rel=0.05) and abs(ours - rubbed) < 0.2 * abs(ours - smooth)


@pytest.mark.parametrize(
    "law",
    [
        {"damping": 60.0},
        {"frequencies": (40.0, 100.0), "stiffnesses": (2e4, 5e4), "dampings": (30.0, 10.0), "frequency": 75.0},
    ],
)
def test_a_linear_damper_in_time_meets_the_frequency_domain(law):
    """Order 3 at 1500 rev/min is 75 Hz, at which the steel springs are linearised."""
    fitted = with_damper_housing(replace(SIX, damper=Damper(kind="linear", ring_inertia=0.3, **law)))
    check_engine(fitted)
    settings = replace(RIGID, damper="fitted")
    found = last_cycle(fitted, settings)
    expected = abs(steady(fitted, orders=[3.0], settings=settings).order(3.0)[0])
    assert order(found["pulley.torsion"], 3.0) == pytest.approx(expected, rel=2e-3)


def test_what_cannot_run_in_time_is_refused_in_one_line():
    free = behind(Shaft(("flywheel", "driven"), 2e4, 5.0), discs=HEAVY)
    with pytest.raises(InputError, match=r"ends freely; a run in time needs a shaft to 'dynamometer'"):
        Simulation(free, rigid_crank(free), RIGID)
    geared = behind(
        Shaft(("flywheel", "a"), 3e4, 5.0), Shaft(("a", "b"), ratio=2.0),
        Shaft(("b", "c"), 2e4, friction=3.0), Shaft(("c", "dynamometer"), 1e4, 5.0),
        discs=(Disc("a", 0.5), Disc("b", 0.2), Disc("c", 0.4)),
    )  # fmt: skip
    with pytest.raises(InputError, match=r"shaft 3 has stiffness over torque or friction, and its end 'b' is no disc"):
        Simulation(geared, rigid_crank(geared), RIGID)
    # In the frequency domain both run.
    for engine in (free, geared):
        assert np.isfinite(steady(engine).torsion).all()


def test_cycles_in_time_balance_a_propeller_at_each_speed():
    """The shaft's mean torque is the load's, less the heat of dampings: nothing rubs on locked journals."""
    load = MeanLoad(kind="propeller", speed=200.0, torque=1200.0)
    engine = replace(SIX, load=load, reduction=replace(SIX.reduction, torsional_source="ker-wilson"))
    made = assemble(engine, Settings(crank="torsional", bearings="held"), inherit=False)
    runs = SteadyRuns(Job(made, None, 1e-4, 6.0, ("shaft.torque",), balanced=True))
    near = []
    for speed in (150.0, 152.0, 100.0):
        found = runs.at(speed, near)
        near = [found.start]
        burn = balancing_load(engine, GasTrace.from_engine(engine), speed)
        run = simulate(engine, made.body, replace(made.settings, gas_load=burn), speed, settle=1e-4)
        works = np.trapezoid(run.powers, dx=run.step, axis=0)
        damped = (entry.power(works, "crank_loss") + entry.power(works, "shafts_loss")) / CYCLE
        assert found.extremes["shaft.torque"][1] + damped == pytest.approx(load.torque_at(speed), rel=1e-3)
