"""Cranks and cylinders of other layouts: several pins between mains, unequal throws, offset banks, compressors."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from cranktrain.core.errors import InputError
from cranktrain.dynamics.simulation import Settings, simulate
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.file import load_engine
from cranktrain.engine.firing import firing_summary
from cranktrain.engine.parts import Compressor
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.assembly import running_crank
from cranktrain.structure.crank.beam import beam_body
from cranktrain.structure.crank.reduction import reduced_crankshaft
from cranktrain.structure.crank.shape import crank_interfaces, stations, webs_of

SIX = load_engine("diesel_i6")


def split(flying, between, bays=3, **changes):
    """A crank of pins in pairs between mains, one of each pair turned against the other by an angle (deg)."""
    angles = [angle for k in range(bays) for angle in (120.0 * k, 120.0 * k + between)]
    crank = replace(
        SIX.crankshaft, throw_angles=tuple(map(math.radians, angles)), pins_between_mains=(2,) * bays,
        main_widths=SIX.crankshaft.main_widths[: bays + 1], flying_web_thickness=flying,
        pin_width=0.7 * SIX.crankshaft.pin_width, counterweights=(True, False, True) * bays, oil_holes=False, **changes,
    )  # fmt: skip
    return replace(SIX, name="split", crankshaft=crank, thrust=replace(SIX.thrust, main=1))


def v_six(bank, between, flying=0.008):
    """Six cylinders in two banks on split pins."""
    made = split(flying, between)
    half = math.radians(0.5 * bank)
    cylinders = replace(
        SIX.cylinders, pins=(1, 3, 5, 2, 4, 6), bank_angles=(-half,) * 3 + (half,) * 3, firing_order=(1, 4, 2, 5, 3, 6),
        rod_offsets=(),
    )  # fmt: skip
    return replace(made, cylinders=cylinders)


def cycle(engine, rpm=1500.0, **choices):
    """Outputs of the last cycle at a speed, on a crank that only twists with its journals held or as told."""
    settings = Settings(crank=choices.pop("crank", "rigid"), block="ground", pistons="rigid", **choices)
    return simulate(engine, running_crank(engine, settings.crank), speed=rpm * math.pi / 30.0, settings=settings)


def test_pins_in_pairs_lie_between_their_mains():
    made = split(0.008, 30.0)
    at, c = stations(made.crankshaft), made.crankshaft
    assert [web.main for web in at.joins] == [1, 0, 2, 2, 0, 3, 3, 0, 4]
    assert [web.pins for web in at.joins[:3]] == [(1,), (1, 2), (2,)]
    assert [webs_of(c, pin) for pin in (1, 2, 3)] == [(1, 2), (2, 3), (4, 5)]
    pieces = sorted([at.nose, *at.mains, *at.pins, *at.webs, at.flange])
    assert all(a[1] == pytest.approx(b[0]) for a, b in pairwise(pieces))
    assert c.main_positions == pytest.approx([0.5 * sum(span) for span in at.mains])
    assert c.pin_positions == pytest.approx([0.5 * sum(span) for span in at.pins])
    places = [*(f"main[{i}]" for i in range(1, 5)), *(f"pin[{i}]" for i in range(1, 7)), "pulley"]
    assert list(crank_interfaces(c)[:11]) == places


@pytest.mark.parametrize(("bank", "between"), [(60.0, -60.0), (90.0, -30.0)])
def test_split_pins_let_a_v_six_fire_evenly(bank, between):
    """The split is the bank's angle less 120 degrees: C. F. Taylor, The Internal-Combustion Engine, vol. 2."""
    found = firing_summary(v_six(bank, between))
    assert found["intervals_deg"] == pytest.approx([120.0] * 6)


@pytest.mark.parametrize(
    ("flying", "between", "tolerance"), [(0.008, 30.0, 0.1), (0.012, 60.0, 0.1), (0.0, 30.0, 0.1), (0.02, 180.0, 0.17)]
)
def test_beams_of_split_pins_follow_the_solid(flying, between, tolerance):
    """One bay: mass and inertia within 0.5 %, first frequencies within 10 %, across a long flying arm within 17 %."""
    made = split(flying, between, bays=1, mesh_size=0.03)
    beam, solid = beam_body(made), reduced_crankshaft(made)
    assert beam.mass == pytest.approx(solid.mass, rel=5e-3)
    np.testing.assert_allclose(np.diag(beam.inertia), np.diag(solid.inertia), rtol=5e-3)
    np.testing.assert_allclose(beam.omega[6:9], solid.omega[6:9], rtol=tolerance)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"pins_between_mains": (2, 2)}, r"pins_between_mains: 4 pins between mains, but throw_angles has 6"),
        ({"pins_between_mains": (2, 4)}, r"main_widths: 4 widths for 2 entries of pins_between_mains"),
        ({"counterweights": (True, True, True) * 3}, r"counterweights: a flying web"),
        ({"counterweights": (True, True) * 6}, r"counterweights: 12 entries for 9 webs"),
        # Throws of 60 mm: 60 degrees apart their chord is as long; 60 and 80 mm at a right angle are 100 mm apart.
        ({"flying_web_thickness": 0.0}, r"flying_web_thickness: pins 1 and 2 lie 60 mm apart and overlap too little"),
        ({"flying_web_thickness": 0.0, "throw_angles": tuple(map(math.radians, (30, 60, 100, 190, 240, 270))),
          "pin_throws": (0.06, 0.06, 0.08, 0.06, 0.06, 0.06)}, r"pins 3 and 4 lie 100 mm apart and overlap too little"),
        ({"pin_throws": (0.05,) * 5}, r"pin_throws: 5 values for 6 throws"),
        ({"pin_throws": (0.05,) * 6}, r"pin_throws: begins with 50 mm, throw is"),
    ],
)  # fmt: skip
def test_lists_that_do_not_fit_are_told(changes, says):
    made = v_six(60.0, -60.0)
    with pytest.raises(InputError, match=says):
        check_engine(replace(made, crankshaft=replace(made.crankshaft, **changes)))


def test_a_split_crank_runs_and_its_pins_carry_their_rods():
    """Held on its axis, the crank passes on the gas torque of all cylinders: the mean of what they were given."""
    made = v_six(60.0, -60.0)
    found = cycle(made)
    trace = GasTrace.from_engine(made)
    share = 1.0 - trace.falloff * (1500.0 * math.pi / 30.0 / trace.best_speed - 1.0) ** 2
    motored = GasTrace.from_engine(replace(made, combustion=replace(made.burn, heat=0.0)))
    work = share * trace.imep + (1.0 - share) * motored.imep
    mean = float(np.mean(found.last_cycle("shaft.torque")[1][:-1]))
    assert abs(mean) == pytest.approx(work * made.displacement / (4.0 * math.pi), rel=0.05)


def test_unequal_throws_have_unequal_strokes():
    throws = tuple(SIX.crankshaft.throw * share for share in (1.0, 1.0, 0.8, 0.8, 1.0, 1.0))
    made = replace(SIX, crankshaft=replace(SIX.crankshaft, pin_throws=throws))
    found = cycle(made)
    for k, throw in enumerate(throws, 1):
        assert np.ptp(found.outputs[f"cylinder[{k}].piston_position"]) == pytest.approx(2.0 * throw, rel=2e-3)
    assert made.displacement == pytest.approx(SIX.displacement * 5.6 / 6.0)


def test_offset_banks_fire_where_throw_and_rod_are_in_line():
    """A narrow V: the piston is highest at its firing angle, and both banks have the stroke of an offset crank."""
    offsets = tuple(0.02 * sign for sign in (1.0, -1.0) * 3)
    made = replace(SIX, cylinders=replace(SIX.cylinders, axis_offsets=offsets, firing_intervals=(), firing_angles=()))
    found = cycle(made, rpm=600.0)
    angle = found.last_cycle("crank.angle")[1]
    rod, throw = made.rod.length, made.crankshaft.throw
    stroke = math.sqrt((rod + throw) ** 2 - 0.02**2) - math.sqrt((rod - throw) ** 2 - 0.02**2)
    for k in range(6):
        position = found.last_cycle(f"cylinder[{k + 1}].piston_position")[1]
        assert np.ptp(position) == pytest.approx(stroke, rel=2e-3)
        at = np.abs(position[1:-1]).argmin() + 1
        square, slope, _ = np.polyfit(angle[at - 1 : at + 2] - angle[at], position[at - 1 : at + 2], 2)
        top = angle[at] - 0.5 * slope / square
        assert math.remainder(top - made.firing_angles[k], 2.0 * math.pi) == pytest.approx(0.0, abs=1e-3)


def test_fork_and_blade_lie_in_one_plane_without_films():
    eight = load_engine("diesel_v8")
    made = replace(eight, cylinders=replace(eight.cylinders, rod_offsets=(), rods_on_pin="fork-and-blade"))
    check_engine(made)
    aside = replace(made, cylinders=replace(made.cylinders, rods_on_pin="side-by-side"))
    with pytest.raises(InputError, match="overlap on pin 1"):
        check_engine(aside)
    with pytest.raises(InputError, match="a blade runs on its fork"):
        cycle(made, big_ends="impedance")


def test_a_crosshead_may_be_heavy_and_has_no_liners_of_a_block():
    heavy = replace(SIX.cylinders, piston_mass=7.0)
    with pytest.warns(UserWarning, match=r"piston_mass: 7 kg .* or state crosshead = true"):
        check_engine(replace(SIX, cylinders=heavy))
    guided = replace(SIX, cylinders=replace(heavy, crosshead=True))
    with pytest.raises(InputError, match=r"block\.deck_height: is that of trunk pistons"):
        check_engine(guided)
    check_engine(replace(guided, block=None, mounts=None))


def compressor(**changes):
    gas = Compressor(**{"suction": 1e5, "discharge": 8e5, "exponent": 1.3, "best_speed": 100.0, **changes})
    cylinders = replace(SIX.cylinders, cycle=2.0 * math.pi, compression_ratio=13.0)
    return replace(SIX, name="compressor", combustion=None, compressor=gas, cylinders=cylinders)


def test_a_compressor_takes_the_work_of_its_polytropic_cycle():
    """W = n/(n−1) p_s V_in [(p_d/p_s)^((n−1)/n) − 1], V_in the volume that suction brings; any thermodynamics book."""
    made, n, ratio = compressor(), 1.3, 8.0
    check_engine(made)
    clearance = 1.0 / 12.0
    drawn = 1.0 + clearance - clearance * ratio ** (1.0 / n)
    expected = -n / (n - 1.0) * 1e5 * drawn * (ratio ** ((n - 1.0) / n) - 1.0)
    assert GasTrace.from_engine(made).imep == pytest.approx(expected, rel=1e-3)
    found = cycle(made, rpm=900.0)
    torque = float(np.mean(found.last_cycle("shaft.torque")[1][:-1]))
    assert abs(torque) > abs(expected) * made.displacement / (2.0 * math.pi)


@pytest.mark.parametrize(
    ("made", "says"),
    [
        (compressor(discharge=0.9e5), r"compressor.discharge: 0.9 bar is not above suction, 1 bar"),
        (compressor(discharge=40e5), r"discharge: 40 bar is not reached with cylinders.compression_ratio 13"),
        (replace(SIX, combustion=None), r"combustion\.heat: is missing"),
        (replace(SIX, compressor=compressor().compressor), "is given together with"),
    ],
)
def test_gas_that_cannot_be_is_told(made, says):
    with pytest.raises(InputError, match=says):
        check_engine(made)
