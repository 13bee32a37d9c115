"""Module files of combustion: tables of values with units and origins, geometry from the engine's own file.

Bore, stroke, rod, compression ratio and firing angles come from the engine file. Its table ``[combustion]`` also gives
intake and wall temperature, the angles at which the intake closes and the exhaust opens, and the manifold pressures
unless the module file states them. :class:`.CycleSettings` lists the table and key of each setting.
"""

from dataclasses import replace
from typing import Any

from cranktrain.core.errors import InputError
from cranktrain.engine.model import Engine
from cranktrain.modules.combustion import quantities
from cranktrain.modules.combustion.gas import stoichiometric_air
from cranktrain.modules.combustion.performance import burn_scatter, swept
from cranktrain.modules.combustion.settings import CycleSettings, check_settings
from cranktrain.modules.module_file import ModuleFile

RICHEST = 0.6
"""Air ratio of a filled cylinder below which a module file's fuel is refused."""
AIR_CONSTANT = 287.0
"""Gas constant of air, J/(kg K)."""


def cycle_settings(values: dict[str, Any], engine: Engine, name: str, title: str) -> CycleSettings:
    """Settings from a module file's values and an engine; ``InputError`` for contradictory values."""
    engine.refuse_two_strokes("the combustion module")
    burn, cylinders = engine.burn, engine.cylinders
    for pressure in ("intake_pressure", "exhaust_pressure"):
        values[pressure] = values[pressure] or getattr(burn, pressure)
    settings = CycleSettings(
        sparks=float("air_ratio" in values),
        name=name,
        title=title,
        bore=cylinders.bore,
        stroke=2.0 * engine.crankshaft.throw,
        rod_length=engine.rod.length,
        pin_offset=cylinders.pin_offset,
        compression_ratio=cylinders.compression_ratio,
        firing_angles=engine.firing_angles,
        intake_temperature=burn.intake_temperature,
        wall_temperature=burn.wall_temperature,
        intake_closes=burn.intake_closes,
        exhaust_opens=burn.exhaust_opens,
        **values,
    )
    check_settings(settings)
    check_mixture(settings)
    if settings.scatter_pressure:
        settings = replace(settings, scatter_burn=burn_scatter(settings))
    return settings


def check_mixture(settings: CycleSettings) -> None:
    """Refuse fuel that the air of a filled cylinder cannot burn, ``InputError``."""
    if settings.sparks:
        return
    air = settings.intake_pressure / (AIR_CONSTANT * settings.intake_temperature) * swept(settings)
    ratio = air / max(settings.fuel_mass * stoichiometric_air(settings.hydrogen_per_carbon), 1e-12)
    if ratio < RICHEST:
        burnt = air / stoichiometric_air(settings.hydrogen_per_carbon)
        raise InputError(
            f"injection.mass {1e6 * settings.fuel_mass:.4g} mg is too much for {1e6 * swept(settings):.4g} cm3 of air "
            f"at {1e-5 * settings.intake_pressure:.3g} bar: lambda {ratio:.2g}, diesels have 1.2 or more; "
            f"{1e6 * burnt:.3g} mg is lambda 1 (check [manifolds], and the engine that the file names)"
        )


FILE = ModuleFile(
    quantities,
    CycleSettings,
    cycle_settings,
    "modules/combustion/data/combustion_i6.toml",
    {
        "fuel": "Fuel CH_y: lower heating value, and y.",
        "injection": "Initial inputs: fuel of a cylinder and cycle, start of injection after dead centre.",
        "spark": "Spark ignition, initial inputs: angle of the spark after dead centre, air over what the fuel needs.",
        "burn": "One or two Wiebe functions from the spark, at a reference speed and state of the charge at the spark.",
        "ignition": "Delay A φ^−k p^−n exp(T_A/T), p in bar: factor A, exponent n, temperature T_A, by_ratio k.",
        "premixed": "Watson's fraction 1 − a φ^b/τ^c, and the Wiebe function of the premixed burn.",
        "diffusion": "Wiebe function of the diffusion burn at its reference equivalence ratio and speed.",
        "valves": "Valves of one cylinder: sizes, coefficients of curtain and port, the angles of the built-in lifts.",
        "manifolds": "Exhaust temperature, fraction of products in the intake, and pressures in place of the engine's.",
        "walls": "Factor on Woschni's coefficient, and swirl c_u/c_m.",
        "scatter": "Coefficient of variation of the mean effective pressure; the burn's scatter follows from it.",
    },
    variants={
        "compression ignition": ("injection", "ignition", "premixed", "diffusion"),
        "spark ignition": ("spark", "burn"),
    },
)
"""Description of a combustion module file: its TOML tables and their titles."""
load = FILE.load
