"""Sets of data beside orders of the pulley: shaft torque, targets of the crank that bends, mounts, runs in time."""

import math
from dataclasses import replace

import numpy as np
import pytest
from identified import identified, model_of, places, stated, write_orders

from cranktrain.core.threads import one_thread
from cranktrain.core.typed_file import record
from cranktrain.core.units import RPM
from cranktrain.engine.file import load_engine
from cranktrain_lab.identification.bending import Bending
from cranktrain_lab.identification.data import FREQUENCY, MOUNTS, TARGET, Data, Scalar
from cranktrain_lab.identification.model import mode_of
from cranktrain_lab.identification.tables import MeasuredTable

SPEEDS = np.linspace(1000.0, 4500.0, 12) * RPM
SHAFT = "flywheel to secondary"


@pytest.fixture(scope="module")
def four(tmp_path_factory):
    return stated("four_petrol", tmp_path_factory.mktemp("four"))


def largest(values, share):
    """Noise of each order as a share of its largest amplitude."""
    return [share * np.abs(own).max() for own in values]


def test_the_torque_of_a_shaft_knows_its_stiffness_and_damping(four, tmp_path):
    """Orders 2 and 4 in the bow springs, 1 % of noise: within three of their deviations and 5 % of the stiffness."""
    keys = ("drive_line_chain.stiffnesses[1]", "load")
    data = places(SPEEDS, (2.0, 4.0), f"shaft[{SHAFT}].torque")
    with one_thread():
        model = model_of(load_engine(four), keys, Data(data))
        own = np.array([one.start for one in model.sought])
        values = model.answers(own * [1.2, 0.95]).strands
    write_orders(tmp_path / "torque.csv", data, values, largest(values, 0.01), 1, 1.0, "N m")
    text = "".join(["[parameters]\n", *(f'"{key}" = {{}}\n' for key in keys)])
    text += f'[[torque]]\nfile = "torque.csv"\nshaft = "{SHAFT}"\n'
    found, report = identified(four, tmp_path / "measured.toml", text, method="linear")
    for key, true in zip(keys, own * [1.2, 0.95], strict=True):
        si = found[key]["value"] / true
        assert abs(math.log(si)) < 0.03 * found[key]["deviation_percent"] and si == pytest.approx(1.0, abs=0.05), key
    assert report["orders"][0]["output"] == f"shaft[{SHAFT}].torque"


def test_runs_in_time_correct_what_harmonic_balance_found(four, tmp_path):
    """Data by runs in time of a torsional crank: its steady cycle's orders are those of harmonic balance to 1 %."""
    data = places(np.array([1500.0, 2000.0, 2500.0, 3000.0]) * RPM, (2.0, 4.0))
    with one_thread():
        values = model_of(load_engine(four), ("load",), Data(data)).in_time(np.array([0.9]), "torsional", 1e-3)
    write_orders(tmp_path / "orders.csv", data, values)
    text = '[parameters]\nload = { low = 0.7, high = 1.2 }\n[[orders]]\nfile = "orders.csv"\n'
    found, report = identified(four, tmp_path / "measured.toml", text, method="time", crank="torsional")
    assert [step["level"] for step in report["levels"]] == ["linear", "harmonic-balance", "time"]
    assert report["levels"][1]["values"]["load"] == pytest.approx(0.9, rel=0.01)
    assert found["load"]["value"] == pytest.approx(0.9, rel=2e-3)


@pytest.mark.slow
def test_targets_and_mounts_stand_beside_frequencies_of_twist(tmp_path):
    """A bending target and the lowest frequency on the mounts, of softer mounts and a heavier pulley, found again."""
    engine = load_engine("diesel_i6")
    mounts, pulley = engine.mounts, engine.pulley
    inertias = {key: 1.15 * getattr(pulley, key) for key in ("polar_inertia", "diametral_inertia")}
    softer = replace(mounts, stiffness_y=tuple(0.7 * one for one in mounts.stiffness_y))
    soft = replace(engine, mounts=softer, pulley=replace(pulley, **inertias))
    target = {"shape": "bending", "hz": 200.0, "tolerance": 0.01, "source": "test"}
    read = record(MeasuredTable, {"block": "flexible", "targets": {"bending": target}})
    on_mounts = [Scalar("mounts", MOUNTS, 1, 1.0, 0.01, False)]
    with one_thread():
        bending, vertical = Bending(engine, read, on_mounts, lambda stage: None).frequencies(soft)
        # The crank of the engine itself: one that is made for another pulley is tuned to that.
        model = model_of(engine, ["pulley.polar_inertia"], Data(), inherit=False)
        first = Scalar("first", FREQUENCY, 1, 200.0, 0.01, False)
        twist, _ = mode_of(model.assembly(np.array([soft.pulley.polar_inertia])), first)
    text = f"""damper = false
inherit = false
block = "flexible"
[parameters]
"mounts.stiffness_y" = {{}}
"pulley.polar_inertia" = {{}}
[[frequencies]]
hz = {twist:.4f}
[[frequencies]]
of = "mounts"
hz = {vertical:.5f}
[targets.bending]
shape = "bending"
hz = {bending:.3f}
tolerance = 0.01
source = "test"
"""
    found, report = identified("diesel_i6", tmp_path / "measured.toml", text)
    assert found["pulley.polar_inertia"]["value"] == pytest.approx(soft.pulley.polar_inertia, rel=5e-3)
    assert found["mounts.stiffness_y"]["value"] == pytest.approx(0.7 * engine.mounts.stiffness_y[0], rel=0.02)
    kinds = {row["kind"]: row["over_deviation"] for row in report["numbers"]}
    assert set(kinds) == {FREQUENCY, TARGET, MOUNTS} and max(map(abs, kinds.values())) < 0.1
    assert not report["told_apart"]
