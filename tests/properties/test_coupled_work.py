"""Combustion beside a cranktrain that twists: the gas gives the work that the pistons take."""

import math
from dataclasses import replace
from functools import cache

import entry
import numpy as np
import pytest
from started import at_speed

import cranktrain as ct
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.engine.file import load_engine
from cranktrain.modules.combustion.file import load
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.register import module_files
from cranktrain.studies.design.layouts import layout
from cranktrain.studies.design.rules import document
from cranktrain.studies.design.sizes import sizes
from cranktrain_lab.coupling.master import Master
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN
from cranktrain_lab.coupling.run import Steps, run
from cranktrain_lab.coupling.simulation_unit import SimulationUnit
from cranktrain_lab.coupling.virtual_engine import GAS_WORK, gas_connections, gas_exchange, volume_connections

SPEED = 2000.0 * math.pi / 30.0
CYCLE = 4.0 * math.pi / SPEED
READ = {
    COMBUSTION: ["gas.work", "indicated.torque"],
    CRANKTRAIN: ["gas.work", "shaft.torque", "cylinder[1].volume", "cylinder[1].volume_deviation",
                 "cylinder[1].volume_deviation_rate"],
}  # fmt: skip


@cache
def engine_of(name, folder):
    """The six, or a new engine of its bore and stroke."""
    six = load_engine("diesel_i6")
    if name == "six":
        return six
    path = folder / f"{name}.toml"
    found = sizes(layout(name), six.cylinders.bore, 2.0 * six.crankshaft.throw, fuel="diesel")
    path.write_text(document(name, found).text, encoding="utf-8")
    return load_engine(path)


def units_of(engine, **settings):
    """Cranktrain and combustion of an engine, at 2000 rev/min."""
    made = ct.assemble(engine, Settings(gas_source="input", **settings))
    crank = Simulation(made.engine, made.body, made.settings, parts=made.parts)
    cylinders = made.engine.cylinders
    own = {name: getattr(cylinders, name) for name in ("bore", "pin_offset", "compression_ratio")}
    own |= {"stroke": 2.0 * made.engine.crankshaft.throw, "rod_length": made.engine.rod.length}
    usual = load(module_files()["combustion_i6"])
    gas = CombustionSimulation(replace(usual, **own, firing_angles=made.engine.firing_angles))
    crank.inputs[0] = gas.inputs[0] = SPEED
    return SimulationUnit(COMBUSTION, gas), SimulationUnit(CRANKTRAIN, crank)


def coupled(engine, step_deg=1.0, cycles=8, scheme="gauss-seidel", rule="own", tells=True, **settings):
    """A run of both, its points of the last cycle, and the cranktrain's mean powers (POWERS,) at these, W."""
    own = rule == "own"
    n = engine.n_cylinders
    usual = {"bearings": "linear", "reconstruction": "polytropic" if own else "hold"}
    combustion, cranktrain = units_of(engine, **usual | settings)
    links = gas_connections(n, own) + (volume_connections(n) if tells else [])
    master = Master([combustion, cranktrain], links, gas_exchange(scheme, rule), READ)
    master.initialize()
    powers, count = [], round(720 / step_deg)
    found = run(
        master, cycles * CYCLE, Steps(math.radians(step_deg) / SPEED), [GAS_WORK],
        told=lambda record: powers.append(cranktrain.simulation.work.powers.copy()),
    )  # fmt: skip
    return found, slice(-count - 1, None), np.mean(powers[-count:], axis=0)


def works(found, last, _=None):
    """Work of the last cycle that the gas gives and that the pistons take, J."""
    return [float(np.ptp(found.of(f"{unit}.gas.work")[last][[0, -1]])) for unit in (COMBUSTION, CRANKTRAIN)]


@pytest.mark.parametrize(("name", "how", "close"), [
    ("six", {}, 2e-5), ("i5", {}, 2e-5), ("single", {}, 2e-5), ("six", {"scheme": "jacobi", "cycles": 5}, 1e-4),
    ("six", {"scheme": "jacobi", "step_deg": 1.5, "cycles": 5}, 1e-4), ("six", {"step_deg": 3.0, "cycles": 5}, 1e-4),
    ("six", {"scheme": "iterative", "cycles": 2}, 1e-4), ("six", {"tells": False}, 1e-3),
], ids=str)  # fmt: skip
def test_a_torsional_crank_takes_the_work_that_the_gas_gives(name, how, close, tmp_path_factory):
    """By all schemes; the last combustion knows one angle: what is left are pressures ahead of the newest sample."""
    given, taken = works(*coupled(engine_of(name, tmp_path_factory.mktemp(name)), **how, crank="torsional"))
    assert taken == pytest.approx(given, rel=close)


def test_the_residual_is_the_difference_of_both_works():
    """By steps; held pressures miss some per cent of the work, which powers at the points do not show."""
    found, last, _ = coupled(load_engine("diesel_i6"), cycles=3, rule="hold", crank="torsional")
    given, taken = works(found, last)
    steps = np.diff(found.times[last])
    assert found.residuals["gas"][-steps.size :] @ steps == pytest.approx(given - taken, rel=1e-9)
    assert 0.02 < 1.0 - taken / given < 0.05


@pytest.mark.parametrize("level", ["rigid", "torsional"])
def test_the_shaft_gets_the_indicated_torque(level):
    """But for damping of crank and shaft, each a twentieth of a per cent; journals are held, so no film takes power."""
    found, last, powers = coupled(load_engine("diesel_i6"), cycles=16, crank=level, bearings="held")
    shaft = found.of(f"{CRANKTRAIN}.shaft.torque")[last][1:].mean()
    damped = (entry.power(powers, "crank_loss") + entry.power(powers, "shafts_loss")) / SPEED
    given, _ = works(found, last)
    assert shaft + damped == pytest.approx(given / (4.0 * math.pi), rel=2e-5)
    assert 0.0 < damped < 1e-3 * shaft


def rigid_volume(engine, angle):
    """Volume above the piston of a slider crank at crank angles after its dead centre, m³."""
    r, length, bore = engine.crankshaft.throw, engine.rod.length, engine.cylinders.bore
    height = r * np.cos(angle) + np.sqrt(length**2 - (r * np.sin(angle)) ** 2)
    return 0.25 * math.pi * bore**2 * (r + length - height + 2.0 * r / (engine.cylinders.compression_ratio - 1.0))


@cache
def compressed(engine, rule, step_deg):
    """Pulley torsion of two cycles, rad, where a partner compresses and expands by pV^1.33 at the crank's angle."""
    made = ct.assemble(engine, Settings(crank="torsional", bearings="linear", gas_source="input", reconstruction=rule))
    crank = at_speed(SPEED, made.engine, made.body, made.settings, parts=made.parts)
    angle, torsion = (crank.output_names.index(name) for name in ("crank.angle", "pulley.torsion"))
    full, found, h = rigid_volume(engine, math.pi), [], math.radians(step_deg) / SPEED
    for k in range(round(1440 / step_deg)):
        after = crank.outputs[angle] - np.array(engine.firing_angles)
        crank.pressures[:] = 1.5e5 * (full / rigid_volume(engine, after)) ** 1.33
        crank.step((k + 1) * h)
        found.append(crank.outputs[torsion])
    return np.array(found)


@pytest.mark.parametrize("name", ["six", "i5", "single"])
@pytest.mark.parametrize(("rule", "order"), [("linear", 2.0), ("hold", 1.0), ("interpolate", 1.0)])
def test_every_rule_moves_pressures_of_one_angle_to_each_pin_s_own(name, rule, order, tmp_path_factory):
    """What is left goes with its order in the step; left at the crank's angle, 7 % of the six's torsion do not go."""
    engine = engine_of(name, tmp_path_factory.mktemp(name))

    def error(step_deg):
        exact = compressed(engine, "polytropic", step_deg)
        return float(np.std(compressed(engine, rule, step_deg) - exact) / np.std(exact))

    assert math.log2(error(1.0) / error(0.5)) == pytest.approx(order, abs=0.1)


def test_the_deviation_is_that_of_the_volume_and_its_rate():
    """Volume of a rigid slider crank at the crank's angle by its own formula; the rate is the derivative."""
    engine = load_engine("diesel_i6")
    found, last, _ = coupled(engine, 0.5, cycles=3, crank="torsional")
    angle = found.of(f"{CRANKTRAIN}.crank.angle")[last]
    volume, deviation, rate = (
        found.of(f"{CRANKTRAIN}.cylinder[1].{name}")[last]
        for name in ("volume", "volume_deviation", "volume_deviation_rate")
    )
    assert np.abs(deviation).max() > 1e-6
    np.testing.assert_allclose(volume - deviation, rigid_volume(engine, angle), rtol=1e-10)
    times = found.times[last]
    own = (deviation[2:] - deviation[:-2]) / (times[2:] - times[:-2])
    np.testing.assert_allclose(rate[1:-1], own, atol=3e-3 * np.abs(own).max())


@pytest.mark.slow
@pytest.mark.parametrize("bearings", ["linear", "impedance"])
def test_a_solid_crank_takes_the_work_that_the_gas_gives(bearings):
    """Bending and films move pins in their cylinders by a per cent of the clearance volume."""
    given, taken = works(*coupled(load_engine("diesel_i6"), crank="solid", bearings=bearings))
    assert taken == pytest.approx(given, rel=2e-5)
