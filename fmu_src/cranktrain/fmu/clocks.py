"""Output clocks of an FMU of FMI 3.0, one for each cylinder, which tick at its firing dead centre.

Source: FMI 3.0.2, section 2.2.9 (clocks): clocks are scalars, and output clocks are triggered.
"""

import math
from collections.abc import Sequence
from xml.etree.ElementTree import Element

from cranktrain.core.errors import InputError
from cranktrain.fmu.archive import Product
from cranktrain.fmu.description import Variable, member_names


def clock_table(product: Product, variables: Sequence[Variable]) -> str:
    """Entry ``clocks`` of native.bin: three whole numbers as text, read by ``fmi3_events.c``.

    They are the value references of the angle and of the array of dead centres, and the revolutions between two ticks
    of a clock. ``variables`` are those of the FMU. ``InputError`` if the FMU lacks a variable that clocks need.
    """
    clock = product.interface.clock
    assert clock is not None
    places = {variable.name: variable.reference for variable in variables}
    marks = member_names(clock.at, product.counts)
    lacking = [name for name in (clock.angle, *marks) if name not in places]
    if lacking:
        raise InputError(f"clocks need '{lacking[0]}', which this FMU does not have; build it without clocks")
    turns = round(product.starts[clock.period] / (2.0 * math.pi))
    return f"{places[clock.angle]} {places[marks[0]]} {turns}"


def clock_entries(product: Product, first: int) -> list[Element]:
    """Entries of the clocks in the model description, with value references from ``first`` on."""
    clock = product.interface.clock
    if clock is None:
        return []
    return [
        Element("Clock", _attributes(name, first + k, clock.description))
        for k, name in enumerate(member_names(clock.name, product.counts))
    ]


def _attributes(name: str, reference: int, description: str) -> dict[str, str]:
    return {
        "name": name, "valueReference": str(reference), "description": description, "causality": "output",
        "variability": "discrete", "intervalVariability": "triggered",
    }  # fmt: skip
