"""List of the shipped engines as constants, without numerical libraries: ``python -m cranktrain.cli.shipped``."""

import json
import math
from pathlib import Path
from typing import Any

TYPE_CHECKING = False
if TYPE_CHECKING:
    from cranktrain.engine.model import Engine

TABLE = Path(__file__).parents[1] / "engine" / "data" / "shipped.json"
"""The list as :func:`made` returns it; a test compares both."""
SAME_DEG = 1e-6
"""Difference (deg) below which two bank angles count as equal."""


def shipped() -> list[dict[str, Any]]:
    """Name, title, layout, cylinders, displacement (l) and firing order of each engine."""
    return list(json.loads(TABLE.read_text("utf-8")))


def made() -> list[dict[str, Any]]:
    """Make the list from the engine files."""
    from cranktrain.engine.file import engine_names, load_engine

    return [_entry(load_engine(name)) for name in engine_names()]


def _entry(engine: "Engine") -> dict[str, Any]:
    from cranktrain.engine.firing import firing_summary

    return {
        "name": engine.name, "title": engine.title, "layout": _layout(engine), "cylinders": engine.n_cylinders,
        "displacement_l": 1e3 * engine.displacement,
        "firing_order": firing_summary(engine)["order"],
    }  # fmt: skip


def _layout(engine: "Engine") -> str:
    """Layout as text: in line, boxer, or V with its bank angle."""
    banks = sorted({round(math.degrees(angle) / SAME_DEG) * SAME_DEG for angle in engine.cylinders.bank_angles})
    if len(banks) == 1:
        return "in line" if engine.n_cylinders > 1 else "single"
    own_pins = len(set(engine.cylinders.pins)) == engine.n_cylinders
    if len(banks) == 2 and abs(banks[1] - banks[0] - 180.0) < SAME_DEG and own_pins:
        return "boxer"
    return f"V of {banks[-1] - banks[0]:g} deg" if len(banks) == 2 else f"{len(banks)} banks"


if __name__ == "__main__":
    TABLE.write_text(json.dumps(made(), indent=1) + "\n", encoding="utf-8")
