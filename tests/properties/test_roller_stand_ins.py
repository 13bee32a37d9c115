"""Linear stand-ins of roller mains: the rule between its limits; a run with them twists as the rollers do."""

import math
from dataclasses import replace

import numpy as np
import pytest
from some import some

from cranktrain.core.errors import InputError
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.file import load_engine
from cranktrain.engine.parts import RollerBearings
from cranktrain.structure.assembly import assemble
from cranktrain.studies.roller_stand_ins import in_series, running_rollers, with_stand_ins
from cranktrain.studies.run_up.free_decay import torsional_mode

BEAM = Settings(crank="beam")
RPM = math.pi / 30.0


def short_engine(throws):
    """Two or four cylinders in line of the six's parts, on roller mains; a beam crank needs no finite elements."""
    six = load_engine("diesel_i6")
    mains = throws + 1
    crank = replace(
        six.crankshaft,
        throw_angles=(0.0, math.pi) if throws == 2 else (0.0, math.pi, math.pi, 0.0),
        main_widths=six.crankshaft.main_widths[:1] * mains,
        counterweights=(True,) * (2 * throws),
    )
    cylinders = replace(
        six.cylinders,
        firing_order=(1, 2) if throws == 2 else (1, 3, 4, 2),
        pins=tuple(range(1, throws + 1)),
        bank_angles=(0.0,) * throws,
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


def with_springs(engine, radial, tilting):
    rollers = replace(engine.main_roller, law="linear", stiffness=tuple(radial), tilt_stiffness=tuple(tilting))
    return replace(engine, main_roller=rollers)


def torsion_hz(engine, rpm):
    """Torsional mode about the settled cycle."""
    made = assemble(engine, BEAM)
    simulation = Simulation(engine, made.body, made.settings, parts=made.parts)
    simulation.inputs[0] = rpm * RPM
    simulation.initialize()
    run_cycles(simulation, None, 1e-5, None, None)
    return torsional_mode(simulation).decay.imag / (2.0 * math.pi)


def test_the_rule_lies_between_harmonic_and_plain_mean():
    rng = np.random.default_rng(3)
    tangents = 1e9 * rng.uniform(0.1, 2.0, (400, 3))
    soft, middle, stiff = (in_series(tangents, np.full(3, own)) for own in (1.0, 5e8, 1e14))
    np.testing.assert_allclose(soft, 1.0 / np.mean(1.0 / tangents, axis=0), rtol=1e-6)
    np.testing.assert_allclose(stiff, tangents.mean(axis=0), rtol=1e-4)
    assert np.all(soft < middle) and np.all(middle < stiff)


def test_a_constant_tangent_is_its_own_stand_in_and_a_free_journal_has_none():
    own = np.array([3e8])
    np.testing.assert_allclose(in_series(np.full((9, 1), 7e8), own), 7e8, rtol=1e-12)
    np.testing.assert_allclose(in_series(np.zeros((9, 1)), own), 0.0, atol=1e-6)


@pytest.mark.parametrize(("throws", "within"), [(2, 0.015), (4, 0.007)])
def test_a_run_on_the_stand_ins_twists_as_one_on_the_rollers(throws, within):
    engine, rpm = short_engine(throws), 2000.0
    report = running_rollers(engine, rpm, BEAM)
    assert report["periodic"] and report["block"] == "ground" and report["law"] == "palmgren"
    mains = report["mains"]
    found = with_springs(
        engine,
        [1e3 * entry["stand_in"]["stiffness_n_per_mm"] for entry in mains],
        [entry["stand_in"]["tilt_stiffness_nm_per_rad"] for entry in mains],
    )
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
        plain = with_springs(
            engine,
            [1e3 * entry["tangent_n_per_mm"]["mean"] for entry in mains],
            [entry["tilt_tangent_nm_per_rad"]["mean"] for entry in mains],
        )
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


def test_plain_mains_have_none():
    with pytest.raises(InputError, match=r"'diesel_i6' has no \[main_roller\]"):
        running_rollers(load_engine("diesel_i6"), 2000.0)
