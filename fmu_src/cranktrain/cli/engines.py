"""The verb ``engines``: list of the engines that ship with the package."""

import json
from pathlib import Path
from typing import Any

from cranktrain.cli.functions import verb_alone
from cranktrain.studies.requests.fields import Question

DESCRIPTION = "The engines that ship with the package: name, title, layout, displacement and firing order."

TABLE = Path(__file__).parents[1] / "engine" / "data" / "shipped.json"
"""List of the engines, which ``python docs/engine_library.py`` writes, so that the verb needs no numerical library."""
PLAIN = True
"""The verb only prints a stored list and computes nothing."""


@verb_alone(Question, DESCRIPTION)
def engines(ask: Question) -> dict[str, Any]:
    """Name, title, layout, cylinders, displacement (l) and firing order of each engine."""
    return {"engines": json.loads(TABLE.read_text("utf-8"))}


def show(found: dict[str, Any]) -> None:
    """Print a line for each engine."""
    for one in found["engines"]:
        order = "-".join(map(str, one["firing_order"]))
        cylinders = f"{one['cylinders']} cylinder{'s' if one['cylinders'] > 1 else ''}"
        print(
            f"{one['name']}: {one['title']}; {one['layout']}, {cylinders}, {one['displacement_l']:.3g} l, fires {order}"
        )
