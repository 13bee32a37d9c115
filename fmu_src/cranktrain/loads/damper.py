"""Torsional damper: the torque between its housing, which turns with the hub, and its ring.

With the twist ψ = hub rotation − ring rotation the torque on the hub is

    T = −[k ψ + c ψ̇ + Σ_i w_i η(s_i ψ̇) ψ̇]

*Viscous*. The fluid in a thin gap h at radius r shears at γ̇ = r ψ̇/h (Couette flow without inertia), so the gaps give
∫ r² η dA/h: faces 2 · 2π ∫ r³ η dr/h, cylinders 2π r³ b η/h. The faces are integrated by Gauss with four points, hence
the layers of weight w_i and shear ratio s_i = r_i/h; with one viscosity Σ w_i = S, the area moment over the gaps. Its
viscosity without shear falls with temperature as η₀(T) = η₂₅ exp[B (1/T − 1/298.15 K)], and

* ``newtonian`` keeps it: c = S η₀;
* ``shear-thinning`` follows Carreau at every instant, η = η₀ [1 + (λγ̇)²]^((n−1)/2);
* ``complex-modulus`` has G* = iω η₀ / [1 + (iωλ)^(1−n)] (Cole and Cole). Its modulus over ω falls over ω like Carreau's
  viscosity over γ̇ (the rule of Cox and Merz). In time it is the pair k = S G'(ω₀), c = S G''(ω₀)/ω₀ (Kelvin and Voigt)
  of the frequency ω₀ at which it is linearised; it is exact at ω₀ only.

The time λ = η₀(T)/τ* with a critical stress τ* that temperature leaves alone (time–temperature superposition).

*Linear*: k and c as given, or over the frequency ω as makers of steel-spring (leaf-spring) dampers state them, straight
between their points; in time k(ω₀) and c(ω₀).

*Rubber*: k as given and c = d k/ω₀ with the loss factor d at ω₀, the same at all temperatures of its range.

The temperature of the damper comes from a table over speed, or from the heat balance T = T_a + P/(α A).

Sources: P. J. Carreau, Trans. Soc. Rheol. 16 (1972) 99; K. S. Cole, R. H. Cole, J. Chem. Phys. 9 (1941) 341; W. P. Cox,
E. H. Merz, J. Polym. Sci. 28 (1958) 619; Shin-Etsu, KF-96 performance test results (lg η = 763.1/T + const for
dimethyl silicones from −25 to 250 °C, so B = 1757 K); silicone oils in dampers show G' beside G'': D. Andrä, J. Sound
Vib. 82 (1982) 465; V. Píštěk, L. Klimeš, T. Mauder, Vibroeng. Procedia (2016), Rheological models of high viscosity
silicone fluids.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import put_four
from cranktrain.core.reduced_body import Array
from cranktrain.engine.lubricant import temperature_at
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Damper
from cranktrain.engine.quantities import COMPLEX_MODULUS, DAMPER_LAWS, SHEAR_THINNING

# Places of the parameters; LAYERS weights (N m s) follow from WEIGHTS, their shear ratios from SHEARS.
STIFFNESS, DAMPING, EXPONENT, TIME = range(4)
LAYERS = 6
WEIGHTS, SHEARS = 4, 4 + LAYERS
PARAMETERS = 4 + 2 * LAYERS
REFERENCE_TEMPERATURE = 298.15
_CELSIUS = 273.15
# Slots of :func:`damper_constants`: kind of damper, range of its temperature (K) and the frequency (rad/s) at which it
# is linearised; a rubber's stiffness and loss factor; of a fluid the viscosity and its slope, critical stress and flow
# exponent, the sum of its layers' moments; these moments and the shear ratios.
KIND, LOWEST, HIGHEST, OMEGA, SPRING, LOSS_FACTOR, FLUID, SLOPE, STRESS, FLOW, MOMENT = range(11)
MOMENTS, RATIOS, DAMPER_CONSTANTS = 11, 11 + LAYERS, 11 + 2 * LAYERS
NO_DAMPER, RUBBER, NEWTONIAN, THINNING, COMPLEX = range(5)
_FLUIDS = {SHEAR_THINNING: THINNING, COMPLEX_MODULUS: COMPLEX}


def damper_parameters(damper: Damper, temperature: float, frequency: float | None = None) -> Array:
    """Parameters of :func:`damper_torque`, (16,), at ``temperature``, K.

    ``frequency`` (Hz) is where complex modulus and rubber are linearised, in place of the damper's own.

    Raises
    ------
    InputError
        a temperature outside the damper's law, an unknown law, a frequency that is not positive
    """
    check_temperature(damper, temperature)
    parameters = np.zeros(PARAMETERS)
    damper_at(damper_constants(damper, frequency), temperature, parameters)
    return parameters


def damper_constants(damper: Damper, frequency: float | None = None) -> Array:
    """Constants of a damper for :func:`damper_at`, (DAMPER_CONSTANTS,); raises like :func:`damper_parameters`."""
    omega = 2.0 * math.pi * (damper.frequency if frequency is None else frequency)
    if not 0.0 < omega < math.inf:
        raise InputError(f"a damper is linearised at a positive frequency, got {omega / (2.0 * math.pi):g} Hz")
    constants = np.zeros(DAMPER_CONSTANTS)
    constants[[LOWEST, HIGHEST, OMEGA]] = damper.lowest_temperature, damper.highest_temperature, omega
    if damper.kind == "rubber":
        constants[[KIND, SPRING, LOSS_FACTOR]] = RUBBER, damper.stiffness, damper.loss_factor
        return constants
    if damper.kind == "linear":
        [value] = linear_stiffness(damper, np.array([omega]))
        # A fluid whose viscosity is c over a moment of 1, the same at every temperature.
        constants[[KIND, FLUID, MOMENT, SPRING]] = NEWTONIAN, value.imag / omega, 1.0, value.real
        return constants
    if damper.law not in DAMPER_LAWS:
        raise InputError(f"damper.law '{damper.law}' does not exist; {nearest(damper.law, DAMPER_LAWS)}")
    moments, ratios = shear_layers(damper)
    constants[KIND] = _FLUIDS.get(damper.law, NEWTONIAN)
    constants[[FLUID, SLOPE]] = damper.viscosity, damper.viscosity_slope
    constants[[STRESS, FLOW]] = damper.critical_stress, damper.flow_exponent
    constants[MOMENT] = moments.sum()
    constants[MOMENTS : MOMENTS + LAYERS], constants[RATIOS : RATIOS + LAYERS] = moments, ratios
    return constants


def linear_stiffness(damper: Damper, omega: Array) -> NDArray[np.complex128]:
    """Complex stiffness k + iωc (N m/rad) of a damper of kind ``linear`` at angular frequencies, rad/s."""
    if not damper.frequencies:
        return np.asarray(damper.stiffness + 1j * omega * damper.damping)
    k, c = (np.interp(omega / (2.0 * math.pi), damper.frequencies, of) for of in (damper.stiffnesses, damper.dampings))
    return np.asarray(k + 1j * omega * c)


def silicone_viscosity(damper: Damper, temperature: float) -> float:
    """Dynamic viscosity of the fluid without shear, Pa s, at ``temperature``, K."""
    return float(fluid_viscosity(temperature, damper.viscosity, damper.viscosity_slope))


def complex_modulus(damper: Damper, temperature: float, omega: float) -> complex:
    """G' + iG'' of the fluid, Pa, at ``temperature``, K, and angular frequency ``omega``, rad/s."""
    eta = silicone_viscosity(damper, temperature)
    return complex(*modulus_parts(eta, omega, damper.critical_stress, damper.flow_exponent))


def shear_layers(damper: Damper) -> tuple[Array, Array]:
    """Weights ∫ r² dA/h (6,) m³ and shear ratios r/h (6,): four layers of the faces, outer and inner cylinder."""
    outer, inner, width = damper.ring_outer_radius, damper.ring_inner_radius, damper.ring_width
    nodes, shares = np.polynomial.legendre.leggauss(LAYERS - 2)
    r = 0.5 * (outer + inner) + 0.5 * (outer - inner) * nodes
    faces = 4.0 * math.pi * 0.5 * (outer - inner) * shares * r**3 / damper.axial_gap
    cylinders = [2.0 * math.pi * width * a**3 / h for a, h in ((outer, damper.outer_gap), (inner, damper.inner_gap))]
    ratios = np.concatenate((r / damper.axial_gap, [outer / damper.outer_gap, inner / damper.inner_gap]))
    return np.concatenate((faces, cylinders)), ratios


def damping_coefficient(parameters: Array) -> float:
    """Damping at zero rate, N m s/rad."""
    return float(parameters[DAMPING] + parameters[WEIGHTS:SHEARS].sum())


def equivalent_damping(parameters: Array, rate: float) -> float:
    """Damping (N m s/rad) of a linear damper that dissipates as much at the harmonic rate of amplitude ``rate``, rad/s.

    The describing function (1/π X) ∮ T cos φ dφ of the torque at ψ̇ = X cos φ.
    """
    phase = np.arange(64) * (math.pi / 128.0)  # a quarter: the torque is odd, the sum spectral
    cosine = np.cos(phase)
    sums = np.zeros_like(phase)
    for w, s in zip(parameters[WEIGHTS:SHEARS], parameters[SHEARS:], strict=True):
        sums += w * (1.0 + (parameters[TIME] * s * rate * cosine) ** 2) ** parameters[EXPONENT]
    weights = np.where(np.arange(64) == 0, 0.5, 1.0)  # trapezoidal rule; the integrand vanishes at the other end
    return float(parameters[DAMPING] + np.sum(weights * sums * cosine**2) / np.sum(weights * cosine**2))


def damper_temperature(damper: Damper, speed: float) -> float:
    """Temperature of the damper, K, at engine speed ``speed``, rad/s, from its table."""
    table = (np.array(column, dtype=float) for column in (damper.temperature_speeds, damper.temperatures))
    return float(temperature_at(speed, *table))


def balanced_temperature(damper: Damper, power: float) -> float:
    """Temperature, K, at which the damper gives off the mean dissipated ``power``, W; refuses one beyond its law."""
    if not damper.heat_transfer * damper.cooling_area:
        raise InputError(
            "damper: a heat balance needs damper.heat_transfer and damper.cooling_area; give them, or take the "
            "temperature of the engine file"
        )
    temperature = damper.ambient_temperature + power / (damper.heat_transfer * damper.cooling_area)
    if temperature > damper.highest_temperature:
        most = damper.heat_transfer * damper.cooling_area * (damper.highest_temperature - damper.ambient_temperature)
        raise InputError(
            f"damper: {power:.4g} W heat it to {temperature - _CELSIUS:.4g} degC, hotter than its law is valid (to "
            f"{damper.highest_temperature - _CELSIUS:.4g} degC or {most:.4g} W); give more damper.cooling_area or "
            "heat_transfer, or less load"
        )
    return temperature


def check_temperature(damper: Damper, temperature: float) -> None:
    """Refuse a temperature (K) at which the damper's law is not valid, with ``InputError``."""
    if damper.lowest_temperature <= temperature <= damper.highest_temperature:
        return
    way = "colder" if temperature < damper.lowest_temperature else "hotter"
    raise InputError(
        f"damper: {temperature - _CELSIUS:.4g} degC is {way} than its law is valid, "
        f"{damper.lowest_temperature - _CELSIUS:.4g} to {damper.highest_temperature - _CELSIUS:.4g} degC "
        "(damper.lowest_temperature, damper.highest_temperature)"
    )


def power_warning(damper: Damper, power: float) -> str | None:
    """One line where the mean dissipated ``power`` (W) exceeds the limit of the cooling area, else None."""
    if not damper.cooling_area:
        return None
    flux = power / damper.cooling_area
    if flux <= damper.power_limit:
        return None
    return (
        f"damper dissipates {power:.4g} W, {1e-3 * flux:.4g} kW/m^2 of its cooling area; its limit is "
        f"{1e-3 * damper.power_limit:.4g} kW/m^2 (damper.power_limit)"
    )


def with_damper_housing(engine: Engine) -> Engine:
    """The engine with its damper on the pulley: mass, housing inertia, and the ring's inertia in tilting.

    The ring's own rotation is an additional coordinate; across and in tilt it moves with the housing.

    Raises
    ------
    InputError
        an engine without ``[damper]``
    """
    damper = required_damper(engine)
    pulley = replace(
        engine.pulley,
        mass=engine.pulley.mass + damper.mass,
        polar_inertia=engine.pulley.polar_inertia + damper.housing_inertia,
        # A flat ring's inertia about its diameter is half the polar one.
        diametral_inertia=engine.pulley.diametral_inertia + 0.5 * (damper.housing_inertia + damper.ring_inertia),
    )
    return replace(engine, pulley=pulley)


def required_damper(engine: Engine) -> Damper:
    """The engine's damper; ``InputError`` where it has none."""
    if engine.damper is None:
        raise InputError(f"engine '{engine.name}' has no [damper]; add that table as in engine/data/diesel_i6.toml")
    return engine.damper


@kernel
def damper_at(constants, temperature, parameters):
    """Fill ``parameters`` (PARAMETERS,) of :func:`damper_torque` at a ``temperature``, K, from its constants.

    Returns 0, or 1 for a temperature outside its range.
    """
    for k in range(PARAMETERS):
        parameters[k] = 0.0
    if constants[KIND] == NO_DAMPER:
        return 0
    if not (constants[LOWEST] <= temperature <= constants[HIGHEST]):
        return 1
    omega = constants[OMEGA]
    if constants[KIND] == RUBBER:
        parameters[STIFFNESS] = constants[SPRING]
        parameters[DAMPING] = constants[LOSS_FACTOR] * constants[SPRING] / omega
        return 0
    eta = fluid_viscosity(temperature, constants[FLUID], constants[SLOPE])
    if constants[KIND] == THINNING:
        parameters[EXPONENT] = 0.5 * (constants[FLOW] - 1.0)
        parameters[TIME] = eta / constants[STRESS]
        for k in range(LAYERS):
            parameters[WEIGHTS + k] = eta * constants[MOMENTS + k]
            parameters[SHEARS + k] = constants[RATIOS + k]
        return 0
    real, imaginary = 0.0, omega * eta
    if constants[KIND] == COMPLEX:
        real, imaginary = modulus_parts(eta, omega, constants[STRESS], constants[FLOW])
    parameters[STIFFNESS] = constants[SPRING] + constants[MOMENT] * real
    parameters[DAMPING] = constants[MOMENT] * imaginary / omega
    return 0


@kernel
def fluid_viscosity(temperature, reference, slope):
    """Viscosity of a fluid without shear, Pa s, at a temperature, K, from that at 25 °C and its ``slope``, K."""
    return reference * math.exp(slope * (1.0 / temperature - 1.0 / REFERENCE_TEMPERATURE))


@kernel
def modulus_parts(viscosity, omega, stress, exponent):
    """G' and G'' (Pa) at the angular frequency ``omega`` (rad/s) of a fluid of ``viscosity`` (Pa s) without shear."""
    # G* = iωη/(1 + (iωλ)^p), in polar form.
    power = 1.0 - exponent
    size = (omega * viscosity / stress) ** power
    real = 1.0 + size * math.cos(0.5 * math.pi * power)
    imaginary = size * math.sin(0.5 * math.pi * power)
    share = omega * viscosity / (real * real + imaginary * imaginary)
    return share * imaginary, share * real


@kernel
def damper_torque(parameters, twist, rate, out):
    """Torque on the hub at ``twist`` (rad) and ``rate`` (rad/s), hub less ring, with tangents.

    ``out`` (4,): torque on the hub, N m (the ring feels its opposite); ∂/∂twist; ∂/∂rate; dissipated power, W, never
    negative.
    """
    torque = parameters[DAMPING] * rate
    tangent = parameters[DAMPING]
    for i in range(LAYERS):
        shear = parameters[TIME] * parameters[SHEARS + i] * rate
        square = shear * shear
        eta = parameters[WEIGHTS + i] * math.exp(parameters[EXPONENT] * math.log1p(square))
        torque += eta * rate
        tangent += eta * (1.0 + 2.0 * parameters[EXPONENT] * square / (1.0 + square))
    put_four(out, 0, (-parameters[STIFFNESS] * twist - torque, -parameters[STIFFNESS], -tangent, torque * rate))
