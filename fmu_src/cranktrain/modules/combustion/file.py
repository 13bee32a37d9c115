"""Module files of combustion: tables of values with units and origins, geometry from the engine's own file.

Bore, stroke, rod, compression ratio and firing angles come from the engine file. Its table ``[combustion]`` also gives
intake and wall temperature, the angles at which the intake closes and the exhaust opens, and the manifold pressures
unless the module file states them. :class:`.CycleSettings` lists the table and key of each setting.
"""

from typing import Any

from cranktrain.engine.model import Engine
from cranktrain.modules.combustion import quantities
from cranktrain.modules.combustion.settings import CycleSettings, check_settings
from cranktrain.modules.module_file import ModuleFile


def cycle_settings(values: dict[str, Any], engine: Engine, name: str, title: str) -> CycleSettings:
    """Settings from a module file's values and an engine; ``InputError`` for contradictory values."""
    engine.refuse_two_strokes("the combustion module")
    burn, cylinders = engine.burn, engine.cylinders
    for pressure in ("intake_pressure", "exhaust_pressure"):
        values[pressure] = values[pressure] or getattr(burn, pressure)
    settings = CycleSettings(
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
    return settings


FILE = ModuleFile(
    quantities,
    CycleSettings,
    cycle_settings,
    "modules/combustion/data/combustion_i6.toml",
    {
        "fuel": "Fuel CH_y: lower heating value, and y.",
        "injection": "Initial inputs: fuel of a cylinder and cycle, start of injection after dead centre.",
        "ignition": "Delay A φ^−k p^−n exp(T_A/T), p in bar: factor A, exponent n, temperature T_A, by_ratio k.",
        "premixed": "Watson's fraction 1 − a φ^b/τ^c, and the Wiebe function of the premixed burn.",
        "diffusion": "Wiebe function of the diffusion burn at its reference equivalence ratio and speed.",
        "valves": "Valves of one cylinder: sizes, coefficients of curtain and port, the angles of the built-in lifts.",
        "manifolds": "Exhaust temperature, fraction of products in the intake, and pressures in place of the engine's.",
        "walls": "Factor on Woschni's coefficient, and swirl c_u/c_m.",
    },
)
"""Description of a combustion module file: its TOML tables and their titles."""
load = FILE.load
