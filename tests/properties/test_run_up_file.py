"""Files of run-ups: all comes back as it was, and a damaged file is refused in one line."""

from concurrent.futures import Future
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

import cranktrain.studies.run_up.run_up as verb
from cranktrain.core.errors import InputError, StoreError
from cranktrain.dynamics.settled.motion import Motion
from cranktrain.results.run_up.run_up import RunUp, merged
from cranktrain.store.hdf5 import write_result
from cranktrain.store.journal import journal_place
from cranktrain.studies.run_up.run_up import ASKED, CODE
from cranktrain.studies.run_up.steady import CycleStart, SteadySpeed


def run_up(speeds, seed=1):
    s, o = len(speeds), 48
    generator = np.random.default_rng(seed)

    def amplitudes():
        return generator.standard_normal((s, o)) + 1j * generator.standard_normal((s, o))

    return RunUp(
        np.array(speeds, dtype=float), 0.5 * np.arange(1, o + 1),
        {"pulley.torsion": amplitudes(), "pulley.axial": amplitudes()},
        {"bearing[1].force.x": generator.standard_normal((s, 3))}, generator.integers(2, 9, s), np.ones(s, dtype=int),
        generator.random(s), {"engine": "diesel_i6", "settle": 1e-4},
    )  # fmt: skip


@pytest.mark.parametrize("extremes", [True, False])
def test_a_file_gives_back_what_it_was_given(tmp_path, extremes):
    made = run_up([100.0, 110.0, 120.0])
    made = made if extremes else replace(made, extremes={})
    found = RunUp.load(made.save(tmp_path / "run-up.h5"))
    for name in ("speeds", "orders", "cycles", "repeats", "left"):
        assert np.array_equal(getattr(found, name), getattr(made, name))
    assert found.attributes == made.attributes
    assert np.array_equal(found.torsion, made.torsion) and np.array_equal(found.axial, made.axial)
    assert found.extremes.keys() == made.extremes.keys()
    assert all(np.array_equal(found.extremes[name], values) for name, values in made.extremes.items())
    assert np.array_equal(found.order(6.0), made.torsion[:, 11])


def test_parts_merge_in_the_order_of_their_speeds():
    low, high = run_up([100.0, 120.0]), run_up([110.0, 120.0, 130.0], seed=2)
    whole = merged([low, high])
    assert whole.speeds.tolist() == [100.0, 110.0, 120.0, 130.0]
    assert np.array_equal(whole.torsion[[0, 2]], low.torsion)
    assert np.array_equal(whole.torsion[[1, 3]], high.torsion[[0, 2]])


def test_a_file_of_another_kind_is_refused(tmp_path):
    other = write_result(tmp_path / "run.h5", {"time": (np.zeros(2), "s")})
    with pytest.raises(StoreError, match="not a cranktrain run-up"):
        RunUp.load(other)
    with pytest.raises(InputError, match="is no cranktrain run-up file"):
        run_up([100.0]).save(other)

    replace(run_up([100.0, 110.0]), speeds=np.array([100.0, 110.0, 120.0])).save(tmp_path / "run-up.h5")
    with pytest.raises(StoreError, match="do not fit together"):
        RunUp.load(tmp_path / "run-up.h5")


def test_speeds_in_the_journal_are_read_with_the_file(tmp_path):
    """Up to where a kill left a row half-written; the journal of another run-up says nothing."""
    path = tmp_path / "run-up.h5"
    whole = run_up([100.0, 110.0, 120.0, 130.0])
    one, *others = (part(whole, k) for k in range(4))
    one.save(path)
    for other in others:
        other.add_to_journal(path)
    found = RunUp.load(path)
    assert np.array_equal(found.speeds, whole.speeds) and np.array_equal(found.cycles, whole.cycles)
    assert np.array_equal(found.axial, whole.axial) and found.attributes == whole.attributes
    assert np.array_equal(found.extremes["bearing[1].force.x"], whole.extremes["bearing[1].force.x"])
    place = journal_place(path)
    content = place.read_bytes()
    place.write_bytes(content[:-1])
    assert RunUp.load(path).speeds.tolist() == [100.0, 110.0, 120.0]
    middle = len(content) // 2
    place.write_bytes(content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :])
    assert RunUp.load(path).speeds.tolist() == [100.0, 110.0]
    place.write_bytes(content)
    replace(one, attributes={"engine": "diesel_v8", "settle": 1e-4}).save(tmp_path / "other.h5")
    place.replace(journal_place(tmp_path / "other.h5"))
    assert RunUp.load(tmp_path / "other.h5").speeds.tolist() == [100.0]
    others[0].add_to_journal(tmp_path / "other.h5")  # begins anew
    assert RunUp.load(tmp_path / "other.h5").speeds.tolist() == [100.0]


def part(whole, k):
    """One of the speeds of a run-up."""
    one = slice(k, k + 1)
    named = {name: {output: values[one] for output, values in getattr(whole, name).items()}
             for name in ("amplitudes", "extremes")}  # fmt: skip
    return replace(
        whole, **named, **{name: getattr(whole, name)[one] for name in ("speeds", "cycles", "repeats", "left")}
    )


class Resonance:
    """Workers that know the peak at 204 rad/s, and are interrupted after so many speeds."""

    count, apart = 1, False

    def __init__(self, left):
        self.left = left

    def submit(self, speed, near):
        if not self.left:
            raise KeyboardInterrupt
        self.left -= 1
        motion = Motion(np.full(6, speed), np.zeros(6), np.zeros(6), 0.0, 0.0)
        start = CycleStart(speed, motion, 0.0, np.zeros(0), None, True)
        size = 1.0 / abs(1.0 - (speed / 204.0) ** 2 + 0.06j)
        found: Future = Future()
        found.set_result(SteadySpeed(speed, {"pulley.torsion": np.array([size + 0j])}, {}, 2, 1, 1e-5, np.nan, start))
        return found


def test_a_refined_run_up_goes_on_wherever_it_was_interrupted(tmp_path, monkeypatch):
    """Also among the speeds that refining added, when all that were asked for are there."""
    monkeypatch.setattr(verb, "digests", lambda job: {ASKED: "a", CODE: "b"})
    speeds, means = [100.0 + 10.0 * k for k in range(21)], verb.Means(workers=1, refine=0.02)

    def run(path, left):
        monkeypatch.setattr(verb, "_workers", lambda *asked: nullcontext(Resonance(left)))
        return verb.run_up(None, speeds, path, means, {}).run_up

    whole = run(tmp_path / "whole.h5", 1000)
    assert whole.speeds.size > 21
    for attempt in range(1, 1000):
        try:
            often = run(tmp_path / "often.h5", 4)
            break
        except KeyboardInterrupt:
            assert RunUp.load(tmp_path / "often.h5").speeds.size == 4 * attempt
    assert np.array_equal(often.speeds, whole.speeds) and np.array_equal(often.torsion, whole.torsion)
    assert sorted(place.name for place in tmp_path.iterdir()) == ["often.h5", "whole.h5"]
