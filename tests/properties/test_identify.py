"""Identification of engines: values found again from their orders, files written, what is refused in one line."""

import json
import math
import re
import tomllib

import numpy as np
import pytest
from identified import identified, model_of, places, stated, write_orders
from one_line import one_line
from refusals import refused_files

import cranktrain as ct
from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.core.threads import one_thread
from cranktrain.core.units import RPM
from cranktrain.engine.file import engine_provenance, load_engine
from cranktrain.results.views.found import VerbResult
from cranktrain_lab.identification.data import Data, Shape, read_data
from cranktrain_lab.identification.decays import measured_damping_ratio
from cranktrain_lab.identification.identify import identify
from cranktrain_lab.identification.model import TorsionalModel, shape_of
from cranktrain_lab.identification.parameters import sought_parameters
from cranktrain_lab.identification.tables import MeasuredTable, OrdersTable, SoughtTable
from cranktrain_lab.identification.written import identified_text

SPEEDS = np.linspace(1500.0, 5000.0, 22) * RPM
ORDERS = (2.0, 4.0, 6.0)
FIRST, SECOND = "damping.torsional_ratios[1]", "damping.torsional_ratios[2]"
TRUE = {FIRST: 0.04, "load": 0.95, "pulley.polar_inertia": 1.1}
PARAMETERS = """
[parameters]
"damping.torsional_ratios[1]" = { low = 0.01, high = 0.1 }
load = { low = 0.8, high = 1.2 }
"pulley.polar_inertia" = { low = "-40 %", high = "+40 %" }
"""
ORDERS_OF_PULLEY = """
[[orders]]
name = "pulley"
file = "orders.csv"
"""
DECAY = "[[decay]]\ndamping_ratio = 0.3\n"
TARGET = '[targets.t]\nshape = "torsional"\nhz = 238\ntolerance = 0.01\nsource = "test"\n'
STRANDS = places(SPEEDS, ORDERS, deviation=1e-5)


@pytest.fixture(scope="module")
def four(tmp_path_factory):
    return stated("four_petrol", tmp_path_factory.mktemp("four"))


@pytest.fixture(scope="module")
def truth(four):
    """Model with the true values, and its orders by harmonic balance and by the linear level."""
    with one_thread():
        model = model_of(load_engine(four), TRUE, Data(STRANDS))
        values = np.array([TRUE[FIRST], TRUE["load"], inertia(four)])
        return model, values, model.balanced(values), model.answers(values).strands


def inertia(four):
    """The true value of the pulley."""
    return TRUE["pulley.polar_inertia"] * load_engine(four).pulley.polar_inertia


def write(folder, orders, noise=1e-5, speeds=None, **more):
    strands = STRANDS if speeds is None else places(speeds, ORDERS)
    write_orders(folder / "orders.csv", strands, orders, noise, **more)


def measured(folder, text, name="measured.toml"):
    path = folder / name
    path.write_text(text, "utf-8")
    return path


def quick(four, path, **more):
    return identified(four, path, **more)[1]


def test_values_are_found_again_from_a_higher_level_and_written_with_their_intervals(four, truth, tmp_path):
    """Data by harmonic balance with noise; the linear fit is corrected. 3 standard deviations, and 5 % of damping."""
    write(tmp_path, truth[2])
    path = measured(tmp_path, PARAMETERS + ORDERS_OF_PULLEY + "\n[hold_out]\nspeeds_rpm = [3000, 4500]\n")
    report = ct.identify(four, path, output=tmp_path / "new.toml", bootstrap=50, above="none")
    found = {row["key"]: row for row in report["parameters"]}
    for key, true in {**TRUE, "pulley.polar_inertia": inertia(four)}.items():
        row = found[key]
        assert abs(math.log(row["value"] / true)) < 3.0 * 0.01 * row["deviation_percent"], key
        assert row["low"] < row["value"] < row["high"]
        assert row["covariance"] == pytest.approx(row["profile"], rel=0.02)
    assert found[FIRST]["value"] == pytest.approx(0.04, rel=0.05)
    assert [level["level"] for level in report["levels"]] == ["linear", "harmonic-balance"]
    assert len(report["held_out"]) == 6 and sum(row["inside"] for row in report["held_out"]) >= 5
    assert not report["systematic"] and not report["told_apart"]
    new = load_engine(tmp_path / "new.toml")
    assert new.damping.torsional_ratios == pytest.approx((found[FIRST]["value"], 0.03), rel=1e-3)
    assert new.pulley.polar_inertia == pytest.approx(found["pulley.polar_inertia"]["value"], rel=1e-3)
    origins = {key: (origin, note) for key, _, _, origin, note in engine_provenance(tmp_path / "new.toml")}
    origin, note = origins["pulley.polar_inertia"]
    assert origin == "identified" and "measured.toml" in note and "95 % from" in note
    before = four.read_text("utf-8").splitlines()
    changed = [line for line in (tmp_path / "new.toml").read_text("utf-8").splitlines() if line not in before]
    assert all(line.startswith("#") or "identified" in line or "follows pulley" in line for line in changed)


def test_zero_and_scale_of_an_encoder_are_found(four, truth, tmp_path):
    turned = [0.98 * np.exp(1j * order * math.radians(2.0)) * v for order, v in zip(ORDERS, truth[3], strict=True)]
    write(tmp_path, turned)
    text = '[parameters]\n"zero.pulley" = {}\n"scale.pulley" = {}\n"pulley.polar_inertia" = {}\n' + ORDERS_OF_PULLEY
    found, _ = identified(four, measured(tmp_path, f"load = 0.95\n{text}"), method="linear")
    assert found["zero.pulley"]["value"] == pytest.approx(2.0, abs=0.2)


def test_decay_and_shape_are_sets_of_their_own(four, tmp_path):
    """A decrement δ is a ratio δ/√(4π² + δ²); a shape is compared in any scale."""
    made = model_of(load_engine(four), ["load"], Data()).assembly(np.array([1.0]))
    own = shape_of(made, Shape("s", 1, ("pulley", "main[3]", "flywheel"), np.array([1.0, 0.5, -0.2]), 0.01))
    shape = ", ".join(f'"{k}" = {7.0 * v:.5f}' for k, v in zip(("pulley", "main[3]", "flywheel"), own, strict=True))
    decrement = 2.0 * math.pi * 0.05 / math.sqrt(1.0 - 0.05**2)
    text = f"""[parameters]
"damping.torsional_ratios[1]" = {{}}
"pulley.polar_inertia" = {{}}
[[decay]]
log_decrement = {decrement:.6f}
deviation = 0.02
[[modes]]
shape = {{ {shape} }}
deviation = 0.01
"""
    found, report = identified(four, measured(tmp_path, text))
    assert found[FIRST]["value"] == pytest.approx(0.05, rel=1e-3)
    assert found[FIRST]["deviation_percent"] == pytest.approx(2.0, rel=0.05)
    assert found["pulley.polar_inertia"]["value"] == pytest.approx(load_engine(four).pulley.polar_inertia, rel=1e-3)
    assert next(row for row in report["numbers"] if row["kind"] == "mac")["computed"] > 0.9999


def test_a_free_decay_is_read_from_its_signal(four, tmp_path):
    recording(tmp_path / "ring.csv", 10000, 0.08, hz=430.0, ratio=0.03, noise=0.0)
    text = '[parameters]\n"damping.torsional_ratios[1]" = {}\n[[decay]]\nfile = "ring.csv"\nchannel = "twist"\n'
    report = quick(four, measured(tmp_path, text))
    assert report["numbers"][0]["measured"] == pytest.approx(0.03, rel=1e-3)


def recording(path, rate, seconds, begin=0.0, hz=300.0, ratio=0.02, noise=0.01, digits=7, lost=math.inf):
    """File of a free decay from ``begin`` s on, with noise and rounded times; no number from ``lost`` s on."""
    times = np.arange(int(seconds * rate)) / rate
    after = np.clip(times - begin, 0.0, None)
    values = (times >= begin) * np.exp(-2 * np.pi * hz * ratio * after) * np.cos(2 * np.pi * hz * after)
    values += noise * np.random.default_rng(5).normal(size=times.size)
    values[times >= lost] = math.nan
    rows = "".join(f"{t:.{digits}f},{v:.6g}\n" for t, v in zip(times, values, strict=True))
    path.write_text("time [s],twist [mdeg]\n" + rows, "utf-8")
    return path


@pytest.mark.parametrize(
    "state",
    [
        {"rate": 51200, "seconds": 0.4},  # steps of 19.5 us that the file rounds to 0.1 us
        {"rate": 20000, "seconds": 0.5, "begin": 0.15},  # 3000 samples before the trigger
        {"rate": 50000, "seconds": 2.0, "hz": 25.0, "ratio": 0.05},  # 2000 samples are one cycle
        {"rate": 5000, "seconds": 0.1, "digits": 4},
    ],
)
def test_a_decay_is_found_in_a_long_recording(tmp_path, state):
    path = recording(tmp_path / "ring.csv", **state)
    assert measured_damping_ratio(path, None, "ring") == pytest.approx(state.get("ratio", 0.02), rel=0.03)


@pytest.mark.parametrize(
    ("state", "said"),
    [
        ({"rate": 5000, "seconds": 0.3, "begin": 9.0}, "no decaying oscillation: the largest, of .* Hz, is . %"),
        ({"rate": 5000, "seconds": 0.1, "digits": 3}, "has no even steps of time; export it at even times"),
        ({"rate": 5000, "seconds": 0.3, "ratio": 0.0, "noise": 0.0}, "does not decay: its largest oscillation, of 300"),
        ({"rate": 20000, "seconds": 0.3, "lost": 0.2}, "has samples that are no numbers"),  # thinned to 2000 samples
    ],
)
def test_a_recording_without_decay_or_even_times_is_refused(tmp_path, state, said):
    with one_line(match=said):
        measured_damping_ratio(recording(tmp_path / "ring.csv", **state), "twist", "ring")


def test_a_file_of_targets_alone_is_a_calibration(monkeypatch, tmp_path):
    """The same function with the same arguments; what the tolerances say of each value is added."""
    given = {
        "refused": None, "interrupted": False,
        "targets": 2 * [{"sensitivities": {"a.b": 0.5, "c.d": -0.5}, "tolerance_percent": 1.0}],
        "parameters": [{"key": key, "value": 2.0, "low": 1.0, "high": 4.0, "unit": "1"} for key in ("a.b", "c.d")],
    }  # fmt: skip
    asked = []
    monkeypatch.setattr(
        "cranktrain_lab.cli.targets.calibrated",
        lambda engine, targets, output, seed, evaluations: asked.append((targets, seed)) or VerbResult.of(given, "x"),
    )
    text = TARGET + '[parameters]\n"flywheel.mass" = { low = 1, high = 2 }\n'
    report = ct.identify("diesel_i6", measured(tmp_path, text), seed=5)
    assert asked[0][1] == 5 and str(asked[0][0]).endswith("measured.toml")
    (line,) = report["told_apart"]
    assert "a.b and c.d cannot be told apart" in line.replace("c.d and a.b", "a.b and c.d")
    # ln 4 over √12 along the sum, which no frequency knows: 40 % for both.
    known = 100.0 * math.log(4.0) / math.sqrt(24.0)
    assert report["parameters"][0]["deviation_percent"] == pytest.approx(known, rel=0.01)


SETS = {
    "orders": "", "nothing": "", "decay alone": DECAY, "decay": DECAY, "frequencies": "[[frequencies]]\nhz = 900\n",
    "hold_out": "[hold_out]\nspeeds_rpm = [900]\n", "shape": "[[modes]]\nshape = { pulley = 1, flywheel = 5 }\n",
    "both": f'{TARGET}[derived]\n"flywheel.mass" = {{ formula = "pulley.mass" }}\n',
}  # fmt: skip


@pytest.mark.parametrize(("parameters", "sets", "changed", "message"), refused_files()["identify"]["calls"])
def test_bad_input_is_one_line(four, truth, tmp_path, parameters, sets, changed, message):
    """What is changed of the set of orders: a text is that of a key, anything else belongs to the table."""
    keys = {key: value for key, value in changed.items() if isinstance(value, str)}
    table = {key: SPEEDS * value if key == "speeds" else value for key, value in changed.items() if key not in keys}
    write(tmp_path, truth[3], **table)
    orders = {"name": "pulley", "file": "orders.csv"} | keys
    lines = [f"{key} = {value if value[0] in '[' else json.dumps(value)}\n" for key, value in orders.items()]
    text = "".join(["[[orders]]\n", *lines] if sets not in ("nothing", "decay alone", "frequencies") else [])
    with one_line(match=message):
        path = measured(tmp_path, f"[parameters]\n{parameters}\n{text}{SETS[sets]}")
        quick(four, path, output=tmp_path / "new.toml")
    assert not (tmp_path / "new.toml").exists()


WITHIN = slice(16)
CONTRADICTING = {
    "nothing depends on it": (
        f'[parameters]\n"{SECOND}" = {{ low = 0.02, high = 0.04 }}\n{ORDERS_OF_PULLEY}orders = [2]\n', {"noise": 1e-4},
        r"torsional_ratios\[2\]': nothing in the data depends on it; from 0.02 to 0.04 .*leave it out, or add a "
        r"free decay of mode 2, known to 5 % \(\[\[decay\]\] number = 2\), which would tell it to ±9",
    ),
    "two sets": (
        f"{PARAMETERS}{ORDERS_OF_PULLEY}[[decay]]\ndamping_ratio = 0.08\ndeviation = 0.02\n", {},
        r"'pulley' and 'decay 1' contradict each other: chi-square \d+ for 1 .*wants",
    ),
    "another engine": (
        PARAMETERS + ORDERS_OF_PULLEY, {"turned": lambda one: np.conj(one[::-1])},
        r"is not the engine's|explain .* of its squared amplitudes",
    ),
    "a peak elsewhere": (
        '[parameters]\nload = {}\n"pulley.polar_inertia" = { low = "-5 %", high = "+5 %" }\n' + ORDERS_OF_PULLEY,
        {"turned": lambda one: one[WITHIN], "speeds": 1.2 * SPEEDS[WITHIN]},
        r"the peak of order \d at \d+ rev/min, \d+\.\d Hz, is not the engine's: with",
    ),
}  # fmt: skip
"""The second mode's damping by an order far below it; a decay against the orders; the same orders at speeds from last
to first, and at speeds a fifth higher, of which those within the engine's are measured."""


@pytest.mark.parametrize("case", CONTRADICTING)
def test_data_that_no_values_within_the_bounds_explain_are_refused(four, truth, tmp_path, case):
    text, changed, message = CONTRADICTING[case]
    table = {key: value for key, value in changed.items() if key != "turned"}
    write(tmp_path, list(map(changed.get("turned", np.asarray), truth[3])), **table)
    with pytest.raises(InputError, match=message):
        quick(four, measured(tmp_path, text), method="linear")


def test_values_of_one_list_have_their_own_intervals_in_its_note(four):
    """A note on one value of a list does not speak of the others, which are as they were."""
    engine, text = load_engine(four), four.read_text("utf-8")
    sought = sought_parameters(engine, {f"oil.temperatures[{k}]": SoughtTable(unit="degC") for k in (1, 2)}, [], 1.0)
    rows = [
        {"key": one.key, "value": 80.0 + k, "unit": "degC", "low": 70.0 + k, "high": 90.0 + k}
        for k, one in enumerate(sought)
    ]
    found = tomllib.loads(identified_text(text, engine, sought, rows, "data.toml", "four.toml"))["oil"]["temperatures"]
    assert found["value"] == [80, 81]
    for k in (0, 1):
        assert (
            f"value {k + 1} from data.toml" in found["note"] and f"95 % from {70 + k} to {90 + k} degC" in found["note"]
        )


def test_a_value_without_a_place_in_the_engine_file_is_refused_before_the_search(four, truth, tmp_path, monkeypatch):
    write(tmp_path, truth[3])
    text, entry = four.read_text("utf-8"), "torsional_ratios"
    line = next(one for one in text.splitlines() if one.startswith(entry))
    dotted = f'{entry}.value = [0.03, 0.03]\n{entry}.unit = "1"\n{entry}.origin = "chosen"'
    own = measured(tmp_path, text.replace(line, dotted), "own.toml")
    monkeypatch.setattr(f"{identify.__module__}.climb", None)  # a search would fail
    with pytest.raises(InputError, match=r"damping.torsional_ratios: is not written as torsional_ratios = "):
        quick(own, measured(tmp_path, PARAMETERS + ORDERS_OF_PULLEY), method="linear", output=tmp_path / "new.toml")


def test_peak_to_peak_amplitudes_are_doubted_in_a_sentence(four, truth, tmp_path, capsys):
    """In orders of the gas the load takes up the factor of two, as far as its bound lets it."""
    write(tmp_path, truth[3], factor=360.0 / math.pi)
    hint = "amplitudes are zero to peak: peak-to-peak ones are twice as large"
    for high, said in (
        (2.5, rf"load is [12]\.\d+ times the full load of the engine file; {hint}"),
        (1.5, rf"load lies at its upper bound, 1\.5: the data want more, .*; widen the bound; {hint}"),
    ):
        text = f"[parameters]\nload = {{ low = 0.5, high = {high} }}\n{ORDERS_OF_PULLEY}orders = [4, 6]\n"
        (line,) = quick(four, measured(tmp_path, text), method="linear")["doubts"]
        assert re.search(said, line)
    options = ["--method", "linear", "--above", "none", "--no-profile", "--bootstrap", "0"]
    assert main(["identify", str(four), str(tmp_path / "measured.toml"), *options]) == 0
    assert "Doubtful: load lies at its upper bound" in capsys.readouterr().out


def test_an_order_that_is_named_twice_counts_once(four, truth, tmp_path):
    """Its noise would otherwise seem to be smaller."""
    write(tmp_path, truth[2])
    table = MeasuredTable(orders=[OrdersTable(file="orders.csv", orders=[4.0, 2.0, 4.0])])
    found = read_data(load_engine(four), table, tmp_path / "measured.toml")
    assert [one.order for one in found.strands] == [2.0, 4.0]


def test_an_existing_file_is_kept_and_the_command_exits_with_2(four, truth, tmp_path, capsys):
    write(tmp_path, truth[3])
    path, kept = measured(tmp_path, PARAMETERS + ORDERS_OF_PULLEY), tmp_path / "kept.toml"
    kept.write_text("mine", "utf-8")
    assert main(["identify", str(four), str(path), "--output", str(kept), "--json"]) == 2
    assert "exists and is not overwritten" in json.loads(capsys.readouterr().out)["error"]["what"]
    assert kept.read_text("utf-8") == "mine"


def test_an_interrupt_keeps_the_best_and_says_so(four, truth, tmp_path, monkeypatch, capsys):
    write(tmp_path, truth[3])
    path, calls = measured(tmp_path, PARAMETERS + ORDERS_OF_PULLEY), []
    own = TorsionalModel.answers

    def answers(self, values):
        calls.append(values)
        if len(calls) == 70:
            raise KeyboardInterrupt
        return own(self, values)

    monkeypatch.setattr(TorsionalModel, "answers", answers)
    assert main(["identify", str(four), str(path), "--output", str(tmp_path / "best.toml")]) == 130
    told = capsys.readouterr()
    assert "the best values so far are in" in told.err and "The search was interrupted" in told.out
    text = (tmp_path / "best.toml").read_text("utf-8")
    entry = tomllib.loads(text)["pulley"]["polar_inertia"]
    assert entry["origin"] == "identified"
    # No fit has ended there, so there is no interval.
    assert "best so far of an interrupted search, without interval" in entry["note"]
    assert "95 % from" not in text


@pytest.mark.parametrize(
    "part", ["model.TorsionalModel.balanced", *(f"identify.{p}" for p in ("profiles", "bootstrap", "advised"))]
)
def test_an_interrupt_behind_the_linear_fit_keeps_its_values(four, truth, tmp_path, monkeypatch, capsys, part):
    """In a higher level, or in intervals, which come after all runs."""
    write(tmp_path, truth[3])
    path, new = measured(tmp_path, PARAMETERS + ORDERS_OF_PULLEY), tmp_path / "best.toml"

    def interrupted(*given):
        raise KeyboardInterrupt

    monkeypatch.setattr(f"cranktrain_lab.identification.{part}", interrupted)
    levels = [] if "balanced" in part else ["--method", "linear", "--above", "none"]
    assert main(["identify", str(four), str(path), "--output", str(new), *levels]) == 130
    assert "the best values so far are in" in capsys.readouterr().err
    assert load_engine(new).pulley.polar_inertia == pytest.approx(inertia(four), rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "trials", "more"),
    [
        ("diesel_i6", 100, []),
        ("four_petrol", 100, []),
        # The damper dominates the damping of its mode: orders alone do not know that of the crank.
        ("diesel_v8", 40, ["--decay", "0.05", "--flywheel", "--speeds", "48"]),
        ("diesel_i6", 10, ["--teeth-mdeg", "10"]),
        ("four_petrol", 10, ["--teeth-mdeg", "2"]),
    ],
)
def test_intervals_hold_the_true_values_in_nine_of_ten_trials(name, trials, more, monkeypatch, capsys):
    """True values by harmonic balance, fitted linearly: a level lower than the truth."""
    from benchmarks import identify_trials

    monkeypatch.setattr("sys.argv", ["identify_trials", "--engines", name, "--trials", str(trials), *more])
    identify_trials.main()
    said = json.loads(capsys.readouterr().out.strip().splitlines()[-1])
    assert said["trials"] == trials
    for key, covered in said["covered"].items():
        assert covered >= 0.9 * trials, key
    assert said["rms_percent"].get("damper.viscosity", 0.0) < 5.0
    assert said["rms_percent"]["damping.torsional_ratios[1]"] < 10.0


def test_a_per_cent_with_a_sign_is_a_change_and_one_without_is_the_value_of_a_factor(four):
    table = SoughtTable(low="-10 %", high="115 %")
    (load,) = sought_parameters(load_engine(four), {"load": table}, [], 1.2)
    assert (load.low, load.high) == pytest.approx((0.9 * 1.2, 1.15))
