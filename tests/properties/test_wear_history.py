"""Wear of an engine's mains over time: kept, resumed, converged in its increments, and its limit; wear in passes."""

import json
import math

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.film.contact.gap import relief
from cranktrain.film.contact.wear import WearLaw
from cranktrain_lab.wear.history import Choices, Running, wear_history
from cranktrain_lab.wear.records import WearHistory
from cranktrain_lab.wear.result import envelope, run_in_over_time, save_wear_pictures
from cranktrain_lab.wear.run_in import fitted_profile, run_in
from cranktrain_lab.wear.schedule import HOUR, Block

FOUR = load_engine("four_petrol")
SLOW = FOUR.oil.temperature_speeds[0]
BEAM = Choices(crank="beam")


@pytest.fixture(scope="module")
def running():
    return Running(FOUR, BEAM, lambda text: None)


@pytest.fixture(scope="module")
def history(running):
    return wear_history(running, [Block(HOUR, SLOW)], 0.06)


def test_edges_wear_and_what_they_carry_and_rub_falls(history):
    assert history.time[0] == 0.0 and history.hours[-1] == pytest.approx(0.06)
    assert (np.diff(history.time) > 0.0).all() and (np.diff(history.volume, axis=0) >= 0.0).all()
    assert (np.diff(history.profile, axis=0) >= 0.0).all() and (np.diff(history.sigma, axis=0) <= 0.0).all()
    limit = BEAM.increment * FOUR.plain_mains.roughness  # of one increment
    assert np.diff(history.deepest, axis=0).max() <= limit * (1.0 + 1e-9)
    worst = int(history.deepest[-1].argmax())
    profile = history.profile[-1, worst]
    # The crank bends: an edge wears, the middle does not; new shells are straight.
    assert profile.argmax() in (0, profile.size - 1) and profile[np.abs(history.zeta).argmin()] == 0.0
    assert not history.profile[0].any()
    assert history.contact_share[-1, worst] < history.contact_share[0, worst]
    assert history.friction_power[-1].sum() < history.friction_power[0].sum()
    assert history.least_gap[-1, worst] > history.least_gap[0, worst]


def test_worn_volume_is_the_map_and_without_an_end_archards_integral():
    law = WearLaw(end_gap=math.inf, coefficient=3e-8)
    found = wear_history(Running(FOUR, Choices(law=law, crank="beam"), lambda text: None), [Block(HOUR, SLOW)], 0.01)
    assert found.time.size >= 3
    wanted = 3e-8 / FOUR.plain_mains.hardness * found.contact_work[-1]
    assert found.volume[-1] == pytest.approx(wanted, rel=1e-10)
    area = found.weight * math.pi * FOUR.plain_mains.diameter
    assert (found.worn.mean(axis=1) @ area) == pytest.approx(found.volume[-1])


def test_time_and_coefficient_count_as_their_product(history):
    law = WearLaw(coefficient=10.0 * BEAM.law.coefficient)
    fast = wear_history(Running(FOUR, Choices(law=law, crank="beam"), lambda text: None), [Block(HOUR, SLOW)], 0.006)
    assert fast.time.size == history.time.size
    assert fast.deepest[-1] == pytest.approx(history.deepest[-1], rel=1e-6)


@pytest.mark.slow
def test_increments_converge_in_first_order():
    """With cycles enough that orbits follow the shells."""
    depths = []
    for increment in (0.25, 0.125, 0.0625):
        choices = Choices(crank="beam", increment=increment, cycles=6)
        found = wear_history(Running(FOUR, choices, lambda text: None), [Block(HOUR, SLOW)], 0.06)
        depths.append(found.deepest[-1].max())
    first, second = np.abs(np.diff(depths))
    assert 0.3 * first < second < 0.7 * first
    assert first < 0.02 * depths[-1]


def test_an_interrupted_history_is_kept_and_goes_on(running, history, tmp_path):
    file, told = tmp_path / "wear.h5", []

    def stop(text):
        told.append(text)
        if len(told) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        wear_history(running, [Block(HOUR, SLOW)], 0.06, file, stop)
    kept = WearHistory.load_file(file)
    assert kept.time.size == 3
    found = wear_history(running, [Block(HOUR, SLOW)], 0.06, file)
    assert found.time[:3].tolist() == kept.time.tolist()
    assert found.hours[-1] == pytest.approx(0.06)
    # Orbits start where they were left in this process, so the last cycle of an increment is another one by a little.
    assert found.deepest[-1] == pytest.approx(history.deepest[-1], rel=0.02, abs=1e-8)
    # At the end the same command does nothing, more hours go on.
    assert wear_history(running, [Block(HOUR, SLOW)], 0.06, file).time.size == found.time.size
    with pytest.raises(InputError, match="of another schedule"):
        wear_history(running, [Block(HOUR, 2.0 * SLOW)], 0.1, file)
    other = Running(FOUR, Choices(crank="beam", law=WearLaw(coefficient=1e-7)), lambda text: None)
    with pytest.raises(InputError, match="another engine"):
        wear_history(other, [Block(HOUR, SLOW)], 0.1, file)


def test_an_engine_whose_edges_do_not_touch_does_not_wear():
    """The single's crank is short: at its lowest speed no summit is within six roughnesses."""
    history, found = run_in_over_time("single_petrol", hours=100.0, choices=BEAM)
    assert found["settled"] and not history.deepest.any() and history.time.size == 2
    assert history.sigma[-1] == pytest.approx(history.sigma[0]) and found["relief_depth_um"] == 0.0


def test_a_schedule_takes_its_turns(running):
    blocks = [Block(36.0, SLOW, 0.5), Block(72.0, 1.5 * SLOW)]
    history = wear_history(running, blocks, 0.04)
    assert {0.01, 0.03, 0.04} <= {round(float(hours), 9) for hours in history.hours}
    in_second = (history.hours >= 0.01 - 1e-9) & (history.hours < 0.03 - 1e-9)
    assert (history.speed[in_second] == 1.5 * SLOW).all() and (history.speed[~in_second][:-1] == SLOW).all()


def test_pictures_and_table(history, tmp_path):
    assert all(path.stat().st_size > 5000 for path in save_wear_pictures(tmp_path, history, "four"))
    rows = history.write_table(tmp_path / "t.csv").read_text("utf-8").splitlines()
    assert rows[1].startswith("hours,speed_rpm,load,main[1].depth_um") and len(rows) == 2 + history.time.size
    (tmp_path / "mine.csv").write_text("mine", "utf-8")
    with pytest.raises(InputError, match="mine"):
        history.write_table(tmp_path / "mine.csv")


def test_the_command_writes_history_table_and_engine(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = "run-in four_petrol --crank beam --hours 0.02 --table t.csv --output new.toml --json"
    assert main(command.split()) == 0
    found = json.loads(capsys.readouterr().out)
    new = load_engine(tmp_path / "new.toml").plain_mains
    assert 1e6 * new.relief_depth == pytest.approx(found["relief_depth_um"], rel=1e-3) and new.relief_depth > 0.0
    assert new.roughness == pytest.approx(1e-6 * np.mean(found["roughness_um"]), rel=1e-3)
    assert new.asperity_ratio < FOUR.plain_mains.asperity_ratio
    assert (tmp_path / "four_petrol_wear.h5").is_file() and (tmp_path / "t.csv").is_file()


@pytest.mark.slow
def test_the_history_ends_at_the_shape_that_passes_of_wear_find(tmp_path):
    """Both end where the least gap is half of the roughness; passes wear in leaps and so somewhat more."""
    new = tmp_path / "run_in.toml"
    passes = run_in("diesel_i6", new, crank="beam")
    gaps, worn = passes["least_gap_um"], passes["worn_um"]
    assert gaps[0] < 0.0 and gaps[-1] > 0.5 * gaps[0]
    assert worn[-1] == max(worn) > 1.0 > worn[0]  # the edge wears, the middle does not
    assert 1e6 * load_engine(new).plain_mains.relief_depth == pytest.approx(passes["relief_depth_um"], rel=1e-3)
    assert "run-in at 1000 rev/min" in new.read_text("utf-8")
    choices = Choices(crank="beam", alike=True, increment=0.5)
    history, _ = run_in_over_time("diesel_i6", hours=30.0, choices=choices)
    zeta, shape = envelope(history)
    found = 1e6 * np.interp(passes["zeta"], zeta, shape)
    wanted = np.array(passes["worn_um"])
    assert found[-1] == pytest.approx(wanted[-1], rel=0.12)
    assert np.sqrt(np.mean((found - wanted) ** 2)) < 0.08 * wanted[-1]
    least = 1e6 * history.least_gap[-1].min()
    end = 1e6 * 0.5 * load_engine("diesel_i6").plain_mains.roughness
    assert history.least_gap[0].min() < -2e-6 and 0.6 * end < least <= 1.01 * end


ZETA = np.linspace(0.0, 1.0, 101)


@pytest.mark.parametrize("profile", [(6e-6, 0.5, 2.0), (2e-6, 1.0, 1.0), (9e-6, 0.25, 3.0)])
def test_a_profile_is_fitted_by_itself(profile):
    worn = np.array([relief(zeta, profile) for zeta in ZETA])
    assert fitted_profile(ZETA, worn) == pytest.approx(profile, rel=1e-3)
    assert fitted_profile(ZETA, 0.0 * worn)[0] == 0.0


def test_what_cannot_be_run_in_is_refused(tmp_path):
    with pytest.raises(InputError, match="roller bearings without an oil film"):
        run_in("diesel_v8", crank="beam")
    kept = tmp_path / "kept.toml"
    kept.write_text("", "utf-8")
    with pytest.raises(InputError, match="exists"):
        run_in("diesel_i6", kept, crank="beam")
