"""The damper's laws: tangents, limits, what they dissipate, how warm they are and where they are refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from one_line import one_line
from scipy.integrate import quad

from cranktrain.engine.file import load_engine
from cranktrain.loads import damper as law_of

DAMPER = load_engine("diesel_i6").damper
WARM = 273.15 + 80.0
LAWS = {
    "newtonian": replace(DAMPER, law="newtonian"),
    "shear-thinning": replace(DAMPER, law="shear-thinning"),
    "complex-modulus": replace(DAMPER, law="complex-modulus"),
    "rubber": replace(DAMPER, kind="rubber"),
}
RATES = [0.0, 1e-6, 0.3, 4.0, 60.0, 1e4]


def torque(parameters, twist, rate):
    out = np.zeros(4)
    law_of.damper_torque(parameters, twist, rate, out)
    return out


def plain_torque(parameters, twist, rate):
    """Twin of the kernel."""
    eta = (
        parameters[law_of.WEIGHTS : law_of.SHEARS]
        * (1.0 + (parameters[law_of.TIME] * parameters[law_of.SHEARS :] * rate) ** 2) ** parameters[law_of.EXPONENT]
    )
    return -parameters[law_of.STIFFNESS] * twist - (parameters[law_of.DAMPING] + eta.sum()) * rate


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("law", LAWS)
def test_torque_of_its_twin_odd_with_exact_tangents(law, rate):
    parameters, twist = law_of.damper_parameters(LAWS[law], WARM), 2e-3
    out = torque(parameters, twist, rate)
    assert out[0] == pytest.approx(plain_torque(parameters, twist, rate), rel=1e-12)
    assert torque(parameters, -twist, -rate)[0] == -out[0]
    h = 1e-4 * max(1.0, rate)
    by_rate = (torque(parameters, twist, rate + h)[0] - torque(parameters, twist, rate - h)[0]) / (2.0 * h)
    by_twist = (torque(parameters, twist + 1e-4, rate)[0] - torque(parameters, twist - 1e-4, rate)[0]) / 2e-4
    assert by_rate == pytest.approx(out[2], rel=1e-6)
    assert by_twist == pytest.approx(out[1], rel=1e-6, abs=1e-6)
    assert out[3] >= 0.0
    assert out[3] == pytest.approx(-(out[0] - out[1] * twist) * rate, rel=1e-12)


def test_layers_are_the_integral_over_the_gaps():
    """∫ r² η(r ψ̇/h) dA/h over faces and cylinders; the faces by Gauss with four points."""
    d = LAWS["shear-thinning"]
    parameters = law_of.damper_parameters(d, WARM)
    eta0 = law_of.silicone_viscosity(d, WARM)

    def carreau(shear):
        return eta0 * (1.0 + (eta0 / d.critical_stress * shear) ** 2) ** (0.5 * (d.flow_exponent - 1.0))

    for rate in (0.1, 5.0, 100.0):
        inner, outer = d.ring_inner_radius, d.ring_outer_radius
        faces = quad(lambda r, rate=rate: 4.0 * math.pi * r**3 * carreau(r * rate / d.axial_gap), inner, outer)[0]
        rings = sum(
            2.0 * math.pi * a**3 * d.ring_width / h * carreau(a * rate / h)
            for a, h in ((outer, d.outer_gap), (inner, d.inner_gap))
        )
        assert -torque(parameters, 0.0, rate)[0] == pytest.approx((faces / d.axial_gap + rings) * rate, rel=1e-6)


def test_laws_meet_where_nothing_thins():
    """Without shear, or with a critical stress far above it, all viscous laws are Newton's."""
    newton = law_of.damping_coefficient(law_of.damper_parameters(LAWS["newtonian"], WARM))
    assert law_of.damping_coefficient(law_of.damper_parameters(LAWS["shear-thinning"], WARM)) == pytest.approx(
        newton, rel=1e-12
    )
    stiff = law_of.damper_parameters(replace(LAWS["complex-modulus"], critical_stress=1e15), WARM)
    assert stiff[law_of.DAMPING] == pytest.approx(newton, rel=1e-5)
    assert stiff[law_of.STIFFNESS] < 1e-5 * newton * 2.0 * math.pi * DAMPER.frequency
    assert torque(law_of.damper_parameters(replace(DAMPER, critical_stress=1e15), WARM), 0.0, 50.0)[0] == pytest.approx(
        -50.0 * newton, rel=1e-9
    )


def test_complex_modulus_is_positive_and_falls_like_the_viscosity():
    """G', G'' of a liquid; at high frequency |G*|/ω falls with the exponent of Carreau's viscosity (Cox and Merz)."""
    omegas = np.geomspace(1.0, 1e8, 30)
    modulus = np.array([law_of.complex_modulus(DAMPER, WARM, omega) for omega in omegas])
    assert (modulus.real > 0.0).all() and (modulus.imag > 0.0).all()
    size = np.abs(modulus) / omegas
    slope = np.log(size[-1] / size[-2]) / np.log(omegas[-1] / omegas[-2])
    assert slope == pytest.approx(DAMPER.flow_exponent - 1.0, rel=1e-2)
    assert size[0] == pytest.approx(law_of.silicone_viscosity(DAMPER, WARM), rel=0.02)


def test_time_temperature_superposition():
    """Warmer is faster: at a rate, or frequency, higher by the viscosities' ratio the stress is the same."""
    hot = WARM + 40.0
    shift = law_of.silicone_viscosity(DAMPER, WARM) / law_of.silicone_viscosity(DAMPER, hot)
    assert shift > 1.0
    assert law_of.complex_modulus(DAMPER, hot, shift * 900.0) == pytest.approx(
        law_of.complex_modulus(DAMPER, WARM, 900.0), rel=1e-12
    )
    warm, hotter = (law_of.damper_parameters(DAMPER, temperature) for temperature in (WARM, hot))
    assert torque(hotter, 0.0, 5.0 * shift)[0] == pytest.approx(torque(warm, 0.0, 5.0)[0], rel=1e-12)


def test_viscosity_temperature_coefficient_of_dimethyl_silicone():
    """1 − ν(210 °F)/ν(100 °F) of dimethyl silicones from 100 mm²/s on is 0.60 to 0.62 in makers' tables."""
    cold, warm = (law_of.silicone_viscosity(DAMPER, (f - 32.0) / 1.8 + 273.15) for f in (100.0, 210.0))
    assert 1.0 - warm / cold == pytest.approx(0.61, abs=0.02)


def test_rubber_loses_its_loss_factor_at_its_frequency():
    rubber = LAWS["rubber"]
    for frequency in (None, 100.0):
        parameters = law_of.damper_parameters(rubber, WARM, frequency)
        omega = 2.0 * math.pi * (frequency or rubber.frequency)
        assert omega * parameters[law_of.DAMPING] / parameters[law_of.STIFFNESS] == pytest.approx(
            rubber.loss_factor, rel=1e-12
        )


@pytest.mark.parametrize("law", LAWS)
def test_equivalent_damping_dissipates_as_much(law):
    parameters, amplitude, omega = law_of.damper_parameters(LAWS[law], WARM), 6.0, 1300.0
    phase = np.linspace(0.0, 2.0 * math.pi, 2000, endpoint=False)
    power = [torque(parameters, amplitude / omega * math.sin(p), amplitude * math.cos(p))[3] for p in phase]
    assert np.mean(power) == pytest.approx(
        0.5 * law_of.equivalent_damping(parameters, amplitude) * amplitude**2, rel=1e-9
    )


def test_temperature_follows_its_table_and_its_heat_balance():
    speeds, temperatures = DAMPER.temperature_speeds, DAMPER.temperatures
    for speed in (speeds[0], 0.5 * (speeds[0] + speeds[1]), 2.0 * speeds[-1]):
        assert law_of.damper_temperature(DAMPER, speed) == pytest.approx(np.interp(speed, speeds, temperatures))
    for power in (0.0, 100.0, 500.0):
        warmth = DAMPER.ambient_temperature + power / (DAMPER.heat_transfer * DAMPER.cooling_area)
        assert law_of.balanced_temperature(DAMPER, power) == pytest.approx(warmth)


def test_a_damper_outside_its_law_is_refused():
    hottest = DAMPER.highest_temperature
    law_of.check_temperature(DAMPER, hottest)
    for temperature, way in ((hottest + 0.1, "hotter"), (DAMPER.lowest_temperature - 0.1, "colder"), (math.nan, "")):
        with one_line(way, " than its law is valid, -25 to 150 degC"):
            law_of.damper_parameters(DAMPER, temperature)
    with one_line("W heat it to ", " hotter than its law is valid"):
        law_of.balanced_temperature(DAMPER, 1e5)


def test_too_much_power_for_its_area_is_warned_of():
    limit = DAMPER.power_limit * DAMPER.cooling_area
    assert law_of.power_warning(DAMPER, limit) is None
    text = law_of.power_warning(DAMPER, 1.01 * limit)
    assert text is not None and "kW/m^2" in text and "\n" not in text


def test_the_pulley_carries_the_housing():
    engine = load_engine("diesel_i6")
    housed = law_of.with_damper_housing(engine)
    assert housed.pulley.mass - engine.pulley.mass == pytest.approx(DAMPER.mass)
    assert housed.pulley.polar_inertia - engine.pulley.polar_inertia == pytest.approx(DAMPER.housing_inertia)
    # Flat bodies: the inertias about two diameters add up to the polar one. The ring tilts along, its twist is its own.
    tilt = housed.pulley.diametral_inertia - engine.pulley.diametral_inertia
    assert 2.0 * tilt == pytest.approx(DAMPER.housing_inertia + DAMPER.ring_inertia)
    assert replace(housed, pulley=engine.pulley) == engine
    with one_line("has no [damper]"):
        law_of.with_damper_housing(replace(engine, damper=None))
