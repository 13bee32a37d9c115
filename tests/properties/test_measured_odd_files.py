"""Odd measurement files of every format, made by the formats' own libraries: one line each, and nothing is lost."""

import tracemalloc
from decimal import Decimal

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
import scipy.sparse
from measured_files import FORMATS, write
from nptdms import ChannelObject, TdmsWriter
from one_line import one_line
from scipy.io import wavfile

import cranktrain as ct
from cranktrain_lab.measured.formats import matlab, uff

TIME = np.arange(600) / 2000.0
PULSES, PRESSURE = np.sin(360.0 * np.pi * TIME), 1.0 + 0.5 * np.cos(7.0 * TIME)
UNITS = {"tacho": "V", "pcyl1": "furlong"}
RNG = np.random.default_rng(0)


def with_pressure(values, **more):
    """Columns with other pressures, or further ones."""
    return {"tacho": PULSES, "pcyl1": values, **more}


ENDLESS, LOST = np.where(np.arange(600) == 5, np.inf, PRESSURE), np.where(np.arange(600) == 300, np.nan, TIME)
COUNTER = np.arange(600, dtype=np.int64) + 2**60 + 1
BLOCKS = np.concatenate([TIME[k : k + 20] + 0.01 * k for k in range(0, 600, 20)])
# Name → times, columns, words of the remark, formats that cannot have it
ODD = {
    "a time that is no number": (LOST, with_pressure(PRESSURE), "not numbers; their", "wav"),
    "times that repeat": (np.repeat(TIME[:300], 2), with_pressure(PRESSURE), "that of the sample before", "wav"),
    "a time that stands still": (np.zeros(600), with_pressure(PRESSURE), "stands still|a step of 0", "wav"),
    "times from last to first": (TIME[::-1].copy(), with_pressure(PRESSURE), "backwards|a step of -", "wav"),
    "time stamps that shake": (TIME + RNG.normal(0.0, 1e-5, 600), with_pressure(PRESSURE), "uneven steps", "wav"),
    "blocks with rests between": (BLOCKS, with_pressure(PRESSURE), "uneven steps|gaps", "wav"),
    "a time before zero": (TIME - 0.1, with_pressure(PRESSURE), "", "wav"),
    "an endless value": (TIME, with_pressure(ENDLESS), "1 of 600 values are not numbers", "uff uffb csv"),
    "a dead channel": (TIME, with_pressure(PRESSURE, dead=np.full(600, np.nan)), "no numbers|not numbers", "uff uffb"),
    "counts beyond float64": (TIME, with_pressure(COUNTER), "rounded to the 53 bits", "wav"),
    "bytes": (TIME, with_pressure((np.arange(600) % 256).astype(np.uint8)), "", ""),
    "switches": (TIME, with_pressure(PRESSURE, flag=PULSES > 0.0), "", "csv"),
    "a shorter channel": (TIME, with_pressure(PRESSURE, slow=PRESSURE[:100]), "", "wav"),
    "complex values": (TIME, with_pressure(PRESSURE, z=PULSES + 1j * PRESSURE), "left out", "uff uffb wav parquet"),
    "a name of other letters": (TIME, with_pressure(PRESSURE, **{"Kühlmittel µ": PRESSURE}), "", "uff uffb"),
    "a gap": (np.concatenate((TIME[:300], TIME[300:] + 0.25)), with_pressure(PRESSURE), "gap", "wav"),
    "times out of order": (np.roll(TIME, 300), with_pressure(PRESSURE), "backwards", "wav"),
    "missing values": (TIME, with_pressure(LOST), "", "uff uffb"),
    "an empty channel": (TIME, with_pressure(PRESSURE, empty=np.zeros(0)), "empty", "uff uffb wav"),
    "a channel of text": (TIME, with_pressure(PRESSURE, state=np.array(600 * ["on"])), "left out", "uff uffb wav"),
    "a channel of constants": (TIME, with_pressure(PRESSURE, off=np.zeros(600)), "", ""),
    "two samples": (TIME[:2], {"tacho": PULSES[:2], "pcyl1": PRESSURE[:2]}, "", ""),
}


@pytest.mark.parametrize(("kind", "odd"), [(k, odd) for k in FORMATS for odd in ODD if k not in ODD[odd][3].split()])
def test_odd_files_are_read_with_one_line(kind, odd, tmp_path):
    time, columns, said, _ = ODD[odd]
    found = ct.read_measured(write(tmp_path, kind, time, columns, UNITS))
    own = [channel for channel in found.channels if channel.name in ("pcyl1", "run:2", "pcyl1/data")]
    assert len(own) == 1
    good = np.isfinite(time)
    values = np.asarray(columns["pcyl1"], dtype=float)[good]
    if "a step of" not in " ".join(found.remarks):
        values = values[np.argsort(time[good], kind="stable")]
        if kind != "wav":
            np.testing.assert_allclose(own[0].abscissae(), np.sort(time[good]), atol=1e-6)
    np.testing.assert_allclose(own[0].values(), values, rtol=2e-7 if kind == "wav" else 1e-11)
    assert all("\n" not in text and text.startswith("run.") for text in map(str.lower, found.remarks))
    if said:
        assert any(word in remark for remark in found.remarks for word in said.split("|")), found.remarks


@pytest.mark.parametrize("kind", [k for k in FORMATS if k not in ("uff", "uffb", "wav")])
def test_files_without_a_sample_are_refused_in_one_line(kind, tmp_path):
    path = write(tmp_path, kind, TIME[:0], dict.fromkeys(UNITS, PRESSURE[:0]), UNITS)
    with one_line(match=r"holds no channel of numbers|no points or values"):
        ct.read_measured(path)


def test_equal_names_in_one_file_are_told_apart(tmp_path):
    """Parquet and tables may have a column twice, MDF and TDMS groups of one name each with its own clock."""
    from asammdf import MDF, Signal

    pq.write_table(pa.table([TIME, PULSES, PRESSURE], names=["time", "signal", "signal"]), tmp_path / "twice.parquet")
    lines = [f"{t:.9g};{a:.17g};{b:.17g}" for t, a, b in zip(TIME, PULSES, PRESSURE, strict=True)]
    (tmp_path / "twice.csv").write_text("time;signal;signal\n" + "\n".join(lines))
    for ending in ("parquet", "csv"):
        found = ct.read_measured(tmp_path / f"twice.{ending}")
        assert found.names == ("signal", "signal #2")
        np.testing.assert_array_equal(found["signal #2"].values(), PRESSURE)
    with MDF(version="4.10") as file:
        file.append([Signal(PULSES, TIME, name="signal", unit="V")])
        file.append([Signal(PRESSURE[:60], 10.0 * TIME[:60], name="signal", unit="bar")])
        file.save(tmp_path / "twice.mf4", overwrite=True)
    with TdmsWriter(str(tmp_path / "twice.tdms")) as file:
        places = ("fast", PULSES, 5e-4), ("slow", PRESSURE[:60], 5e-3)
        file.write_segment(
            [ChannelObject(name, "signal", values, properties={"wf_increment": h}) for name, values, h in places]
        )
    for ending in ("mf4", "tdms"):
        fast, slow = ct.read_measured(tmp_path / f"twice.{ending}").channels
        assert fast.name != slow.name and (fast.rate, slow.rate) == pytest.approx((2000.0, 200.0))
        np.testing.assert_array_equal(slow.values(), PRESSURE[:60])


def test_dates_and_decimals_of_parquet_are_numbers(tmp_path):
    stamps = pa.array((1e6 * TIME).round().astype("int64") + 1_700_000_000_000_000, pa.timestamp("us"))
    pq.write_table(
        pa.table({"time": stamps, "p": pa.array([Decimal("1.5")] * 600)}), tmp_path / "a.parquet", row_group_size=70
    )
    (channel,) = ct.read_measured(tmp_path / "a.parquet").channels
    assert channel.rate == pytest.approx(2000.0) and channel.start == 0.0
    np.testing.assert_array_equal(channel.values(), 1.5)


def test_hdf5_with_groups_links_and_what_is_no_signal(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        for name, every in (("fast", 1), ("slow", 10)):
            file[f"{name}/time"], file[f"{name}/p"] = TIME[::every], PRESSURE[::every]
        file["cube"], file["note"] = np.zeros((3, 4, 600)), "hello"
        file["pairs"] = np.array([(1, 2.0)] * 5, dtype=[("x", "i4"), ("y", "f8")])
        file["gone"], file["nowhere"] = h5py.ExternalLink("gone.h5", "/a"), h5py.SoftLink("/b")
    found = ct.read_measured(tmp_path / "run.h5")
    assert found.names == ("fast/p", "slow/p")
    assert [channel.rate for channel in found.channels] == pytest.approx([2000.0, 200.0])
    for name in ("cube", "note", "pairs"):
        assert any(f"channel {name}: " in text and "left out" in text for text in found.remarks)


def test_matlab_of_version_4_and_what_is_no_signal(tmp_path):
    scipy.io.savemat(tmp_path / "four.mat", {"time": TIME, "p": PRESSURE}, format="4")
    np.testing.assert_array_equal(ct.read_measured(tmp_path / "four.mat")["p"].values(), PRESSURE)
    scipy.io.savemat(tmp_path / "run.mat", {
        "time": TIME, "p": PRESSURE, "cell": np.array([PULSES, PRESSURE[:9]], dtype=object),
        "cube": np.zeros((2, 3, 4)),
        "sparse": scipy.sparse.csc_matrix(np.eye(4)), "z": PULSES + 1j, "note": "hello", "empty": np.zeros((0, 0)),
        "two": np.array([(PULSES, "V"), (PRESSURE, "bar")], dtype=[("data", "O"), ("unit", "O")]),
    })  # fmt: skip
    found = ct.read_measured(tmp_path / "run.mat")
    assert found.names == ("p", "two(1)/data", "two(2)/data") and found["two(2)/data"].unit == "bar"
    for name in ("cell", "cube", "sparse", "z", "empty"):
        assert any(f"channel {name}: " in text and "left out" in text for text in found.remarks)


def test_wav_of_other_depths_without_samples_and_cut_off_at_full_scale(tmp_path):
    wavfile.write(tmp_path / "none.wav", 8000, np.zeros((0, 2), np.int16))
    with pytest.raises(ct.InputError, match=r"none.wav: holds no samples"):
        ct.read_measured(tmp_path / "none.wav")
    for name, values in (("u8", np.array([0, 128, 255], np.uint8)), ("i32", np.array([-(2**31), 0, 2**30], np.int32))):
        wavfile.write(tmp_path / f"{name}.wav", 8000, values)
        (channel,) = ct.read_measured(tmp_path / f"{name}.wav").channels
        np.testing.assert_allclose(channel.values(), [-1.0, 0.0, {"u8": 127.0 / 128.0, "i32": 0.5}[name]])
    loud = (32767.0 * np.clip(2.0 * PULSES, -1.0, 1.0)).astype(np.int16)
    wavfile.write(tmp_path / "loud.wav", 8000, loud)
    (remark,) = ct.read_measured(tmp_path / "loud.wav").remarks
    assert f"{np.count_nonzero(loud == 32767)} of 600 samples are at full scale" in remark
    content = bytearray((tmp_path / "loud.wav").read_bytes())
    content[20:22] = (2).to_bytes(2, "little")  # a compressed kind
    (tmp_path / "adpcm.wav").write_bytes(bytes(content))
    with pytest.raises(ct.InputError, match=r"adpcm.wav: not a WAV file, or a damaged one \(.*ADPCM"):
        ct.read_measured(tmp_path / "adpcm.wav")


def test_tdms_properties_that_are_no_numbers(tmp_path):
    with TdmsWriter(str(tmp_path / "run.tdms")) as file:
        file.write_segment([ChannelObject("g", name, PRESSURE, properties={"wf_increment": step})
                            for name, step in (("a", "fast"), ("b", -5e-4), ("c", float("nan")))])  # fmt: skip
    found = ct.read_measured(tmp_path / "run.tdms")
    assert found.names == ("a", "b", "c") and all(channel.abscissa == "sample" for channel in found.channels)
    stated = [text.partition("states a step of ")[2].partition(";")[0] for text in found.remarks]
    assert stated == ["fast", "-0.0005", "nan"]


def test_uff_with_other_data_sets_and_no_end(tmp_path):
    path = write(tmp_path, "uff", TIME, with_pressure(PRESSURE), UNITS)
    other = "    -1\n   164\n         1  SI: meters             2\n  1.0  1.0  1.0\n  0.0\n    -1\n"
    own = path.read_text()
    path.write_text(other + other.replace("164", "999") + own)
    found = ct.read_measured(path)
    assert found.names == ("tacho", "pcyl1") and any("data sets 999 hold no signals" in text for text in found.remarks)
    path.write_text(own[: int(0.8 * len(own))])
    found = ct.read_measured(path)
    assert found.names == ("tacho",) and any("has no end and is left out" in text for text in found.remarks)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["uff", "uffb", "mat"])
def test_long_channels_are_not_all_in_memory_at_once(kind, tmp_path, monkeypatch):
    """Sixty channels, one at a time: what is held is far below their sum, and samples come back in any order."""
    n, count = 10_000, 60
    monkeypatch.setattr(uff, "HELD", 1000)
    monkeypatch.setattr(matlab, "HELD", 1000)
    time = np.arange(n) / 1e4
    columns = {f"c{k}": np.sin(time + k) for k in range(count)}
    path = write(tmp_path, kind, time, columns, dict.fromkeys(columns, "V"))
    ct.read_measured(write(tmp_path, kind, time[:50], {"c": time[:50]}, {"c": "V"}, name="small"))  # imports
    tracemalloc.start()
    found = ct.read_measured(path)
    for k in (59, 0, 5, 0):
        np.testing.assert_allclose(found.channels[k].values(100, 200), columns[f"c{k}"][100:200], atol=1e-6)
    held, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert held < 0.2 * 8 * n * count and peak < 8 * n * count + 1.2 * path.stat().st_size * (kind != "mat")


def test_a_uff_file_that_is_too_large_is_refused_with_what_to_do(tmp_path, monkeypatch):
    path = write(tmp_path, "uff", TIME, with_pressure(PRESSURE), UNITS)
    monkeypatch.setattr(uff, "LARGEST", 1000)
    with pytest.raises(ct.InputError, match=r"run.uff: has .* GB, UFF files are read up to 1e-06 GB; export fewer"):
        ct.read_measured(path)
