"""Engine from a crankshaft found in CAD, with layout, bore and rod by the rules of a first design.

The throws determine the layout. If several layouts have the same crank (an in-line six and a V12), the in-line one is
used with a remark. If none of them is in line, an error asks for the layout.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.structure.fem.own_mesh import UNITS
from cranktrain.studies.design.layouts import BOXER, CYCLE_DEG, IN_LINE, LAYOUTS, VEE, Layout
from cranktrain.studies.design.sizes import Sizes, sizes, today
from cranktrain_lab.cad.found_crank import Dimensions, dimensions
from cranktrain_lab.cad.recognition import Journal, RecognisedCrank, moved
from cranktrain_lab.cad.step_file import stated_unit

MATCH_DEG = 0.5
"""Largest deviation of a throw's angle from a layout's, deg."""
MESH_SIZE = 0.17
"""Largest edge of the mesh as a fraction of the bore, as in generated engine files."""
OF_BORE, JOURNALS = (0.25, 2.0), (3e-3, 1.2)
"""Limits of main journal diameters relative to the bore, and in m. Outside the limits the file's unit is wrong."""
_UNIT_WORDS = {1e3: "m", 10.0: "cm", 1.0: "mm", 25.4: "inches", 1e-3: "um"}
STROKE_MM = 0.1
"""Largest deviation of a stated stroke from twice the throw, mm."""


class Stated(NamedTuple):
    """User's statements on the engine (SI, deg); None if the crank or a rule determines the value."""

    layout: str | None = None
    bank_deg: float | None = None
    bore: float | None = None
    stroke: float | None = None
    fuel: str = "petrol"
    rod: float | None = None
    power: float | None = None
    rated: float | None = None
    thrust_main: int | None = None
    mesh_size: float | None = None


class StepEngine(NamedTuple):
    """Sizes of the engine, found crank rotated to the layout, the crank's dimensions, and remarks for the user."""

    sizes: Sizes
    found: RecognisedCrank
    dimensions: Dimensions
    told: tuple[str, ...]


def step_engine(found: RecognisedCrank, stated: Stated) -> StepEngine:
    """Return the engine of a crank; raises ``InputError`` if the user's statements do not fit the crank."""
    angles = np.degrees([math.atan2(-one.cylinder.axis[0], one.cylinder.axis[1]) for one in found.pins])
    layout, told = _layout(found, angles, stated)
    offsets = np.radians(np.array(layout.throws_deg) - angles)
    found = turned(found, float(np.angle(np.exp(1j * offsets).mean())))
    diameter = 2e-3 * float(np.median([one.cylinder.radius for one in found.mains]))
    _check_unit(found, diameter, stated.bore)
    share = today(layout, stated.fuel).main
    bore = round(diameter / share, 4) if stated.bore is None else stated.bore
    if stated.bore is None:
        told = (*told, f"bore {1e3 * bore:.4g} mm: main journals are {share:g} of it by rule; state --bore-mm")
    crank = dimensions(found, stated.mesh_size or round(MESH_SIZE * bore, 5))
    stroke = 2.0 * crank.crankshaft.throw
    if stated.stroke is not None and abs(stated.stroke - stroke) > 1e-3 * STROKE_MM:
        raise InputError(
            f"--stroke-mm {1e3 * stated.stroke:g}: the throws of {found.solid.path} have a stroke of "
            f"{1e3 * stroke:.4g} mm; leave the option out"
        )
    if stated.thrust_main is not None and not 1 <= stated.thrust_main <= len(found.mains):
        raise InputError(f"--thrust-main {stated.thrust_main}: the crank has main journals 1 to {len(found.mains)}")
    made = sizes(
        layout, bore, stroke, stated.fuel, rod=stated.rod, power=stated.power, rated=stated.rated,
        crank=crank.crankshaft,
    )  # fmt: skip
    note = "given" if stated.bore is not None else f"main journals are {share:g} B by rule"
    made = made._replace(bore_note=note, stated_thrust_main=stated.thrust_main or 0)
    return StepEngine(made, found, crank, (*told, *crank.doubts))


def _check_unit(found: RecognisedCrank, diameter: float, bore: float | None) -> None:
    """Raise ``InputError`` for main journal diameters, m, that are implausible for the bore or for any engine."""
    low, high = (OF_BORE[0] * bore, OF_BORE[1] * bore) if bore is not None else JOURNALS
    if low <= diameter <= high:
        return
    in_file = diameter / found.solid.scale / (1e-3 * stated_unit(found.solid.path))
    fitting = [unit for unit, size in UNITS.items() if low <= size * in_file <= high]
    beside = f"for a bore of {1e3 * bore:g} mm" if bore is not None else "as no engine has them"
    remedy = (
        f"the numbers are in another unit than the file states: --cad-unit {' or '.join(fitting)}"
        if fitting
        else "check --bore-mm and the file"
    )
    raise InputError(
        f"{found.solid.path}: main journals of {1e3 * diameter:.4g} mm {beside} ({in_file:.4g} in the file, which "
        f"states {_UNIT_WORDS.get(stated_unit(found.solid.path), 'another unit')}); {remedy}"
    )


def turned(found: RecognisedCrank, angle: float) -> RecognisedCrank:
    """Return a crank rotated about its axis by an angle, rad."""
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def about(journal: Journal) -> Journal:
        x, y = journal.cylinder.axis
        return journal._replace(cylinder=journal.cylinder._replace(axis=(c * x - s * y, s * x + c * y)))

    return found._replace(
        solid=found.solid._replace(nodes=found.solid.nodes @ turn.T),
        faces=moved(found.faces, turn, np.zeros(3)),
        turn=turn @ found.turn,
        shift=turn @ found.shift,
        mains=tuple(map(about, found.mains)),
        pins=tuple(map(about, found.pins)),
    )


def _layout(found: RecognisedCrank, angles: np.ndarray, stated: Stated) -> tuple[Layout, tuple[str, ...]]:
    """Return the layout of the throws (deg), and remarks for the user."""
    fitting = {}
    for row in _rows(stated):
        own = next((one for one in (row, _mirrored(row)) if one is not None and _fits(one, found, angles)), None)
        if own is not None:
            fitting[row.name] = own
    throws = ", ".join(f"{round((angle - angles[0] + 0.05) % 360.0 - 0.05, 2) + 0.0:g}" for angle in angles)
    if stated.layout is not None:
        if stated.layout in fitting:
            return fitting[stated.layout], ()
        if stated.layout not in LAYOUTS:
            raise InputError(f"--layout '{stated.layout}' is not known; {nearest(stated.layout, LAYOUTS)}")
        others = f"; they fit {', '.join(fitting)}" if fitting else "; leave --layout out"
        raise InputError(
            f"--layout {stated.layout}: {found.solid.path} has throws at {throws} deg from the first in "
            f"{len(found.bays)} bays, which that layout has not{others}"
        )
    in_line = [row for row in fitting.values() if row.form == IN_LINE]
    if in_line:
        rest = [name for name in fitting if name != in_line[0].name]
        told = (f"taken as {in_line[0].name}; the crank also fits --layout {' or '.join(rest)}",) if rest else ()
        return in_line[0], told
    if len(fitting) == 1:
        return next(iter(fitting.values())), ()
    if fitting:
        raise InputError(
            f"{found.solid.path}: throws at {throws} deg fit several layouts: state --layout {' or '.join(fitting)}"
        )
    row = _own_layout(angles)
    return row, (f"throws at {throws} deg are of no listed layout: taken as in line, fires "
                 f"{'-'.join(map(str, row.order))}",)  # fmt: skip


def _rows(stated: Stated) -> list[Layout]:
    """Return candidate layouts, with the stated bank angle."""
    rows = [row for row in LAYOUTS.values() if stated.layout in (None, row.name)]
    if stated.bank_deg is None:
        return rows
    return [row.with_bank(stated.bank_deg) for row in rows if stated.layout is not None or row.form == VEE]


def _fits(row: Layout, found: RecognisedCrank, angles: np.ndarray) -> bool:
    """True if throws (deg) match a layout up to rotation, with equal numbers of pins between mains."""
    throws = np.array(row.throws_deg)
    if throws.size != angles.size or (row.split and set(found.bays) != {2}):
        return False
    if row.form == VEE and not row.split and set(found.bays) != {1}:
        return False
    off = np.radians(throws - angles)
    return bool(np.abs(np.degrees(np.angle(np.exp(1j * (off - off[0]))))).max() < MATCH_DEG)


def _mirrored(row: Layout) -> Layout | None:
    """Return the layout with a mirrored crank, which fires in reverse order. Return None for a boxer engine."""
    back = tuple((CYCLE_DEG - angle) % CYCLE_DEG for angle in row.firing_deg)
    half = row.cylinders // 2
    if row.form == BOXER:
        return None
    if row.form == VEE:
        if row.split:
            return None
        back = (*back[half:], *back[:half])
    return row._replace(firing_deg=back)


def _own_layout(angles: np.ndarray) -> Layout:
    """Return an in-line layout for throws (deg) of no listed layout, with firing as even as possible."""
    n = angles.size
    free = [round(k * CYCLE_DEG / n, 3) for k in range(n)]
    firing: list[float] = []
    for angle in (angles[0] - angles) % 360.0:
        near = [one for one in free if abs((one - angle + 180.0) % 360.0 - 180.0) < MATCH_DEG]
        taken = near[0] if near else float(angle) + (360.0 if float(angle) in firing else 0.0)
        free = [one for one in free if one != taken]
        firing.append(taken)
    return Layout(f"i{n}" if n > 1 else "single", f"in-line {n}", IN_LINE, tuple(firing))
