"""The gas trace: thermodynamic limits of the built-in cycle, smoothness, and what measured files may look like."""

import math
import os
import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from one_line import one_line

from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.loads.cylinder_volume import cylinder_volume, mean_effective_pressure
from cranktrain.loads.gas_pressure import CYCLE, GasTrace, gas_pressure, spline_coefficients

ENGINE = load_engine("diesel_i6")
SHARED = Path(__file__).parents[2] / "../shared/data/six_cylinder_diesel_pressure.csv"
MEASURED = Path(os.environ.get("CRANKTRAIN_MEASURED", SHARED))


def test_built_in_trace_is_that_of_a_diesel_at_full_load():
    """Its peak, a compression between isotherm and adiabat of cold air, a loss without burn, and its efficiency."""
    trace = GasTrace.from_engine(ENGINE)
    assert 12e6 < trace.peak < 14e6 and 5.0 < math.degrees(trace.peak_angle) < 15.0
    assert 1.0e6 < trace.imep < 2.0e6 and trace.fired.min() > 1e5
    before = slice(540, 715)  # compression ends before the burn starts at -3 degrees
    assert trace.fired[before] == pytest.approx(trace.motored[before], rel=1e-12)
    assert mean_effective_pressure(ENGINE, trace.motored) < 0.0
    volume, _ = cylinder_volume(ENGINE, trace.angles)
    ratio = volume[570] / volume[0]
    assert ratio < trace.motored[0] / ENGINE.combustion.intake_pressure < ratio**1.4
    for heat in (0.5 * ENGINE.combustion.heat, ENGINE.combustion.heat):
        trace = GasTrace.from_engine(replace(ENGINE, combustion=replace(ENGINE.combustion, heat=heat)))
        gained = trace.imep - mean_effective_pressure(ENGINE, trace.motored)
        # well under the efficiency of the ideal Otto cycle at this compression ratio
        assert 0.35 < gained * np.ptp(volume) / heat < 0.62


def test_volume_derivative_and_stroke():
    angle = np.linspace(0.0, CYCLE, 50)
    engine = replace(ENGINE, cylinders=replace(ENGINE.cylinders, pin_offset=0.004))
    step = 1e-5
    difference = (cylinder_volume(engine, angle + step)[0] - cylinder_volume(engine, angle - step)[0]) / (2.0 * step)
    assert cylinder_volume(engine, angle)[1] == pytest.approx(difference, abs=1e-9 * np.ptp(difference) + 1e-12)
    volume, _ = cylinder_volume(ENGINE, np.array([0.0, math.pi]))
    assert volume[1] / volume[0] == pytest.approx(ENGINE.cylinders.compression_ratio, rel=1e-12)
    # A constant pressure does no work, and a closed curve p(V) encloses no area.
    volume, _ = cylinder_volume(ENGINE, np.arange(720) * CYCLE / 720)
    assert mean_effective_pressure(ENGINE, np.full(720, 3e5)) == pytest.approx(0.0, abs=1e-6)
    assert mean_effective_pressure(ENGINE, 1e5 * (volume.max() / volume) ** 1.3) == pytest.approx(0.0, abs=1.0)


def test_a_two_stroke_has_its_cycle_twice_in_720_degrees():
    """Closed, it compresses and burns as the four-stroke; open, it goes to exhaust pressure and is scavenged."""
    four = replace(ENGINE, combustion=replace(ENGINE.combustion, intake_closes=-2.4, exhaust_opens=2.1))
    two = replace(four, cylinders=replace(four.cylinders, cycle=2.0 * math.pi))
    slow, fast = GasTrace.from_engine(four), GasTrace.from_engine(two)
    assert np.array_equal(fast.fired[:360], fast.fired[360:])
    np.testing.assert_allclose(np.roll(fast.fired, 115)[:230], np.roll(slow.fired, 115)[:230], rtol=1e-12)
    low, high = sorted((four.combustion.exhaust_pressure, four.combustion.intake_pressure))
    open_to_both = fast.fired[180:222]
    assert np.all((low * 0.999 < open_to_both) & (open_to_both < high * 1.001))
    assert fast.fired[180:222].max() > 0.999 * high
    # The same closed cycle in half the angle: the mean effective pressure is that of the loop alone.
    assert fast.imep == pytest.approx(slow.imep, rel=0.05)


def test_periodic_spline_is_twice_continuously_differentiable_fourth_order_and_periodic_for_any_angle():
    errors = []
    for n in (32, 64, 128):
        table = spline_coefficients(np.exp(np.sin(np.arange(n) * 2.0 * math.pi / n)))
        following = np.roll(table, -1, axis=0)
        end = table.sum(axis=1)
        slope = table[:, 1] + 2.0 * table[:, 2] + 3.0 * table[:, 3]
        curvature = 2.0 * table[:, 2] + 6.0 * table[:, 3]
        assert end == pytest.approx(following[:, 0], abs=1e-13)
        assert slope == pytest.approx(following[:, 1], abs=1e-13)
        assert curvature == pytest.approx(2.0 * following[:, 2], abs=1e-13)
        theta = np.linspace(0.0, CYCLE, 1001)
        values = gas_pressure(theta, table)
        errors.append(np.abs(values - np.exp(np.sin(0.5 * theta))).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 3.8)
    for theta in (0.0, 0.3, 7.9, -0.2, CYCLE, -1e-18):
        assert gas_pressure(theta, table) == pytest.approx(gas_pressure(theta + 50.0 * CYCLE, table), rel=1e-9)


def points(spacing=1.0, noise=0.0, seed=1):
    """Points of the built-in trace as a file with firing dead centre at 360 would hold them (deg, MPa)."""
    trace = GasTrace.from_engine(ENGINE)
    table = spline_coefficients(trace.fired)
    angle = np.arange(0.0, 720.0, spacing)
    pressure = 1e-6 * gas_pressure(np.radians(angle - 360.0), table)
    return angle, pressure + noise * np.random.default_rng(seed).standard_normal(angle.size), trace


def write(path, angle, pressure, header="angle_deg,pressure_mpa", separator=","):
    lines = [header] if header else []
    path.write_text("\n".join(lines + [f"{a:.6f}{separator}{p:.9g}" for a, p in zip(angle, pressure, strict=True)]))
    return path


@pytest.mark.parametrize(
    ("header", "separator", "scale", "unit"),
    [
        ("angle_deg,pressure_mpa", ",", 1.0, None),
        ("", ";", 1.0, None),
        ("", " ", 10.0, "bar"),
        ("Crank angle [deg]\tp [kPa]", "\t", 1e3, None),
        ("angle;pressure", ";", 1e6, "Pa"),
    ],
)
def test_a_clean_file_comes_back_whatever_its_form(tmp_path, header, separator, scale, unit):
    angle, pressure, trace = points()
    path = write(tmp_path / "p.csv", angle, scale * pressure, header, separator)
    read = GasTrace.from_csv(path, ENGINE, unit)
    # a monotone interpolant of one-degree points is third order or better; 0.1 % of the peak is its known size
    assert np.abs(read.fired - trace.fired).max() < 1e-3 * trace.peak
    assert read.imep == pytest.approx(trace.imep, rel=1e-3) and read.falloff == 0.0


def test_shift_order_start_and_several_cycles_do_not_matter(tmp_path):
    angle, pressure, _ = points()
    first = GasTrace.from_csv(write(tmp_path / "a.csv", angle, pressure), ENGINE)
    centred = write(tmp_path / "b.csv", angle - 360.0, pressure)
    turned = write(tmp_path / "c.csv", np.roll(angle, 100), np.roll(pressure, 100))
    twice = write(tmp_path / "d.csv", np.append(angle, angle + 720.0), np.append(pressure, pressure))
    stated = write(tmp_path / "e.csv", angle + 17.0, pressure)
    later = write(tmp_path / "f.csv", angle + 360.0, pressure)
    for path, centre in ((centred, None), (later, None), (turned, None), (twice, None), (stated, 377.0)):
        read = GasTrace.from_csv(path, ENGINE, dead_centre_deg=centre)
        assert read.fired == pytest.approx(first.fired, rel=1e-9, abs=1.0)


def test_noise_is_reduced_the_peak_is_kept_and_irregular_points_do_not_overshoot(tmp_path):
    scatter = 0.05  # MPa, rms
    angle, pressure, trace = points(spacing=0.5, noise=scatter)
    read = GasTrace.from_csv(write(tmp_path / "noisy.csv", angle, pressure), ENGINE)
    assert np.std(read.fired - trace.fired) < 0.6 * scatter * 1e6
    assert read.peak == pytest.approx(trace.peak, rel=0.01)
    angle, pressure, trace = points()
    chosen = np.unique(np.concatenate((np.arange(0, 720, 25), np.arange(300, 460, 4))))
    read = GasTrace.from_csv(write(tmp_path / "sparse.csv", angle[chosen], pressure[chosen]), ENGINE)
    assert read.fired.min() > 0.95 * trace.fired.min() and read.peak < 1.01 * trace.peak
    assert read.imep == pytest.approx(trace.imep, rel=0.01)


@pytest.mark.parametrize(
    ("text", "unit", "says"),
    [
        ("angle_rad,p_mpa\n" + "0,1\n" * 30, None, "rad"),
        ("0,15\n" * 30, "mm", "unknown pressure unit 'mm'; known: Pa, .*, MPa, .*psig"),
        ("angle;p [mV]\n" + "0;15\n" * 30, None, "the header's pressure unit 'mv' is not known; known: Pa"),
        ("deg;pC\n" + "0;15\n" * 30, None, "the header's pressure unit 'pc' is not known"),
        ("deg;psia\n" + "0;-15\n" * 30, None, "line 2: pressure -15 is negative; .* gauge unit such as barg"),
        ("deg;barg\n" + "0;60\n" + "1;-15\n" * 30, None, "-15 bar gauge is less than nothing"),
        ("0,1e400\n" * 30, None, "line 1: .* not finite"),
        ("0,15\n" * 30, "Pa", "no cylinder pressure of an engine"),
        ("0,1e-4\n" * 30, None, "no unit is stated and none fits a peak of 0.0001: Pa .*; state it"),
        ("\n".join(f"{a},15" for a in range(300)), None, "no points over 421 deg"),
        ("\n".join(f"{a},{5 + 5 * (a == 180)}" for a in range(720)), None, "say where firing dead centre is"),
    ],
)
def test_bad_files_are_refused_in_one_line(tmp_path, text, unit, says):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with one_line(match=says):
        GasTrace.from_csv(path, ENGINE, unit)


@pytest.mark.parametrize(
    ("header", "option", "factor", "zero"),
    [
        ("deg;psi", None, 6894.757293168, 0.0),
        ("deg;psig", None, 6894.757293168, 101325.0),
        ("angle [deg];p (kgf/cm2)", None, 98066.5, 0.0),
        ("crank angle;pressure kp/cm²", None, 98066.5, 0.0),
        ("deg;at", None, 98066.5, 0.0),
        ("angle;p [torr]", None, 101325.0 / 760.0, 0.0),
        ("Winkel [°KW];p [lbf/in²]", None, 6894.757293168, 0.0),
        ("angle;pressure", "inHg", 3386.389, 0.0),
        ("angle;pressure at cylinder 1 [atm]", None, 101325.0, 0.0),
        ("angle_deg;p_mbar", None, 100.0, 0.0),
        ("angle;p [bar(a)]", None, 1e5, 0.0),
        ("angle;p [bar gauge]", None, 1e5, 101325.0),
        ("angle;mean/kPa", None, 1e3, 0.0),
        ("Angle;Pressure\ndeg;barg", None, 1e5, 101325.0),
        ("angle;pressure at cylinder 1", "N/mm^2", 1e6, 0.0),
        ("deg;bar", "psi", 6894.757293168, 0.0),
    ],
)
def test_units_mean_what_they_say(tmp_path, header, option, factor, zero):
    """Pascals of each unit: NIST SP 811 (2008), appendix B; gauge counts from the standard atmosphere."""
    angle, pressure, trace = points(spacing=2.0)
    path = write(tmp_path / "p.csv", angle, (1e6 * pressure - zero) / factor, header, ";")
    read = GasTrace.from_csv(path, ENGINE, option)
    assert read.peak == pytest.approx(trace.peak, rel=1e-3)
    assert ("one atmosphere" in read.source) == (zero > 0.0)


def doubted(tmp_path, angle, pressure):
    """Warnings of a file."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        GasTrace.from_csv(write(tmp_path / "doubted.csv", angle, pressure), ENGINE, "MPa", 360.0)
    return [str(warning.message) for warning in caught]


def test_what_is_hardly_a_cylinder_pressure_is_said_in_one_line_and_sound_traces_are_not_doubted(tmp_path):
    """Sound ones: fine, coarse, noisy, motored, of several cycles that differ by a tenth, and the measured one."""
    angle, pressure, _ = points()
    noise = np.random.default_rng(5).standard_normal(angle.size)
    late = np.abs(angle - 370.0) > 14.0
    cases = {
        "nearly constant": (angle, np.full(angle.size, 5.0)),
        "points scatter by": (angle, np.abs(pressure + 1.5 * noise) + 0.5),
        "two peaks of": (angle, np.maximum(pressure, np.roll(pressure, angle.size // 2))),
        "points at .* differ by .* their mean is taken": (np.append(angle, 365.0), np.append(pressure, 1.0)),
        "no points from 356.. to 384|no points from .* at the peak": (angle[late], pressure[late]),
    }
    for says, (x, y) in cases.items():
        found = doubted(tmp_path, x, y)
        assert len(found) == 1 and re.search(says, found[0]) and "\n" not in found[0], (says, found)
    angle, pressure, trace = points(spacing=0.5, noise=0.05)
    motored = np.interp(angle, np.degrees(trace.angles) + 360.0, 1e-6 * trace.motored, period=720.0)
    cycles = (np.append(angle, angle + 720.0), np.append(0.95 * pressure, 1.05 * pressure))
    for x, y in ((angle, pressure), (angle[::16], pressure[::16]), (angle, motored), cycles):
        assert doubted(tmp_path, x, y) == []
    if MEASURED.is_file():
        assert doubted(tmp_path, *np.loadtxt(MEASURED, delimiter=";").T) == []


@pytest.mark.skipif(not MEASURED.is_file(), reason=f"measured trace not at {MEASURED}; set CRANKTRAIN_MEASURED")
def test_the_measured_trace_keeps_its_peak_and_its_dead_centre():
    trace = GasTrace.from_csv(MEASURED, ENGINE)
    raw = np.loadtxt(MEASURED, delimiter=";")
    assert trace.peak == pytest.approx(1e6 * raw[:, 1].max(), rel=0.01)
    assert math.degrees(trace.peak_angle) == pytest.approx(raw[raw[:, 1].argmax(), 0] - 360.0, abs=2.0)
    assert GasTrace.from_csv(MEASURED, ENGINE, "MPa").fired == pytest.approx(trace.fired)
    with pytest.raises(InputError, match="state another unit"):
        GasTrace.from_csv(MEASURED, ENGINE, "Pa")
    # work of the raw points by the trapezoidal rule against that of the smoothed trace
    volume, _ = cylinder_volume(ENGINE, np.radians(raw[:, 0] - 360.0))
    displaced = np.ptp(cylinder_volume(ENGINE, np.linspace(0.0, math.pi, 3))[0])
    work = np.sum(0.5 * (raw[1:, 1] + raw[:-1, 1]) * np.diff(volume)) * 1e6
    assert trace.imep == pytest.approx(work / displaced, rel=0.02)
