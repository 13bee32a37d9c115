"""Modes of crank and drive line: closed forms of two and three masses, a published chain, names by energy, far ends.

Two masses on a shaft: ω² = k (J₁ + J₂)/(J₁ J₂). Three masses: ω⁴ − ω² (k₁/J₁ + (k₁ + k₂)/J₂ + k₂/J₃)
+ k₁ k₂ (J₁ + J₂ + J₃)/(J₁ J₂ J₃) = 0 (W. Ker Wilson, Practical Solution of Torsional Vibration Problems, vol. 1).
"""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from cranktrain.cli.main import main
from cranktrain.engine.drive_line_chain import DriveLineChain, read_drive_line
from cranktrain.engine.file import load_engine
from cranktrain.engine.torsional_chain import Chain, Disc, Shaft
from cranktrain.loads.torsional_line import torsional_line
from cranktrain.structure.crank.level import crank_body
from cranktrain.structure.crank.modal import cranktrain_matrices, cranktrain_modes
from cranktrain.studies.campbell import campbell
from cranktrain.studies.torsion.line_modes import LINE, line_modes, line_report, line_table, with_line

SIX = load_engine("diesel_i6")
DATA = {case["id"]: case for case in json.loads((Path(__file__).parents[1] / "data" / "torsion.json").read_text())}


def behind(discs, shafts, engine=SIX):
    line = DriveLineChain.of(Chain(tuple(Disc(*row) for row in discs), tuple(Shaft(*row) for row in shafts)))
    return replace(engine, drive_line_chain=line)


def on_one_disc(engine, inertia):
    """ω (rad/s) and rotations of a crank that is one disc, with its drive line."""
    line = torsional_line(engine)
    stiffness, mass, _ = with_line(np.zeros((1, 1)), np.array([[inertia]]), np.ones(1), line)
    squares, shapes = eigh(stiffness, mass)
    return np.sqrt(np.maximum(squares, 0.0)), shapes


def test_two_and_three_masses_that_end_freely():
    j1, j2, j3, k1, k2 = 5.0, 2.0, 8.0, 3e4, 5e4
    two, _ = on_one_disc(behind([("a", j2)], [(("flywheel", "a"), k1)]), j1)
    assert two == pytest.approx([0.0, math.sqrt(k1 * (j1 + j2) / (j1 * j2))], rel=1e-12, abs=1e-5)
    three, _ = on_one_disc(behind([("a", j2), ("b", j3)], [(("flywheel", "a"), k1), (("a", "b"), k2)]), j1)
    squares = np.roots([1.0, -(k1 / j1 + (k1 + k2) / j2 + k2 / j3), k1 * k2 * (j1 + j2 + j3) / (j1 * j2 * j3)])
    assert three == pytest.approx([0.0, *np.sqrt(np.sort(squares))], rel=1e-12, abs=1e-5)


def test_a_published_chain_that_ends_freely():
    """Malychevitch (1939): six discs and a flywheel, the first disc in place of the crank."""
    case = DATA["malychevitch_1939_six_cyl"]
    inertias, stiffnesses = case["inputs"]["I_lb_in_s2"], case["inputs"]["k_lb_in_per_rad"]
    names = ["flywheel", *(f"d{k}" for k in range(1, len(inertias)))]
    shafts = [((names[k], names[k + 1]), k_) for k, k_ in enumerate(stiffnesses)]
    omega, shapes = on_one_disc(behind(list(zip(names[1:], inertias[1:], strict=True)), shafts), inertias[0])
    expected = case["expected"]
    assert 30.0 / math.pi * omega[1:3] == pytest.approx(
        [expected["recomputed_f1_cpm"], expected["recomputed_f2_cpm"]], rel=1e-3
    )
    for k in (1, 2):
        assert shapes[:, k] / shapes[0, k] == pytest.approx(expected[f"recomputed_mode{k}"], abs=2e-3)


@pytest.fixture(scope="module")
def crank():
    return crank_body(SIX, "torsional")


def test_a_soft_line_leaves_the_crank_its_modes_and_has_its_own(crank):
    """A crank behind a coupling a hundred times softer is one disc to its line; its own modes hardly move."""
    j, k = 1.5, 3e3
    free = behind([("generator", j)], [(("flywheel", "generator"), k)])
    modes = line_modes(free, crank)
    _, mass = cranktrain_matrices(SIX, crank)
    rigid = np.zeros(crank.n_modes)
    rigid[5] = 1.0 / crank.shapes[crank.index("flywheel"), 5, 5]
    inertia = float(rigid @ mass @ rigid)
    assert modes.names[0] == "drive line, 1-node"
    assert 2.0 * math.pi * modes.hz[0] == pytest.approx(math.sqrt(k * (inertia + j) / (inertia * j)), rel=1e-3)
    assert modes.strain[0] > 0.99
    own = [hz for hz, name in zip(modes.hz, modes.names, strict=True) if name == "torsional"]
    hz, shares, _ = cranktrain_modes(SIX, crank)
    assert own[0] == pytest.approx(hz[np.argmax(shares, axis=1) == 1][0], rel=2e-3)
    # Kinetic energies add up to the mode's.
    assert modes.shares.sum(axis=1) == pytest.approx(np.ones(modes.hz.size))
    # Held at its far end by the same shaft the whole turns against the dynamometer too, without a node.
    held = behind([("generator", j)], [(("flywheel", "generator"), k), (("generator", "dynamometer"), 1e2)])
    assert line_modes(held, crank).names[:2] == ("drive line, 0-node", "drive line, 1-node")
    # A flywheel bolted on by a shaft stiffer than the crank holds little strain: the mode is the crank's.
    stiff = line_modes(behind([("wheel", 0.5)], [(("flywheel", "wheel"), 5e7)]), crank)
    assert stiff.names[0] == "torsional" and stiff.strain[0] < 0.1


def test_report_and_campbell_name_the_same_modes(crank):
    engine = behind(
        [("primary", 0.2), ("vehicle", 5.0)],
        [(("flywheel", "primary"), 2e4, 8.0), (("primary", "vehicle"), 4e3), (("vehicle", "dynamometer"), 10.0)],
    )
    report = line_report(engine, crank)
    listed = [mode for mode in report["modes"] if mode["shape"].startswith(LINE)]
    assert [mode["shape"] for mode in listed] == [f"{LINE}, {k}-node" for k in range(3)]
    first = listed[1]
    assert first["critical_rpm"]["3"] == pytest.approx(20.0 * first["hz"])
    assert f"{first['hz']:.2f}" in [row[0] for row in line_table(report).rows]
    found = campbell(engine, crank, np.array([1000.0, 1500.0]) * math.pi / 30.0)
    for mode in listed[1:]:
        at = found.names.index(mode["shape"])
        # The Campbell diagram has rods whose mean inertia differs a little from half of the oscillating mass.
        assert found.hz[0, at] == pytest.approx(mode["hz"], rel=5e-3)


def test_tables_over_torque_are_read_for_their_linear_part(tmp_path, capsys):
    path = tmp_path / "line.csv"
    path.write_text(
        "disc,inertia,to,stiffness,torques,shaft_damping\nflywheel,,,2e4/3e4/6e4,500/1500,8\ndriven,2,dynamometer,5e4,,1\n"
    )
    line = read_drive_line(path)
    shaft = line.chain.shafts[0]
    assert shaft.stiffness == 2e4 and shaft.torques == (500.0, 500.0, 1500.0, 1500.0)
    assert DriveLineChain.of(line.chain) == line and main(["modal", str(path)]) == 2
    assert f"cranktrain modal ENGINE --drive-line {path}" in capsys.readouterr().err
    path.write_text(path.read_text().replace("500/1500", ""))
    with pytest.warns(UserWarning, match="without the torques at which they hold; the first, 20000 N m/rad"):
        assert read_drive_line(path).chain.shafts[0].stiffness == 2e4
