"""Rollers as springs: on an elastic ring, its limits, symmetry and convergence; and linear stand-ins for a run."""

import math
from dataclasses import replace

import numpy as np
import pytest
from one_line import one_line
from some import some
from started import at_speed

from cranktrain.core.errors import InputError
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.file import load_engine
from cranktrain.engine.parts import RollerBearings
from cranktrain.engine.roller_bearing import RollerBearing
from cranktrain.film.laws.roller_contacts import equilibrium, roller_slices, slice_stiffness
from cranktrain.structure.assembly import assemble
from cranktrain.structure.block import roller_ring as rings
from cranktrain.studies.roller_stand_ins import in_series, running_rollers, with_stand_ins
from cranktrain.studies.run_up.free_decay import torsional_mode

BEARING = RollerBearing(16, 20e-3, 14e-3, 100e-3, 30e-6, 0.00035)
RING = rings.ring_for(BEARING)
LOADED = equilibrium(BEARING, np.array([15e3, 0.0, 0.0, 0.0]))
SPRINGS = slice_stiffness(BEARING, LOADED.place)
ZETA = roller_slices(BEARING)[0]


def compliance(share=1.0, **changes):
    """Compliance of the ring on a mesh of ``share`` of its usual edge."""
    ring = replace(RING, mesh_size=share * RING.mesh_size, **changes)
    mesh = rings.ring_mesh(ring)
    model = rings.ring_model(ring, mesh)
    return rings.track_compliance(ring, model, model.basis.get_dofs(mesh.boundaries["clamped"]).flatten())


@pytest.fixture(scope="module")
def usual():
    return compliance()


def stiffness(of, springs=SPRINGS):
    return rings.elastic_ring_stiffness(of, ZETA, springs, 0.0)


def test_on_a_rigid_ring_springs_are_the_tangent_of_the_contacts():
    rigid = np.zeros((BEARING.rollers, rings.DEGREE + 1) * 2)
    assert stiffness(rigid) == pytest.approx(LOADED.stiffness, abs=1e-9 * LOADED.stiffness.max())


def test_compliance_is_symmetric_and_positive(usual):
    matrix = usual.reshape(2 * (BEARING.rollers * (rings.DEGREE + 1),))
    assert np.abs(matrix - matrix.T).max() <= 1e-12 * matrix.max()
    assert np.linalg.eigvalsh(matrix).min() > 0.0


def test_every_roller_finds_the_same_ring(usual):
    own = np.array([usual[j, :, j, :] for j in range(BEARING.rollers)])
    # As good as the mesh resolves them: the mean well, the cubic along the rollers not as well.
    assert np.ptp(own[:, 0, 0]) < 5e-3 * own[0, 0, 0]
    assert np.ptp(own, axis=0).max() < 0.05 * own.max()
    # Even and odd orders along the rollers do not mix.
    assert np.abs(usual[:, 0::2, :, 1::2]).max() < 5e-3 * usual.max()


def test_stiffness_is_symmetric_and_that_of_rollers_in_series_with_their_ring(usual):
    found = stiffness(usual)
    assert found == pytest.approx(found.T, rel=1e-12)
    # One roller alone, by the mean along it: contact and ring in series.
    lone = np.zeros_like(SPRINGS)
    lone[0] = SPRINGS[0].sum() * roller_slices(BEARING)[1]
    radial = rings.elastic_ring_stiffness(np.pad(usual[:, :1, :, :1], ((0, 0), (0, 1)) * 2), ZETA, lone, 0.0)
    assert 1.0 / radial[0, 0] == pytest.approx(1.0 / SPRINGS[0].sum() + usual[0, 0, 0, 0], rel=1e-9)


def test_stiffness_converges_with_the_mesh(usual):
    coarse, fine = (np.diag(stiffness(compliance(share)))[[0, 2]] for share in (1.5, 0.75))
    found = np.diag(stiffness(usual))[[0, 2]]
    assert found == pytest.approx(fine, rel=2e-3)
    assert (np.abs(coarse - fine) > np.abs(found - fine)).all()


def test_compliance_is_kept_for_these_inputs_only(monkeypatch, tmp_path, usual):
    calls, wider = [], replace(RING, width=1.1 * RING.width)
    monkeypatch.setenv("CRANKTRAIN_CACHE", str(tmp_path))
    monkeypatch.setattr(rings, "ring_mesh", lambda ring, whole=rings.ring_mesh: whole(replace(ring, mesh_size=0.03)))
    monkeypatch.setattr(rings, "track_compliance", lambda *_: calls.append(1) or usual)
    for ring, angle, anew, count in (
        (RING, 0.0, False, 1), (RING, 0.0, False, 1), (wider, 0.0, False, 2), (RING, 0.1, False, 3),
        (RING, 0.0, True, 4),
    ):  # fmt: skip
        assert np.array_equal(rings.ring_compliance(ring, angle, rebuild=anew), usual) and len(calls) == count


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [("width", 10e-3, "is less than the rollers' length"), ("ring_diameter", 0.1, "leaves no ring"),
     ("housing_diameter", 0.1, "leaves no housing"), ("mesh_size", 1e-4, "would take millions"),
     ("track_diameter", -0.1, "-100 mm is not within 0.01 to 10000 mm"), ("rollers", 2, "at least 3")],
)  # fmt: skip
def test_what_is_no_ring_is_refused(key, value, text):
    with one_line(f"{key}: {text}"):
        rings.check_ring(replace(RING, **{key: value}))


BEAM = Settings(crank="beam")
RPM = math.pi / 30.0


def short_engine(throws):
    """Two or four cylinders in line of the six's parts, on roller mains; a beam crank needs no finite elements."""
    six = load_engine("diesel_i6")
    mains = throws + 1
    angles, order = ((0.0, math.pi), (1, 2)) if throws == 2 else ((0.0, math.pi, math.pi, 0.0), (1, 3, 4, 2))
    crank = replace(six.crankshaft, throw_angles=angles, main_widths=six.crankshaft.main_widths[:1] * mains,
                    counterweights=(True,) * (2 * throws))  # fmt: skip
    cylinders = replace(
        six.cylinders, firing_order=order, pins=tuple(range(1, throws + 1)), bank_angles=(0.0,) * throws
    )
    one = {
        "rollers": 18, "roller_diameter": 14e-3, "roller_length": 20e-3, "pitch_diameter": crank.main_diameter + 14e-3,
        "clearance": 30e-6, "stiffness": 5e8, "tilt_stiffness": 2e4, "damping": 2e4, "tilt_damping": 2.0,
        "ring_mass": 1.0, "profile": 0.00035,
    }  # fmt: skip
    rollers = RollerBearings(**{key: (value,) * mains for key, value in one.items()})
    engine = replace(
        six, name=f"short_{throws}", crankshaft=crank, cylinders=cylinders, main_bearing=None, main_roller=rollers,
        thrust=replace(six.thrust, main=2), block=None, mounts=None, piston_guidance=None, bearing_limits=None,
    )  # fmt: skip
    check_engine(engine)
    return engine


def with_springs(engine, mains):
    """An engine on springs, N/mm and N m/rad of each main."""
    radial, tilting = zip(*((1e3 * one, other) for one, other in mains), strict=True)
    rollers = replace(engine.main_roller, law="linear", stiffness=radial, tilt_stiffness=tilting)
    return replace(engine, main_roller=rollers)


def torsion_hz(engine, rpm):
    """Torsional mode about the settled cycle."""
    made = assemble(engine, BEAM)
    simulation = at_speed(rpm * RPM, engine, made.body, made.settings, parts=made.parts)
    run_cycles(simulation, None, 1e-5, None, None)
    return torsional_mode(simulation).decay.imag / (2.0 * math.pi)


def test_the_rule_lies_between_harmonic_and_plain_mean():
    rng = np.random.default_rng(3)
    tangents = 1e9 * rng.uniform(0.1, 2.0, (400, 3))
    soft, middle, stiff = (in_series(tangents, np.full(3, own)) for own in (1.0, 5e8, 1e14))
    np.testing.assert_allclose(soft, 1.0 / np.mean(1.0 / tangents, axis=0), rtol=1e-6)
    np.testing.assert_allclose(stiff, tangents.mean(axis=0), rtol=1e-4)
    assert np.all(soft < middle) and np.all(middle < stiff)
    np.testing.assert_allclose(in_series(np.zeros((9, 1)), np.array([3e8])), 0.0, atol=1e-6)  # a free journal


@pytest.mark.parametrize(("throws", "within"), [(2, 0.015), (4, 0.007)])
def test_a_run_on_the_stand_ins_twists_as_one_on_the_rollers(throws, within):
    engine, rpm = short_engine(throws), 2000.0
    report = running_rollers(engine, rpm, BEAM)
    assert report["periodic"] and report["block"] == "ground" and report["law"] == "palmgren"
    mains = report["mains"]
    own = (entry["stand_in"] for entry in mains)
    found = with_springs(engine, [(one["stiffness_n_per_mm"], one["tilt_stiffness_nm_per_rad"]) for one in own])
    rollers = torsion_hz(engine, rpm)
    assert torsion_hz(found, rpm) == pytest.approx(rollers, rel=within)
    for entry in mains:
        tangent = entry["tangent_n_per_mm"]
        assert 0.0 < entry["stand_in"]["stiffness_n_per_mm"] < tangent["mean"] * (1.0 + 1e-9)
        # The isotropic part is the same in all axes.
        for axes in ("turning", "at_rest"):
            assert 0.5 * sum(tangent[axes].values()) == pytest.approx(tangent["mean"], rel=1e-9)
        assert tangent["across_load"] < tangent["along_load"]
    if throws == 4:
        # Plain means are too stiff a spring: they are farther off.
        names = "tangent_n_per_mm", "tilt_tangent_nm_per_rad"
        plain = with_springs(engine, [[entry[name]["mean"] for name in names] for entry in mains])
        assert torsion_hz(plain, rpm) > rollers * (1.0 + within)


def test_a_linear_law_is_run_with_palmgrens_contacts():
    engine = short_engine(2)
    linear = replace(engine, main_roller=replace(engine.main_roller, law="linear", stiffness=(1e8,) * 3))
    of_rollers, of_springs = (running_rollers(e, 1500.0, BEAM)["mains"] for e in (engine, linear))
    for one, other in some(zip(of_rollers, of_springs, strict=True)):
        assert one["stand_in"] == other["stand_in"]


def test_an_engine_file_is_written_with_them(tmp_path):
    mains = [
        {"main": i, "stand_in": {"stiffness_n_per_mm": 1e5 * i, "tilt_stiffness_nm_per_rad": 1e4 * i}}
        for i in range(1, 6)
    ]
    path = with_stand_ins("diesel_v8", tmp_path / "own.toml", {"rpm": 1800.0, "load": 1.0, "mains": mains})
    rollers = load_engine(path).main_roller
    assert rollers.stiffness == pytest.approx([1e8, 2e8, 3e8, 4e8, 5e8])
    assert rollers.tilt_stiffness == pytest.approx([1e4, 2e4, 3e4, 4e4, 5e4])
    assert "at 1800 rev/min and full load" in path.read_text(encoding="utf-8")
    with pytest.raises(InputError, match="not overwritten"):
        with_stand_ins("diesel_v8", path, {"rpm": 1800.0, "load": 1.0, "mains": mains})
