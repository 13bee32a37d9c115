"""What test benches and acquisition programs write, with right answers that are known before it is read."""

import datetime as dt
from pathlib import Path

import numpy as np
import pytest
from measured_files import write

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.loads.pressure_file import read_pressure
from cranktrain.loads.pressure_points import read_points
from cranktrain.loads.pressure_units import header_unit
from cranktrain_lab.measured.analysis import orders_of, rotations_of
from cranktrain_lab.measured.channels import Channel, Measurement, of_array

RATE = 25e3
ORDERS = {0.5: (0.03, 10), 2: (0.30, 40), 4: (0.10, -70)}
"""Order: amplitude and phase, deg."""


def motion(t, start, end, orders):
    """Angle (rad) at times t (s) of a wheel from ``start`` to ``end`` rev/min, with cos(order angle + phase)."""
    rate = (end - start) * 2 * np.pi / 60 / (t[-1] + t[1])
    angle = start * 2 * np.pi / 60 * t + 0.5 * rate * t**2
    return angle + sum(np.radians(a) * np.cos(o * angle + np.radians(p)) for o, (a, p) in orders.items())


def times(seconds, rate=RATE):
    """Times (n,) s of samples."""
    return np.arange(round(rate * seconds)) / rate


def sine_teeth(angle, teeth, missing=()):
    """A whole sine a tooth, nothing in a gap."""
    place = angle / (2 * np.pi) * teeth
    there = np.ones(teeth)
    there[list(missing)] = 0
    return np.sin(2 * np.pi * (place % 1)) * there[np.floor(place).astype(int) % teeth]


def inductive(angle, teeth, missing, noise=0.02):
    """An inductive pick-up: the flux of a tooth is a bell, the voltage its derivative; flat zero in a gap."""
    place = angle / (2 * np.pi) * teeth
    whole = np.floor(place).astype(int)
    out = np.zeros(len(angle))
    for j in (-1, 0, 1, 2):
        d = (place - whole - j - 0.5) / 0.24
        out += np.where((whole + j) % teeth != missing, -2 * d * np.exp(-(d**2)), 0)
    out *= np.gradient(angle, 1 / RATE)
    return 5 * out / np.abs(out).max() + noise * np.random.default_rng(1).standard_normal(len(angle))


def edges(teeth, seconds, start, end, orders):
    """Times (k,) s of the teeth's edges."""
    t = np.linspace(0, seconds, 100_001 * seconds)
    angle = motion(t, start, end, orders)
    return np.interp(np.arange(1, int(angle[-1] / (2 * np.pi) * teeth)) * 2 * np.pi / teeth, angle, t)


def channel(values, name="crank", unit="V"):
    """Channel of samples in memory."""
    return Channel(name, unit, values.size, "bench", of_array(values), 0.0, 1.0 / RATE)


RPM = 30.0 / np.pi


def by_rotation(signal, orders=(2.0, 4.0), **asked):
    """Rotation of a channel, and mean amplitudes of its orders, deg."""
    measurement = Measurement((signal,))
    (one,) = rotations_of(measurement, ct.AnalyseMeasured((), rotation=signal.name, **asked))
    (found,) = orders_of(measurement, [one], orders)
    return one, np.degrees(np.abs(found.amplitudes.mean(axis=0)))


@pytest.mark.parametrize(("sign", "edge"), [(1, None), (-1, None), (1, "rising"), (-1, "falling")])
def test_wires_of_a_pick_up_may_be_swapped(sign, edge):
    """A crossing that begins in the flat zero of the gap is late; it adds 0.15 deg to order 2 and 0.1 to order 4."""
    t = times(8)
    signal = channel(sign * inductive(motion(t, 900, 1800, ORDERS), 36, 35))
    one, found = by_rotation(signal, (1.0, 2.0, 4.0), teeth=36, missing=1, edge=edge)
    np.testing.assert_allclose(found, [0.0, 0.30, 0.10], atol=0.01)
    assert any("of a pitch" in remark and "gap" in remark for remark in one.remarks) == (sign > 0 or edge == "falling")


@pytest.mark.parametrize(("teeth", "missing", "gaps"), [(60, 2, 3), (60, 2, 2), (36, 1, 2), (60, 1, 4), (60, 2, 1)])
def test_equal_gaps_look_alike(teeth, missing, gaps):
    """Speed and sizes of orders are those of the stated teeth, however these are counted; tooth 0 stays open."""
    part = teeth // gaps
    there = [g * part - m - 1 for g in range(1, gaps + 1) for m in range(missing)]
    signal = channel(-sine_teeth(motion(times(6), 700, 1500, ORDERS), teeth, there))
    for stated in (teeth, teeth - gaps * missing):
        one, found = by_rotation(signal, teeth=stated)
        assert one.wheel.name == f"{teeth}" + f"-{missing}" * gaps and one.numbered.lost == 0
        np.testing.assert_allclose(np.array(one.speed_range) * RPM, [700, 1500], rtol=0.01)
        np.testing.assert_allclose(found, [0.30, 0.10], atol=2e-3)
        said = "cannot be told" if gaps > 1 else "58 are the teeth that are there" if stated == 58 else ""
        assert any(said in remark for remark in one.remarks)
    if gaps > 1:
        with pytest.raises(InputError, match=f"{part}-{missing} at .* give the teeth a revolution"):
            by_rotation(signal)


def _tdms(path, columns, starts):
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(str(path)) as file:
        file.write_segment([
            ChannelObject("Box", name, data, {"wf_increment": 1 / RATE, "wf_start_offset": 0.0, "wf_start_time": start})
            for (name, data), start in zip(columns.items(), starts, strict=True)
        ])  # fmt: skip


def _mdf(folder, columns, starts):
    from asammdf import MDF, Signal

    paths = []
    for (name, data), start in zip(columns.items(), starts, strict=True):
        with MDF(version="4.10") as file:
            file.header.start_time = start.replace(tzinfo=dt.UTC)
            file.append([Signal(data, np.arange(len(data)) / RATE, name=name, unit="V")])
            paths.append(folder / f"{name}.mf4")
            file.save(paths[-1], overwrite=True)
    return paths


def _lvm(path, columns, starts):
    n = max(map(len, columns.values()))
    heads = ["LabVIEW Measurement\t", "Separator\tTab", "Decimal_Separator\t,", "Multi_Headings\tNo", "X_Columns\tNo",
             "Time_Pref\tRelative", "***End_of_Header***\t", "\t", f"Channels\t{len(columns)}\t",
             "Date" + "".join(f"\t{start:%Y/%m/%d}" for start in starts),
             "Time" + "".join(f"\t{start:%H:%M:%S},{start.microsecond:06d}0000000000" for start in starts),
             "Delta_X" + f"\t{1 / RATE:.6E}".replace(".", ",") * len(columns), "***End_of_Header***\t",
             "X_Value\t" + "\t".join(columns) + "\tComment"]  # fmt: skip
    cells = [[f"{value:.7f}".replace(".", ",") for value in data] + [""] * (n - len(data)) for data in columns.values()]
    rows = ["\t" + "\t".join(row) for row in zip(*cells, strict=True)]
    path.write_text("\n".join([*heads, *rows]) + "\n")


@pytest.mark.parametrize("kind", ["tdms", "mdf", "lvm"])
def test_channels_that_begin_later_are_placed_in_time(kind, tmp_path):
    """Twist of 0.18 deg at −148 deg between 0.02 and 0.20 deg at 20 deg, the second recorded 0.755 s later."""
    late, n = 0.755, 1503.0
    fly = sine_teeth(motion(times(5), n, n, {4: (0.02, 20)}), 120)
    pulley = -sine_teeth(motion(times(6)[round(late * RATE) :], n, n, {4: (0.20, 20)}), 60, [58, 59])
    columns, begin = {"flywheel": fly, "pulley": pulley}, dt.datetime(2026, 11, 28, 23, 59, 59, 500_000)
    starts = [begin, begin + dt.timedelta(seconds=late)]
    if kind == "mdf":
        found = ct.read_measured(*_mdf(tmp_path, columns, starts))
    else:
        {"tdms": _tdms, "lvm": _lvm}[kind](path := tmp_path / f"run.{kind}", columns, starts)
        found = ct.read_measured(path)
    assert any("0.755 s behind" in remark for remark in found.remarks)
    asked = ct.AnalyseMeasured((), rotation="flywheel", teeth=120, second="pulley", second_teeth=60, second_missing=2)
    rotations = rotations_of(found, asked)
    twist = orders_of(found, rotations, [4.0])[-1].amplitudes.mean(axis=0)[0]
    assert np.degrees(abs(twist)) == pytest.approx(0.18, abs=1e-3)


def test_invalid_samples_of_mdf_keep_their_time(tmp_path):
    from asammdf import MDF, Signal

    bad = np.isin(np.arange(400), range(100, 110))
    with MDF(version="4.10") as file:
        file.append([Signal(np.arange(400.0), np.arange(400) / 100, name="a", unit="V", invalidation_bits=bad)])
        file.save(tmp_path / "run.mf4", overwrite=True)
    one = ct.read_measured(tmp_path / "run.mf4")["a"]
    assert one.size == 400 and one.rate == pytest.approx(100.0)
    np.testing.assert_array_equal(one.values(), np.where(bad, np.nan, np.arange(400.0)))


def test_each_structure_has_its_own_rate_and_start(tmp_path):
    import h5py
    from scipy.io import savemat

    crank, oil = np.sin(np.arange(5000.0)), np.full(80, 90.0)
    savemat(tmp_path / "a.mat", {"meas": {"crank": {"data": crank, "unit": "V", "fs": 25e3, "t0": 0.5},
                                          "oil": {"data": oil, "fs": 10.0}}})  # fmt: skip
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, data, rate in (("crank", crank, 25e3), ("oil", oil, 10.0)):
            file[f"meas/{name}/data"] = data
            file[f"meas/{name}"].attrs["fs"] = rate
        file["meas/crank"].attrs["t0"] = 0.5
    for name in ("a.mat", "a.h5"):
        found = ct.read_measured(tmp_path / name)
        assert {one.name.split("/")[1]: one.rate for one in found.channels} == pytest.approx({"crank": 25e3, "oil": 10})
        assert {one.start for one in found.channels} == {0.5, 0.0}


def test_labview_text_with_an_abscissa_before_each_channel_and_in_segments(tmp_path):
    t = np.arange(300) / 1000
    head = "Channels,2,,\nX0,0,0,\nY_Unit_Label,V,bar,\n***End_of_Header***,,,\nX_Value,a,X_Value,b,Comment\n"
    begin = "LabVIEW Measurement,\nSeparator,Comma\nMulti_Headings,Yes\nX_Columns,Multi\n***End_of_Header***,\n,\n"
    text = begin
    for part in (0, 1):
        own = t + 0.3 * part
        text += "\n" * part + head + "".join(f"{x},{np.sin(50 * x):.9f},{2 * x},{np.cos(x):.9f}\n" for x in own)
    (tmp_path / "run.lvm").write_text(text)
    found = ct.read_measured(tmp_path / "run.lvm")
    assert [(one.name, one.unit, one.size) for one in found.channels] == [("a", "V", 600), ("b", "bar", 600)]
    assert [one.rate for one in found.channels] == pytest.approx([1000.0, 500.0])
    np.testing.assert_allclose(found["b"].values(), np.cos(found["b"].abscissae() / 2), atol=1e-8)


@pytest.mark.parametrize(("head", "scale", "bits", "clock"), [
    ("edge (s)", None, 0, None), ("edge (ticks of 80 MHz)", 80e6, 64, None),
    ("edge (ticks of 80 MHz)", 80e6, 24, None), ("edge", 10e6, 16, 10e6), ("", 10e6, 32, 10e6),
])  # fmt: skip
def test_a_column_of_edges(head, scale, bits, clock, tmp_path):
    """Times of 36 teeth from 1200 to 1800 rev/min, in s or in ticks that wrap around; 2²⁴ of 80 MHz last 0.2 s."""
    found = edges(36, 4, 1200, 1800, ORDERS)
    rows = [f"{x:.9f}" for x in found] if scale is None else [f"{round(x * scale) % 2**bits}" for x in found]
    path = tmp_path / "edges.csv"
    path.write_text("\n".join([*([head] if head else []), *rows]) + "\n")
    measurement = ct.read_measured(path)
    (one,) = rotations_of(measurement, ct.AnalyseMeasured((), rotation=measurement.names[0], teeth=36, clock_hz=clock))
    np.testing.assert_allclose(np.array(one.speed_range) * RPM, [1200, 1800], rtol=0.01)
    (orders,) = orders_of(measurement, [one], [0.5, 2.0, 4.0])
    np.testing.assert_allclose(np.degrees(np.abs(orders.amplitudes)).mean(axis=0), [0.03, 0.30, 0.10], atol=1e-3)
    assert any("begins again" in remark for remark in one.remarks) == (0 < bits < 32)


def test_edges_without_a_clock_are_asked_about(tmp_path):
    path = tmp_path / "edges.csv"
    path.write_text("\n".join(f"{k * 1000}" for k in range(1, 500)) + "\n")
    measurement = ct.read_measured(path)
    with pytest.raises(InputError, match="state its clock, --clock-hz"):
        rotations_of(measurement, ct.AnalyseMeasured((), rotation=measurement.names[0], teeth=36))


BEGIN = dt.datetime(2026, 11, 28, 23, 59, 59, 500_000)
AT = [BEGIN + dt.timedelta(seconds=k / 2000) for k in range(3000)]
CLOCKS = {
    "iso": ("time,a", lambda t: f"{t.isoformat(timespec='microseconds')}+01:00,"),
    "german": ("Zeit;a", lambda t: f"{t:%d.%m.%Y %H:%M:%S},{t.microsecond:06d};"),
    "clock": ("Uhrzeit;a", lambda t: f"{t:%H:%M:%S}.{t.microsecond:06d};"),
    "two columns": ("Date;Time;a", lambda t: f"{t:%Y-%m-%d};{t:%H:%M:%S}.{t.microsecond:06d};"),
    "afternoon": ("time\ta", lambda t: f"{t:%m/%d/%Y %I:%M:%S}.{t.microsecond:06d} {t:%p}\t"),
}


@pytest.mark.parametrize("kind", CLOCKS)
def test_times_of_day_across_midnight(kind, tmp_path):
    """2 kHz from half a second before midnight: to 1 µs even, though seconds since 1970 have 0.2 µs."""
    head, stamp = CLOCKS[kind]
    values = np.cos(np.arange(3000) / 7)
    rows = [stamp(at) + f"{v:.9f}" for at, v in zip(AT, values, strict=True)]
    (tmp_path / "run.csv").write_text("\n".join([head, *rows]) + "\n")
    one = ct.read_measured(tmp_path / "run.csv")["a"]
    assert one.rate == pytest.approx(2000.0, rel=1e-9)
    np.testing.assert_allclose(one.values(), values, atol=1e-9)


@pytest.mark.parametrize("form", [lambda t: t, dt.datetime.isoformat, dt.datetime.time, lambda t: t - BEGIN])
def test_times_of_parquet(form, tmp_path):
    """Stamps, texts, times of day and durations."""
    import pandas as pd

    pd.DataFrame({"when": list(map(form, AT)), "a": np.arange(3000.0)}).to_parquet(tmp_path / "run.parquet")
    one = ct.read_measured(tmp_path / "run.parquet")["a"]
    assert one.rate == pytest.approx(2000.0, rel=1e-9) and one.size == 3000


@pytest.mark.parametrize("fill", [f"{0.0:20.12E}", " " * 20])
def test_universal_files_fill_their_last_line(fill, tmp_path):
    """Lines of four values; the last one has one, and three zeros or blanks that are none."""
    values = np.cos(np.arange(101) / 5)
    path = write(tmp_path, "uff", 0.5 + np.arange(101) / 100, {"a": values})
    lines = path.read_text().splitlines()
    last = max(k for k, line in enumerate(lines) if line.strip() != "-1")
    lines[last] = lines[last].rstrip().ljust(20) + 3 * fill
    path.write_text("\n".join(lines) + "\n")
    found = ct.read_measured(path)
    (one,) = found.channels
    assert one.size == 101 and one.start == pytest.approx(0.5) and not any("cut short" in r for r in found.remarks)
    np.testing.assert_allclose(one.values(), values, rtol=1e-9)


def test_a_header_of_quantities_is_none_of_units():
    """Pc is a pressure's name here, and a charge in brackets; Fi, Tc and V are no units either."""
    path = Path(__file__).parents[1] / "data/bench/own.ind"
    assert read_points(path, ["1", "2"], 6).names == ["Pc"]
    assert header_unit(["Fi", "Pc"], "f") is None and header_unit(["deg", "Pc"], "f") is None
    with pytest.raises(InputError, match="'pc' is not known"):
        header_unit(["deg", "p [pC]"], "f")
    rest = None, 720, load_engine("diesel_i6")
    rows, told = read_pressure(f"{path}:1,2", "bar", *rest)
    assert rows[0].max() == pytest.approx(110.4e5, rel=5e-3) and "in bar" in told
    with pytest.raises(InputError, match=r"own\.ind, column Pc: .* --pressure-unit: .*bar \(110\.4 bar\)"):
        read_pressure(f"{path}:1,2", None, *rest)


def test_a_channel_keeps_its_place_when_it_is_shifted():
    uneven = np.array([0.0, 0.1, 0.3])
    one = Channel("a", "V", 3, "f", of_array(uneven), 0.0, float("nan"), of_array(uneven)).later(2.0)
    np.testing.assert_allclose(one.abscissae(), uneven + 2.0)
