"""Torsional systems from a table: a published engine, closed forms of geared, branched and damped systems, refusals.

Source of the engine: Malychevitch (1939), a six-cylinder crankshaft with its flywheel (tests/data/torsion.json).
Geared and branched systems: W. Ker Wilson, Practical Solution of Torsional Vibration Problems, vol. 1 (1956), and the
closed forms that follow from Lagrange's equations.
"""

import json
import math
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from expected import cases
from one_line import one_line
from refusals import text_of

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.engine.torsional_chain import Chain, Disc, Shaft
from cranktrain.structure.crank.chain import chain_body, chain_matrices, chain_modes
from cranktrain.structure.crank.torsional import shaft_modes, shaft_nodes, shaft_stiffnesses

DATA = cases("torsion")


def row(inertias, stiffnesses):
    """Discs on one shaft."""
    discs = tuple(Disc(f"d{k}", inertia) for k, inertia in enumerate(inertias))
    return Chain(discs, tuple(Shaft((f"d{k}", f"d{k + 1}"), value) for k, value in enumerate(stiffnesses)))


def test_published_engine_of_six_cylinders():
    """Malychevitch 1939, as one shaft and as a table: frequencies within 0.1 %, mode shapes within 0.002."""
    given, expected = (DATA["malychevitch_1939_six_cyl"][key] for key in ("inputs", "expected"))
    inertia, stiffness = np.array(given["I_lb_in_s2"]), np.array(given["k_lb_in_per_rad"])
    modes = chain_modes(row(inertia, stiffness))
    assert modes.omega[0] == 0.0
    for omega, shapes in (shaft_modes(stiffness, inertia), (modes.omega[1:], modes.shapes[:, 1:])):
        per_minute = omega * 30.0 / math.pi
        assert per_minute[1] == pytest.approx(expected["published_f2_cpm"], rel=1e-3)
        assert per_minute[:2] == pytest.approx([expected[f"recomputed_f{k}_cpm"] for k in (1, 2)], rel=1e-3)
        for k in (1, 2):
            assert shapes[:, k - 1] / shapes[0, k - 1] == pytest.approx(expected[f"recomputed_mode{k}"], abs=2e-3)


@pytest.mark.parametrize("ratio", [2.5, -3.0])
def test_a_gear_is_the_shaft_behind_it_times_its_ratio_squared(ratio):
    """Two discs, a rigid pair of gears, two discs: as one shaft with J n² and k n² behind the gears."""
    discs = tuple(Disc(name, j) for name, j in (("a", 1.0), ("g1", 0.2), ("g2", 0.1), ("b", 0.7)))
    shafts = (Shaft(("a", "g1"), 900.0), Shaft(("g1", "g2"), ratio=ratio), Shaft(("g2", "b"), 400.0))
    geared = chain_modes(Chain(discs, shafts))
    n2 = ratio**2
    alike = chain_modes(row([1.0, 0.2 + 0.1 * n2, 0.7 * n2], [900.0, 400.0 * n2]))
    assert geared.omega == pytest.approx(alike.omega, rel=1e-10, abs=1e-6)
    assert geared.shapes[2] == pytest.approx(ratio * geared.shapes[1], rel=1e-12)
    # A mesh that is very stiff, but not rigid, is the same.
    stiff = chain_modes(Chain(discs, (shafts[0], Shaft(("g1", "g2"), 1e9, ratio=ratio), shafts[2])))
    assert stiff.omega[:3] == pytest.approx(geared.omega, rel=1e-5, abs=1e-4)


def test_branches_and_dampers_are_the_textbook_s():
    """Hub with three equal branches: two modes at √(k/j), the hub still, one at √(k/j (1 + 3 j/J)).

    One disc on ground: ω = √(k/J), ζ = c/(2√(kJ)) of both dampers, and half the loss factor."""
    hub, j, k = 2.0, 0.5, 300.0
    discs = (Disc("hub", hub), *(Disc(name, j) for name in "abc"))
    modes = chain_modes(Chain(discs, tuple(Shaft(("hub", name), k) for name in "abc")))
    expected = [0.0, math.sqrt(k / j), math.sqrt(k / j), math.sqrt(k / j * (1.0 + 3.0 * j / hub))]
    assert modes.omega == pytest.approx(expected, rel=1e-10)
    assert np.abs(modes.shapes[0, 1:3]).max() < 1e-9
    spring = Shaft(("d", "ground"), 400.0, damping=0.3, loss_factor=0.04)
    modes = chain_modes(Chain((Disc("d", 4.0, damping=0.5),), (spring,)))
    assert modes.omega == pytest.approx([10.0])
    assert modes.damping / (2.0 * modes.omega) == pytest.approx([0.8 / (2.0 * math.sqrt(1600.0)) + 0.02])


@pytest.mark.parametrize("at", range(5))
def test_viscous_absorber_at_its_optimum(at):
    """Houdaille: the hub's response where the undamped curves cross is 1 + 2/μ, whatever the damper."""
    mu, zeta, _, amplitude, _, shift, _ = DATA["houdaille_optimum"]["expected"]["rows"][at]
    hub, spring = 2.0, 800.0
    natural = math.sqrt(spring / hub)
    chain = Chain(
        (Disc("hub", hub), Disc("ring", mu * hub)),
        (Shaft(("hub", "ground"), spring), Shaft(("hub", "ring"), 1e-9, damping=2.0 * zeta * hub * natural)),
    )
    m = chain_matrices(chain)
    omega = shift * natural
    answer = np.linalg.solve(m.stiffness + 1j * omega * m.damping - omega**2 * m.mass, [spring, 0.0])
    assert abs(answer[0]) == pytest.approx(amplitude, rel=1e-6)


def test_a_crank_from_a_table_is_the_crank_of_its_discs():
    engine = load_engine("diesel_i6")
    names, stiffness = shaft_nodes(engine), shaft_stiffnesses(engine, "ker-wilson")
    inertia = np.linspace(0.02, 0.06, len(names))
    shafts = [Shaft(pair, k) for pair, k in zip(pairwise(names), stiffness, strict=True)]
    chain = Chain(tuple(Disc(name, j) for name, j in zip(names, inertia, strict=True)), tuple(shafts))
    body = chain_body(engine, chain)
    omega, _ = shaft_modes(stiffness, inertia)
    assert body.omega[6:] == pytest.approx(omega, rel=1e-9)
    assert body.inertia[2, 2] == pytest.approx(inertia.sum())
    assert body.damping.size == 0
    # Rotation as a whole and twists are orthonormal in the table's discs.
    turns = np.array([body.shapes[body.index(name), 5, 5:] for name in names])
    assert turns.T @ (inertia[:, None] * turns) == pytest.approx(np.eye(len(names)), abs=1e-9)
    damped = Chain(chain.discs, tuple(Shaft(s.between, s.stiffness, loss_factor=0.02) for s in shafts))
    body = chain_body(engine, damped)
    stiffness, _, loss = body.shaft_laws.T
    ratios = (loss * stiffness) @ body.twists[:, 6:] ** 2 / (2.0 * body.omega[6:] ** 2)
    assert ratios == pytest.approx(np.full(len(names) - 1, 0.01))
    with one_line("has no disc 'main[7]'"):
        chain_body(engine, Chain(tuple(d for d in chain.discs if d.name != "main[7]"), ()))
    with one_line("leave out ground"):
        chain_body(engine, Chain(chain.discs, (*chain.shafts, Shaft(("flywheel", "ground"), 1e5))))


GOOD = text_of("chain")


def test_the_verb_prints_frequencies_and_shapes(tmp_path, capsys):
    path = tmp_path / "chain.toml"
    path.write_text(GOOD)
    assert main(["modal", str(path), "--json"]) == 0
    modes = json.loads(capsys.readouterr().out)["modes"]
    assert modes[1]["hz"] == pytest.approx(30.0 / (2.0 * math.pi))
    assert modes[1]["rotations"] == pytest.approx({"a": 1.0, "b": -0.5})
    assert main(["modal", str(path)]) == 0
    assert "4.775" in capsys.readouterr().out


def test_a_reader_that_has_seen_enough_ends_the_verb_quietly(tmp_path):
    """As ``cranktrain modal FILE --json | head`` does: the pipe closes before all is written."""
    path = tmp_path / "chain.toml"
    discs = "".join(f'[[disc]]\nname = "d{k}"\ninertia = 1\n' for k in range(60))
    shafts = "".join(f'[[shaft]]\nbetween = ["d{k}", "d{k + 1}"]\nstiffness = 9\n' for k in range(59))
    path.write_text(discs + shafts)
    command = [sys.executable, "-m", "cranktrain.cli.main", "modal", str(path), "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout.readline() == b"{\n"
    process.stdout.close()
    assert process.stderr.read() == b""
    assert process.wait() == 0
