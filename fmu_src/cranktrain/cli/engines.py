"""The verb ``engines``: the engines that ship with the package, a line each."""

from __future__ import annotations

import argparse
import math
from typing import Any

from cranktrain.engine.file import engine_names, load_engine
from cranktrain.engine.firing import firing_summary
from cranktrain.engine.model import Engine

DESCRIPTION = "The engines that ship with the package: name, title, layout, displacement and firing order."
SAME_DEG = 1e-6
"""Bank angles that differ by less are one, deg."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options: none but --json."""


def run(options: argparse.Namespace) -> dict[str, Any]:
    """List the engines."""
    listed = [_entry(load_engine(name)) for name in engine_names()]
    if not options.json:
        for one in listed:
            order = "-".join(map(str, one["firing_order"]))
            cylinders = f"{one['cylinders']} cylinder{'s' if one['cylinders'] > 1 else ''}"
            print(
                f"{one['name']}: {one['title']}; {one['layout']}, {cylinders}, "
                f"{one['displacement_l']:.3g} l, fires {order}"
            )
    return {"engines": listed}


def _entry(engine: Engine) -> dict[str, Any]:
    return {
        "name": engine.name, "title": engine.title, "layout": _layout(engine), "cylinders": engine.n_cylinders,
        "displacement_l": 1e3 * engine.displacement,
        "firing_order": firing_summary(engine)["order"],
    }  # fmt: skip


def _layout(engine: Engine) -> str:
    """In line, boxer, or V with its bank angle."""
    banks = sorted({round(math.degrees(angle) / SAME_DEG) * SAME_DEG for angle in engine.cylinders.bank_angles})
    if len(banks) == 1:
        return "in line" if engine.n_cylinders > 1 else "single"
    own_pins = len(set(engine.cylinders.pins)) == engine.n_cylinders
    if len(banks) == 2 and abs(banks[1] - banks[0] - 180.0) < SAME_DEG and own_pins:
        return "boxer"
    return f"V of {banks[-1] - banks[0]:g} deg" if len(banks) == 2 else f"{len(banks)} banks"
