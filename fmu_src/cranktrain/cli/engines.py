"""The verb ``engines``: list of the engines that ship with the package."""

from typing import Any

from cranktrain.cli.functions import verb_alone
from cranktrain.cli.shipped import shipped
from cranktrain.studies.requests.fields import Question

DESCRIPTION = "The engines that ship with the package: name, title, layout, displacement and firing order."

PLAIN = True
"""The verb only prints a stored list and computes nothing."""


@verb_alone(Question, DESCRIPTION)
def engines(ask: Question) -> dict[str, Any]:
    """List the engines."""
    return {"engines": shipped()}


def show(found: dict[str, Any]) -> None:
    """Print a line for each engine."""
    for one in found["engines"]:
        order = "-".join(map(str, one["firing_order"]))
        cylinders = f"{one['cylinders']} cylinder{'s' if one['cylinders'] > 1 else ''}"
        print(
            f"{one['name']}: {one['title']}; {one['layout']}, {cylinders}, {one['displacement_l']:.3g} l, fires {order}"
        )
