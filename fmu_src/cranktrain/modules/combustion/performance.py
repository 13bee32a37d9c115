"""Performance of an engine's cylinders at one speed and load: air, pressures and fuel consumption.

    λ = m_air/(m_fuel L),   ratio = p_max/p_motored,   b_e = m_fuel/(p_me V_h),   p_me = p_mi − p_mf

m_air is the trapped fresh air, p_motored the peak pressure of the same cylinder without fuel; p_mi includes the gas
exchange. The module itself has no friction; the cranktrain includes the friction of bearings and piston skirts. The
total friction with rings, valve train, pumps and injection is estimated by the form of Chen and Flynn,

    p_mf = 0.4 bar + 0.005 p_max + 0.09 bar s/m c_m + 0.0009 bar s²/m² c_m²

with values that are usual in engine cycle simulation today; c_m is the mean piston speed.

Source: S. K. Chen, P. F. Flynn, Development of a Single Cylinder Compression Ignition Research Engine, SAE 650733
(1965).
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.modules.combustion.gas import stoichiometric_air
from cranktrain.modules.combustion.settings import CycleSettings
from cranktrain.modules.combustion.simulation import CombustionSimulation

FRICTION = 0.4e5, 0.005, 0.09e5, 0.0009e5
"""Chen and Flynn's constant (Pa) and factors of peak pressure (1), mean piston speed (Pa s/m) and its square."""
STEP = math.radians(0.5)
CLOSED = math.radians(-100.0)
"""Angle after firing dead centre, rad, at which the trapped air is read; valves are closed and no fuel burns yet."""
MOST_SCATTER, LEAST_FACTOR = 0.3, 0.2
"""Largest scatter of the burn's duration that is tried, and the smallest factor on the duration that occurs."""
SETTLE = 5.0
"""Number of cycles that are run before the evaluated cycle."""


@dataclass(frozen=True)
class Performance:
    """Results at one operating point (SI).

    Speed, rad/s; trapped fresh air over the air that the fuel needs; peak pressure, Pa, and its angle after firing dead
    centre, rad; peak pressure without fuel, Pa; indicated (with gas exchange) and friction mean effective pressure, Pa;
    torque of all cylinders minus friction, N m; fuel per brake work, kg/J; fraction of the fuel's heat that goes to the
    walls.
    """

    speed: float
    air_ratio: float
    peak_pressure: float
    peak_angle: float
    motored_pressure: float
    indicated_pressure: float
    friction_pressure: float
    torque: float
    fuel_consumption: float
    wall_fraction: float

    @property
    def peak_ratio(self) -> float:
        """Ratio of the peak pressure to the peak pressure without fuel."""
        return self.peak_pressure / self.motored_pressure

    @property
    def brake_pressure(self) -> float:
        """Brake mean effective pressure, Pa."""
        return self.indicated_pressure - self.friction_pressure


def friction_pressure(peak: float, piston_speed: float) -> float:
    """Friction mean effective pressure, Pa, auxiliaries included, from peak pressure (Pa), mean piston speed (m/s)."""
    constant, by_peak, by_speed, by_square = FRICTION
    return constant + by_peak * peak + by_speed * piston_speed + by_square * piston_speed**2


def performance(settings: CycleSettings, speed: float) -> Performance:
    """Performance at a speed, rad/s, with the settings' fuel, timing and manifolds; all cylinders are equal."""
    fired, motored = (
        settled_cycle(settings, speed),
        settled_cycle(replace(settings, fuel_mass=0.0, air_ratio=0.0), speed),
    )
    closed = round((CLOSED + 4.0 * math.pi) / STEP) - 1
    air = fired["cylinder[1].mass"][closed] * (1.0 - fired["cylinder[1].products"][closed])
    fuel = settings.fuel_mass
    if settings.sparks:
        air, fuel = (fired[f"cylinder[1].{name}"][-1] for name in ("trapped_air", "fuel_mass"))
    last = {name: float(values[-1]) for name, values in fired.items()}
    peak, indicated = last["cylinder[1].pressure_peak"], last["indicated.pressure_mean"]
    friction = friction_pressure(peak, settings.stroke * speed / math.pi)
    work = (indicated - friction) * swept(settings)
    return Performance(
        speed=speed,
        air_ratio=float(air) / (fuel * stoichiometric_air(settings.hydrogen_per_carbon)),
        peak_pressure=peak,
        peak_angle=last["cylinder[1].peak_angle"],
        motored_pressure=float(motored["cylinder[1].pressure_peak"][-1]),
        indicated_pressure=indicated,
        friction_pressure=friction,
        torque=work * len(settings.firing_angles) / (4.0 * math.pi),
        fuel_consumption=float(fuel) / work,
        wall_fraction=last["cylinder[1].wall_heat"] / last["cylinder[1].heat_released"],
    )


def swept(settings: CycleSettings) -> float:
    """Swept volume of a cylinder without pin offset, m³."""
    return 0.25 * math.pi * settings.bore**2 * settings.stroke


def mean_pressure(settings: CycleSettings, speed: float) -> float:
    """Indicated mean effective pressure, Pa, of a settled cycle at a speed, rad/s."""
    return float(settled_cycle(settings, speed)["indicated.pressure_mean"][-1])


def best_spark(settings: CycleSettings, speed: float) -> float:
    """Spark angle of the largest torque at a speed (rad/s), after dead centre, rad, to a tenth of a degree."""
    low, high = math.radians(-60.0), math.radians(10.0)

    def torque(angle: float) -> float:
        return mean_pressure(replace(settings, injection_angle=angle), speed)

    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    inner = [high - golden * (high - low), low + golden * (high - low)]
    values = [torque(angle) for angle in inner]
    while high - low > math.radians(0.1):
        if values[0] > values[1]:
            high, inner[1], values[1] = inner[1], inner[0], values[0]
            inner[0] = high - golden * (high - low)
            values[0] = torque(inner[0])
        else:
            low, inner[0], values[0] = inner[0], inner[1], values[1]
            inner[1] = low + golden * (high - low)
            values[1] = torque(inner[1])
    return 0.5 * (low + high)


def burn_scatter(settings: CycleSettings) -> float:
    """Scatter of the burn's duration that gives the settings' scatter of the mean pressure, at the reference speed.

    After a settled cycle, the mean pressure of the next one is computed at durations over the whole range of the
    scatter, as a polynomial; mean and deviation follow by summing over the normal distribution, limited to ±3.
    ``InputError`` if no scatter up to ``MOST_SCATTER`` suffices.
    """
    factors = np.linspace(LEAST_FACTOR, 1.0 + 3.0 * MOST_SCATTER, 12)
    start, values = _started(settings, settings.reference_speed), []
    start.step(2.0 * math.pi / settings.reference_speed)
    for factor in factors:
        other = replace(start.settings, premixed_duration=factor * settings.premixed_duration,
                        diffusion_duration=factor * settings.diffusion_duration)  # fmt: skip
        simulation = CombustionSimulation(other)
        simulation.inputs[:] = start.inputs
        simulation.initialize()
        simulation.state = start.state
        simulation.step(6.0 * math.pi / settings.reference_speed)
        values.append(simulation.outputs[simulation.output_names.index("indicated.pressure_mean")])
    fitted = np.polynomial.Polynomial.fit(factors, values, 8)
    place = np.linspace(-3.0, 3.0, 601)
    weight = np.exp(-0.5 * place**2)
    weight[[0, -1]] += math.sqrt(2.0 * math.pi) * 0.5 * math.erfc(3.0 / math.sqrt(2.0)) / (place[1] - place[0])
    weight /= weight.sum()

    def variation(scatter: float) -> float:
        pressures = fitted(np.maximum(1.0 + scatter * place, LEAST_FACTOR))
        mean = float(weight @ pressures)
        return math.sqrt(max(float(weight @ (pressures - mean) ** 2), 0.0)) / mean

    low, high = 0.0, MOST_SCATTER
    if variation(high) < settings.scatter_pressure:
        raise InputError(
            f"scatter.mean_pressure {settings.scatter_pressure:g} is more than a scatter of the burn's duration of "
            f"{MOST_SCATTER:g} gives, {variation(high):.2g}; give less, or scatter fuel and timing of the FMU as well"
        )
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if variation(middle) < settings.scatter_pressure else (low, middle)
    return 0.5 * (low + high)


def settled_cycle(settings: CycleSettings, speed: float) -> dict[str, NDArray[np.float64]]:
    """Outputs of one cylinder's settled cycle in steps of ``STEP``, the first one after firing dead centre, by name."""
    simulation, rows = _started(settings, speed), []
    for k in range(round(8.0 * math.pi / STEP)):
        simulation.step((k + 1) * STEP / speed)
        rows.append(simulation.outputs.copy())
    last = np.array(rows[len(rows) // 2 :])
    return {name: last[:, k] for k, name in enumerate(simulation.output_names)}


def _started(settings: CycleSettings, speed: float) -> CombustionSimulation:
    """One cylinder without scatter at its firing dead centre, settled at a speed, rad/s."""
    alone = replace(settings, firing_angles=(0.0,), start_cycles=SETTLE, angle_source="speed", scatter_burn=0.0)
    simulation = CombustionSimulation(alone)
    simulation.inputs[simulation.input_names.index("crank.speed")] = speed
    simulation.initialize()
    return simulation
