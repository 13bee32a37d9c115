"""Drive line of discs and shafts behind the flywheel: closed forms, gears, equal runs, free dynamometer."""

import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from bodies import rigid_crank
from refusals import text_of
from scipy.linalg import eigh
from test_line_modes import behind as with_line

from cranktrain.dynamics.model.arrays import build_model
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import simulate
from cranktrain.engine.drive_line_chain import DriveLineChain, read_drive_line
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import engine_from_dict, engine_to_dict
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.torsional_line import torsional_line
from cranktrain.studies.torsion.frequency_run_up import steady_orders

SIX = load_engine("diesel_i6")
SPEED = 2000 * math.pi / 30
LOCKED = Settings(crank="rigid", bearings="held")
CRANK = 1.4
"""Inertia of the test's rigid crank, kg m²."""


def frequencies(engine):
    """Of a crank that is one disc on its drive line, from the running model's own arrays, rad/s, with their damping."""
    body = rigid_crank(engine, inertia=(1.0, 1.0, CRANK))
    found = entry.matrices(build_model(engine, body, LOCKED, SPEED, GasTrace.from_engine(engine)))
    turns = np.any(found[1] != 0.0, axis=0)
    damping, stiffness = (matrix[turns][:, turns] for matrix in found)
    squares, shapes = eigh(stiffness)
    return np.sqrt(np.maximum(squares, 0.0)), np.einsum("ij,ik,kj->j", shapes, damping, shapes)


def test_a_line_between_crank_and_dynamometer_has_the_closed_form():
    """Equal discs on equal shafts, one end held: ω = 2 √(k/J) sin(π (2 i − 1)/(2 (2 n + 1)))."""
    n, k = 3, 2.0e4
    names = ["flywheel", "a", "b", "dynamometer"]
    engine = with_line([("a", CRANK), ("b", CRANK)], [((names[i], names[i + 1]), k) for i in range(3)])
    expected = 2.0 * math.sqrt(k / CRANK) * np.sin(math.pi * (np.arange(1, n + 1) - 0.5) / (2.0 * n + 1.0))
    assert frequencies(engine)[0] == pytest.approx(expected, rel=1e-12)
    line = torsional_line(engine)
    assert line.stiffness == pytest.approx(k / 3.0)
    assert line.follow == pytest.approx([2.0 / 3.0, 1.0 / 3.0])


def test_a_branch_tunes_the_crank_as_an_absorber_does():
    """Crank on k with a branch k₁, J₁: ω⁴ − ω² (k/J + k₁/J + k₁/J₁) + k k₁/(J J₁) = 0; Den Hartog."""
    k, k1, j1 = 2.0e4, 5.0e3, 0.2
    engine = with_line([("fan", j1)], [(("flywheel", "dynamometer"), k), (("flywheel", "fan"), k1)])
    expected = np.sqrt(np.roots([1.0, -(k / CRANK + k1 / CRANK + k1 / j1), k * k1 / (CRANK * j1)]))
    assert frequencies(engine)[0] == pytest.approx(np.sort(expected), rel=1e-12)


@pytest.mark.parametrize("ratio", [2.5, -3.0])
def test_gears_count_with_the_square_of_their_ratio(ratio):
    n2 = ratio**2
    discs = [("g1", 0.3, 0.4), ("g2", 0.1, 0.2)]
    geared = with_line(
        discs, [(("flywheel", "g1"), 3e4, 8.0), (("g1", "g2"), 0.0, 0.0, 0.0, ratio), (("g2", "dynamometer"), 4e3, 3.0)]
    )
    alike = with_line(
        [("g", 0.3 + 0.1 * n2, 0.4 + 0.2 * n2)],
        [(("flywheel", "g"), 3e4, 8.0), (("g", "dynamometer"), 4e3 * n2, 3.0 * n2)],
    )
    for ours, theirs in zip(frequencies(geared), frequencies(alike), strict=True):
        assert ours == pytest.approx(theirs, rel=1e-12)
    assert torsional_line(geared).inertia_at_crank == pytest.approx(0.3 + 0.1 * n2)
    # The same in motion, frame, start and outputs included.
    runs = [simulate(engine, rigid_crank(engine), LOCKED, SPEED, 2).outputs for engine in (geared, alike)]
    for name in ("pulley.torsion", "shaft.torque", "crank.angle"):
        assert runs[0][name] == pytest.approx(runs[1][name], rel=1e-9, abs=1e-9 * np.ptp(runs[1][name]))


def test_one_shaft_is_the_connecting_shaft():
    line = SIX.drive_line
    chain = with_line([], [(("flywheel", "dynamometer"), line.stiffness, line.damping)])
    runs = [simulate(engine, rigid_crank(engine), LOCKED, SPEED, 2).outputs for engine in (SIX, chain)]
    for name in ("pulley.torsion", "shaft.torque", "crank.angle"):
        assert np.array_equal(runs[0][name], runs[1][name])


def test_a_light_stiff_disc_is_no_disc_and_a_run_starts_settled():
    """A disc that weighs nothing halves the shaft: the motion is that of the connecting shaft, from the start."""
    k, c = SIX.drive_line.stiffness, SIX.drive_line.damping
    shafts = [(("flywheel", "a"), 2.0 * k, 2.0 * c), (("a", "dynamometer"), 2.0 * k, 2.0 * c)]
    engines = SIX, with_line([("a", 1e-5)], shafts)
    ours, theirs = (
        simulate(engine, rigid_crank(engine), LOCKED, SPEED, 1).outputs["pulley.torsion"] for engine in engines
    )
    assert np.abs(ours - theirs).max() < 1e-4 * np.ptp(theirs)
    gas = GasTrace.from_engine(SIX)
    ours, theirs = (
        np.array(steady_orders(engine, rigid_crank(engine), LOCKED, SPEED, gas))[:, 1] for engine in engines
    )
    assert ours == pytest.approx(theirs, rel=1e-4, abs=1e-6 * theirs.max())


def test_a_free_dynamometer_behind_gears_slows_all_that_turns():
    """J dΩ/dt = −g T: line and dynamometer count with the squares of their speeds."""
    ratio, load, cycles = 2.0, 40.0, 10
    shafts = [(("flywheel", "a"), 4e4, 60.0), (("a", "b"), 0.0, 0.0, 0.0, ratio), (("b", "dynamometer"), 8e3, 12.0)]
    engine = with_line([("a", 0.4), ("b", 0.3)], shafts)
    free = Settings(crank="rigid", bearings="held", boundary="torque", gas_load=0.0)
    speeds = []
    for torque in (0.0, load):
        run = simulate(engine, rigid_crank(engine), free, SPEED, cycles, load_torque=torque)
        n, values = run.per_cycle, run.outputs["crank.speed"]
        speeds.append([values[k * n : (k + 1) * n].mean() for k in range(cycles)])
    lost = np.polyfit(4 * math.pi / SPEED * np.arange(2, cycles), (np.array(speeds[0]) - speeds[1])[2:], 1)[0]
    cylinders = SIX.cylinders
    rods = 6 * (SIX.rod.big_end_mass + 0.5 * (SIX.rod.small_end_mass + cylinders.piston_mass)) * SIX.crankshaft.throw**2
    inertia = CRANK + rods + 0.4 + (0.3 + SIX.drive_line.dynamometer_inertia) * ratio**2
    assert lost == pytest.approx(ratio * load / inertia, rel=1e-2)


def test_a_table_is_the_same_as_toml_csv_and_engine_file(tmp_path):
    (tmp_path / "line.toml").write_text(text_of("drive-line"))
    (tmp_path / "line.csv").write_text(text_of("drive-line-csv"))
    line = read_drive_line(tmp_path / "line.toml")
    assert read_drive_line(tmp_path / "line.csv") == line
    assert DriveLineChain.of(line.chain) == line
    engine = replace(SIX, drive_line_chain=line)
    assert engine_from_dict(engine_to_dict(engine)) == engine
    (tmp_path / "six.toml").write_text(engine.to_toml(), "utf-8")
    assert load_engine(tmp_path / "six.toml").drive_line_chain == line
