"""Pieces of connections whose laws are those of an engine's own bearings, or of its torsional damper.

The first end is the rotating body of the bearing, and the law is evaluated in the axes of its frame.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.named import resolve
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.topology.axial_joint import sliding_law, sliding_record
from cranktrain.dynamics.topology.damper import HEAT, damper_law, damper_record
from cranktrain.dynamics.topology.pieces import (
    ANGLE,
    LENGTH,
    REFERENCE_VISCOSITY,
    SAME,
    FilmParts,
    Piece,
    between,
    component,
)
from cranktrain.dynamics.topology.terms import Direction, unit
from cranktrain.dynamics.topology.values import CRANK, Frame
from cranktrain.engine.checks.crankshaft import check_damper
from cranktrain.engine.connections import Film, RingDamper, Roller, SlidingJoint, Thrust
from cranktrain.engine.quantities import mm, need
from cranktrain.engine.roller_bearing import FILE_KEYS, check_roller_bearing, main_roller
from cranktrain.film.laws.axial_joint import REMEMBERED
from cranktrain.film.laws.bearings import Bearings, bearing_parameters
from cranktrain.film.laws.films import ECCENTRICITY, FLOW, FRICTION, P_MAX
from cranktrain.film.laws.parameters import CLEARANCE, VISCOSITY
from cranktrain.film.laws.register import BIG_END, PLAIN, ROLLER, THRUST, bearing_law
from cranktrain.film.laws.roller import FIRST_ANGLE, roller_parameters, seats

ACROSS = (
    ("force.x", "force", 0), ("force.y", "force", 1), ("position.x", "place", 0), ("position.y", "place", 1),
    ("eccentricity", "out", ECCENTRICITY),
)  # fmt: skip
"""Outputs of every bearing across an axis, in axes of the journal's frame."""


def film_pieces(bearing: Film, journal: Frame, bore: Frame) -> list[Piece]:
    """Piece of a connection for a plain bearing at a film level; the first end is the journal."""
    _need_turning(journal, bore, "the first end of a bearing is its journal, which turns; exchange the ends")
    law, parameters = bearing_law(bearing.level), bearing_parameters(bearing, bearing.viscosity or REFERENCE_VISCOSITY)
    # A film that remembers its oil is solved in axes of its bore. Those of a rod swing, others are at rest.
    swings = bore.swings and bool(law.forms[PLAIN].memory)
    form, axes = (law.forms[BIG_END], bore) if swings else (law.forms[PLAIN], journal)
    # The angle of the oil supply is measured in axes of the rod, or in the engine's axes.
    own = bearing if swings else replace(bearing, supply_angle=journal.sense * bearing.supply_angle)

    def record(rows: Array, parts: FilmParts) -> Any:
        found = {name: _part(name, own, parts) for name in form.parts}
        return resolve(form.record)(Bearings(rows, own, parts=found, oil=parts.oil, swings=swings))

    half = 0.5 * bearing.width
    components = _journal(axes, half if form.tilt else 0.0)
    outputs: tuple[tuple[str, str, int], ...] = ACROSS
    if law.film:
        outputs += (("friction_torque", "out", FRICTION), ("pressure_max", "out", P_MAX), ("oil_flow", "out", FLOW))
    scales = [float(parameters[CLEARANCE])] * len(components)
    return [
        Piece(
            components, scales, resolve(form.kernel), record, axes, 0, law.film, form.closes,
            outputs, parameters, bearing.viscosity if law.film else -1.0, tilt=half if form.tilt else 0.0,
            told_oil=form.viscous, tells_rate=bool(form.memory), memory=resolve(form.memory) if form.memory else None,
        )
    ]  # fmt: skip


def film_parts(bearing: Film, ends: Sequence[str]) -> tuple[str, ...]:
    """Names of the parts that a film between ``ends`` (body.interface) needs: film ``table``, elastic bore or eye."""
    own = bearing_law(bearing.level).forms[PLAIN].parts
    at = "big_end_bore" if ends and ends[0].startswith(f"{CRANK}.pin[") else "bore"
    return tuple(at if name == "bore" else name for name in own if name != "bore" or bearing.bore == "elastic")


def no_bore(bearing: Film) -> InputError:
    """Error for a film with an elastic bore whose compliance is not known."""
    return InputError(
        f"level '{bearing.level}' knows the elastic bores of the engine's own main bearings alone, and of rods on its "
        "crank pins; write bore = rigid for this film in a rigid bore, or take level table or reynolds"
    )


def _part(name: str, bearing: Film, parts: FilmParts) -> Any:
    """Part (table or bore) that a film's level needs, by name; ``InputError`` if it is missing."""
    if name == "table":
        from cranktrain.film.laws.rigid_bore import fitting_table

        table = fitting_table(parts.tables, bearing)
        if table is None:
            raise InputError(
                f"level '{bearing.level}' needs a film table of L/D {bearing.width / bearing.diameter:.4g}, which "
                "cranktrain.film_tables(topology) makes for Parts.film_tables; or take level impedance or reynolds"
            )
        return table
    if bearing.bore == "rigid":
        from cranktrain.film.elastic.bore_compliance import RIGID_BORE

        return RIGID_BORE
    big_end = name == "big_end_bore"
    like, bore, here = (
        (parts.big_ends, parts.eye, parts.at_pin) if big_end else (parts.mains, parts.bore, parts.at_main)
    )
    if bore is None or like is None or not here or (like.diameter, like.width) != (bearing.diameter, bearing.width):
        raise no_bore(bearing)
    return bore


def roller_pieces(roller: Roller, journal: Frame, ring: Frame) -> list[Piece]:
    """Piece of a connection for a cylindrical roller bearing; the first end is the journal."""
    _need_turning(journal, ring, "the first end of a bearing is its journal, which turns; exchange the ends")
    _need_rest(ring, "outer ring", roller.variable)
    bearings = roller.bearings
    try:
        check_roller_bearing(main_roller(bearings, 0))
    except InputError as error:
        key, text = str(error).split(": ", 1)
        raise InputError(f"{FILE_KEYS.get(key, key)}: {text}") from None
    form, half = bearing_law("roller").forms[ROLLER], 0.5 * roller.roller_length
    parameters = roller_parameters(bearings)[0]
    parameters[VISCOSITY] = REFERENCE_VISCOSITY  # rollers do not use it, but laws of films read all rows
    # Angle of a roller straight below the journal, also if the frame's y axis points down.
    record = seats(bearings, journal.sense * FIRST_ANGLE)
    return [
        Piece(
            _journal(journal, half), [float(parameters[CLEARANCE])] * 4, resolve(form.kernel), record, journal, 0, True,
            form.closes, (*ACROSS, ("pressure_max", "out", P_MAX)), parameters, tilt=half,
        )
    ]  # fmt: skip


def thrust_pieces(thrust: Thrust, collar: Frame, pads: Frame) -> list[Piece]:
    """Piece of a connection for an axial bearing; the first end is the collar, square to its axis or tilting."""
    _need_turning(collar, pads, "the first end of an axial bearing is its collar, which turns; exchange the ends")
    _need_rest(pads, "row of pads")
    inner, outer, height = thrust.inner_diameter, thrust.outer_diameter, thrust.contact_height
    need("", "inner_diameter", inner < outer, f"{mm(inner)} is not less than outer_diameter {mm(outer)}")
    text = f"two of {mm(height)} leave nothing of the clearance, {mm(thrust.clearance)}"
    need("", "contact_height", 2.0 * height < thrust.clearance, text)
    tilts = thrust.collar == "tilting"
    form = THRUST["tilting" if tilts else "axial"]
    half = 0.5 * thrust.clearance
    components, scales = [component(collar, "z")], [half]
    outputs = [("force.z", "force", 0), ("position.z", "place", 0)]
    if tilts:
        components += [component(collar, axis) for axis in ("rx", "ry")]
        scales += [half / (0.25 * (inner + outer))] * 2
        outputs += [(f"moment.{way}", "force", 1 + k) for k, way in enumerate("xy")]
        outputs += [(f"rotation.{way}", "place", 1 + k) for k, way in enumerate("xy")]
    record = resolve(form.record)(thrust.bearing, thrust.viscosity or REFERENCE_VISCOSITY)
    return [
        Piece(
            components, scales, resolve(form.kernel), record, collar, 1 if tilts else -1, tilts, form.closes,
            tuple(outputs), viscosity=thrust.viscosity, tilt=1.0 if tilts else 0.0, told_oil=form.viscous,
            tells_rate=True,
        )
    ]  # fmt: skip


def damper_pieces(ring: RingDamper, first: Frame, second: Frame) -> list[Piece]:
    """Piece of a connection for a torsional damper; the first end is the housing, the second end is the ring."""
    need_alike("a damper joins a housing and a ring that turn alike", first, second)
    check_damper(ring.damper)
    outputs = (
        ("torque", "force", 0), ("twist", "place", 0), ("twist_rate", "velocity", 0), ("heat", "out", HEAT),
    )  # fmt: skip
    record, twist = damper_record(ring.damper), [component(first, "rz")]
    return [Piece(twist, [ANGLE], damper_law, record, first, outputs=outputs, told_speed=True)]


def need_alike(what: str, first: Frame, second: Frame) -> None:
    """Raise ``InputError`` that begins with ``what`` unless two frames turn at the same speed."""
    speeds = first.sense * first.rate, second.sense * second.rate
    if abs(speeds[0] - speeds[1]) <= SAME:
        return
    fix = "give both frames the same ratio, or take gears"
    if 0.0 in speeds:
        fix = "one end is at rest; join the other to a body that turns with the crank, so that this drives it"
    raise InputError(f"{what}, but its ends turn {speeds[0]:g} and {speeds[1]:g} times as fast as the crank; {fix}")


def joint_pieces(joint: SlidingJoint, first: Frame, second: Frame) -> list[Piece]:
    """Piece of a connection for a joint that carries a torque and slides along the axis."""
    need_alike("a joint carries a torque between bodies that turn alike", first, second)
    if first.rate == 0.0:
        raise InputError("a joint carries a torque between bodies that turn; give both frames the same ratio, not 0")
    if joint.joint == "spline":
        for key in ("spline_radius", "friction"):
            text = "is missing; a spline slides by friction x torque / spline_radius; give it, or take joint bolted"
            need("", key, getattr(joint, key) > 0.0, text)
    components = [component(first, axis) for axis in ("z", "rz")]
    outputs = (
        ("force.z", "force", 0), ("torque", "force", 1), ("slip", "place", 0), ("slip_velocity", "velocity", 0),
        ("twist", "place", 1), ("twist_rate", "velocity", 1),
    )  # fmt: skip
    return [
        Piece(
            components, [LENGTH, ANGLE], sliding_law, sliding_record(joint), first, outputs=outputs,
            memory=lambda record: REMEMBERED,
        )
    ]  # fmt: skip


def _journal(frame: Frame, half: float) -> list[tuple[Direction, Direction]]:
    """Components of a journal's motion: lateral motion of its middle, and of its end at ``half`` (m), if any."""
    components = [component(frame, axis) for axis in "xy"]
    if half:
        ways = (half * unit(1), -half * unit(0))
        components += [between(frame, np.zeros(3), way) for way in ways]
    return components


def _need_turning(first: Frame, second: Frame, text: str) -> None:
    if first.rate == 0.0 and not (first.swings or second.swings):
        raise InputError(text)


def _need_rest(frame: Frame, what: str, moves: bool = True) -> None:
    """Refuse a second end that rotates, or that swings as a rod if its part ``moves`` with rotation; ``InputError``."""
    if frame.rate != 0.0 or (frame.swings and moves):
        raise InputError(
            f"the second end holds the {what}, which does not turn; give its body the frame 'rest', or take block or "
            "ground"
        )
