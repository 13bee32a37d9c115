"""Files of run-ups: all comes back as it was, and a damaged file is refused in one line."""

from dataclasses import replace

import numpy as np
import pytest

from cranktrain.core.errors import InputError, StoreError
from cranktrain.results.run_up.run_up import RunUp, merged
from cranktrain.store.hdf5 import write_result


def run_up(speeds, seed=1):
    s, o = len(speeds), 48
    generator = np.random.default_rng(seed)

    def amplitudes():
        return generator.standard_normal((s, o)) + 1j * generator.standard_normal((s, o))

    return RunUp(
        speeds=np.array(speeds, dtype=float),
        orders=0.5 * np.arange(1, o + 1),
        amplitudes={"pulley.torsion": amplitudes(), "pulley.axial": amplitudes()},
        extremes={"bearing[1].force.x": generator.standard_normal((s, 3))},
        cycles=generator.integers(2, 9, s),
        repeats=np.ones(s, dtype=int),
        left=generator.random(s),
        attributes={"engine": "diesel_i6", "settle": 1e-4},
    )


def test_a_file_gives_back_what_it_was_given(tmp_path):
    made = run_up([100.0, 110.0, 120.0])
    found = RunUp.load(made.save(tmp_path / "run-up.h5"))
    for name in ("speeds", "orders", "cycles", "repeats", "left"):
        assert np.array_equal(getattr(found, name), getattr(made, name))
    assert found.attributes == made.attributes
    assert np.array_equal(found.torsion, made.torsion) and np.array_equal(found.axial, made.axial)
    assert np.array_equal(found.extremes["bearing[1].force.x"], made.extremes["bearing[1].force.x"])
    assert np.array_equal(found.order(6.0), made.torsion[:, 11])


def test_what_a_run_up_does_not_have_is_refused_with_what_it_has():
    made = run_up([100.0, 110.0])
    with pytest.raises(InputError, match=r"order 25 is not in this run-up; it has 0\.5 to 24"):
        made.order(25.0)
    with pytest.raises(InputError, match=r"did you mean 'pulley\.axial'"):
        made.order(6.0, "pulley.axal")


def test_parts_merge_in_the_order_of_their_speeds():
    low, high = run_up([100.0, 120.0]), run_up([110.0, 120.0, 130.0], seed=2)
    whole = merged([low, high])
    assert whole.speeds.tolist() == [100.0, 110.0, 120.0, 130.0]
    assert np.array_equal(whole.torsion[[0, 2]], low.torsion)
    assert np.array_equal(whole.torsion[[1, 3]], high.torsion[[0, 2]])


def test_a_file_cut_short_or_of_another_kind_is_refused(tmp_path):
    path = run_up([100.0, 110.0]).save(tmp_path / "run-up.h5")
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(StoreError, match=r"damaged.*runup") as refused:
        RunUp.load(path)
    assert "\n" not in str(refused.value)
    other = write_result(tmp_path / "run.h5", {"time": (np.zeros(2), "s")})
    with pytest.raises(StoreError, match="not a cranktrain run-up"):
        RunUp.load(other)
    with pytest.raises(InputError, match="is no cranktrain run-up file"):
        run_up([100.0]).save(other)


def test_arrays_that_do_not_fit_together_are_refused(tmp_path):
    made = run_up([100.0, 110.0])
    replace(made, speeds=np.array([100.0, 110.0, 120.0])).save(tmp_path / "run-up.h5")
    with pytest.raises(StoreError, match="do not fit together"):
        RunUp.load(tmp_path / "run-up.h5")
