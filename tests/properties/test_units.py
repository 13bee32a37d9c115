"""Spellings of units, against their definitions (SI brochure; NIST SP 811, 2008)."""

import math
import re
import subprocess
import sys

import numpy as np
import pytest
from one_line import one_line
from some import some

from cranktrain.core.errors import InputError
from cranktrain.core.units import ATMOSPHERE, UNITS, is_unit, to_si, unit_factor
from cranktrain.engine.file import engine_path, load_engine

INCH, POUND, GRAVITY = 0.0254, 0.45359237, 9.80665
LBF = POUND * GRAVITY
PSI = LBF / INCH**2
SPELLINGS = {
    "torsional stiffness": {
        1.0: ("N m/rad", "Nm/rad", "N·m/rad", "N*m/rad", "N.m/rad", "N-m/rad", "N⋅m/rad"),
        1e3: ("kN m/rad", "kNm/rad", "kN·m/rad", "KNm/rad"),
        1e6: ("MNm/rad", "MN m / rad"),
        180.0 / math.pi: ("Nm/deg", "N m/°", "Nm/grad"),
        LBF * INCH: ("lbf in/rad", "lbf·in/rad", "in-lbf/rad", "lb in/rad"),
    },
    "torsional damping": {1.0: ("Nms/rad", "N m s/rad", "N·m·s/rad"), 1e3: ("kNms/rad",)},
    "inertia": {
        1.0: ("kg m^2", "kg m²", "kg·m²", "kgm2", "kg*m^2", "kgm^2", "kg m**2"),
        1e-4: ("kg cm²", "kg*cm^2", "kgcm2"),
        1e-6: ("kg mm^2",),
        POUND * INCH**2: ("lb in^2", "lb-in²", "lbm in2"),
        LBF * INCH: ("lbf·in·s²", "lbf in s^2", "lb in s²", "in-lbf-s^2", "lbf-in-s2", "lbf*in*s^2"),
    },
    "torque": {1.0: ("Nm", "N.m", "N-m", "N m", "kNmm"), 1e-3: ("Nmm", "N.mm", "mNm"), 10.0: ("daNm",),
               GRAVITY: ("kgf m", "kp m", "kg m"),
               LBF * INCH * 12: ("ft-lb", "lbf ft")},
    "length": {
        1e-2: ("cm",), INCH: ("in", "inch", '"', "″", "''", "Zoll"), 1e-6: ("um", "µm", "μm"), 1e-3: ("mm", "MM"),
        12 * INCH: ("ft",), 1e-3 * INCH: ("mil", "thou"),
    },
    "speed": {
        math.pi / 30.0: (
            "rpm", "tr/min", "1/min", "min-1", "min^-1", "min⁻¹", "U/min", "/min", "rev/min", "r/min", "RPM", "Upm",
        ),
        math.pi / 180.0: ("deg/s", "°/s"), 2.0 * math.pi: ("rev/s", "rps"),
    },
    "angle": {math.pi / 180.0: ("deg", "°", "grad", "Grad", "°KW", "°CA", "deg CA", "CAD", "degree"), 1e-3: ("mrad",)},
    "pressure": {
        PSI: ("psi", "lbf/in^2", "PSI"), 1e6: ("MPa", "N/mm²", "N/mm2", "MPA", "Mpa"), 1e5: ("bar", "Bar", "BAR"),
        GRAVITY * 1e4: ("kgf/cm2", "kg/cm²", "kp/cm²", "at"), 1e3 * PSI: ("ksi",), 1e2: ("mbar", "hPa"),
    },
    "viscosity": {1e-3: ("cP", "mPas", "mPa·s", "mPa s"), 1.0: ("Pas", "Pa·s"), 0.1: ("P",)},
    "kinematic viscosity": {1e-6: ("cSt", "mm²/s", "mm2/s"), 1e-4: ("St", "cm^2/s")},
    "density": {1e3: ("g/cm³", "kg/dm³", "g/cm3", "kg/l", "t/m³")},
    "power": {735.49875: ("PS",), 745.69987158227022: ("hp",), 1e3: ("kW",)},
    "heat capacity": {1.0: ("J/(kg K)", "J/kgK", "J/kg/K", "J/(kg·K)"), 1e3: ("kJ/kg K",)},
    "heat transfer": {1.0: ("W/m²K", "W/(m² K)", "W/m^2/K")},
    "velocity": {INCH: ("in/s", "ips"), 1.0 / 3.6: ("km/h",)}, "force": {10.0: ("daN",), LBF: ("lbf", "lb")},
    "mass": {POUND: ("lb", "lbm", "lbs"), 1.0: ("Kg", "KG"), LBF / INCH: ("lbf s²/in", "lb-s^2/in"),
             1e3: ("t",), 28.349523125e-3: ("oz",)},
    "stiffness": {1e6: ("N/µm", "kN/mm"), LBF / INCH: ("lbf/in", "lb/in")},
    "pressure coefficient": {1e-6: ("mm²/N", "1/MPa", "MPa^-1"), 1.0 / PSI: ("1/psi", "in²/lbf")},
}  # fmt: skip


@pytest.mark.parametrize("dimension", SPELLINGS)
def test_spellings_mean_their_definition(dimension):
    for factor, spellings in some(SPELLINGS[dimension].items()):
        for spelling in some(spellings):
            found = unit_factor(spelling, dimension)
            assert found.scale == pytest.approx(factor, rel=1e-13), spelling
            assert found.zero == 0.0 and found.si == next(iter(UNITS[dimension])), spelling


@pytest.mark.parametrize(
    ("si", "factors"),
    [("m^3/s", {"l/min": 1e-3 / 60.0, "L/min": 1e-3 / 60.0, "l/h": 1e-3 / 3600.0, "m³/h": 1.0 / 3600.0}),
     ("m^3", {"l": 1e-3, "L": 1e-3, "in³": INCH**3, **dict.fromkeys(("cc", "ccm", "cm3", "ml"), 1e-6)})],
)  # fmt: skip
def test_volumes_and_flows_are_known_without_a_dimension(si, factors):
    for unit, factor in some(factors.items()):
        assert unit_factor(unit) == (pytest.approx(factor, rel=1e-14), 0.0, si)


def test_temperatures_have_a_zero_and_their_differences_none():
    for celsius in ("degC", "°C", "C", "deg C", "Grad C"):
        assert to_si(80.0, celsius, "temperature") == pytest.approx(353.15)
    assert to_si(np.array([32.0, 212.0]), "°F", "temperature") == pytest.approx([273.15, 373.15])
    assert to_si(5.0, "K", "temperature difference") == 5.0
    for unit in ("degC", "°F"):
        with pytest.raises(InputError, match="temperature difference"):
            unit_factor(unit, "temperature difference")


@pytest.mark.parametrize("unit", ["barg", "bar(g)", "bar (g)", "bar g", "bar gauge", "barü", "bar rel"])
def test_gauge_pressures_count_from_the_atmosphere_where_a_pressure_is_absolute(unit):
    assert unit_factor(unit, "absolute pressure") == (1e5, ATMOSPHERE, "Pa")
    assert unit_factor(unit, "gauge pressure") == (1e5, 0.0, "Pa")
    with pytest.raises(InputError):  # a modulus has no atmosphere
        unit_factor(unit, "pressure")
    assert unit_factor("bar(a)", "absolute pressure") == (1e5, 0.0, "Pa")


@pytest.mark.parametrize(
    ("unit", "dimension", "says"),
    [
        ("N m", "torsional stiffness", "unit 'N m' measures torque, not torsional stiffness; did you mean 'N m/rad'?"),
        ("Hz", "speed", "unit 'Hz' measures frequency, not speed; valid: rad/s, rev/min"),
        ("mm", "torque", "measures length, not torque; valid: N m, kN m"),
        ("kg m^3", "inertia", "does not measure inertia; did you mean 'kg m^2'?"),
        ("gr", "mass", "unit 'gr' is not known; did you mean 'g'?"),
        ("foo", "length", "unit 'foo' is not known; valid: m, mm, um"),
        ("foo", None, "unit 'foo' is not known; write it as in 'N m/rad'"),
    ],
)
def test_a_wrong_unit_is_refused_in_one_line(unit, dimension, says):
    with one_line(says):
        unit_factor(unit, dimension)


def test_the_units_of_files_need_no_pint():
    """What cranktrain writes is in the quick table; pint and pandas load for other spellings and tables only."""
    code = (
        "import sys, cranktrain\nfrom cranktrain.engine.file import load_engine\nload_engine('diesel_i6')\n"
        "import cranktrain.dynamics.simulation\nassert not {'pint', 'pandas'} & set(sys.modules), 'loaded'"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("engine", ["diesel_i6", "diesel_v8"])
def test_an_engine_in_other_spellings_is_the_same_engine(tmp_path, engine):
    """Each unit of a file in a spelling of an equal unit: the engine is equal to the last bit."""
    others = {
        "mm": "㎜", "kg": "KG", "kg m^2": "kg·m²", "N m/rad": "Nm/rad", "kg/m^3": "kg/m³", "GPa": "kN/mm²",
        "MPa": "N/mm²", "degC": "°C", "um": "µm", "rev/min": "1/min", "mPa s": "cP", "bar": "BAR", "deg": "°",
        "J/(kg K)": "J/kgK", "1/GPa": "GPa^-1", "N m s/rad": "Nms/rad", "W/(m^2 K)": "W/m²K", "mm^2/s": "cSt",
    }  # fmt: skip
    text = engine_path(engine).read_text("utf-8")
    changed = re.sub(r'unit = "([^"]+)"', lambda found: f'unit = "{others.get(found[1], found[1])}"', text)
    assert changed != text
    path = tmp_path / "other.TOML"
    path.write_text(changed, "utf-8")
    assert load_engine(path) == load_engine(engine)


@pytest.mark.parametrize("unit", [400 * "9", 400 * "9" + " mm", "0 mm", "-1 mm", "km^200"])
def test_a_unit_of_no_finite_size_above_zero_is_none(unit):
    with pytest.raises(InputError):
        unit_factor(unit, "length")
    assert not is_unit(unit)
