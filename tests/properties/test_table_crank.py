"""Cranks from tables of discs and shafts: a rubber damper on them, stored and read again, fatigue, what is refused.

Expected values are those of complex stiffness matrices written out in numpy, as in ``test_loss_factors.py``.
"""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from one_line import one_line
from some import some
from test_loss_factors import (
    ENGINES,
    ETA,
    SETTINGS,
    assembled,
    chain_of,
    constant_gas,
    engine_of,
    hysteretic,
    in_time,
    pins_of,
)

from cranktrain.cli.main import main
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.engine.torsional_chain import Chain
from cranktrain.loads.damper import with_damper_housing
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.strength.cut_loads import crank_loads
from cranktrain.results.strength.recorded_cycle import recorded_cycle
from cranktrain.store.bodies import export_body, import_body
from cranktrain.structure.crank.chain import chain_body
from cranktrain.structure.crank.level import running_crank
from cranktrain.structure.crank.reduction import attached_parts
from cranktrain.studies.torsion.damper_link import DamperLink
from cranktrain.studies.torsion.shaft_orders import ShaftOrders

RUBBER = {"kind": "rubber", "stiffness": 2e4, "loss_factor": 0.15}
FITTED = replace(SETTINGS, damper="fitted")
MWM = Path(__file__).parents[1] / "data" / "mwm"


def with_rubber(name, hz=200.0):
    """An engine with the six's damper as a rubber one that is linearised at ``hz``."""
    damper = replace(load_engine("diesel_i6").damper, frequency=hz, **RUBBER)
    return replace(engine_of(name), damper=damper)


def with_ring(engine, chain, rods=None):
    """Complex stiffness and mass of the assembled chain with housing and ring, the ring last."""
    stiffness, mass = assembled(with_damper_housing(engine), chain, rods)
    n, nose = len(mass), chain.names.index("pulley")
    whole, weights = np.zeros((n + 1, n + 1), dtype=complex), np.zeros((n + 1, n + 1))
    whole[:n, :n], weights[:n, :n], weights[n, n] = stiffness, mass, engine.damper.ring_inertia
    twist = np.zeros(n + 1)
    twist[[nose, n]] = 1.0, -1.0
    return whole + RUBBER["stiffness"] * (1.0 + 1j * RUBBER["loss_factor"]) * np.outer(twist, twist), weights


def crank_of(engine, chain):
    return running_crank(with_damper_housing(engine), "torsional", chain_body(engine, chain))


@pytest.mark.parametrize("name", ENGINES)
def test_a_rubber_damper_loses_its_loss_factor_in_the_assembled_modes(name):
    """In time, linearised at a mode's own frequency: shafts and rubber together damp the mode as hysteresis does."""
    chain = chain_of(engine_of(name))
    omega, ratios = hysteretic(*with_ring(with_rubber(name), chain))
    # The crank on the dynamometer's soft shaft comes first.
    for k in (1, 2):
        engine = with_rubber(name, float(omega[k]) / (2.0 * math.pi))
        found, damping = in_time(engine, crank_of(engine, chain), FITTED)
        nearest = int(np.argmin(np.abs(found - omega[k])))
        assert found[nearest] == pytest.approx(omega[k], rel=0.01)
        assert damping[nearest] == pytest.approx(ratios[k], rel=0.02)
    # The rubber damps more than the shafts in one of these modes.
    assert ratios[1:3].max() > 0.6 * ETA


@pytest.mark.parametrize("name", ENGINES)
def test_orders_with_a_rubber_damper_are_those_of_the_complex_stiffness(name):
    """In the frequency domain the rubber's stiffness is k (1 + iη) at every frequency, whatever its own one is."""
    engine = with_rubber(name)
    chain = chain_of(engine)
    structure = ShaftOrders(engine, crank_of(engine, chain), FITTED, constant_gas(engine), 12.0)
    structure._by_turn = structure._by_lead = (np.zeros(structure.pins), np.zeros(structure.pins))
    stiffness, mass = with_ring(engine, chain, structure.inertia[0].real)
    omega, _ = hysteretic(stiffness, mass)
    speeds, orders = np.array([0.98, 1.02]) * omega[1] / 6.0, np.array([6, 12, 20])
    transfer = structure.transfer(speeds, orders)
    link = DamperLink(engine, FITTED, speeds, 0.5 * orders * speeds[:, None]).stiffness
    # The torque between hub and ring is the last load, their twist the row of the same number.
    free, by_link = transfer[..., 0], transfer[..., structure.pins]
    twist = free[..., structure.pins] / (1.0 + link * by_link[..., structure.pins])
    moved = free - (link * twist)[..., None] * by_link
    names, rows = [*pins_of(engine), "pulley"], [*range(structure.pins), structure.at.pulley]
    for i, speed in some(enumerate(speeds)):
        for j, order in some(enumerate(0.5 * orders)):
            load = np.zeros(len(mass))
            load[chain.names.index("pin[1]")] = 1.0
            own = np.linalg.solve(stiffness - (order * speed) ** 2 * mass, load)
            expected = np.array([own[chain.names.index(one)] for one in names])
            assert moved[i, j, rows] == pytest.approx(expected, abs=0.01 * np.abs(expected).max())


@pytest.mark.parametrize("place", ["crank.h5", "crank.npz", "crank"])
def test_a_stored_crank_keeps_the_loss_of_its_table(tmp_path, place):
    engine = engine_of("diesel_i6")
    chain = chain_of(engine)
    bare = chain_body(engine, chain)
    export_body(tmp_path / place, bare)
    omega, ratios = hysteretic(*assembled(engine, chain))
    found, damping = in_time(engine, running_crank(engine, "torsional", import_body(tmp_path / place)))
    for k in (1, 2):
        own = int(np.argmin(np.abs(found - omega[k])))
        assert damping[own] == pytest.approx(ratios[k], rel=0.02)


def modes_of(capsys, *options):
    capsys.readouterr()
    assert main(["modal", str(MWM / "mwm.toml"), "--crank", "torsional", *options, "--json"]) == 0
    line = json.loads(capsys.readouterr().out)["drive_line"]["modes"]
    return [(one["hz"], one["damping_ratio"]) for one in line]


def test_a_crank_that_reduce_wrote_from_a_table_is_that_crank(tmp_path, capsys):
    """Also where the engine file makes torsional cranks by formula; levels that bend refuse it as they do the table."""
    table, stored = str(MWM / "pins.csv"), str(tmp_path / "crank.h5")
    assert main(["reduce", str(MWM / "mwm.toml"), "--mesh", table, "--output", stored]) == 0
    expected = modes_of(capsys, "--mesh", table)
    assert expected[1][1] == pytest.approx(0.03, abs=0.005)
    assert np.array(modes_of(capsys, "--body", stored)) == pytest.approx(np.array(expected), rel=1e-9)
    for given in (("--mesh", table), ("--body", stored)):
        assert main(["modal", str(MWM / "mwm.toml"), "--crank", "beam", *given]) == 2
        assert "a table of discs and shafts serves crank level torsional, not 'beam'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("values", "message"),
    [({"torques": (0.0, 100.0), "stiffnesses": (1e5, 2e5)}, "has stiffness over torque"),
     ({"frequencies": (10.0, 100.0), "stiffnesses": (1e5, 2e5)}, "has stiffness over frequency"),
     ({"friction": 20.0}, "has friction")],
)  # fmt: skip
def test_shafts_that_are_not_linear_are_refused(values, message):
    engine = engine_of("diesel_i6")
    chain = chain_of(engine)
    shafts = (replace(chain.shafts[0], **values), *chain.shafts[1:])
    with one_line(f"shaft pulley to pin[1] {message}, but the shafts of a crank are linear"):
        chain_body(engine, Chain(chain.discs, shafts))


def test_a_wrong_table_is_told_in_one_line(tmp_path, capsys):
    table = tmp_path / "table.csv"
    table.write_text((MWM / "pins.csv").read_text("utf-8").replace("pin[6]", "pin[9]"), "utf-8")
    assert main(["modal", str(MWM / "mwm.toml"), "--crank", "torsional", "--mesh", str(table)]) == 2
    [line] = capsys.readouterr().err.strip().splitlines()
    assert "engine has no 'pin[9]'; did you mean 'pin[6]'" in line


def test_torque_of_a_cut_is_what_turns_the_flywheel_behind_it():
    """Newton at the flywheel, J (θ̈ + Ω̇) = T − T_shaft, and at the pulley; the engine's own pieces are lighter."""
    engine = engine_of("diesel_i6")
    chain = chain_of(engine, 0.0)
    chain = replace(chain, shafts=tuple(replace(shaft, damping=30.0) for shaft in chain.shafts))
    run = Simulation(
        engine, running_crank(engine, "torsional", chain_body(engine, chain)), SETTINGS, GasTrace.from_engine(engine)
    )
    run.inputs[0] = 150.0
    cycle = recorded_cycle(run, engine)
    loads = crank_loads(cycle)
    parts = dict(attached_parts(engine))
    inertia = {disc.name: disc.inertia + (parts[disc.name].polar_inertia if disc.name in parts else 0.0)
               for disc in chain.discs}  # fmt: skip
    turned = {name: cycle.motion(name, 2)[:, 5] + cycle.acceleration for name in ("pulley", "flywheel")}
    mains = (cycle.body.positions[cycle.body.index(f"main[{k}]"), 2] for k in (1, 7))
    front, behind = (loads.cut(z, np.zeros(3))[1][:, 2] for z in mains)
    size = np.ptp(behind)
    expected = inertia["flywheel"] * turned["flywheel"] + cycle.outputs["shaft.torque"]
    assert behind == pytest.approx(expected, abs=1e-3 * size)
    assert front == pytest.approx(-inertia["pulley"] * turned["pulley"], abs=1e-3 * size)


def factors(capsys, table):
    capsys.readouterr()
    given = ["--crank", "torsional", "--mesh", str(MWM / table), "--speed", "1500"]
    assert main(["fatigue", str(MWM / "mwm.toml"), *given, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    return {one["name"]: one["safety_factor"] for one in found["fillets"]}, found["speeds"][0]


def test_fatigue_of_a_crank_from_a_table(capsys):
    """The published six with discs at its pins, or between massless mains: one crank; discs that damp are loads too."""
    (pins, first), (mains, second) = (factors(capsys, table) for table in ("pins.csv", "chain.csv"))
    assert np.array([pins[name] for name in mains]) == pytest.approx(np.array(list(mains.values())), rel=0.01)
    assert max(first["unbalanced_relative"], second["unbalanced_relative"]) < 1e-3
