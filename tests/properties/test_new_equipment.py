"""Journals, pressures, dampers, flywheels, mounts and limits that ``new`` writes, by formulas of their own."""

from __future__ import annotations

import itertools
import math
import warnings

import numpy as np
import pytest
from scipy.linalg import eigh

import cranktrain as ct
from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.loads.damper import damper_parameters, equivalent_damping
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.block.mesh import block_mesh
from cranktrain.structure.block.shape import block_plan
from cranktrain.structure.crank.level import bare_crank
from cranktrain.structure.crank.sections import crank_moments
from cranktrain.structure.crank.torsional import discs
from cranktrain.studies.design.layouts import LAYOUTS, layout
from cranktrain.studies.design.mounted_block import mounted_mass
from cranktrain.studies.design.options import BARE, Equipment
from cranktrain.studies.design.rules import document
from cranktrain.studies.design.sizes import PUBLISHED, is_short, sizes, today
from cranktrain.studies.torsion.damper_optimum import crank_optimum

RPM = math.pi / 30.0
ENGINES = {
    "single": (0.096, 0.0621, "petrol"), "i3": (0.0719, 0.082, "petrol"), "i4": (0.0825, 0.0928, "petrol"),
    "i6": (0.105, 0.120, "diesel"), "v6": (0.090, 0.084, "petrol"), "v8": (0.100, 0.090, "petrol"),
    "v12": (0.089, 0.080, "petrol"),
}  # fmt: skip
"""Bore and stroke, m, and fuel."""
RODS = {"v12": 0.154}
"""Rod, m, of an engine whose banks stand too close for a block around the usual one."""


def made(tmp_path, name, equipment=BARE, rod=None):
    """An engine as its file is read back, without a warning, and its sizes."""
    bore, stroke, fuel = ENGINES[name]
    found = sizes(layout(name), bore, stroke, fuel, rod=rod)
    path = tmp_path / f"{name}.toml"
    path.write_text(document(name, found, equipment).text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return load_engine(path), found


def test_journals_are_those_of_published_engines():
    """Each published engine within 15 %, the mean of its class within 3 %; a four of 86 mm as they are built today."""
    classes = {}
    for one in PUBLISHED:
        row = next(x for x in LAYOUTS.values() if (x.form, x.cylinders) == (one.form, one.cylinders))
        of = today(row, one.fuel)
        assert one.main / one.bore == pytest.approx(of.main, rel=0.15), one
        assert one.pin / one.bore == pytest.approx(of.pin, rel=0.15), one
        classes.setdefault(of, []).append((one.main / one.bore, one.pin / one.bore))
    for of, rows in classes.items():
        assert np.mean(rows, axis=0) == pytest.approx([of.main, of.pin], rel=0.03)
    four = sizes(layout("i4"), 0.086, 0.086)
    assert 54e-3 <= four.main_diameter <= 58e-3 and 47e-3 <= four.pin_diameter <= 52e-3
    assert is_short("boxer", 4) and not is_short("V", 2) and not is_short("in line", 5)


@pytest.mark.parametrize("name", ENGINES)
def test_full_load_pressure_is_that_of_its_fuel(name, tmp_path):
    """Petrol without charging: 65 to 75 bar at 11.5 bar mean pressure, 10 to 16 deg after dead centre."""
    engine, _ = made(tmp_path, name)
    trace = GasTrace.from_engine(engine)
    angle = math.degrees(trace.peak_angle)
    if ENGINES[name][2] == "petrol":
        assert trace.imep == pytest.approx(11.5e5, abs=0.1e5)
        assert 65e5 <= trace.peak <= 75e5 and 10.0 <= angle <= 16.0
    else:
        assert 100e5 <= trace.peak <= 160e5 and 5.0 <= angle <= 16.0
    assert engine.limits is not None and trace.peak < engine.limits.peak_pressure < 1.2 * trace.peak


def test_the_limit_of_twist_is_that_of_the_shear_stress(tmp_path):
    """A shaft of the pins' diameter that twists so as a quarter of a sine has 50 MPa where it is steepest."""
    engine, _ = made(tmp_path, "i6")
    crank = engine.crankshaft
    z = np.linspace(0.0, crank.main_positions[-1] - crank.main_positions[0], 2001)
    twist = engine.limits.twist * np.sin(0.5 * math.pi * z / z[-1])
    shear = engine.material.youngs_modulus / 2.6
    assert 0.5 * crank.pin_diameter * shear * np.gradient(twist, z).max() == pytest.approx(50e6, rel=0.02)
    assert engine.bearing_limits.main_film == pytest.approx(3.0 * engine.main_bearing.roughness)


def peaks(engine, damper):
    """Largest amplitude, deg, of orders above those that the engine turns unevenly by, over its speeds."""
    low, high = (speed / RPM for speed in engine.speeds)
    levels = {"crank": "torsional", "method": "linear", "inherit": False}
    found = ct.runup(engine, from_rpm=low, to_rpm=high, step_rpm=(high - low) / 60.0, damper=damper, **levels)
    return {n: found["pulley.torsion", n].to("deg").max() for n in (4, 4.5, 6, 8, 9)}


@pytest.mark.parametrize("name", ["i4", "i6", "v12"])
@pytest.mark.parametrize("kind", ["rubber", "viscous"])
def test_a_damper_takes_most_of_the_torsion(name, kind, tmp_path):
    engine, _ = made(tmp_path, name, Equipment(damper=kind))
    without, fitted = peaks(engine, False), peaks(engine, True)
    worst = max(without, key=without.get)
    assert fitted[worst] < 0.35 * without[worst]


@pytest.mark.parametrize("name", ["single", "i4", "i6"])
def test_rubber_is_tuned_as_den_hartog_says(name, tmp_path):
    """Two masses, hub and ring without damping: the amplitudes at both fixed points are nearly the same, √(1 + 2/μ)."""
    engine, _ = made(tmp_path, name, Equipment(damper="rubber"))
    damper = engine.damper
    own = crank_optimum(engine, bare_crank(engine, "beam"))
    mu = damper.ring_inertia / own.inertia
    f = math.sqrt(damper.stiffness / damper.ring_inertia) / (2.0 * math.pi * own.hz)
    assert 0.2 <= mu <= 0.3
    # Where free and locked ring give the same amplitude (Den Hartog, 3.3): (2 + μ) x² − 2 (1 + f² + μ f²) x + 2 f² = 0.
    squares = np.roots([2.0 + mu, -2.0 * (1.0 + f**2 + mu * f**2), 2.0 * f**2])
    heights = 1.0 / np.abs(1.0 - (1.0 + mu) * squares)
    assert heights == pytest.approx(2 * [math.sqrt(1.0 + 2.0 / mu)], rel=0.12)


@pytest.mark.parametrize("name", ["i4", "i6"])
def test_oil_of_a_viscous_damper_gives_the_optimum(name, tmp_path):
    """That of a search on the crank's own modes; the ring is of steel."""
    engine, found = made(tmp_path, name, Equipment(damper="viscous"))
    damper = engine.damper
    own = crank_optimum(engine, bare_crank(engine, "beam"))
    rate = 2.0 * math.pi * own.hz * math.radians(0.1)
    warm = damper_parameters(damper, damper.temperatures[-1])
    assert equivalent_damping(warm, rate) == pytest.approx(own.damping, rel=0.1)
    steel = 0.5 * math.pi * 7850.0 * damper.ring_width * (damper.ring_outer_radius**4 - damper.ring_inner_radius**4)
    assert damper.ring_inertia == pytest.approx(steel, rel=2e-3)
    assert 50.0 < damper.viscosity < 1000.0
    assert damper.temperature_speeds == pytest.approx((found.lowest, found.rated), rel=1e-6)


@pytest.mark.parametrize("name", ENGINES)
def test_a_dual_mass_flywheel_swings_below_half_the_firing_frequency_at_idle(name, tmp_path):
    """Rigid crank, secondary mass and held end, with inertias counted anew; the springs carry full load in 70 deg."""
    engine, found = made(tmp_path, name, Equipment(dual_mass=True))
    whole, _ = made(tmp_path, name)
    line = engine.drive_line_chain
    crank = float(discs(engine).sum()) if engine.reduction.torsional_source != "solid" else None
    rod = engine.rod
    rods = engine.n_cylinders * engine.crankshaft.throw**2 * (
        rod.big_end_mass + 0.5 * (rod.small_end_mass + engine.cylinders.piston_mass))  # fmt: skip
    front = crank + rods + engine.pulley.polar_inertia + engine.flywheel.polar_inertia
    k, held = line.stiffnesses
    squares = eigh([[k, -k], [-k, k + held]], np.diag([front, line.inertias[0]]), eigvals_only=True)
    swing = math.sqrt(squares[-1]) / (2.0 * math.pi)
    firing = found.lowest / (2.0 * math.pi) * engine.n_cylinders / 2.0
    assert swing == pytest.approx(0.5 * firing, rel=0.05)
    inertias = engine.flywheel.polar_inertia + line.inertias[0]
    assert inertias == pytest.approx(whole.flywheel.polar_inertia, rel=1e-3)
    torque = GasTrace.from_engine(engine).imep * engine.displacement / (4.0 * math.pi)
    assert torque / k < math.radians(70.0)


def rigid_motions(engine):
    """Frequencies, Hz, of the engine as a rigid body on its mounts; the block's mass by its mesh."""
    block, plan = engine.block, block_plan(engine)
    mesh = block_mesh(plan)
    corners = mesh.p[:, mesh.t[:4]]
    volume = np.abs(np.linalg.det((corners[:, 1:] - corners[:, :1]).transpose(2, 0, 1))) / 6.0
    # Four points of a tetrahedron, exact for quadratic moments.
    near, far = (5.0 - math.sqrt(5.0)) / 20.0, (5.0 + 3.0 * math.sqrt(5.0)) / 20.0
    points = [np.einsum("dkn,k->nd", corners, np.where(np.arange(4) == k, far, near)) for k in range(4)]
    masses = 4 * [0.25 * block.density * volume]
    height, rod = block.deck_height + block.head_height, engine.rod
    crank = float(crank_moments(engine)[0, 0]) / len(plan.mains)
    lumps = [((0.0, 0.0, z), crank) for z in plan.mains]
    lumps += [((0.0, 0.0, plan.mains[-1]), engine.flywheel.mass), ((0.0, 0.0, plan.mains[0]), engine.pulley.mass)]
    for angle, z in zip(engine.cylinders.bank_angles, engine.cylinder_positions, strict=True):
        up = np.array([-math.sin(angle), math.cos(angle), 0.0])
        lumps += [(height * up + [0.0, 0.0, z], block.head_mass), ((0.0, 0.0, z), rod.big_end_mass)]
        lumps += [(rod.length * up + [0.0, 0.0, z], rod.small_end_mass + engine.cylinders.piston_mass)]
    points, masses = np.vstack([*points, *(np.array([place]) for place, _ in lumps)]), np.concatenate(
        [*masses, [mass for _, mass in lumps]])  # fmt: skip

    def moved(x, y, z):
        return np.array([[1, 0, 0, 0, z, -y], [0, 1, 0, -z, 0, x], [0, 0, 1, y, -x, 0]], dtype=float)

    mass = sum(m * moved(*x).T @ moved(*x) for x, m in zip(points, masses, strict=True))
    stiffness = np.zeros((6, 6))
    for place, k in zip(engine.mounts.positions, engine.mounts.stiffness, strict=True):
        motion = np.vstack((moved(*place), np.eye(6)[3:]))
        stiffness += motion.T @ (np.array(k)[:, None] * motion)
    return np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2.0 * math.pi)


@pytest.mark.parametrize(
    "name", ["i3", *(pytest.param(one, marks=pytest.mark.slow) for one in ("i4", "i6", "v6", "v8", "v12"))]
)
def test_the_engine_on_its_mounts_moves_at_5_to_15_hz(name, tmp_path):
    engine, _ = made(tmp_path, name, Equipment(mounts=True), RODS.get(name))
    hz = rigid_motions(engine)
    assert hz[0] >= 5.0 and hz[-1] <= 15.0


@pytest.mark.slow
def test_a_single_on_mounts_pitches_lower(tmp_path):
    """Its four mounts stand close together along the crank."""
    hz = rigid_motions(made(tmp_path, "single", Equipment(mounts=True))[0])
    assert 2.5 <= hz[0] < 5.0 <= hz[1] and hz[-1] <= 16.0


@pytest.mark.slow
def test_a_new_engine_runs_in_its_block(tmp_path):
    """Its mounts carry its weight on average: block, heads, crank, flywheel and pistons."""
    engine, found = made(tmp_path, "i3", Equipment("rubber", dual_mass=True, mounts=True))
    run = ct.simulate(engine, speed_rpm=found.best / RPM, crank="beam", block="flexible", damper=True, step_deg=0.5)
    carried = sum(run[f"mount[{k}].force.y"][-run.per_cycle :].mean() for k in range(1, 5))
    assert abs(carried) == pytest.approx(9.81 * mounted_mass(engine), rel=0.12)
    assert run.settling.cycles < 40


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (["--damper", "ruber"], "--damper 'ruber' does not exist; did you mean 'rubber'?"),
        (["--flywheel", "dual"], "--flywheel 'dual' does not exist"),
        (["--layout", "boxer4", "--mounts"], "--mounts: there is no parametric block for a boxer"),
        (["--layout", "v12", "--mounts"], "(--rod-mm)"),
    ],
)
def test_bad_choices_give_one_line(change, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    given = ["new", "x", "--layout", "i4", "--bore-mm", "89", "--stroke-mm", "80"]
    if change[0] == "--layout":
        given[3] = change[1]
        change = change[2:]
    assert main([*given, *change]) == 2
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_rod_that_a_refusal_names_fits(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    order = ["new", "x", "--layout", "v12", "--bore-mm", "89", "--stroke-mm", "80", "--mounts"]
    assert main(order) == 2
    length = capsys.readouterr().err.split("rod of ")[1].split(" mm")[0]
    assert main([*order, "--rod-mm", length]) == 0
    assert load_engine("x.toml").block is not None


@pytest.mark.parametrize("name", LAYOUTS)
def test_every_layout_takes_all_that_fits_it(name, tmp_path):
    """Written, read back without a warning; mounts where the layout has a block."""
    found = sizes(layout(name), 0.09, 0.09)
    for choice in itertools.product((None, "rubber"), (False, True)):
        path = tmp_path / f"{name}.toml"
        path.write_text(document(name, found, Equipment(*choice)).text, encoding="utf-8")
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            engine = load_engine(path)
        assert (engine.damper is not None, engine.drive_line_chain is not None) == (choice[0] is not None, choice[1])
        assert engine.piston_guidance is not None and engine.limits is not None and engine.bearing_limits is not None
