"""Table ``[crankshaft]`` of an engine file for a crank measured from CAD."""

from __future__ import annotations

import math

from cranktrain.engine.parts import Crankshaft
from cranktrain.studies.design.document import Block, Entry

NOTE = "measured in the STEP file"
LENGTH_DECIMALS, ANGLE_DECIMALS = 4, 6
"""Number of decimals of lengths in mm and of angles in deg."""


def found_crankshaft(c: Crankshaft) -> Block:
    """Table of a crankshaft's dimensions, m and rad, with origin measured."""

    def mm(key: str, value: float | tuple[float, ...], note: str = NOTE) -> Entry:
        return Entry(key, _scaled(value, 1e3, LENGTH_DECIMALS), "mm", "derived", note)

    split = bool(c.pins_between_mains)
    entries = (
        mm("throw", c.throw),
        Entry("throw_angles", _scaled(c.throw_angles, 180.0 / math.pi, ANGLE_DECIMALS), "deg", "derived",
              f"{NOTE}; turned as the layout has them"),
        mm("main_diameter", c.main_diameter),
        mm("main_widths", c.main_widths, f"between webs, {NOTE}"),
        mm("pin_diameter", c.pin_diameter),
        mm("pin_width", c.pin_width, f"between webs, {NOTE}"),
        mm("web_thickness", c.web_thickness),
        mm("web_main_radius", c.web_main_radius, f"outline about the main axis, {NOTE}"),
        mm("web_pin_radius", c.web_pin_radius, f"outline about the pin axis, {NOTE}"),
        mm("counterweight_radius", c.counterweight_radius),
        mm("counterweight_half_width", c.counterweight_half_width),
        Entry("counterweights", list(c.counterweights), "", "derived", NOTE),
        *((Entry("pins_between_mains", list(c.pins_between_mains), "", "derived", NOTE),
           mm("flying_web_thickness", c.flying_web_thickness)) if split else ()),
        *((mm("pin_throws", c.pin_throws),) if c.pin_throws else ()),
        mm("nose_diameter", c.nose_diameter),
        mm("nose_length", c.nose_length, f"from main journal 1 to the front end, {NOTE}"),
        mm("flange_diameter", c.flange_diameter),
        mm("flange_length", c.flange_length, f"from the last main journal to the rear end, {NOTE}"),
        mm("fillet", c.fillet),
        mm("oil_hole_diameter", c.oil_hole_diameter, "used where oil_holes is true"),
        Entry("oil_holes", False, "", "chosen", "the mesh of the STEP file has its own"),
        mm("mesh_size", c.mesh_size, "largest element edge"),
    )  # fmt: skip
    return Block("crankshaft", "Angles of throws from the vertical, in the sense of rotation.", entries)


def _scaled(value: float | tuple[float, ...], factor: float, decimals: int) -> float | list[float]:
    if isinstance(value, tuple):
        return [round(factor * one, decimals) + 0.0 for one in value]
    return round(factor * value, decimals) + 0.0
