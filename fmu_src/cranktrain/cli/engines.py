"""The verb ``engines``: the engines that ship with the package, a line each."""

from __future__ import annotations

import argparse
from typing import Any

from cranktrain.cli.shipped import shipped

DESCRIPTION = "The engines that ship with the package: name, title, layout, displacement and firing order."
PLAIN = True
"""It shows what is written: nothing is computed."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options: none but --json."""


def run(options: argparse.Namespace) -> dict[str, Any]:
    """List the engines."""
    listed = shipped()
    if not options.json:
        for one in listed:
            order = "-".join(map(str, one["firing_order"]))
            cylinders = f"{one['cylinders']} cylinder{'s' if one['cylinders'] > 1 else ''}"
            print(
                f"{one['name']}: {one['title']}; {one['layout']}, {cylinders}, "
                f"{one['displacement_l']:.3g} l, fires {order}"
            )
    return {"engines": listed}
