"""Geometry in a cranktrain FMU: dimensions for other modules, and dimensions that a user may set.

Bore and compression ratio act through the gas only, so they may differ from the engine file's values. With a flexible
block the bore may not differ, because the block was made for its bore. All other dimensions must equal those of crank
and rods, so that a parameter set of another engine is noticed.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings, axial_force, resolved
from cranktrain.engine.model import Engine

SETTABLE = ("bore", "compression_ratio")
START_SPEED = 2000.0 * RPM
"""Start value of the FMU's speed, rad/s; if the engine does not run at it, the nearest of its speeds is used."""
CLOSE = 1.0e-9
"""Relative tolerance within which values that were written as text count as equal."""


def geometry(engine: Engine) -> dict[str, Any]:
    """Dimensions of an engine, m and rad, by their names in interface.toml, and firing angles of each cylinder."""
    cylinders = engine.cylinders
    return {
        "bore": cylinders.bore,
        "stroke": 2.0 * engine.crankshaft.throw,
        "rod_length": engine.rod.length,
        "pin_offset": cylinders.pin_offset,
        "compression_ratio": cylinders.compression_ratio,
        "firing_angles": engine.firing_angles,
    }


def start_values(engine: Engine) -> dict[str, Any]:
    """Values of an engine for variables of the interface: dimensions, axial force (N), speed (rad/s), cycle (rad)."""
    low, high = engine.speeds
    speed = min(max(START_SPEED, low), high)
    more = {"axial_force": axial_force(Settings(), engine), "speed": speed, "cycle": engine.cylinders.cycle}
    return geometry(engine) | more


def with_geometry(engine: Engine, chosen: Mapping[str, Any], names: Mapping[str, str]) -> tuple[Engine, dict[str, Any]]:
    """Engine with those dimensions that ``chosen`` contains, and the remaining chosen values.

    Raises ``InputError``: a dimension that would need other bodies than the FMU's.

    Parameters
    ----------
    chosen : values by setting; the firing angle of a cylinder is named ``firing_angles[1]``
    names : the FMU's names of settings
    """
    rest = dict(chosen)
    own = geometry(engine)
    own |= {f"firing_angles[{c + 1}]": angle for c, angle in enumerate(own.pop("firing_angles"))}
    given = {key: float(rest.pop(key)) for key in own if key in rest}
    new: dict[str, Any] = {
        key: value for key, value in given.items() if not math.isclose(value, own[key], rel_tol=CLOSE, abs_tol=CLOSE)
    }
    for key, value in new.items():
        if key not in SETTABLE:
            _refuse(names.get(key, key), value, own[key], "crank and rods of this FMU were")
        if key == "bore" and resolved(Settings(**rest), engine).block == "flexible":
            _refuse(names.get(key, key), value, own[key], "the flexible block of this FMU was")
    return (replace(engine, cylinders=replace(engine.cylinders, **new)) if new else engine), rest


def _refuse(name: str, value: float, own: float, made: str) -> None:
    raise InputError(
        f"'{name}' is {value:.9g}, but {made} made for {own:.9g}; keep that value, or build the FMU of an engine file "
        "with the new one, with build_fmu.py"
    )
