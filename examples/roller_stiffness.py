"""Stiffness of roller main bearings by three routes, as a Markdown note: contacts, closed forms, elastic ring.

``python examples/roller_stiffness.py > docs/roller_bearing.md`` makes the note in ``docs/``. The bearings are of two
sizes that suit the mains of a V8 of 12.6 l; those of an engine file go through ``cranktrain bearing roller --engine``.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cranktrain.engine.parts import Material
from cranktrain.engine.roller_bearing import RollerBearing, iso_profile
from cranktrain.film.laws.roller_contacts import (
    LoadedBearing,
    equilibrium,
    many_rollers,
    roller_slices,
    slice_stiffness,
)
from cranktrain.structure.block.roller_ring import RollerRing, elastic_ring_stiffness, ring_compliance, ring_for

MAIN = RollerBearing(22, 28e-3, 20e-3, 170e-3, 60e-6)
FLYWHEEL_SIDE = RollerBearing(26, 24e-3, 16e-3, 166e-3, 60e-6)
LOADS = (5e3, 20e3, 40e3, 80e3)
NOMINAL = 40e3
ALUMINIUM = Material(youngs_modulus=72e9, poisson_ratio=0.33, density=2700.0)

INTRODUCTION = """\
# Roller main bearings

Made by

    python examples/roller_stiffness.py > docs/roller_bearing.md

Level `roller` sums the line contacts of the rollers between rigid rings (`cranktrain/film/laws/roller.py`): Palmgren's or the
standard's contact law by slices, clearance, profile, tilt, with exact tangents. The reference takes another way: a
finite-element model of the bearing gives one radial and one tilting stiffness for the whole engine's simulation (its
chapter 5.2). That is the table's `law = "linear"`, and `cranktrain/structure/block/roller_ring.py` makes its values: rollers as
springs of their contacts' tangents at a nominal load, on an elastic outer ring and housing, free of contacts.

Two sizes, of steel, diametral clearance {clearance:g} um:

* throws: {main},
* flywheel's side: {other}.

Outer rings are half a roller thick and a quarter wider than the rollers are long, in a cast-iron housing a quarter wider
across than the ring and fixed all around. All of this is chosen; nothing was fitted. Stiffnesses are tangents at the load,
one roller on its line. For any other bearing and for those of an engine file:

    cranktrain bearing roller --rollers 22 --length-mm 28 --roller-diameter-mm 20 --pitch-mm 170 --clearance-um 60 --load-n 40000 --ring
    cranktrain bearing roller --engine diesel_v8 --load-n 40000
"""  # noqa: E501 - a command in one line

READING = """\
## What to take from it

* Contacts against the closed form: Sjövall's integral knows no rollers, only their density. Deflection and largest load
  agree within 0.3 % from 20 kN on; the tangent depends on whether a further roller has just come to bear, and differs
  by what the rollers' position does to it.
* A bearing with clearance is no linear spring: its stiffness grows with the load, by the number of rollers that bear
  even more than by the exponent 10/9. One linear value belongs to one load.
* The profile takes the ends out of the contact at small loads, and the tilting stiffness with them, far more than the
  radial one.
* Ring and housing take about a tenth of the radial stiffness, less of the tilting one. The mesh does not count, the
  spread of a roller's force by 1 %, material and size of what lies behind the ring by 2 to 6 %. (A thicker ring with
  its housing is softer here: the fixed circle lies further out.)
* The springs are where rollers bear between rigid rings: that an oval ring loads more of them is not in the linear
  values.
"""


def say(stage: str) -> None:
    """Show the stage at work on stderr."""
    print(f"roller bearings: {stage}", file=sys.stderr, flush=True)


def loaded(bearing: RollerBearing, load: float, first_angle: float = 0.0) -> LoadedBearing:
    """Bearing under a radial load along x."""
    return equilibrium(bearing, np.array([load, 0.0, 0.0, 0.0]), first_angle)


def stiffnesses(bearing: RollerBearing, matrix: np.ndarray) -> tuple[float, float]:
    """Radial (N/mm) and tilting stiffness (N m/rad) in the plane of the load."""
    return 1e-3 * float(matrix[0, 0]), float(matrix[2, 2]) * (0.5 * bearing.length) ** 2


def on_ring(bearing: RollerBearing, load: float, ring: RollerRing) -> tuple[float, float]:
    """The same without contacts, on an elastic ring."""
    springs = slice_stiffness(bearing, loaded(bearing, load).place)
    matrix = elastic_ring_stiffness(ring_compliance(ring, progress=say), roller_slices(bearing)[0], springs, 0.0)
    return stiffnesses(bearing, matrix)


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a Markdown table."""
    print("| " + " | ".join(header) + " |\n|" + " --- |" * len(header))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print()


def of_load(title: str, bearing: RollerBearing, loads: Sequence[float] = LOADS) -> float:
    """Deflection and stiffness over the load, by all routes; returns the last radial stiffness, N/mm."""
    print(f"## {title}\n")
    profiled = replace(bearing, profile=iso_profile(bearing.length, bearing.diameter))
    ring = ring_for(bearing)
    rows = []
    for load in loads:
        at = loaded(bearing, load)
        closed, largest = many_rollers(bearing, load)
        radial, tilting = stiffnesses(bearing, at.stiffness)
        crowned = stiffnesses(profiled, loaded(profiled, load).stiffness)
        elastic = on_ring(bearing, load, ring)
        # Closed form: slope of Sjovall's integral by a difference, and l²/12 of it.
        step = 1e-4 * load
        slope = 2e-3 * step / (many_rollers(bearing, load + step)[0] - many_rollers(bearing, load - step)[0])
        deflection = at.place[0] - 0.5 * bearing.clearance
        rows.append(
            [
                f"{1e-3 * load:g}",
                f"{1e6 * deflection:.2f} / {1e6 * closed:.2f}",
                f"{1e-3 * at.loads.max():.2f} / {1e-3 * largest:.2f}",
                f"{1e-3 * radial:.0f} / {1e-3 * slope:.0f}",
                f"{1e-3 * crowned[0]:.0f}",
                f"{1e-3 * elastic[0]:.0f}",
                f"{1e-3 * tilting:.0f} / {1e3 * slope * bearing.length**2 / 12.0 * 1e-3:.0f}",
                f"{1e-3 * crowned[1]:.0f}",
                f"{1e-3 * elastic[1]:.0f}",
            ]
        )
    table(
        [
            "load / kN", "deflection / um: contacts / closed form", "Q_max / kN: contacts / closed form",
            "radial / (kN/mm): contacts / closed form", "with profile", "elastic ring",
            "tilting / (kN m/rad): contacts / closed form", "with profile", "elastic ring",
        ],
        rows,
    )  # fmt: skip
    return radial


def of_rollers(bearing: RollerBearing) -> None:
    """How much the rollers' positions change the stiffness."""
    print("## Rollers going round\n\nRadial stiffness with two rollers beside the load line, against one on it:\n")
    rows = []
    for clearance in (0.0, 60e-6):
        row = [f"{1e6 * clearance:g}"]
        for load in LOADS:
            own = replace(bearing, clearance=clearance)
            on, beside = (loaded(own, load, angle).stiffness[0, 0] for angle in (0.0, math.pi / own.rollers))
            row.append(f"{100.0 * (beside / on - 1.0):+.2f} %")
        rows.append(row)
    table(["clearance / um", *(f"{1e-3 * load:g} kN" for load in LOADS)], rows)


def of_ring(bearing: RollerBearing) -> None:
    """What the elastic ring's own assumptions amount to."""
    print(f"## Assumptions of the elastic ring\n\nThe larger bearing at {1e-3 * NOMINAL:g} kN, straight rollers:\n")
    usual = ring_for(bearing)
    thick = usual.ring_diameter + bearing.diameter
    cases = [
        ("rigid", None),
        ("as above", usual),
        ("mesh 1.4 times as fine", replace(usual, mesh_size=usual.mesh_size / 1.4)),
        ("force spread half as wide", replace(usual, spread=0.5)),
        ("ring twice as thick", replace(usual, ring_diameter=thick, housing_diameter=1.25 * thick)),
        ("housing of aluminium", replace(usual, housing=ALUMINIUM)),
        ("housing half again as wide", replace(usual, housing_diameter=1.5 * usual.ring_diameter)),
    ]
    rows = []
    for name, ring in cases:
        rigid = stiffnesses(bearing, loaded(bearing, NOMINAL).stiffness)
        at = rigid if ring is None else on_ring(bearing, NOMINAL, ring)
        rows.append([name, f"{1e-3 * at[0]:.0f}", f"{1e-3 * at[1]:.1f}"])
    table(["ring", "radial / (kN/mm)", "tilting / (kN m/rad)"], rows)


def sizes(bearing: RollerBearing) -> str:
    """A bearing's dimensions in words."""
    diameter, length, pitch = (1e3 * value for value in (bearing.diameter, bearing.length, bearing.pitch))
    return f"{bearing.rollers} rollers {diameter:g} x {length:g} mm on {pitch:g} mm"


def main() -> None:
    """Print the note."""
    print(INTRODUCTION.format(main=sizes(MAIN), other=sizes(FLYWHEEL_SIDE), clearance=1e6 * MAIN.clearance))
    of_load("At the throws", MAIN)
    of_load("Beside the flywheel", FLYWHEEL_SIDE)
    of_rollers(MAIN)
    of_ring(MAIN)
    print(READING, end="")


if __name__ == "__main__":
    main()
