"""Measurement files of every format, made by the formats' own libraries: read to the last digit, or told in a line."""

import json
import sys

import numpy as np
import pytest
from measured_files import FORMATS, write
from one_line import one_line

import cranktrain as ct
from cranktrain.cli.main import main
from cranktrain_lab.measured.order_table import order_curves

RATE = 2000.0
TIME = np.arange(3000) / RATE
PULSES = np.sin(2.0 * np.pi * 60.0 * 3.0 * TIME)
PRESSURE = 1.0 + 0.5 * np.cos(7.0 * TIME)
COLUMNS = {"tacho": PULSES, "pcyl1": PRESSURE}
UNITS = {"tacho": "V", "pcyl1": "bar"}


def by_name(measurement, name):
    """A channel by its name; those of WAV are numbered and those of MATLAB's structures stand in them."""
    names = {"tacho": ("tacho", "run:1", "tacho/data"), "pcyl1": ("pcyl1", "run:2", "pcyl1/data")}[name]
    return next(channel for channel in measurement.channels if channel.name in names)


@pytest.mark.parametrize("kind", FORMATS)
def test_values_units_and_sampling_come_back(kind, tmp_path):
    found = ct.read_measured(write(tmp_path, kind, TIME, COLUMNS, UNITS))
    assert len(found.channels) == 2 and not found.remarks
    for name, values in COLUMNS.items():
        channel = by_name(found, name)
        exact = np.float32(values).astype(float) if kind == "wav" else values
        np.testing.assert_allclose(channel.values(), exact, rtol=1e-15 if kind != "uff" else 1e-11)
        assert channel.rate == pytest.approx(RATE, rel=1e-6) and channel.size == TIME.size
        assert channel.unit == ("" if kind == "wav" else UNITS[name])
        parts = [block for _, block in channel.blocks(700)]
        np.testing.assert_array_equal(np.concatenate(parts), channel.values())


@pytest.mark.parametrize("share", [0.02, 0.45, 0.9])
@pytest.mark.parametrize("kind", FORMATS)
def test_files_cut_short_are_told(kind, share, tmp_path):
    """Either what is left is read, with a remark, or one line says what is wrong; nothing that is not in the file."""
    path = write(tmp_path, kind, TIME, COLUMNS, UNITS)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    try:
        found = ct.read_measured(path)
    except ct.CranktrainError as error:
        assert "\n" not in str(error) and path.name in str(error)
        return
    # A table that ends with a whole number has no end that could be missing.
    assert found.remarks or kind == "csv", [channel.size for channel in found.channels]
    for name, values in COLUMNS.items():
        for channel in found.channels:
            if channel.name.startswith(name) and channel.size > 1:
                left = channel.size - (kind == "csv")
                np.testing.assert_allclose(channel.values(0, left), values[:left], rtol=1e-11)


@pytest.mark.parametrize("kind", FORMATS)
def test_files_of_another_kind_are_told(kind, tmp_path):
    path = write(tmp_path, kind, TIME, COLUMNS, UNITS)
    if kind in ("mf4", "h5", "parquet", "tdms"):  # the content decides, not the ending
        path = path.rename(tmp_path / "run.CSV")
        assert sorted(ct.read_measured(path).names) == ["pcyl1", "tacho"]
    for content in (b"", b"\x00\x01\x02 nothing" * 40):
        path.write_bytes(content)
        with one_line(match=path.name):
            ct.read_measured(path)


@pytest.mark.slow
@pytest.mark.parametrize("kind", FORMATS)
def test_damaged_files_are_read_or_refused_in_one_line(kind, tmp_path, capfd):
    """Bytes that change, are missing or come in between; nothing else is printed."""
    rng = np.random.default_rng(7)
    path = write(tmp_path, kind, TIME[:400], {name: values[:400] for name, values in COLUMNS.items()}, UNITS)
    whole = path.read_bytes()
    capfd.readouterr()
    for k in range(24):
        content, place = bytearray(whole), int(rng.integers(len(whole)))
        content[place : place + (0, 1, 60)[k % 3]] = rng.integers(0, 256, (40, 1, 0)[k % 3], dtype=np.uint8).tobytes()
        path.write_bytes(bytes(content))
        try:
            for channel in ct.read_measured(path).channels:
                assert channel.values().size == channel.abscissae().size == channel.size
        except ct.CranktrainError as error:
            assert "\n" not in str(error) and path.name in str(error)
    assert capfd.readouterr() == ("", "")


TIMES = {
    "even": TIME, "a gap": np.concatenate((TIME[:1500], TIME[1500:] + 0.25)), "out of order": np.roll(TIME, 1500),
}  # fmt: skip


@pytest.mark.parametrize("times", TIMES)
@pytest.mark.parametrize("kind", ["mf4", "h5", "parquet", "mat", "csv"])
def test_long_channels_are_read_as_short_ones(kind, times, tmp_path, monkeypatch):
    """Times of many samples are not held: a gap or disorder is still found, and long tables go through a file."""
    path = write(tmp_path, kind, TIMES[times], COLUMNS, UNITS)
    short = by_name(ct.read_measured(path), "pcyl1")
    for module in ("formats.mdf", "formats.arrays"):
        monkeypatch.setattr(f"cranktrain_lab.measured.{module}.MANY", 1000)
    monkeypatch.setattr("cranktrain_lab.measured.formats.text.LARGE", 1000)
    monkeypatch.setattr("cranktrain_lab.measured.formats.text.PIECE", 96)
    monkeypatch.setattr("cranktrain_lab.measured.channels.BLOCK", 1024)
    long = by_name(ct.read_measured(path), "pcyl1")
    np.testing.assert_array_equal(long.values(), short.values())
    np.testing.assert_allclose(long.abscissae(), short.abscissae(), atol=1e-9)
    assert times != "even" or long.rate == pytest.approx(short.rate, rel=1e-9)


def test_channels_are_chosen_and_equal_names_of_two_files_are_told_apart(tmp_path):
    first, second = (write(tmp_path, "h5", TIME, COLUMNS, UNITS, name=name) for name in ("first", "second"))
    assert ct.read_measured(first, channels=["PCYL1"]).names == ("pcyl1",)
    names = ct.read_measured(first, second).names
    assert names == ("pcyl1 (first)", "tacho (first)", "pcyl1 (second)", "tacho (second)")


def test_orders_of_a_uff_file_are_curves_over_speed(tmp_path):
    import pyuff

    rpm = np.array([1600.0, 1700.0, 1850.0])
    values = np.array([0.02, 0.03j, -0.025])
    pyuff.UFF(str(tmp_path / "orders.unv")).write_sets({
        "type": 58, "binary": 0, "func_type": 0, "rsp_ent_name": "Pulley", "rsp_node": 1, "rsp_dir": 0, "ref_node": 0,
        "ref_dir": 0, "id1": "Order 6.00", "data": values, "x": rpm, "num_pts": 3, "abscissa_spec_data_type": 19,
        "abscissa_axis_units_lab": "rpm", "ordinate_spec_data_type": 0, "ordinate_axis_units_lab": "deg",
        "orddenom_spec_data_type": 0, "ord_data_type": 6, "abscissa_spacing": 0, "abscissa_min": 0, "abscissa_inc": 0,
    }, "add")  # fmt: skip
    (curve,) = order_curves(ct.read_measured(tmp_path / "orders.unv"))
    assert curve.order == 6.0 and curve.unit == "deg"
    np.testing.assert_allclose(curve.speeds, rpm * np.pi / 30.0)
    np.testing.assert_allclose(curve.amplitudes, np.abs(values))
    np.testing.assert_allclose(curve.phases, np.angle(values), atol=1e-12)


def test_a_missing_package_is_named_with_its_extra(tmp_path, monkeypatch):
    path = write(tmp_path, "tdms", TIME, COLUMNS, UNITS)
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(ct.InputError, match=r"TDMS files need nptdms: pip install cranktrain\[measured\]"):
        ct.read_measured(path)


def test_the_command_lists_channels_and_tachos(tmp_path, capsys):
    path = write(tmp_path, "mf4", TIME, COLUMNS, UNITS)
    assert main(["measured", str(path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [channel["name"] for channel in told["channels"]] == ["tacho", "pcyl1"]
    assert told["channels"][1]["unit"] == "bar" and told["channels"][0]["rate_hz"] == pytest.approx(RATE)
    assert [tacho["channel"] for tacho in told["tachos"]] == ["tacho"]
    assert told["tachos"][0]["pulses_hz"] == pytest.approx(180.0, rel=1e-3)
