"""Torsional damper: torque between the housing, which rotates with the hub, and the ring.

With the twist ψ = hub rotation − ring rotation the torque on the hub is

    T = −[k ψ + c ψ̇ + Σ_i w_i η(s_i ψ̇) ψ̇]

*Viscous*. The fluid in a thin gap h at radius r shears at γ̇ = r ψ̇/h (Couette flow without inertia), so the gaps give
∫ r² η dA/h: faces 2 · 2π ∫ r³ η dr/h, cylinders 2π r³ b η/h. The faces are integrated by Gauss with four points, which
gives layers of weight w_i and shear ratio s_i = r_i/h. Σ w_i = S is the area moment over the gaps. The zero-shear
viscosity falls with temperature as η₀(T) = η₂₅ exp[B (1/T − 1/298.15 K)]. Three laws of the fluid exist:

* ``newtonian`` has a constant viscosity: c = S η₀;
* ``shear-thinning`` follows Carreau at every instant, η = η₀ [1 + (λγ̇)²]^((n−1)/2);
* ``complex-modulus`` has G* = iω η₀ / [1 + (iωλ)^(1−n)] (Cole and Cole). Its modulus over ω falls over ω like Carreau's
  viscosity over γ̇ (the rule of Cox and Merz). In the time domain it is the pair k = S G'(ω₀), c = S G''(ω₀)/ω₀ (Kelvin
  and Voigt) for the frequency ω₀ at which it is linearised, and is exact at ω₀ only.

The time constant is λ = η₀(T)/τ* with a critical stress τ* independent of temperature (time–temperature superposition).

*Linear*: k and c are given, either constant or over the frequency ω with linear interpolation, as makers of
steel-spring (leaf-spring) dampers state them. In the time domain they are k(ω₀) and c(ω₀).

*Rubber*: k is given, and c = d k/ω₀ with the loss factor d at ω₀. Both are constant within the temperature range.

The temperature of the damper comes from a table over speed, or from the heat balance T = T_a + P/(α A).

Sources: P. J. Carreau, Trans. Soc. Rheol. 16 (1972) 99; K. S. Cole, R. H. Cole, J. Chem. Phys. 9 (1941) 341; W. P. Cox,
E. H. Merz, J. Polym. Sci. 28 (1958) 619; Shin-Etsu, KF-96 performance test results (lg η = 763.1/T + const for
dimethyl silicones from −25 to 250 °C, so B = 1757 K); silicone oils in dampers have both G' and G'': D. Andrä, J. Sound
Vib. 82 (1982) 465; V. Píštěk, L. Klimeš, T. Mauder, Vibroeng. Procedia (2016), Rheological models of high viscosity
silicone fluids.
"""

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

# Indices of the parameters of a damper's torque; LAYERS weights (N m s) start at WEIGHTS, their shear ratios at SHEARS.
STIFFNESS, DAMPING, EXPONENT, TIME = range(4)
LAYERS = 6
WEIGHTS, SHEARS = 4, 4 + LAYERS
PARAMETERS = 4 + 2 * LAYERS
REFERENCE_TEMPERATURE = 298.15
_CELSIUS = 273.15
# Indices of the result of :func:`damper_constants`:
# KIND, LOWEST, HIGHEST, OMEGA: kind of damper, temperature range (K), frequency of linearisation (rad/s).
# SPRING, LOSS_FACTOR: stiffness (N m/rad) and loss factor of rubber.
# FLUID, SLOPE, STRESS, FLOW: viscosity of a fluid (Pa s), temperature slope (K), critical stress (Pa), flow exponent.
# MOMENT, MOMENTS, RATIOS: sum of the fluid layers' moments, moment of each layer (m³), shear ratio of each layer.
KIND, LOWEST, HIGHEST, OMEGA, SPRING, LOSS_FACTOR, FLUID, SLOPE, STRESS, FLOW, MOMENT = range(11)
MOMENTS, RATIOS, DAMPER_CONSTANTS = 11, 11 + LAYERS, 11 + 2 * LAYERS
NO_DAMPER, RUBBER, NEWTONIAN, THINNING, COMPLEX = range(5)
_FLUIDS = {SHEAR_THINNING: THINNING, COMPLEX_MODULUS: COMPLEX}


def damper_parameters(damper: Damper, temperature: float, frequency: float | None = None) -> Array:
    """Return the parameters of :func:`damper_torque`, (16,), at ``temperature``, K.

    ``frequency`` (Hz) replaces the damper's own frequency for the linearisation of complex modulus and rubber.

    Raises
    ------
    InputError
        if the temperature is outside the range of the law, the law is unknown, or the frequency is not positive
    """
    check_temperature(damper, temperature)
    parameters = np.zeros(PARAMETERS)
    damper_at(damper_constants(damper, frequency), temperature, parameters)
    return parameters


def damper_constants(damper: Damper, frequency: float | None = None) -> Array:
    """Return constants of a damper for :func:`damper_at`, (DAMPER_CONSTANTS,); raises as :func:`damper_parameters`."""
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
        # A linear damper is stored as a fluid of viscosity c and unit moment, independent of temperature.
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
    """Return the complex stiffness k + iωc (N m/rad) of a ``linear`` damper at angular frequencies ``omega``, rad/s."""
    if not damper.frequencies:
        return np.asarray(damper.stiffness + 1j * omega * damper.damping)
    k, c = (np.interp(omega / (2.0 * math.pi), damper.frequencies, of) for of in (damper.stiffnesses, damper.dampings))
    return np.asarray(k + 1j * omega * c)


def silicone_viscosity(damper: Damper, temperature: float) -> float:
    """Return the zero-shear dynamic viscosity of the fluid, Pa s, at ``temperature``, K."""
    return float(fluid_viscosity(temperature, damper.viscosity, damper.viscosity_slope))


def complex_modulus(damper: Damper, temperature: float, omega: float) -> complex:
    """Return G' + iG'' of the fluid, Pa, at ``temperature``, K, and angular frequency ``omega``, rad/s."""
    eta = silicone_viscosity(damper, temperature)
    return complex(*modulus_parts(eta, omega, damper.critical_stress, damper.flow_exponent))


def shear_layers(damper: Damper) -> tuple[Array, Array]:
    """Return weights ∫ r² dA/h (6,) m³ and shear ratios r/h (6,): four layers of the faces, outer, inner cylinder."""
    outer, inner, width = damper.ring_outer_radius, damper.ring_inner_radius, damper.ring_width
    nodes, shares = np.polynomial.legendre.leggauss(LAYERS - 2)
    r = 0.5 * (outer + inner) + 0.5 * (outer - inner) * nodes
    faces = 4.0 * math.pi * 0.5 * (outer - inner) * shares * r**3 / damper.axial_gap
    cylinders = [2.0 * math.pi * width * a**3 / h for a, h in ((outer, damper.outer_gap), (inner, damper.inner_gap))]
    ratios = np.concatenate((r / damper.axial_gap, [outer / damper.outer_gap, inner / damper.inner_gap]))
    return np.concatenate((faces, cylinders)), ratios


def damping_coefficient(parameters: Array) -> float:
    """Return the damping at zero rate, N m s/rad."""
    return float(parameters[DAMPING] + parameters[WEIGHTS:SHEARS].sum())


def equivalent_damping(parameters: Array, rate: float) -> float:
    """Return the linear damping (N m s/rad) of equal dissipation at a harmonic rate of amplitude ``rate``, rad/s.

    It is the describing function (1/π X) ∮ T cos φ dφ of the torque at ψ̇ = X cos φ.
    """
    phase = np.arange(64) * (math.pi / 128.0)  # a quarter period suffices for an odd torque
    cosine = np.cos(phase)
    sums = np.zeros_like(phase)
    for w, s in zip(parameters[WEIGHTS:SHEARS], parameters[SHEARS:], strict=True):
        sums += w * (1.0 + (parameters[TIME] * s * rate * cosine) ** 2) ** parameters[EXPONENT]
    weights = np.where(np.arange(64) == 0, 0.5, 1.0)  # trapezoidal rule; the integrand vanishes at the upper end
    return float(parameters[DAMPING] + np.sum(weights * sums * cosine**2) / np.sum(weights * cosine**2))


def damper_temperature(damper: Damper, speed: float) -> float:
    """Return the temperature of the damper, K, at engine speed ``speed``, rad/s, by interpolation of its data."""
    table = (np.array(column, dtype=float) for column in (damper.temperature_speeds, damper.temperatures))
    return float(temperature_at(speed, *table))


def balanced_temperature(damper: Damper, power: float) -> float:
    """Return the damper temperature (K) at which cooling balances the mean ``power`` (W); ``InputError`` if too hot."""
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
    """Raise ``InputError`` for a temperature (K) outside the range of the damper's law."""
    if damper.lowest_temperature <= temperature <= damper.highest_temperature:
        return
    way = "colder" if temperature < damper.lowest_temperature else "hotter"
    raise InputError(
        f"damper: {temperature - _CELSIUS:.4g} degC is {way} than its law is valid, "
        f"{damper.lowest_temperature - _CELSIUS:.4g} to {damper.highest_temperature - _CELSIUS:.4g} degC "
        "(damper.lowest_temperature, damper.highest_temperature)"
    )


def power_warning(damper: Damper, power: float) -> str | None:
    """Return a warning if the mean dissipated ``power`` (W) exceeds the limit of the cooling area, else None."""
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
    """Return the engine with its damper added to the pulley: mass, housing inertia, tilting inertia of the ring.

    The rotation of the ring is a separate coordinate; in translation and tilt the ring moves with the housing.

    Raises
    ------
    InputError
        if the engine has no ``[damper]``
    """
    damper = required_damper(engine)
    pulley = replace(
        engine.pulley,
        mass=engine.pulley.mass + damper.mass,
        polar_inertia=engine.pulley.polar_inertia + damper.housing_inertia,
        # The inertia of a flat ring about a diameter is half the polar inertia.
        diametral_inertia=engine.pulley.diametral_inertia + 0.5 * (damper.housing_inertia + damper.ring_inertia),
    )
    return replace(engine, pulley=pulley)


def required_damper(engine: Engine) -> Damper:
    """Return the engine's damper; ``InputError`` if it has none."""
    if engine.damper is None:
        raise InputError(f"engine '{engine.name}' has no [damper]; add that table as in engine/data/diesel_i6.toml")
    return engine.damper


@kernel
def damper_at(constants, temperature, parameters):
    """Compute ``parameters`` (PARAMETERS,) of :func:`damper_torque` at a ``temperature``, K, from the constants.

    Returns 0, or 1 for a temperature outside the range.
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
    """Return the zero-shear viscosity, Pa s, at a temperature, K, from ``reference`` at 25 °C and its ``slope``, K."""
    return reference * math.exp(slope * (1.0 / temperature - 1.0 / REFERENCE_TEMPERATURE))


@kernel
def modulus_parts(viscosity, omega, stress, exponent):
    """Return G' and G'' (Pa) at angular frequency ``omega`` (rad/s) for a zero-shear ``viscosity`` (Pa s)."""
    # G* = iωη/(1 + (iωλ)^p), in polar form.
    power = 1.0 - exponent
    size = (omega * viscosity / stress) ** power
    real = 1.0 + size * math.cos(0.5 * math.pi * power)
    imaginary = size * math.sin(0.5 * math.pi * power)
    share = omega * viscosity / (real * real + imaginary * imaginary)
    return share * imaginary, share * real


@kernel
def damper_torque(parameters, twist, rate, out):
    """Compute the torque on the hub at ``twist`` (rad) and ``rate`` (rad/s) of the hub relative to the ring.

    ``out`` (4,): torque on the hub, N m (the torque on the ring is opposite); ∂/∂twist; ∂/∂rate; dissipated power, W,
    never negative.
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
