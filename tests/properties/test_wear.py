"""Wear by contact: Archard's integral, run-in surfaces, where wear ends, and increments that converge."""

import math
from dataclasses import replace

import numpy as np
import pytest
from one_line import one_line

from cranktrain.engine.parts import JournalBearing
from cranktrain.film.contact import wear
from cranktrain.film.contact.asperity import bearing_contact_constants, contact_pressure, contact_table
from cranktrain.film.contact.journal import LOAD, N_OUT, RELIEF, WEIGHT, bearing_contact, journal_contact
from cranktrain.film.contact.journal import ZETA as LINE_ZETA
from cranktrain_lab.wear.schedule import HOUR, Block, block_at, read_schedule, same_until
from cranktrain_lab.wear.shells import ANGLES

BEARING = JournalBearing(
    diameter=0.08, width=0.03, clearance=40e-6, contact_height=1e-6, contact_pressure=1e8, stiffness_x=1e9,
    stiffness_y=1e9, damping_x=1e5, damping_y=1e5, relief_depth=2e-6, relief_share=0.4,
)  # fmt: skip
TABLE = contact_table()
SLIDING = 4.0


def rates(law, bearing, place, shell=None, angles=ANGLES):
    line = bearing_contact(bearing).line
    shell = line[RELIEF] if shell is None else shell
    constants = bearing_contact_constants(bearing)
    bearable = wear.end_pressure(constants, TABLE, law.end_gap * bearing.roughness)
    angle = np.arange(angles) * (2.0 * math.pi / angles)
    maps = np.zeros((wear.MAPS, angles, line.shape[1]))
    settings = np.array([bearing.clearance, law.per_work(bearing) * SLIDING, bearable, 1.0])
    highest, least = wear.worn_rates(
        np.array(place), shell, np.ascontiguousarray(line[[LINE_ZETA, WEIGHT]]),
        np.array([np.cos(angle), np.sin(angle)]), constants, TABLE, settings, maps,
    )  # fmt: skip
    area = line[WEIGHT] * math.pi * bearing.diameter / angles
    return maps, area, highest, least


@pytest.mark.parametrize("place", [(40e-6, 0.0, 0.0, 0.0), (20e-6, 25e-6, 7e-6, 8e-6), (-14e-6, 32e-6, -12e-6, 3e-6)])
def test_worn_volume_is_archards_integral_of_the_running_models_contact(place):
    """k/p_H ∫ p v dA: the load of the running model's own contact, times coefficient and speed."""
    law = wear.WearLaw(coefficient=2e-8, end_gap=math.inf)
    maps, area, highest, _ = rates(law, BEARING, place)
    out = np.zeros(N_OUT)
    journal_contact(*place, 0.0, bearing_contact(BEARING), out)
    assert out[LOAD] > 10.0
    # The running model takes a slice's touching arc as that of a straight shell.
    assert (maps[wear.PRESSURE] @ area).sum() == pytest.approx(out[LOAD], rel=0.01)
    volume = (maps[wear.RATE] @ area).sum()
    assert volume == pytest.approx(2e-8 / BEARING.hardness * SLIDING * out[LOAD], rel=0.01)
    assert 0.0 < highest < BEARING.hardness


def test_meridians_are_close_enough():
    volumes = []
    for angles in (ANGLES, 4 * ANGLES):
        maps, area, _, _ = rates(wear.WearLaw(), BEARING, (21e-6, 24e-6, 7e-6, 8e-6), angles=angles)
        volumes.append((maps[wear.RATE] @ area).sum())
    assert volumes[0] == pytest.approx(volumes[1], rel=2e-3)


def test_wear_ends_where_the_gap_is_what_the_law_says_and_decreases_as_it_tells():
    law = wear.WearLaw()
    end = law.end_gap * BEARING.roughness
    straight = replace(BEARING, relief_depth=0.0)
    for gap, wears in ((end * 1.01, False), (end * 0.99, True)):
        maps, _, _, least = rates(law, straight, (BEARING.clearance - gap, 0.0, 0.0, 0.0))
        assert least == pytest.approx(gap)
        assert (maps[wear.RATE].max() > 0.0) == wears and maps[wear.PRESSURE].max() > 0.0
    gap, step = 0.1 * BEARING.roughness, 1e-10
    before, middle, after = (
        rates(law, straight, (BEARING.clearance - gap + shift, 0.0, 0.0, 0.0))[0] for shift in (-step, 0.0, step)
    )
    slope = (after[wear.RATE, 0] - before[wear.RATE, 0]) / (2.0 * step)
    assert slope == pytest.approx(middle[wear.DECREASE, 0], rel=1e-4)


def test_run_in_surfaces_keep_their_asperities_and_blunt_their_tips():
    worn = wear.worn_surfaces(BEARING, 0.5 * BEARING.roughness)
    assert worn.asperity_factor == BEARING.asperity_factor
    density = [b.asperity_factor * b.asperity_ratio / b.roughness**2 for b in (BEARING, worn)]
    assert density[0] == pytest.approx(density[1])
    # At the same gap smoother surfaces press far less.
    pressures = [contact_pressure(2e-7, bearing_contact_constants(b), TABLE)[0] for b in (BEARING, worn)]
    assert 0.0 < pressures[1] < 0.3 * pressures[0]


def test_roughness_falls_to_that_of_run_in_surfaces_and_does_not_care_for_increments():
    law = wear.WearLaw(run_in_roughness=0.4)
    once = law.smoothed(BEARING, BEARING.roughness, 1e-6)
    thrice = BEARING.roughness
    for _ in range(3):
        thrice = law.smoothed(BEARING, thrice, 1e-6 / 3.0)
    assert once == pytest.approx(thrice)
    assert law.smoothed(BEARING, BEARING.roughness, 0.0) == BEARING.roughness
    assert law.smoothed(BEARING, BEARING.roughness, 1.0) == pytest.approx(0.4 * BEARING.roughness)


def worn_until(law, end, share, gap=-0.8e-6):
    """Relief of the edge after a time under a journal that is held in its place, by increments as a history's."""
    straight = replace(BEARING, relief_depth=0.0)
    shell, time = np.zeros(bearing_contact(straight).line.shape[1]), 0.0
    while time < end:
        maps, *_ = rates(law, straight, (BEARING.clearance - gap, 0.0, 0.0, 0.0), shell)
        rate, decrease = maps[wear.RATE].max(), maps[wear.DECREASE].max()
        step = min(share * min(BEARING.roughness / rate, 1.0 / decrease), end - time) if rate > 0.0 else end - time
        shell, time = shell + step * maps[wear.RATE].max(axis=0), time + step
    return shell[0]


def test_increments_converge_in_first_order_to_the_wear_of_a_journal_that_is_held():
    """dg/dt = (k/p_H) v (p(h₀ + g) − p_e), whose solution is ∫ dg/(p − p_e)."""
    law = wear.WearLaw(end_gap=0.5)
    straight = replace(BEARING, relief_depth=0.0)
    constants = bearing_contact_constants(straight)
    bearable = wear.end_pressure(constants, TABLE, 0.5 * BEARING.roughness)
    g = np.linspace(0.0, 0.7e-6, 20001)
    slowness = [1.0 / (contact_pressure(-0.8e-6 + one, constants, TABLE)[0] - bearable) for one in g]
    times = np.concatenate([[0.0], np.cumsum(0.5 * (np.array(slowness[1:]) + slowness[:-1]) * np.diff(g))])
    times /= law.per_work(straight) * SLIDING
    errors = [worn_until(law, times[-1], share) - 0.7e-6 for share in (0.4, 0.2, 0.1)]
    assert abs(errors[2]) < 0.02e-6
    assert 1.6 < errors[0] / errors[1] < 2.6 and 1.6 < errors[1] / errors[2] < 2.6
    # However long it takes: the gap reaches half of the roughness and no more.
    assert worn_until(law, 1e4 * times[-1], 0.4) == pytest.approx(0.8e-6 + 0.5 * BEARING.roughness, abs=2e-9)


def test_laws_that_cannot_be_are_refused():
    for key, value, said in (
        ("coefficient", 0.0, "coefficient 0 is not"), ("end_gap", math.nan, "end_gap"),
        ("run_in_roughness", 1.5, "keeps the roughness of new surfaces"),
    ):  # fmt: skip
        with one_line(said):
            wear.WearLaw(**{key: value})


def test_a_schedule_repeats_and_tells_where_it_is(tmp_path):
    file = tmp_path / "steps.csv"
    file.write_text("hours; speed_rpm; load\n0,5; 1000; 0,25\n1; 2000; 1\n", "utf-8")
    blocks = read_schedule(file)
    assert blocks == (
        Block(0.5 * HOUR, pytest.approx(1000.0 * math.pi / 30.0), 0.25),
        Block(HOUR, pytest.approx(2000.0 * math.pi / 30.0), 1.0),
    )
    found = {hours: block_at(blocks, hours * HOUR)[0] for hours in (0.0, 0.4, 0.5, 1.49, 1.5, 2.0, 3.1)}
    assert found == {0.0: 0, 0.4: 0, 0.5: 1, 1.49: 1, 1.5: 0, 2.0: 1, 3.1: 0}
    assert block_at(blocks, 1.6 * HOUR)[1] == pytest.approx(2.0 * HOUR)
    longer = (blocks[0], blocks[1]._replace(duration=5.0 * HOUR))
    assert same_until(blocks, longer, 1.5 * HOUR) and not same_until(blocks, longer, 1.6 * HOUR)
