"""Data of the force laws that join added bodies, one class per law (SI)."""

import math
from dataclasses import MISSING, dataclass, fields

from cranktrain.engine import quantities as q
from cranktrain.engine.parts import (
    AxialPath,
    Damper,
    Given,
    JournalBearing,
    Needed,
    Rod,
    RollerBearings,
    Skirt,
    ThrustBearing,
)
from cranktrain.engine.quantities import need


@dataclass(frozen=True)
class GearMesh:
    """A gear mesh; the pitch circles follow from the axes and the ratio of the two frames.

    Attributes
    ----------
    stiffness, damping : of the mesh along the normal of its flanks, N/m, N s/m
    pressure_angle, helix_angle : in the normal plane, and at the pitch circle, rad; with a positive helix angle the
        first gear is pushed along −z when it drives the other one forwards
    backlash : along the pitch circle, m
    teeth : number of teeth of the first gear
    variation : amplitude of the tooth-frequency variation of the stiffness, over its mean
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
    """Torque between two bodies in frames of equal ratio, by their relative twist.

    Attributes
    ----------
    stiffness, damping : N m/rad, N m s/rad
    twists, torques : additional spring torque (N m) over twist (rad), linear between the points and beyond them
    friction : friction torque (N m) against the twist rate, full above ``slip_speed`` (rad/s), viscous below
    """

    stiffness: q.SupportTorsionalStiffness = 0.0
    damping: q.TorsionalDamping = 0.0
    twists: tuple[q.Twist, ...] = ()
    torques: tuple[q.Torque, ...] = ()
    friction: q.FrictionTorque = 0.0
    slip_speed: q.SlipSpeed = 0.1


@dataclass(frozen=True)
class Spring:
    """Springs and dampers along and about the engine's three axes.

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
    """Force and torque on the first end and their reaction on the second, along the engine's axes.

    Attributes
    ----------
    force, torque : (3,) N, N m
    order, phase : both are multiplied by cos(order θ + phase) of the crank angle θ; order 0 with phase 0 is steady
    input : input of the run that both are multiplied by, so that they state force and torque per N m, or N, of it. The
       input then acts here, not on the engine's own pulley or flywheel
    """

    force: tuple[q.Force, ...] = (0.0, 0.0, 0.0)
    torque: tuple[q.Torque, ...] = (0.0, 0.0, 0.0)
    order: q.Order = 0.0
    phase: q.Angle = 0.0
    input: q.LoadInput = "none"


@dataclass(frozen=True, kw_only=True)
class Film(JournalBearing):
    """A plain bearing between two bodies, with the keys of a main bearing; the first end is the journal.

    Attributes
    ----------
    level : fidelity level of its film, named as the bearing levels
    bore : for level ``ehd``: ``elastic`` (available for the engine's own main bearings) or ``rigid``
    viscosity : viscosity of its oil, Pa s; 0 takes the engine's oil
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

    The keys are those of [main_roller] for one main bearing.

    Attributes
    ----------
    rollers : number of rollers
    roller_diameter, roller_length, pitch_diameter : roller diameter, effective length, diameter of the pitch circle, m
    clearance : diametral radial clearance (play from side to side), m
    stiffness, tilt_stiffness : of the linear stand-in, used in lists of modes at rest, N/m, N m/rad
    damping, tilt_damping : with every contact law, N s/m, N m s/rad
    profile : parameter p of the rollers' logarithmic profile, 0: straight
    contact : ``linear``, ``palmgren`` or ``iso16281``
    variable : true if rollers move with their cage; otherwise they stand still, the first straight below the journal
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
        """The same bearing as the only main bearing of an engine."""
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
    inner_diameter, outer_diameter, pads, pad_fraction, taper, contact_height : as in [thrust], m
    contact_stiffness, block_stiffness, damping : of collar and shells in contact, N/m; of the pads' support in series
        with the contact, N/m; of the contact, N s/m
    closed_stiffness : of the closed bearing, used in lists of modes at rest, N/m; 0 takes ``contact_stiffness``
    viscosity : viscosity of its oil, Pa s; 0 takes the engine's oil
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
        """The same bearing as the thrust bearing of an engine."""
        names = [entry.name for entry in fields(ThrustBearing) if entry.name != "main"]
        return ThrustBearing(main=1, **{name: getattr(self, name) for name in names})


@dataclass(frozen=True, kw_only=True)
class RingDamper:
    """Fluid or rubber between the housing (first end) and the ring (second end) of a torsional damper.

    The keys are those of [damper] without bodies and heat balance: ring and housing are added bodies, and the
    temperature is taken from the table over speed.

    Attributes
    ----------
    kind : ``viscous`` or ``rubber``
    fluid : law of the fluid, ``newtonian``, ``shear-thinning`` or ``complex-modulus``
    frequency : frequency at which complex modulus and rubber are linearised, Hz
    lowest_temperature, highest_temperature : range in which the law holds, K
    temperature_speeds, temperatures : temperature of the damper, K, over the engine's speed, rad/s
    viscosity, viscosity_slope, critical_stress, flow_exponent : of the fluid at 25 degC, Pa s; K; Pa
    ring_outer_radius, ring_inner_radius, ring_width, axial_gap, outer_gap, inner_gap : ring and gaps with fluid, m
    stiffness, loss_factor : of rubber, N m/rad
    """

    @staticmethod
    def needed(given: Given) -> Needed:
        """Those keys that a damper of an engine needs and this one has."""
        keys, why = Damper.needed(lambda key: given("fluid" if key == "law" else key))
        optional = {entry.name for entry in fields(RingDamper) if entry.default is not MISSING}
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
        """The same damper as that of an engine, with a ring of steel."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self) if entry.name != "fluid"}
        ring = 0.5 * math.pi * STEEL * self.ring_width * (self.ring_outer_radius**4 - self.ring_inner_radius**4)
        return Damper(
            **values, law=self.fluid, ring_inertia=ring, housing_inertia=0.0, mass=1.0,
            ambient_temperature=self.lowest_temperature, heat_transfer=1.0, cooling_area=1.0, power_limit=math.inf,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SlidingJoint:
    """A joint between two bodies that rotate at the same speed: it carries torque, and holds or slides along the axis.

    Attributes
    ----------
    joint : ``bolted``, or ``spline``, which slides if the force exceeds friction times torque over spline_radius
    joint_stiffness, joint_damping : along the axis, for a spline before it slides, N/m, N s/m
    turning_stiffness, turning_damping : about the axis, N m/rad, N m s/rad
    spline_radius, friction : mean radius of a spline, m, and its coefficient of friction
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
        """The same joint as that of an engine's drive line."""
        own = {name: getattr(self, name) for name in ("joint", "joint_stiffness", "joint_damping")}
        return AxialPath(**own, mass=1.0, stiffness=0.0, damping=0.0, spline_radius=self.spline_radius,
                         friction=self.friction)  # fmt: skip


@dataclass(frozen=True)
class RigidGear:
    """Two gears with rigid teeth; the ratios of their frames correspond to the numbers of teeth."""


@dataclass(frozen=True)
class Planetary:
    """A planetary gear with rigid teeth; ends: sun, ring, carrier, and optionally the planets.

    Attributes
    ----------
    teeth_sun, teeth_ring : numbers of teeth; the planets have half the difference. All planets are one body with their
        total inertia, in a frame on the sun's axis
    """

    teeth_sun: q.Teeth
    teeth_ring: q.Teeth


@dataclass(frozen=True)
class Belt:
    """A belt on two pulleys, whose radii follow from the ratio of their frames; crossed if these rotate oppositely.

    Attributes
    ----------
    radius : radius of the first pulley to the belt's middle line, m
    stiffness, damping : of one strand along its length, N/m, N s/m
    tension : tension of both strands at rest, N
    """

    radius: q.Size
    stiffness: q.Stiffness
    damping: q.Damping
    tension: q.Tension


@dataclass(frozen=True, kw_only=True)
class Liner(Skirt):
    """A piston's skirt in its liner; the first end is at the piston pin."""


@dataclass(frozen=True)
class Gas:
    """Gas force along a cylinder between a piston (first end) and its head (second end).

    Attributes
    ----------
    bore : diameter of the piston, m
    cylinder : cylinder of the engine (from 1) whose pressure acts; 0 for a pressure trace given here
    angles, pressures : of this trace, crank angles (rad) and absolute pressures (Pa), linear between points
    period : period of the trace, rad
    crankcase_pressure : pressure behind the piston, used with a trace given here, Pa
    """

    bore: q.Size
    cylinder: q.CylinderNumber = 0
    angles: tuple[q.Angle, ...] = ()
    pressures: tuple[q.TracePressure, ...] = ()
    period: q.Period = 4.0 * math.pi
    crankcase_pressure: q.TracePressure = 1.013e5


@dataclass(frozen=True, kw_only=True)
class SliderCrank:
    """A rigid rod and its piston on a pin (first end), in a cylinder at rest (second end), with the gas on the piston.

    Attributes
    ----------
    cylinder : cylinder of the engine (from 1) whose gas pressure acts, and whose rod and piston are taken where
        lengths and masses below are 0; 0: no gas
    bank : angle of the cylinder from the engine's y axis, from the axis of the crank towards the piston, rad
    offset : of the cylinder's axis from the axis of the crank that holds the pin, across the cylinder, m
    length, big_end_mass, small_end_mass, inertia : of the rod, as in [rod], m, kg, kg m²
    piston_mass, bore : mass of the piston and diameter of the cylinder, kg, m
    """

    cylinder: q.CylinderNumber = 0
    bank: q.Angle = 0.0
    offset: q.Offset = 0.0
    length: q.Size = 0.0
    big_end_mass: q.Mass = 0.0
    small_end_mass: q.Mass = 0.0
    inertia: q.Inertia = 0.0
    piston_mass: q.Mass = 0.0
    bore: q.Size = 0.0

    @property
    def rod(self) -> Rod:
        """Its rod alone."""
        return Rod(self.length, self.big_end_mass, self.small_end_mass, self.inertia)


@dataclass(frozen=True)
class Own:
    """A force law written as a Python function, see :mod:`cranktrain.dynamics.topology.own_law`.

    Attributes
    ----------
    function : name of a law of the running process
    parameters, values : names of the function's parameters, and their values in SI
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
    "slider_crank": SliderCrank, "own": Own,
}  # fmt: skip
"""Data class of each law that a file may name."""
WORDS = {2: "two", 3: "three", 4: "four"}
ENDS: dict[str, tuple[int, ...]] = {"planetary": (3, 4)}
"""Possible numbers of ends of a law, if not two."""


def check_ends(law: str, count: int, where: str) -> None:
    """Raise ``InputError`` if a connection has a number of ends that its law does not allow."""
    valid = ENDS.get(law, (2,))
    text = f"{count} ends; law '{law}' has {' or '.join(WORDS[number] for number in valid)}"
    need(where, "ends", count in valid, text)
