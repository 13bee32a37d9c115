"""Masses and inertias that are unlikely for an engine of this size: warnings only, because a study may need them.

Masses are compared with a steel cube as wide as the bore, radii of gyration with a length of the part or the bore. The
limits are a factor of ten to a hundred beyond what engines have from models to ships.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator

from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import mm

STEEL = 7850.0
MASSES = {
    "cylinders.piston_mass": (0.005, 5.0),
    "rod.big_end_mass": (0.005, 5.0),
    "rod.small_end_mass": (0.002, 5.0),
    "flywheel.mass": (0.01, 300.0),
    "pulley.mass": (0.005, 100.0),
    "clutch.mass": (0.005, 300.0),
    "damper.mass": (0.005, 100.0),
    "block.head_mass": (0.01, 100.0),
}
"""Least and largest mass of a part, over that of a steel cube as wide as the bore."""
GYRATIONS = {"flywheel": (0.1, 10.0), "pulley": (0.05, 10.0), "clutch": (0.05, 10.0)}
"""Least and largest radius of gyration about the crank's axis, over the bore."""
ROD_GYRATION = (0.1, 1.5)
"""Of the rod about its centre of mass, over its length."""


def warn_of_masses(engine: Engine) -> None:
    """Warn of masses and inertias that are hardly of this engine, one line each: ``table.key``, value, limits."""
    for text in _unlikely(engine):
        warnings.warn(f"{engine.name}: {text}; check its unit", stacklevel=2)


def _unlikely(engine: Engine) -> Iterator[str]:
    bore, rod = engine.cylinders.bore, engine.rod
    cube = STEEL * bore**3
    for name, (low, high) in MASSES.items():
        table, key = name.split(".")
        if (part := getattr(engine, table)) is not None and not low * cube <= getattr(part, key) <= high * cube:
            own = getattr(part, key)
            yield f"{name}: {own:.4g} kg with a bore of {mm(bore)}, usual {low * cube:.3g} to {high * cube:.3g} kg"
    for table, (low, high) in GYRATIONS.items():
        if (part := getattr(engine, table)) is not None:
            radius = (part.polar_inertia / part.mass) ** 0.5
            if not low * bore <= radius <= high * bore:
                yield (
                    f"{table}.polar_inertia: a radius of gyration of {mm(radius)} with a bore of {mm(bore)}, "
                    f"usual {mm(low * bore)} to {mm(high * bore)}"
                )
    (low, high), radius = ROD_GYRATION, (rod.inertia / (rod.big_end_mass + rod.small_end_mass)) ** 0.5
    if not low * rod.length <= radius <= high * rod.length:
        yield (
            f"rod.inertia: a radius of gyration of {mm(radius)} in a rod of {mm(rod.length)}, "
            f"usual {mm(low * rod.length)} to {mm(high * rod.length)}"
        )
