"""The engine as data: frozen dataclasses in SI, read from an engine file.

Angles are in radians here. The tables of an engine file are in :mod:`cranktrain.engine.parts`, the quantities of their
numbers in :mod:`cranktrain.engine.quantities`.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, dataclass, fields, is_dataclass, replace
from importlib import import_module
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.engine import parts
from cranktrain.engine.additions import Additions, BodyTable, ConnectionTable, FrameTable, split_end
from cranktrain.engine.articulated_rod import Articulation, articulations, dead_centre_heights, rods_of
from cranktrain.engine.drive_line_chain import DriveLineChain, line_connections
from cranktrain.engine.firing import firing_angles, intervals
from cranktrain.engine.limits import BearingLimits, CrankStrength, Limits
from cranktrain.engine.mount_dynamics import MountDynamics
from cranktrain.engine.rod_shape import RodShape, rod_additions

IDLE_SHARE = 0.25
"""Ratio of lowest to highest speed for an engine whose oil temperature is given at one speed only."""


@dataclass(frozen=True)
class Engine:
    """Complete description of one engine.

    The crank runs in plain bearings, ``main_bearing``, in roller bearings, ``main_roller``, or in both. ``clutch`` is
    fixed to the same interface as the flywheel. Optional parts are needed by certain fidelity levels; ``damper`` is
    used only if it is requested. ``frame``, ``body`` and ``connection`` are additions to crank and block
    (:mod:`cranktrain.engine.additions`), to which ``rod_shape`` adds elastic rods (:mod:`cranktrain.engine.rod_shape`).
    """

    name: str
    title: str
    material: parts.Material
    crankshaft: parts.Crankshaft
    flywheel: parts.LumpedInertia
    pulley: parts.LumpedInertia
    rod: parts.Rod
    cylinders: parts.Cylinders
    thrust: parts.ThrustBearing
    oil: parts.Oil
    drive_line: parts.DriveLine
    combustion: parts.Combustion | None = None
    compressor: parts.Compressor | None = None
    damping: parts.StructuralDamping = parts.USUAL_DAMPING
    reduction: parts.Reduction = parts.USUAL_REDUCTION
    published: parts.Published = parts.NOTHING_PUBLISHED
    big_end_bearing: parts.BigEndBearing | None = None
    main_bearing: parts.JournalBearing | None = None
    main_roller: parts.RollerBearings | None = None
    bearing_limits: BearingLimits | None = None
    limits: Limits | None = None
    clutch: parts.LumpedInertia | None = None
    balance_weights: parts.BalanceWeights | None = None
    drive_line_chain: DriveLineChain | None = None
    axial_path: parts.AxialPath | None = None
    damper: parts.Damper | None = None
    piston_guidance: parts.PistonGuidance | None = None
    block: parts.Block | None = None
    mounts: parts.Mounts | None = None
    crank_strength: CrankStrength | None = None
    articulated_rod: parts.ArticulatedRod | None = None
    load: parts.MeanLoad | None = None
    rod_shape: RodShape | None = None
    frame: tuple[FrameTable, ...] = ()
    body: tuple[BodyTable, ...] = ()
    connection: tuple[ConnectionTable, ...] = ()
    mount_dynamics: tuple[MountDynamics, ...] = ()

    @property
    def n_cylinders(self) -> int:
        """Number of cylinders."""
        return len(self.cylinders.firing_order)

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest speed of the engine, rad/s: the ends of its oil temperature table."""
        low, high = self.oil.temperature_speeds[0], self.oil.temperature_speeds[-1]
        return (low, high) if low < high else (IDLE_SHARE * high, high)

    @property
    def displacement(self) -> float:
        """Swept volume of all cylinders, m³; strokes are twice the throws, except for articulated rods."""
        half_strokes = list(self.throws)
        for c, joint in enumerate(self.articulations):
            if joint is not None:
                half_strokes[c] = 0.5 * float(np.ptp(dead_centre_heights(self, c)))
        return 0.5 * math.pi * self.cylinders.bore**2 * math.fsum(half_strokes)

    @property
    def burn(self) -> parts.Combustion:
        """Combustion data; ``InputError`` if the engine is a compressor."""
        if self.combustion is None:
            raise InputError(f"engine '{self.name}' has no [combustion], which this needs; give pressures of your own")
        return self.combustion

    @property
    def rated_speed(self) -> float:
        """Rated speed, rad/s: that of ``[load]``, else the highest of the engine's speeds."""
        return self.speeds[1] if self.load is None else self.load.speed

    @property
    def best_speed(self) -> float:
        """Speed of the full-load trace, which is that of the largest torque, rad/s."""
        gas = self.combustion or self.compressor
        assert gas is not None  # an engine is checked to have combustion or a compressor
        return gas.best_speed

    @property
    def throws(self) -> tuple[float, ...]:
        """Throw of each cylinder's pin, m."""
        return tuple(self.crankshaft.throws[pin - 1] for pin in self.cylinders.pins)

    @property
    def offsets(self) -> tuple[float, ...]:
        """Distance (m) of each cylinder's piston path from the crank axis, measured across the bank."""
        own, pin = self.cylinders.axis_offsets or self.n_cylinders * (0.0,), self.cylinders.pin_offset
        return tuple(pin + offset for offset in own)

    @property
    def cylinder_positions(self) -> tuple[float, ...]:
        """Position of each cylinder's middle along z (by cylinder number), m; 0 at the middle of main journal 1."""
        pins = self.crankshaft.pin_positions
        return tuple(pins[pin - 1] + z for pin, z in zip(self.cylinders.pins, self.rod_offsets, strict=True))

    @property
    def main_bores(self) -> tuple[float, ...]:
        """Diameter of each main bearing's bore in the block, outside its shells or its outer ring, m."""
        sizes = dict.fromkeys(range(len(self.crankshaft.main_widths)), 0.0)
        roller = self.main_roller
        for row, main in enumerate(self.roller_mains):
            assert roller is not None
            sizes[main] = roller.pitch_diameter[row] + (1.0 + 2.0 * parts.RING_SHARE) * roller.roller_diameter[row]
        for main in self.plain_numbers:
            sizes[main] = (1.0 + 2.0 * parts.SHELL_SHARE) * self.plain_mains.diameter
        return tuple(sizes.values())

    @property
    def roller_mains(self) -> tuple[int, ...]:
        """Mains (from 0) that run in roller bearings, in the order of the values of ``main_roller``."""
        if self.main_roller is None:
            return ()
        return tuple(i - 1 for i in self.main_roller.mains) or tuple(range(len(self.crankshaft.main_widths)))

    @property
    def plain_numbers(self) -> tuple[int, ...]:
        """Mains (from 0) that run in plain bearings."""
        return tuple(i for i in range(len(self.crankshaft.main_widths)) if i not in self.roller_mains)

    @property
    def rollers_only(self) -> bool:
        """True if no main bearing has an oil film."""
        return self.main_bearing is None

    @property
    def plain_mains(self) -> parts.JournalBearing:
        """Data of the plain main bearings; ``InputError`` if all mains are roller bearings."""
        if self.main_bearing is None:
            raise InputError(
                f"engine '{self.name}' has no [main_bearing]: its mains are roller bearings without an oil film; "
                "use bearing level 'roller', or add the table [main_bearing] in place of [main_roller]"
            )
        return self.main_bearing

    @property
    def additions(self) -> Additions:
        """Frames, bodies and connections of the engine file and of its elastic rods."""
        own = Additions(self.frame, self.body, self.connection)
        if self.rod_shape is None:
            return own
        rods = rod_additions(self, self.rod_shape)
        return Additions(own.frame + rods.frame, own.body + rods.body, own.connection + rods.connection)

    @property
    def connections(self) -> tuple[ConnectionTable, ...]:
        """Added connections, and connections that represent nonlinear shafts of the drive line."""
        line, own = self.drive_line_chain, self.additions.connection
        return own if line is None else (*own, *line_connections(line, self.drive_line.start))

    def with_(self, changes: Mapping[str, Any] | None = None, /, **more: Any) -> "Engine":
        """Engine with some values changed, checked in the same way as an engine file.

            engine.with_({"flywheel.mass": "30 kg", "damper": None}, flywheel__polar_inertia=0.5)

        Parameters
        ----------
        changes : value by its key in an engine file: ``table.key``, ``body[1].mass``, or ``name``. A number is in SI, a
            text has its unit. None removes a value or a table; a table may also be given as its dataclass
        more : the same as keywords, with two underscores in place of the dot

        Raises
        ------
        InputError
            one line as for an engine file: unknown names, wrong types and units, values that do not fit together
        """
        changed = import_module("cranktrain.engine.changed").changed_engine(self, {**(changes or {}), **more})
        assert isinstance(changed, Engine)
        return changed

    def connected(
        self, name: str, law: Any, ends: Sequence[str], place: Sequence[float] = (), **values: Any
    ) -> "Engine":
        """Engine with one more connection, checked in the same way as an engine file.

            engine.connected("bush", hardening, ("crank.pulley", "ground"), stiffness="2e5 N/mm")

        Parameters
        ----------
        name : name of the connection
        law : function with ``@ct.law``, or the name of a law such as ``spring``
        ends : two texts ``body.interface``, or ``ground``
        place : position of both ends, (3,) m; if empty they are at their interfaces
        values : values of the law's keys or parameters; numbers are in SI, texts have their unit

        Raises
        ------
        InputError
            one line: unknown laws, keys or ends; values that are missing or of a wrong type
        """
        changed = import_module("cranktrain.engine.changed").connected_engine(self, name, law, ends, place, values)
        assert isinstance(changed, Engine)
        return changed

    def to_toml(self) -> str:
        """Text of an engine file that describes this engine; the origins of its values are not kept."""
        written = import_module("cranktrain.engine.written")
        return str(written.text_of(written.document_of(self)))

    @property
    def without_additions(self) -> "Engine":
        """The engine without the bodies and connections that its file adds, its drive line on the crank itself."""
        line = self.drive_line
        if not self.line_on_crank:
            line = replace(line, start=parts.AT_CRANK)
        return replace(self, frame=(), body=(), connection=(), rod_shape=None, drive_line=line)

    @property
    def line_on_crank(self) -> bool:
        """True if the drive line begins on the crank itself, false if on an added body."""
        return split_end(self.drive_line.start)[0] == "crank"

    @property
    def line_ratio(self) -> float:
        """Turns of the body on which the drive line begins per turn of the crank."""
        frame = {table.name: table.frame for table in self.body}.get(split_end(self.drive_line.start)[0], "crank")
        return {"rest": 0.0, "crank": 1.0, **{table.name: table.ratio for table in self.frame}}[frame]

    def refuse_two_strokes(self, what: str) -> None:
        """Refuse a two-stroke, because the method ``what`` covers four-strokes only; ``InputError``."""
        if self.cylinders.cycle < 3.0 * math.pi:
            raise InputError(
                f"engine '{self.name}' is a two-stroke (cylinders.cycle = 360 deg), which {what} cannot include; give "
                "its cylinder pressure by a trace or as inputs"
            )

    @property
    def rod_offsets(self) -> tuple[float, ...]:
        """Position (m) along z of each rod's middle relative to the middle of its crank pin, by cylinder."""
        return self.cylinders.rod_offsets or self.n_cylinders * (0.0,)

    @property
    def rods_float(self) -> bool:
        """True if each rod may have its own film on its pin: no rod runs on another rod or hangs on a master rod."""
        return self.cylinders.rods_on_pin == "side-by-side"

    @property
    def articulations(self) -> tuple[Articulation | None, ...]:
        """Attachment of each cylinder's rod to a master rod; None for rods on the crank pin."""
        return articulations(self)

    @property
    def rods(self) -> tuple[parts.Rod, ...]:
        """Rod of each cylinder."""
        return rods_of(self)

    @property
    def firing_angles(self) -> tuple[float, ...]:
        """Crank angle within a cycle at which each cylinder (by number) passes firing dead centre, rad.

        Cylinder 1 fires in the first revolution; :mod:`cranktrain.engine.firing` explains how the order determines the
        revolution of the others.
        Raises ``InputError`` if the throws cannot fire in the stated order within one cycle.
        """
        return firing_angles(self)

    @property
    def firings(self) -> float:
        """Number of firings per revolution, which is the order of excitation if cylinders fire evenly."""
        return self.n_cylinders / round(self.cylinders.cycle / (2.0 * math.pi))

    @property
    def firing_intervals(self) -> tuple[float, ...]:
        """Intervals between firings from cylinder 1 on, rad; the last one leads to cylinder 1 of the next cycle."""
        return intervals(self.firing_angles, self.cylinders.cycle)


def engine_to_dict(engine: Engine) -> dict[str, Any]:
    """Engine as nested dictionaries of JSON-compatible values in SI."""
    data: dict[str, Any] = json.loads(json.dumps(asdict(engine)))
    return data


def engine_from_dict(data: Mapping[str, Any]) -> Engine:
    """Inverse of :func:`engine_to_dict`; raises ``InputError`` for unknown or missing keys."""
    engine = _typed(Engine, data, "engine")
    if not isinstance(engine, Engine):
        raise InputError("engine: not a table")
    return engine


def optional_fields(kind: type) -> set[str]:
    """Names of the fields of a dataclass that have a default."""
    return {entry.name for entry in fields(kind) if entry.default is not MISSING}


def _typed(kind: Any, value: Any, where: str) -> Any:
    """Value from a JSON document, converted to the type ``kind`` of its field."""
    if is_dataclass(kind) and isinstance(kind, type):
        if not isinstance(value, Mapping):
            raise InputError(f"{where}: not a table")
        names = {entry.name for entry in fields(kind)}
        if wrong := sorted((names - optional_fields(kind) - set(value)) | (set(value) - names)):
            raise InputError(f"{where}.{wrong[0]}: {'unknown' if wrong[0] in value else 'missing'}")
        hints = get_type_hints(kind)
        return kind(**{name: _typed(hints[name], value[name], f"{where}.{name}") for name in names & set(value)})
    if isinstance(kind, UnionType):
        return None if value is None else _typed(get_args(kind)[0], value, where)
    if get_origin(kind) is tuple:
        return tuple(_typed(get_args(kind)[0], entry, where) for entry in value)
    return float(value) if kind is float else value
