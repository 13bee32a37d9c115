"""Names of modes: the first and second torsional and the first axial one, of engines unlike the shipped ones."""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from started import at_speed

from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.dynamics.simulation import Simulation, simulate
from cranktrain.engine.file import load_engine
from cranktrain.fmu.geometry import start_values
from cranktrain.structure.assembly import assemble
from cranktrain.structure.crank import modal
from cranktrain.structure.crank.beam import beam_body
from cranktrain.structure.crank.critical_speeds import REACH, critical_speeds
from cranktrain.structure.crank.level import bare_crank, crank_body
from cranktrain.structure.crank.modal import KINDS, cranktrain_modes, named_mode, torsional_frequencies
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft
from cranktrain.structure.in_motion.eigenproblem import modes_in_motion
from cranktrain.structure.in_motion.inherited_damping import measured_decay, settings_above
from cranktrain.studies.design.layouts import layout
from cranktrain.studies.design.rules import first_design
from cranktrain.studies.design.sizes import HANDBOOK, sizes
from cranktrain.studies.report.findings import QUICK_STEPS, STEPS, speed_range

DATA = Path(__file__).parents[1] / "data" / "engines"
OWN = ("gas_i4", "i3", "single", "moto_i4", "vtwin")
pytestmark = pytest.mark.filterwarnings("ignore:.*fires at uneven intervals")


@cache
def engine_of(name):
    """An engine of the test data, or a shipped one."""
    path = DATA / f"{name}.toml"
    return load_engine(path if path.exists() else name)


@cache
def beam(name):
    """Modes at rest of the beam crank of an engine: Hz, fractions and answers."""
    engine = engine_of(name)
    return cranktrain_modes(engine, crank_body(engine, "beam"))


def shares_of(torsion):
    """Shares (k, 3) of modes with these fractions of torsion, the rest bending."""
    found = np.zeros((len(torsion), 3))
    found[:, KINDS.index("torsional")] = torsion
    found[:, KINDS.index("bending")] = 1.0 - found[:, KINDS.index("torsional")]
    return found


@pytest.mark.parametrize("name", OWN)
def test_a_crank_that_bends_has_the_torsional_modes_of_one_that_does_not(name):
    """Bending lowers or raises them by less than the distance to the next: 14 % at most on these short cranks."""
    engine = engine_of(name)
    engine = replace(engine, reduction=replace(engine.reduction, torsional_source="ker-wilson"))
    found = torsional_frequencies(*beam(name), 3000.0)
    stiffness, mass = (matrix[5:, 5:] for matrix in modal.cranktrain_matrices(engine, crank_body(engine, "torsional")))
    twists = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[1:3]) / (2.0 * math.pi)
    assert found == pytest.approx(twists, rel=0.14)


@pytest.mark.parametrize(
    ("name", "number", "hz"),
    [("gas_i4", 1, 499.2), ("gas_i4", 2, 1171.3), ("i3", 2, 1324.1), ("single", 1, 989.1), ("moto_i4", 1, 1264.8)],
)
def test_the_mode_with_most_torsion_has_the_name_whatever_its_frequency(name, number, hz):
    """Frequencies of the beam crank; 873 Hz of the four and 675 Hz of the three bend by more than 90 and 60 %."""
    found, shares, _ = beam(name)
    named = named_mode(found, shares, "torsional", number)
    assert found[named] == pytest.approx(hz, rel=2e-3)
    assert shares[named, KINDS.index("torsional")] > 0.4


@pytest.mark.parametrize(
    ("name", "fuel", "bore", "stroke"), [("v6_60", "petrol", 0.083, 0.092), ("v6_90", "diesel", 0.083, 0.092)]
)
def test_beams_of_split_pins_call_the_mode_torsional_that_the_solid_does(name, fuel, bore, stroke):
    """Bending shares the torsion of two modes about evenly, free in the first engine and at rest in the second."""
    made = first_design(name, sizes(layout(name), bore, stroke, fuel, practice=HANDBOOK)).engine
    made = replace(made, crankshaft=replace(made.crankshaft, mesh_size=0.3 * bore))
    cranks = [complete_crankshaft(made, bare) for bare in (beam_body(made), reduced_crankshaft(made))]
    nearly = 0
    for modes in (modal.free_modes, cranktrain_modes):
        (hz, shares, answers), solid = (modes(made, crank) for crank in cranks)
        first = torsional_frequencies(hz, shares, answers)[0]
        assert first == pytest.approx(torsional_frequencies(*solid)[0], rel=0.02)
        nearly += first != torsional_frequencies(hz, shares)[0]
    assert nearly == 1  # where fractions of energy alone choose another mode


def test_a_mode_without_a_quarter_of_its_energy_has_no_name():
    hz = np.arange(1.0, 8.0)
    split = shares_of([0.2, 0.2, 0.2, 0.2, 0.2, 0.9, 0.1])
    assert torsional_frequencies(hz, split) == [None, 6.0]
    with pytest.raises(InputError, match="no mode up to 7 Hz is a torsional one, with 25 % of its kinetic energy"):
        modal.first_torsional(hz, split)
    whole = shares_of([0.0, 0.6, 0.4, 0.0, modal.LEAST_SHARE, 0.3, 0.25])
    assert torsional_frequencies(hz, whole) == [2.0, 6.0]
    assert torsional_frequencies(hz, whole, highest=5.5) == [2.0, 5.0]
    assert torsional_frequencies(hz, whole, highest=3.5) == [2.0, None]
    assert named_mode(hz, whole, "axial") is None


def test_a_report_says_where_no_mode_has_a_name_and_lists_those_that_have_one():
    engine = engine_of("single")
    report = modal.modal_report(engine, bare_crank(engine, "beam"))
    assert report["sought_to_hz"] == engine.reduction.running_cutoff_hz
    assert report["cranktrain"]["second_torsional_hz"] == report["cranktrain"]["modes"][-1]["hz"] > modal.LISTED_HZ
    low = replace(engine, reduction=replace(engine.reduction, running_cutoff_hz=700.0))
    report = modal.modal_report(low, bare_crank(low, "beam"))
    named = {key: report["cranktrain"][key] for key in ("first_torsional_hz", "second_torsional_hz", "first_axial_hz")}
    assert set(named.values()) == {None} and report["cranktrain"]["modes"][-1]["hz"] < modal.LISTED_HZ
    assert critical_speeds(low, complete_crankshaft(low, bare_crank(low, "beam"))) == []


def test_critical_speeds_without_published_orders_lie_within_reach_of_the_engine_s_speeds():
    engine = engine_of("moto_i4")
    assert engine.published.critical_orders == () and engine.published.second_torsional_hz == 0.0
    crankshaft = complete_crankshaft(engine, bare_crank(engine, "beam"))
    first = torsional_frequencies(*cranktrain_modes(engine, crankshaft), engine.reduction.running_cutoff_hz)[0]
    found = critical_speeds(engine, crankshaft)
    assert {6.0, 8.0, 10.0, 12.0} <= {entry["order"] for entry in found}
    for entry in found:
        assert engine.speeds[0] <= entry["rpm"] * RPM <= REACH * engine.speeds[1]
        assert entry["rpm"] * entry["order"] == pytest.approx(60.0 * first)


@pytest.mark.parametrize("name", ["gas_i4", "i3"])
def test_the_measured_decay_is_that_of_the_torsional_modes_in_motion(name):
    """A kick's decay against the eigenvalues of the same cycle's means; both modes twist by more than half."""
    engine = engine_of(name)
    made = assemble(engine, settings_above("beam"))
    simulation = Simulation(engine, made.body, made.settings, parts=made.parts)
    found = measured_decay(simulation)
    modes = modes_in_motion(simulation)
    for number, (hz, ratio) in enumerate(zip(found.hz, found.ratio, strict=True), 1):
        k = modes.twisting(number)
        assert modes.hz[k] == pytest.approx(hz, rel=0.01)
        assert modes.shares[k, KINDS.index("torsional")] > 0.5
        assert ratio == pytest.approx(modes.damping_ratios[k], rel=0.1 if number == 2 else 0.45)


def test_rotation_on_a_stiff_connecting_shaft_is_no_torsion_of_the_crank():
    """A shaft 50 times as stiff lifts its mode from 54 Hz to hundreds, where it turns the pulley most."""
    engine = engine_of("gas_i4")
    named = {}
    for factor in (1.0, 50.0):
        line = replace(engine.drive_line, stiffness=factor * engine.drive_line.stiffness)
        stiff = replace(engine, drive_line=line)
        made = assemble(stiff, settings_above("beam"))
        simulation = at_speed(3000.0 * RPM, stiff, made.body, made.settings, parts=made.parts)
        modes = modes_in_motion(simulation)
        named[factor] = modes.hz[modes.twisting(1)]
        on_shaft = modes.in_shafts > 0.5
        assert np.count_nonzero(on_shaft) == (factor > 1.0) and not on_shaft[modes.torsional]
        assert modes.answers[modes.torsional] == modes.answers[~on_shaft].max()
        assert on_shaft[np.argmax(modes.answers)] == (factor > 1.0)
    assert named[50.0] == pytest.approx(named[1.0], rel=0.1)


@pytest.mark.parametrize(("name", "rpm"), [("moto_i4", 15000.0), ("single", 20.0)])
def test_speeds_from_a_marine_engine_s_to_a_motorcycle_s_are_run(name, rpm):
    engine = engine_of(name)
    settings = replace(settings_above("torsional"), bearings="held")
    run = simulate(engine, crank_body(engine, "torsional"), settings, rpm * RPM, cycles=2)
    assert np.isfinite(run.outputs["pulley.torsion"]).all() and np.ptp(run.outputs["pulley.torsion"]) > 0.0


def test_ranges_of_speed_follow_the_engine():
    assert speed_range(engine_of("diesel_i6"), STEPS) == (1000.0, 2800.0, 10.0)
    first, last, step = speed_range(engine_of("moto_i4"), QUICK_STEPS)
    low, high = (speed / RPM for speed in engine_of("moto_i4").speeds)
    assert low <= first < low + step and high < last <= 7.0 / 6.0 * high and 40.0 < (last - first) / step < 250.0
    for name in ("diesel_i6", "diesel_v8", "gas_i4"):
        assert start_values(engine_of(name))["speed"] == pytest.approx(2000.0 * RPM)
    engine = engine_of("single")
    slow = replace(engine, oil=replace(engine.oil, temperature_speeds=(30.0 * RPM, 120.0 * RPM)))
    assert start_values(slow)["speed"] == pytest.approx(120.0 * RPM)
