"""A unit of pressure that no one states is the right one or is refused with the candidates, never a wrong one."""

import math
import re
import warnings
from pathlib import Path

import numpy as np
import pytest

from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.pressure_level import CANDIDATES, compression_level, meant
from cranktrain.loads.pressure_units import UNITS

OWN = Path(__file__).parents[1] / "data" / "engines"
ENGINES = ["diesel_i6", "diesel_v8", *sorted(str(path) for path in OWN.glob("*.toml"))]


def written(path, pressure):
    """A file without header of a trace (Pa in a unit) at each degree."""
    angle = np.arange(-360.0, 360.0)
    path.write_text("\n".join(f"{a:.1f};{p:.8g}" for a, p in zip(angle, pressure, strict=True)))
    return path


def trace(engine):
    gas = GasTrace.from_engine(engine)
    return np.interp(np.radians(np.arange(-360.0, 360.0)), gas.angles, gas.fired, period=4.0 * math.pi)


@pytest.mark.parametrize("name", ENGINES, ids=lambda name: Path(name).stem)
@pytest.mark.parametrize("share", [1.0, 0.5, 0.3])
@pytest.mark.parametrize("unit", CANDIDATES)
def test_the_right_unit_or_none(tmp_path, name, share, unit):
    """At full load and throttled, in each unit: the peak that comes out is that of the trace."""
    engine = load_engine(name)
    pressure = share * trace(engine)
    path = written(tmp_path / "p.csv", pressure / UNITS[unit])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            read = GasTrace.from_csv(path, engine)
        except InputError as error:
            assert f"{unit} ({1e-5 * pressure.max():.4g} bar)" in str(error) and "--pressure-unit" in str(error)
            assert "\n" not in str(error)
        else:
            assert read.peak == pytest.approx(pressure.max(), rel=5e-3) and f"{unit} (not stated" in read.source
        stated = GasTrace.from_csv(path, engine, unit)
    assert stated.peak == pytest.approx(pressure.max(), rel=5e-3)


def test_usual_traces_need_no_unit(tmp_path):
    """Naturally aspirated and supercharged in bar, and those of diesels in MPa, Pa and kPa, are told apart."""
    six = load_engine("diesel_i6")
    for unit in ("bar", "MPa", "kPa", "Pa"):
        assert GasTrace.from_csv(written(tmp_path / "p.csv", trace(six) / UNITS[unit]), six).peak > 1e7


def test_both_readings_are_told(tmp_path):
    """3.2 in psi is an intake at 0.22 bar, in bar a supercharged one; exponent and ratio of the peak are alike."""
    four = load_engine(OWN / "gas_i4.toml")
    pressure = trace(four)
    level = pressure * 3.2 / (pressure[180] / 1.0)
    with pytest.raises(InputError, match=re.escape("several fit a peak of")) as caught:
        GasTrace.from_csv(written(tmp_path / "p.csv", level), four)
    assert meant(("psi", "bar"), level.max()) in str(caught.value)


@pytest.mark.parametrize("exponent", [1.25, 1.32, 1.4])
@pytest.mark.parametrize("name", ["diesel_i6", str(OWN / "gas_i4.toml")], ids=["six", "four"])
def test_the_level_of_a_polytropic_compression_is_its_pressure_at_bottom_dead_centre(name, exponent):
    from cranktrain.loads.cylinder_volume import cylinder_volume

    engine, angle = load_engine(name), np.arange(-180.0, 180.0, 0.5)
    volume, _ = cylinder_volume(engine, np.radians(angle))
    pressure = 1.7 * (volume / volume[0]) ** -exponent
    assert compression_level(engine, angle % 720.0, pressure) == pytest.approx(1.7, rel=1e-9)
    shifted = np.maximum(pressure - 1.69, 1e-3)  # gauge, or a drifted zero: no line of a compression from 0.01
    assert compression_level(engine, angle % 720.0, shifted) is None
