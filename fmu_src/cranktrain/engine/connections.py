"""Data of the force laws that join added bodies, as a file states them: one class a law (SI)."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from cranktrain.engine import quantities as q
from cranktrain.engine.parts import (
    AxialPath,
    Damper,
    Given,
    JournalBearing,
    Needed,
    RollerBearings,
    Skirt,
    ThrustBearing,
)
from cranktrain.engine.quantities import need


@dataclass(frozen=True)
class GearMesh:
    """Two gears whose pitch circles follow from the axes of their frames and the ratio.

    Attributes
    ----------
    stiffness, damping : of the mesh along the normal of its flanks, N/m, N s/m
    pressure_angle, helix_angle : in the normal plane and at the pitch circle, rad; a positive helix angle pushes the
        first gear along −z as it drives the other one forwards
    backlash : along the pitch circle, m
    teeth : of the first gear
    variation : amplitude of the stiffness over its mean as teeth come and go, once a tooth
    """

    stiffness: q.Stiffness
    damping: q.Damping
    pressure_angle: q.PressureAngle = 0.3490658503988659
    helix_angle: q.HelixAngle = 0.0
    backlash: q.Clearance = 0.0
    teeth: q.Teeth = 0
    variation: q.Variation = 0.0


@dataclass(frozen=True)
class Coupling:
    """Torque between two bodies, in frames of equal ratio, that twist relative to each other.

    Attributes
    ----------
    stiffness, damping : N m/rad, N m s/rad
    twists, torques : further spring torque (N m) over the twist (rad), straight between its points and beyond them
    friction : torque (N m) against the twist's rate, as far as it is above ``slip_speed`` (rad/s); below, viscous
    """

    stiffness: q.SupportTorsionalStiffness = 0.0
    damping: q.TorsionalDamping = 0.0
    twists: tuple[q.Twist, ...] = ()
    torques: tuple[q.Torque, ...] = ()
    friction: q.FrictionTorque = 0.0
    slip_speed: q.SlipSpeed = 0.1


@dataclass(frozen=True)
class Spring:
    """Springs and dampers along and about three axes, those of the engine.

    Attributes
    ----------
    stiffness, damping : (3,) along x, y, z, N/m, N s/m
    turning_stiffness, turning_damping : (3,) about x, y, z, N m/rad, N m s/rad
    """

    stiffness: tuple[q.SupportStiffness, ...] = (0.0, 0.0, 0.0)
    damping: tuple[q.Damping, ...] = (0.0, 0.0, 0.0)
    turning_stiffness: tuple[q.SupportTorsionalStiffness, ...] = (0.0, 0.0, 0.0)
    turning_damping: tuple[q.TorsionalDamping, ...] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Load:
    """Force and torque on the first end and back on the second one, along axes of the engine.

    Attributes
    ----------
    force, torque : (3,) N, N m
    order, phase : of a harmonic of the crank angle by which both are multiplied, cos(order θ + phase); 0: steady
    """

    force: tuple[q.Force, ...] = (0.0, 0.0, 0.0)
    torque: tuple[q.Torque, ...] = (0.0, 0.0, 0.0)
    order: q.Order = 0.0
    phase: q.Angle = 0.0


@dataclass(frozen=True, kw_only=True)
class Film(JournalBearing):
    """A plain bearing between two bodies, as the main bearings are described; the first end is the journal.

    Attributes
    ----------
    level : of its film, as bearing levels are named
    bore : of level ``ehd``: ``elastic``, known of the engine's own main bearings, or ``rigid``
    viscosity : of its oil, Pa s; 0: that of the engine's oil
    """

    level: q.FilmLevel = "impedance"
    bore: q.FilmBore = "elastic"
    stiffness_x: q.Stiffness = 1.0e8
    stiffness_y: q.Stiffness = 1.0e8
    damping_x: q.Damping = 1.0e4
    damping_y: q.Damping = 1.0e4
    viscosity: q.VogelViscosity = 0.0


@dataclass(frozen=True, kw_only=True)
class Roller:
    """A cylindrical roller bearing; the first end is the journal, the second one its outer ring, at rest.

    The values are those of one main bearing of [main_roller].

    Attributes
    ----------
    rollers : their number
    roller_diameter, roller_length, pitch_diameter : of a roller, its effective length, of the circle of rollers, m
    clearance : diametral radial clearance (play from side to side), m
    stiffness, tilt_stiffness : of the linear stand-in, which lists of modes at rest take, N/m, N m/rad
    damping, tilt_damping : with every contact, N s/m, N m s/rad
    profile : parameter p of the rollers' logarithmic profile, 0: straight
    contact : ``linear``, ``palmgren`` or ``iso16281``
    variable : whether rollers go round with their cage, else they stand still, the first one straight below the journal
    """

    rollers: q.Rollers
    roller_diameter: q.Length
    roller_length: q.Length
    pitch_diameter: q.Size
    clearance: q.Clearance
    stiffness: q.Stiffness
    tilt_stiffness: q.TorsionalStiffness
    damping: q.Damping
    tilt_damping: q.TorsionalDamping
    profile: q.RollerProfile = 0.0
    contact: q.RollerLaw = "palmgren"
    variable: bool = False

    @property
    def bearings(self) -> RollerBearings:
        """The bearing as the only one of an engine's main bearings."""
        names = [entry.name for entry in fields(self) if entry.name not in ("contact", "variable")]
        values = {name: (getattr(self, name),) for name in names}
        return RollerBearings(**values, ring_mass=(1.0,), law=self.contact, variable=self.variable)


@dataclass(frozen=True, kw_only=True)
class Thrust:
    """An axial bearing; the first end is the collar, the second one its pads, at rest.

    Attributes
    ----------
    collar : ``square`` to its axis, or ``tilting``
    clearance : total axial play, m
    inner_diameter, outer_diameter, pads, pad_fraction, taper, contact_height : as of [thrust], m
    contact_stiffness, block_stiffness, damping : of collar and shells where they touch, of what holds the pads in
        series with it, N/m; of the contact, N s/m
    closed_stiffness : of the closed bearing, which lists of modes at rest take, N/m; 0: that of the contact
    viscosity : of its oil, Pa s; 0: that of the engine's oil
    """

    clearance: q.Gap
    inner_diameter: q.Size
    outer_diameter: q.Size
    pads: q.Pads
    pad_fraction: q.Share
    taper: q.Taper
    contact_height: q.Roughness
    contact_stiffness: q.Stiffness
    damping: q.Damping
    block_stiffness: q.Stiffness = math.inf
    closed_stiffness: q.SupportStiffness = 0.0
    collar: q.Collar = "square"
    viscosity: q.VogelViscosity = 0.0

    @property
    def bearing(self) -> ThrustBearing:
        """The bearing as that of an engine."""
        names = [entry.name for entry in fields(ThrustBearing) if entry.name != "main"]
        return ThrustBearing(main=1, **{name: getattr(self, name) for name in names})


@dataclass(frozen=True, kw_only=True)
class RingDamper:
    """Fluid or rubber between a torsional damper's housing, the first end, and its ring, the second one.

    The values are those of [damper] but for bodies and heat balance: ring and housing are bodies of their own, and the
    temperature is that of the table.

    Attributes
    ----------
    kind : ``viscous`` or ``rubber``
    fluid : law of a fluid, ``newtonian``, ``shear-thinning`` or ``complex-modulus``
    frequency : at which complex modulus and rubber are linearised, Hz
    lowest_temperature, highest_temperature : between which the law holds, K
    temperature_speeds, temperatures : of the damper, K, over the engine's speed, rad/s
    viscosity, viscosity_slope, critical_stress, flow_exponent : of the fluid at 25 degC, Pa s; K; Pa
    ring_outer_radius, ring_inner_radius, ring_width, axial_gap, outer_gap, inner_gap : between which it is, m
    stiffness, loss_factor : of rubber, N m/rad
    """

    @staticmethod
    def needed(given: Given) -> Needed:
        """Of what a damper of an engine needs, the keys that this one has."""
        keys, why = Damper.needed(lambda key: given("fluid" if key == "law" else key))
        optional = (
            "viscosity",
            "viscosity_slope",
            "critical_stress",
            "flow_exponent",
            "ring_outer_radius",
            "ring_inner_radius",
            "ring_width",
            "axial_gap",
            "outer_gap",
            "inner_gap",
            "stiffness",
            "loss_factor",
        )
        return Needed(tuple(key for key in keys if key in optional), why)

    kind: q.RingDamperKind
    temperature_speeds: tuple[q.Speed, ...]
    temperatures: tuple[q.Temperature, ...]
    lowest_temperature: q.Temperature
    highest_temperature: q.Temperature
    frequency: q.WorkingFrequency
    fluid: q.DamperLaw = "shear-thinning"
    viscosity: q.FluidViscosity = 0.0
    viscosity_slope: q.TemperatureDifference = 0.0
    critical_stress: q.Stress = 0.0
    flow_exponent: q.FlowExponent = 0.0
    ring_outer_radius: q.Length = 0.0
    ring_inner_radius: q.Length = 0.0
    ring_width: q.Length = 0.0
    axial_gap: q.Gap = 0.0
    outer_gap: q.Gap = 0.0
    inner_gap: q.Gap = 0.0
    stiffness: q.TorsionalStiffness = 0.0
    loss_factor: q.LossFactor = 0.0

    @property
    def damper(self) -> Damper:
        """The damper as that of an engine, with a ring of steel."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self) if entry.name != "fluid"}
        ring = 0.5 * math.pi * STEEL * self.ring_width * (self.ring_outer_radius**4 - self.ring_inner_radius**4)
        return Damper(
            **values, law=self.fluid, ring_inertia=ring, housing_inertia=0.0, mass=1.0,
            ambient_temperature=self.lowest_temperature, heat_transfer=1.0, cooling_area=1.0, power_limit=math.inf,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SlidingJoint:
    """A joint between two bodies that turn alike: it carries a torque and holds or slides along the axis.

    Attributes
    ----------
    joint : ``bolted``, or a ``spline``, which slides where the force exceeds friction times torque over spline_radius
    joint_stiffness, joint_damping : along the axis, of a spline before it slides, N/m, N s/m
    turning_stiffness, turning_damping : about the axis, N m/rad, N m s/rad
    spline_radius, friction : of a spline: its mean radius, m, and the coefficient of friction
    """

    joint: q.AxialJoint
    joint_stiffness: q.Stiffness
    turning_stiffness: q.TorsionalStiffness
    joint_damping: q.Damping = 0.0
    turning_damping: q.TorsionalDamping = 0.0
    spline_radius: q.Length = 0.0
    friction: q.Friction = 0.0

    @property
    def path(self) -> AxialPath:
        """The joint as that of an engine's drive line."""
        own = {name: getattr(self, name) for name in ("joint", "joint_stiffness", "joint_damping")}
        return AxialPath(**own, mass=1.0, stiffness=0.0, damping=0.0, spline_radius=self.spline_radius,
                         friction=self.friction)  # fmt: skip


@dataclass(frozen=True)
class RigidGear:
    """Two gears with rigid teeth; the ratios of their frames match the teeth."""


@dataclass(frozen=True)
class Planetary:
    """A planetary gear with rigid teeth; ends: sun, ring, carrier, and optionally the planets.

    Attributes
    ----------
    teeth_sun, teeth_ring : their numbers of teeth, the planets have half the difference; planets are one body of all
        their inertia, in a frame on the sun's axis
    """

    teeth_sun: q.Teeth
    teeth_ring: q.Teeth


@dataclass(frozen=True)
class Belt:
    """A belt on two pulleys, whose radii are in the ratio of their frames' turns; crossed where these turn apart.

    Attributes
    ----------
    radius : of the first pulley at the belt's middle line, m
    stiffness, damping : of one strand along it, N/m, N s/m
    tension : of both strands at rest, N
    """

    radius: q.Size
    stiffness: q.Stiffness
    damping: q.Damping
    tension: q.Tension


@dataclass(frozen=True, kw_only=True)
class Liner(Skirt):
    """A piston's skirt in its liner; the first end is at the piston's pin."""


@dataclass(frozen=True)
class Gas:
    """Gas between a piston and its head, the first and the second end, along the piston's cylinder.

    Attributes
    ----------
    bore : diameter of the piston, m
    cylinder : of the engine, whose pressure it is, counted from 1; 0: a trace of its own
    angles, pressures : of such a trace, crank angles (rad) and absolute pressures (Pa), straight between its points
    period : after which the trace begins anew, rad
    crankcase_pressure : behind the piston, with a trace of its own, Pa
    """

    bore: q.Size
    cylinder: q.CylinderNumber = 0
    angles: tuple[q.Angle, ...] = ()
    pressures: tuple[q.TracePressure, ...] = ()
    period: q.Period = 4.0 * math.pi
    crankcase_pressure: q.TracePressure = 1.013e5


@dataclass(frozen=True)
class Own:
    """A law that is a function of Python, see :mod:`cranktrain.dynamics.topology.own_law`.

    Attributes
    ----------
    function : name of a law of the running process
    parameters, values : names of its parameters, and their values in SI
    """

    function: str
    parameters: tuple[str, ...] = ()
    values: tuple[q.OwnValue, ...] = ()


STEEL = 7850.0
"""Density of a damper's ring, kg/m³."""
DATA: dict[str, type] = {
    "gear_mesh": GearMesh, "coupling": Coupling, "spring": Spring, "load": Load, "film": Film,
    "rigid_gear": RigidGear, "planetary": Planetary, "belt": Belt, "gas": Gas,
    "liner": Liner, "roller": Roller, "thrust": Thrust, "damper": RingDamper, "axial_joint": SlidingJoint,
    "own": Own,
}  # fmt: skip
"""Data of each law that a file may name."""
WORDS = {2: "two", 3: "three", 4: "four"}
ENDS: dict[str, tuple[int, ...]] = {"planetary": (3, 4)}
"""How many ends a connection has, where not two."""


def check_ends(law: str, count: int, where: str) -> None:
    """Refuse another number of ends than a law has; ``InputError``."""
    valid = ENDS.get(law, (2,))
    text = f"{count} ends; law '{law}' has {' or '.join(WORDS[number] for number in valid)}"
    need(where, "ends", count in valid, text)
