"""Comparison of two results: what is equal, what differs by a known amount, and what is only rounding."""

import json
import math

import numpy as np
import pytest

import cranktrain as ct
from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.results.compared.tolerances import QUANTITIES, USUAL, tolerance_list, tolerances_of
from cranktrain.results.orders.measured import MeasuredOrders
from cranktrain.results.overlays import order_overlay
from cranktrain.results.run_up.common_speeds import on_common_speeds
from cranktrain.results.run_up.run_up import TORSION, RunUp
from cranktrain.results.views.loaded import LoadedCoupling, LoadedRun

SPEED = 3000.0 * RPM
FORCE = "bearing[1].force.y"


def run(scale=1.0, step_deg=1.0, turns=4, behind_deg=0.0, more=None, **attributes):
    """Orders 1.5 and 6 of the torsion and a force with a mean, from crank angle ``behind_deg`` on."""
    begin = math.radians(behind_deg)
    angle = np.linspace(begin, begin + 2.0 * math.pi * turns, round(360 * turns / step_deg) + 1)
    outputs = {
        TORSION: scale * (0.01 * np.cos(1.5 * angle - 0.3) + 1e-3 * np.sin(6.0 * angle)),
        FORCE: 500.0 + scale * 1e4 * np.cos(angle),
        **{name: function(angle) for name, function in (more or {}).items()},
    }
    return LoadedRun(angle / SPEED, angle, outputs, {"engine": "own", "speed": SPEED, **attributes})


def response(speeds_rpm, order, hz, damping=0.02, size=1.0):
    """Amplitudes of a mode of unit stiffness under a torque of constant size."""
    ratio = speeds_rpm * order / 60.0 / hz
    return 0.01 * size / order / (1.0 - ratio**2 + 2j * damping * ratio)


def run_up(hz=200.0, damping=0.02, size=1.0, speeds_rpm=None, **attributes):
    """Orders 3, 4.5 and 6 of a mode."""
    speeds = np.arange(1500.0, 4501.0, 20.0) if speeds_rpm is None else speeds_rpm
    orders = np.array([3.0, 4.5, 6.0])
    amplitudes = np.stack([response(speeds, order, hz, damping, size) for order in orders], axis=1)
    extremes = np.array([-0.02, 0.0, 0.02]) * np.ones((speeds.size, 1))
    ones = np.ones(speeds.size, dtype=int)
    outputs = {TORSION: amplitudes}, {TORSION: extremes, FORCE: 1e4 * extremes}
    return RunUp(speeds * RPM, orders, *outputs, ones, ones, np.zeros(speeds.size), {"engine": "own", **attributes})


def rows(found, quantity, output=TORSION):
    return {one["order"]: one for one in found["differences"] if (one["quantity"], one["output"]) == (quantity, output)}


@pytest.mark.parametrize("make", [run, run_up])
def test_equal_results_have_differences_of_exactly_zero(make):
    nothing = {"output", "mean", "order"} if make is run else set(QUANTITIES)
    found = ct.compare(make(), make(), tolerance=0)
    assert found.within and {one["quantity"] for one in found["differences"]} == nothing
    assert all(one["difference"] == 0.0 for one in found["differences"]) and not found["settings"]


@pytest.mark.parametrize("make", [run, run_up])
def test_three_per_cent_are_found_as_three_per_cent_and_the_other_way_round(make):
    """Of orders and peaks; a course differs by as much of its largest value, over its range. All else stays."""
    larger = run(1.03) if make is run else run_up(size=1.03)
    there, back = ct.compare(make(), larger), ct.compare(larger, make())
    quantity = "order" if make is run else "peak-height"
    for order, one in rows(there, quantity).items():
        other = rows(back, quantity)[order]
        assert one["difference"] == pytest.approx(0.03, rel=1e-4)
        assert other["difference"] == pytest.approx(1.0 / 1.03 - 1.0, rel=1e-4)
        assert (one["a"], one["b"]) == (other["b"], other["a"])
    assert not there.within and ct.compare(make(), larger, tolerance=0.031).within
    same = [one for one in there["differences"] if one["quantity"] in ("mean", "peak-speed", "damping")]
    assert same and max(abs(one["difference"]) for one in same) < 1e-9
    assert there.worst in there["differences"] and abs(there.worst["difference"]) > 0.0299
    if make is run:
        force = rows(there, "output", FORCE)[None]
        assert force["difference"] == pytest.approx(0.5 * 0.03, rel=1e-6)
        assert force["rms"] == pytest.approx(0.5 * 0.03 / math.sqrt(2.0), rel=1e-6)
        assert force["b"] / force["a"] == pytest.approx(1.03, rel=1e-9)


def test_cycles_are_aligned_by_crank_angle_at_any_step_and_end():
    """Other step, other count of cycles, a run that ends 200 deg later; a run turned by 1 deg differs by 1.5 deg."""
    reference = run(step_deg=0.5)
    for other in (run(step_deg=2.0), run(turns=8), run(behind_deg=200.0), run(step_deg=0.7, behind_deg=-33.3)):
        found = ct.compare(reference, other)
        assert max(abs(one["difference"]) for one in found["differences"]) < 3e-4
    fine = [
        max(abs(one["difference"]) for one in ct.compare(reference, run(step_deg=step))["differences"])
        for step in (4.0, 2.0, 1.0)
    ]
    assert fine[0] > 10.0 * fine[1] > 100.0 * fine[2]  # the spline errs by the fourth power of the step
    late = run()
    late = LoadedRun(late.time, late.angle + math.radians(1.0), late.outputs, late.attributes)
    assert rows(ct.compare(run(), late), "order")[1.5]["phase_deg"] == pytest.approx(-1.5, abs=1e-3)
    assert rows(ct.compare(run(), late), "order")[1.5]["difference"] == pytest.approx(math.radians(1.5), rel=1e-3)


def test_a_mean_is_told_apart_from_the_course():
    found = ct.compare(run(), run(more={FORCE: lambda angle: 710.0 + 1e4 * np.cos(angle)}))
    assert rows(found, "mean", FORCE)[None]["difference"] == pytest.approx(0.02, rel=1e-6)
    assert abs(rows(found, "output", FORCE)[None]["difference"]) < 1e-12


def test_rounding_beside_outputs_of_the_same_unit_is_no_difference_and_a_small_output_is_one():
    noise = np.random.default_rng(1).normal(size=(2, 1441))
    small = {"a": 1.0, "b": 1.03}
    a, b = (
        run(more={
            "bearing[2].force.y": lambda angle, k=k: 1e-9 * noise[k],
            "bearing[3].force.y": lambda angle, k=k: small["ab"[k]] * np.cos(angle),
            "bearing[4].force.y": lambda angle, k=k: k * np.cos(angle),
        })
        for k in (0, 1)
    )  # fmt: skip
    found = ct.compare(a, b)
    assert abs(rows(found, "output", "bearing[2].force.y")[None]["difference"]) < 1e-6
    assert not rows(found, "order", "bearing[2].force.y")
    assert rows(found, "order", "bearing[3].force.y")[1.0]["difference"] == pytest.approx(0.03, rel=1e-4)
    gone = rows(found, "output", "bearing[4].force.y")[None]  # zero in A
    assert 10.0 < gone["difference"] < math.inf and not gone["passed"]


def test_outputs_without_a_value_that_grow_or_that_are_no_motion():
    def broken(angle):
        return np.where(angle > 15.0, math.nan, angle)

    more = {"damper.heat": broken, "own.sum": lambda angle: angle, "solver.iterations": np.sin, "crank.angle": np.sin}
    both = ct.compare(run(more=more), run(more=more))
    assert both.within and both["left_out"] == ["own.sum"]
    assert {one["output"] for one in both["differences"]} == {TORSION, FORCE}
    one = ct.compare(run(more={"damper.heat": np.cos}), run(more={"damper.heat": broken}))
    failed = [own for own in one["differences"] if not own["passed"]]
    assert [own["output"] for own in failed] == ["damper.heat"] and math.isnan(failed[0]["difference"])
    assert one.worst is failed[0]


def test_a_coupled_run_has_the_cranktrain_s_outputs():
    coupled = run(1.03)
    outputs = {f"cranktrain/{name}": values for name, values in coupled.outputs.items()}
    found = ct.compare(run(), LoadedCoupling(coupled.time, coupled.angle, outputs, {"scheme": "gauss-seidel"}))
    assert rows(found, "order")[1.5]["difference"] == pytest.approx(0.03, rel=1e-4)
    assert len(found.plot().axes) == 3


def test_shifted_and_damped_resonances_are_found():
    """A mode 1 % higher with 10 % more damping: its peaks are 1 % faster and a tenth lower."""
    found = ct.compare(run_up(), run_up(hz=202.0, damping=0.022))
    assert set(rows(found, "peak-speed")) == {3.0, 4.5, 6.0}
    for order in (3.0, 4.5, 6.0):
        assert rows(found, "peak-speed")[order]["difference"] == pytest.approx(0.01, abs=3e-4)
        assert rows(found, "peak-height")[order]["difference"] == pytest.approx(1.0 / 1.1 - 1.0, abs=4e-3)
        assert rows(found, "damping")[order]["difference"] == pytest.approx(0.1, abs=0.01)
        assert rows(found, "peak-speed")[order]["a"] == pytest.approx(60.0 * 200.0 / order, rel=1e-3)


def test_run_ups_on_other_speeds_are_compared_in_the_common_range():
    """Interpolation between 7 rev/min errs by less than a thousandth; equal speeds are not interpolated."""
    other = run_up(speeds_rpm=np.arange(1013.0, 4000.0, 7.0))
    found = ct.compare(run_up(), other, tolerance=1e-3)
    orders = rows(found, "order")
    assert all(1500.0 <= one["speed_rpm"] <= 4000.0 and one["passed"] for one in orders.values())
    a, b = on_common_speeds(run_up(), run_up(speeds_rpm=np.arange(2000.0, 3001.0, 60.0)))
    np.testing.assert_allclose(a.speeds_rpm, np.arange(2000.0, 3001.0, 60.0))
    np.testing.assert_allclose(a.order(4.5), b.order(4.5), rtol=1e-12)
    pair = {"a": run_up(), "b": run_up(hz=202.0)}
    *_, apart = order_overlay(pair, TORSION, [6.0]).axes[0].lines
    expected = np.degrees(np.abs(pair["b"].order(6.0) - pair["a"].order(6.0)))
    np.testing.assert_allclose(apart.get_ydata(), expected)


def test_a_speed_without_result_counts_and_spoils_nothing_else():
    lost = run_up()
    lost.amplitudes[TORSION][10] = math.nan
    found = ct.compare(run_up(), lost)
    assert [one["quantity"] for one in found["differences"] if not one["passed"]] == ["speeds"]
    assert found.worst["speed_rpm"] == pytest.approx(1700.0) and (found.worst["a"], found.worst["b"]) == (151, 150)
    assert ct.compare(lost, lost).within
    near = on_common_speeds(lost, run_up(speeds_rpm=np.arange(1505.0, 4400.0, 30.0)))[0]
    np.testing.assert_array_equal(near.speeds_rpm[~near.with_result].round(), [1685.0, 1715.0])


def test_a_peak_without_partner_is_held_against_the_other_curve():
    """A second mode appears in B, or only a ripple that just counts as a peak."""

    def with_mode(size):
        made = run_up()
        made.amplitudes[TORSION][:, 0] += response(made.speeds_rpm, 3.0, 90.0, 0.02, size)
        return made

    alone = [one for one in rows_of_peaks(ct.compare(run_up(), with_mode(1.0))) if one["speed_rpm"] < 2000.0]
    (one,) = (own for own in alone if own["order"] == 3.0)
    assert one["quantity"] == "peak-height" and one["speed_rpm"] == pytest.approx(1800.0, rel=0.01)
    assert one["difference"] > 5.0
    assert all(own["passed"] for own in rows_of_peaks(ct.compare(run_up(), with_mode(1e-5))))


def rows_of_peaks(found):
    return [one for one in found["differences"] if one["quantity"].startswith("peak")]


def measured(factor=1.0, hz=200.0, turn=0.0):
    found = MeasuredOrders()
    for order in (3.0, 6.0):
        speeds = np.arange(1600.0, 4400.0, 15.0)
        values = factor * response(speeds, order, hz)
        points = zip(speeds * RPM, np.abs(values), np.angle(values) + turn, np.full(speeds.size, math.nan), strict=True)
        found.put(TORSION, order, list(points))
    return found


def test_measured_orders_are_the_reference_and_their_phase_is_not_judged(tmp_path):
    path = tmp_path / "orders.csv"
    lines = ["speed_rpm,order,amplitude,unit,phase_deg"]
    for order, (speeds, sizes) in measured(1.0 / 1.03, 198.0, turn=1.0)[TORSION].items():
        lines += [f"{v / RPM},{order},{size},rad,57.3" for v, size in zip(speeds, sizes, strict=True)]
    path.write_text("\n".join(lines))
    for given in ((path, run_up()), (run_up(), path)):
        found = ct.compare(*given, tolerance="0.05,order=inf")
        assert found.within and found["a"] == str(path)
        for order in (3.0, 6.0):
            assert rows(found, "peak-speed")[order]["difference"] == pytest.approx(200.0 / 198.0 - 1.0, abs=3e-4)
            assert rows(found, "peak-height")[order]["difference"] == pytest.approx(0.03, abs=4e-3)
            assert abs(rows(found, "damping")[order]["difference"]) < 0.02
    # A run at one speed: order 6 is as large as the measurement says there, order 3 is not measured so large.
    size = abs(response(3000.0, 6.0, 198.0)) / 1.03
    one = run(more={TORSION: lambda angle: 1.03 * size * np.cos(6.0 * angle)})
    assert rows(ct.compare(path, one), "order")[6.0]["difference"] == pytest.approx(0.03, abs=1e-3)
    assert ct.compare(path, one).plot().axes


def test_tolerances_are_read_for_all_and_by_quantity():
    assert set(tolerances_of(())) == set(QUANTITIES) and tolerances_of(())["order"] == USUAL
    found = tolerances_of(tolerance_list(" damping=0.1, 0.01 ,order=inf"))
    assert (found["damping"], found["mean"], found["order"], found["speeds"]) == (0.1, 0.01, math.inf, 0.0)
    for text, said in (("dampng=1", "did you mean 'damping'"), ("x", "is no tolerance"), ("-1", "is no tolerance"),
                       ("order=nan", "is no tolerance")):  # fmt: skip
        with pytest.raises(InputError, match=said):
            tolerance_list(text)


def test_what_cannot_be_compared_is_refused_in_one_line():
    far = run_up(speeds_rpm=np.arange(5000.0, 6000.0, 20.0))
    other = LoadedRun(run().time, run().angle, {"own.output": np.sin(run().angle)}, {})
    for pair, options, said in (
        ((run(), run_up()), {}, "is a run-up"),
        ((run_up(), far), {}, "A is from 1500 to 4500, B is from 5000 to 5980 rev/min"),
        ((run(), other), {}, "have no output in common"),
        ((run(), run()), {"outputs": "pulley.torsoin"}, "did you mean 'pulley.torsion'"),
        ((run(), 5), {}, "b is 5, of type int"),
        ((run(), run(turns=1)), {}, "B: last cycle: the run covers 360.0 of 720 deg"),
    ):
        with pytest.raises(InputError, match=said):
            ct.compare(*pair, **options)


def test_the_command_lists_settings_draws_and_ends_with_the_verdict(tmp_path, capsys):
    up = [str(run_up(hz, crank=crank).save(tmp_path / f"{hz}.h5")) for hz, crank in ((200.0, "beam"), (201.0, "solid"))]
    picture = tmp_path / "picture.png"
    assert main(["compare", *up, "--picture", str(picture)]) == 1
    said = capsys.readouterr().out
    assert "crank: beam | solid" in said and "FAILED: " in said and picture.stat().st_size > 10_000
    assert main(["compare", *up, "--tolerance", "0.01,order=1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["passed"] and found["settings"] == [{"name": "crank", "a": "beam", "b": "solid"}]
    assert found["tolerances"]["order"] == 1.0
    assert main(["compare", up[0], up[0], "--tolerance", "0"]) == 0
    assert main(["compare", up[0], str(tmp_path / "none.h5")]) == 2


@pytest.mark.parametrize("name", ct.engines())
def test_steps_of_an_engine_differ_by_less_than_the_usual_tolerance(name):
    """Of pulley, flywheel, shaft and a big end."""
    speed = 0.7 * ct.load_engine(name).speeds[1] / RPM
    usual = ct.simulate(name, speed_rpm=speed, crank="torsional")
    fine = ct.simulate(name, speed_rpm=speed, crank="torsional", step_deg=2)
    outputs = "pulley.torsion,flywheel.torsion,shaft.torque,big_end[1].force.y"
    found = ct.compare(fine, usual, outputs=outputs)
    assert found.within and {one["output"] for one in found["differences"]} == set(outputs.split(","))
    assert [one["name"] for one in found["settings"]] == ["step"]
    assert found.to_dataframe().difference.abs().max() > 0.0
