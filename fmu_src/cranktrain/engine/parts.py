"""The parts of an engine as frozen dataclasses in SI, one for each table of an engine file."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import Any, NamedTuple

from cranktrain.engine import quantities as q


class Relief(NamedTuple):
    """Axial profile of a shell: depth (m), fraction of a half width, exponent; :mod:`cranktrain.film.contact.gap`."""

    depth: float = 0.0
    share: float = 0.5
    exponent: float = 2.0


SHELL_SHARE = 0.03
"""Thickness of a plain bearing's shell over the bearing's diameter; chosen."""
RING_SHARE = 0.5
"""Thickness of a roller bearing's outer ring over the roller diameter; chosen."""


COLDEST, ROOM, HOTTEST = 173.15, 298.15, 1273.15
"""Temperature range, K, and temperature of a linear damper, whose law does not depend on temperature."""
ANY_FREQUENCY = 100.0
"""Nominal linearisation frequency, Hz, of a linear damper with constant stiffness and damping."""


Given = Callable[[str], Any]
"""Function that returns the value of a TOML table under a key; None if the table does not state the key."""


class Needed(NamedTuple):
    """Optional keys that other values of a TOML table make necessary, and the reason for a message."""

    keys: tuple[str, ...] = ()
    why: str = ""


@dataclass(frozen=True)
class Material:
    """Linear isotropic material (Pa, 1, kg/m³)."""

    youngs_modulus: q.Modulus
    poisson_ratio: q.PoissonRatio
    density: q.Density


@dataclass(frozen=True)
class Crankshaft:
    """Parametric crankshaft geometry, m and rad.

    A throw is a pin with its angle. Between two main journals there is one pin, or the number in
    ``pins_between_mains``. Several pins are joined by flying webs of ``flying_web_thickness``; with 0 they meet at
    their faces. ``counterweights`` has an entry for each web, including flying webs, which carry none. ``pin_throws``
    are the throws of the pins if they differ; ``throw`` is then that of the first.
    """

    throw: q.Size
    throw_angles: tuple[q.Angle, ...]
    main_diameter: q.Size
    main_widths: tuple[q.Size, ...]
    pin_diameter: q.Size
    pin_width: q.Size
    web_thickness: q.Length
    web_main_radius: q.Size
    web_pin_radius: q.Size
    counterweight_radius: q.Length
    counterweight_half_width: q.Length
    counterweights: tuple[bool, ...]
    nose_diameter: q.Length
    nose_length: q.Length
    flange_diameter: q.Length
    flange_length: q.Length
    fillet: q.Length
    oil_hole_diameter: q.Length
    oil_holes: bool
    mesh_size: q.Length
    pins_between_mains: tuple[q.Pins, ...] = ()
    flying_web_thickness: q.Web = 0.0
    pin_throws: tuple[q.Size, ...] = ()

    @property
    def bays(self) -> tuple[int, ...]:
        """Number of pins between each two neighbouring main journals."""
        return self.pins_between_mains or (1,) * len(self.throw_angles)

    @property
    def main_before(self) -> tuple[int, ...]:
        """Main journal (from 1) in front of each pin."""
        return tuple(main for main, pins in enumerate(self.bays, 1) for _ in range(pins))

    @property
    def throws(self) -> tuple[float, ...]:
        """Throw of each pin, m."""
        return self.pin_throws or (self.throw,) * len(self.throw_angles)

    @property
    def pin_pitch(self) -> float:
        """Distance along z of neighbouring pins between two main journals, m."""
        return self.pin_width + self.flying_web_thickness

    @property
    def main_positions(self) -> tuple[float, ...]:
        """Position of each main journal's middle along z, m; 0 for the first."""
        one, ends = 2.0 * self.web_thickness + self.pin_width, zip(self.main_widths, self.main_widths[1:], strict=False)
        bays = (one + (pins - 1) * self.pin_pitch for pins in self.bays)
        return tuple(accumulate((0.5 * (a + b) + bay for (a, b), bay in zip(ends, bays, strict=True)), initial=0.0))

    @property
    def pin_positions(self) -> tuple[float, ...]:
        """Position of each pin's middle along z, m."""
        ends = (z + 0.5 * width for z, width in zip(self.main_positions, self.main_widths, strict=True))
        first = (end + self.web_thickness + 0.5 * self.pin_width for end in ends)
        return tuple(z + k * self.pin_pitch for z, pins in zip(first, self.bays, strict=False) for k in range(pins))


@dataclass(frozen=True)
class LumpedInertia:
    """A rigid part fixed to an interface (kg, kg m², m); offset is along z from the interface to its centre of mass."""

    mass: q.Mass
    polar_inertia: q.Inertia
    diametral_inertia: q.Inertia
    offset: q.Offset


@dataclass(frozen=True)
class BalanceWeights:
    """Inserts and weights on the webs next to main journals, as point masses that rotate with the crankshaft.

    There is one entry per weight: number of the main journal, mass, distance from the axis, angle (counted as a
    throw's), and position along z relative to the journal's middle (kg, m, rad).
    """

    mains: tuple[int, ...]
    masses: tuple[q.Mass, ...]
    radii: tuple[q.Length, ...]
    angles: tuple[q.Angle, ...]
    offsets: tuple[q.Offset, ...]


@dataclass(frozen=True)
class Rod:
    """Connecting rod: length, masses at big and small end, and the true inertia about its centre of mass.

    Level ``ehd`` of the big ends makes an elastic eye (:mod:`cranktrain.structure.rod.eye`) from the wall thickness of
    the housing and of the cap, the width across the bolts and the width of the shank; 0 takes usual proportions to the
    bearing.
    """

    length: q.Size
    big_end_mass: q.Mass
    small_end_mass: q.Mass
    inertia: q.Inertia
    eye_wall: q.Length = field(default=0.0, kw_only=True)
    cap_wall: q.Length = field(default=0.0, kw_only=True)
    eye_width: q.Length = field(default=0.0, kw_only=True)
    shank_width: q.Length = field(default=0.0, kw_only=True)


@dataclass(frozen=True)
class ArticulatedRod(Rod):
    """Connecting rod that turns on a knuckle pin in the big end of a master rod, not on the crank pin.

    The knuckle pin lies ``knuckle_radius`` from the middle of the crank pin, at an angle from the master rod's axis in
    the sense of rotation. The angle is in ``knuckle_angles``, one for each cylinder (0 for master rods), or if these
    are not given the difference of the two banks.
    """

    knuckle_radius: q.AddedLength
    knuckle_angles: tuple[q.Angle, ...] = ()


@dataclass(frozen=True)
class Cylinders:
    """Cylinders in the order of their numbers; angles rad, lengths m.

    ``bank_angles`` are counted from the vertical in the sense of rotation. ``rod_offsets`` are the positions of the
    rods' middles along z relative to the middles of their pins; all 0 if the tuple is empty. ``firing_order``
    determines the revolution in which each cylinder fires (:mod:`cranktrain.engine.firing`). An engine that fires
    differently states ``firing_angles``, one for each cylinder relative to cylinder 1, or ``firing_intervals``, one for
    each cylinder of the order. ``cycle`` is 720 degrees for a four-stroke, 360 degrees for a two-stroke.
    ``axis_offsets`` are the distances of the cylinder axes from the crank axis, for offset banks; the offset of the
    piston pin adds to them. ``rods_on_pin`` states how rods share a pin: ``side-by-side``, ``fork-and-blade`` in one
    plane, or ``articulated``: the pin's cylinder with the lowest number has the master rod, all others the engine's
    articulated rod. With a ``crosshead`` the side force acts on a guide at the height of the rod's small end, and
    ``piston_mass`` includes piston rod and crosshead.
    """

    bore: q.Size
    firing_order: tuple[int, ...]
    pins: tuple[int, ...]
    bank_angles: tuple[q.Angle, ...]
    piston_mass: q.Mass
    pin_offset: q.Offset
    compression_ratio: q.CompressionRatio
    rod_offsets: tuple[q.Offset, ...] = ()
    firing_angles: tuple[q.Angle, ...] = ()
    firing_intervals: tuple[q.Angle, ...] = ()
    cycle: q.Cycle = 4.0 * math.pi
    axis_offsets: tuple[q.Offset, ...] = ()
    rods_on_pin: q.RodsOnPin = "side-by-side"
    crosshead: bool = False


@dataclass(frozen=True, kw_only=True)
class PlainBearing:
    """Plain bearing: film geometry, and contact of its rough surfaces.

    Level ``impedance`` uses ``contact_height`` and ``contact_pressure``. The levels above it use the contact model of
    Greenwood and Tripp: combined ``roughness`` σ of both surfaces, ``asperity_factor`` ηβσ, ``asperity_ratio`` σ/β,
    ``contact_modulus`` E', boundary friction (coefficient on the contact pressure, stress on the real contact area),
    and the ``hardness`` of the lining, which limits the contact pressure. ``groove`` is ``none`` or
    ``circumferential``. Level ``ehd`` follows the oil from a supply at ``supply_pressure``: a groove in mid-bore,
    ``supply_width`` wide, all around or ``supply_arc`` long about ``supply_angle`` (from the x axis in the sense of
    rotation); the default is the upper half. The levels below it treat a groove all around as a line.
    """

    diameter: q.Size
    width: q.Size
    clearance: q.RadialClearance
    contact_height: q.Roughness
    contact_pressure: q.ContactPressure
    groove: q.Groove = "none"
    roughness: q.Roughness = 0.4e-6
    asperity_factor: q.AsperityFactor = 0.05
    asperity_ratio: q.AsperityRatio = 0.01
    contact_modulus: q.Modulus = 58.6e9
    boundary_friction: q.Friction = 0.1
    boundary_shear: q.ContactShear = 0.0
    hardness: q.ContactPressure = 300.0e6
    supply_pressure: q.GaugePressure = 4.0e5
    supply_angle: q.Angle = 0.5 * math.pi
    supply_arc: q.Arc = math.pi
    supply_width: q.Length = 4.0e-3

    @property
    def relief(self) -> Relief:
        """Axial profile of the shell: straight, so tilt has no effect on the film."""
        return Relief()


@dataclass(frozen=True, kw_only=True)
class BigEndBearing(PlainBearing):
    """Plain bearing between a rod and its pin; its supply angle is counted in the rod's axes.

    x is across the rod, y points from the big end to the small end. By default the groove is in the cap, because the
    half towards the shank carries the gas force.
    """

    supply_angle: q.Angle = -0.5 * math.pi


@dataclass(frozen=True, kw_only=True)
class JournalBearing(PlainBearing):
    """Main bearing: a plain bearing, its linear stand-in (N/m, N s/m), and the relief of its shell at the edges.

    ``stiffness_x`` and ``stiffness_y`` belong to the film. ``block_stiffness_x`` and ``block_stiffness_y`` represent
    the block in series if the block level is ``ground``. The relief is ``relief_depth`` deep at the edge and extends
    over the fraction ``relief_share`` of each half width with ``relief_exponent``.
    """

    stiffness_x: q.Stiffness
    stiffness_y: q.Stiffness
    damping_x: q.Damping
    damping_y: q.Damping
    block_stiffness_x: q.Stiffness = math.inf
    block_stiffness_y: q.Stiffness = math.inf
    relief_depth: q.ReliefDepth = 6.0e-6
    relief_share: q.Share = 0.5
    relief_exponent: q.ReliefExponent = 2.0

    @property
    def ground_stiffness(self) -> tuple[float, float]:
        """Stiffness of film and block in series across the axis (x, y), N/m."""
        x = 1.0 / (1.0 / self.stiffness_x + 1.0 / self.block_stiffness_x)
        return x, 1.0 / (1.0 / self.stiffness_y + 1.0 / self.block_stiffness_y)

    @property
    def in_rigid_bores(self) -> "JournalBearing":
        """Copy of the bearing without the block's stiffness."""
        return replace(self, block_stiffness_x=math.inf, block_stiffness_y=math.inf)

    @property
    def relief(self) -> Relief:
        """Axial profile of the shell."""
        return Relief(self.relief_depth, self.relief_share, self.relief_exponent)


@dataclass(frozen=True, kw_only=True)
class RollerBearings:
    """Cylindrical roller bearings of mains, with one value per main journal from the pulley to the flywheel (SI).

    They carry all mains, or those whose numbers ``mains`` lists in rising order; then there is one value for each of
    these.

    ``rollers`` on a circle of ``pitch_diameter`` have the effective ``roller_length``. ``clearance`` is the diametral
    radial clearance of the standards (play from side to side), ``profile`` the parameter p of the rollers' logarithmic
    profile (0: straight), see :mod:`cranktrain.film.laws.roller_contacts`. ``stiffness`` (N/m) and ``tilt_stiffness``
    (N m/rad) are the linear stand-ins; ``damping`` (N s/m) and ``tilt_damping`` (N m s/rad) act with every law.
    ``ring_mass`` is the mass of the outer ring. Level ``roller`` uses ``law``: ``linear``, ``palmgren`` or
    ``iso16281``. With ``variable`` the rollers move with their cage; otherwise they stand still, the first straight
    below the journal.
    """

    rollers: tuple[q.Rollers, ...]
    roller_diameter: tuple[q.Length, ...]
    roller_length: tuple[q.Length, ...]
    pitch_diameter: tuple[q.Size, ...]
    clearance: tuple[q.Clearance, ...]
    stiffness: tuple[q.Stiffness, ...]
    tilt_stiffness: tuple[q.TorsionalStiffness, ...]
    damping: tuple[q.Damping, ...]
    tilt_damping: tuple[q.TorsionalDamping, ...]
    ring_mass: tuple[q.Mass, ...]
    profile: tuple[q.RollerProfile, ...]
    law: q.RollerLaw = "palmgren"
    variable: bool = False
    mains: tuple[int, ...] = ()


@dataclass(frozen=True)
class ThrustBearing:
    """Axial bearing at one main journal; ``clearance`` is the total axial play.

    ``contact_stiffness`` is that of collar and shells in contact during a run. ``closed_stiffness`` is used where the
    bearing counts as closed, in lists of modes at rest and with linear mains; 0 takes the contact's.
    ``block_stiffness`` is that of the block, in series with either.
    """

    main: int
    clearance: q.Gap
    inner_diameter: q.Size
    outer_diameter: q.Size
    pads: q.Pads
    pad_fraction: q.Share
    taper: q.Taper
    contact_height: q.Roughness
    contact_stiffness: q.Stiffness
    block_stiffness: q.Stiffness
    damping: q.Damping
    closed_stiffness: q.SupportStiffness = 0.0

    @property
    def closed(self) -> float:
        """Stiffness of collar and shells of the closed bearing, N/m."""
        return self.closed_stiffness or self.contact_stiffness


@dataclass(frozen=True, kw_only=True)
class Oil:
    """Lubricant: viscosity against temperature and pressure, and the oil temperature against engine speed (K, rad/s).

    ``law`` is ``vogel``, η = a exp(b / (T − c)), or ``walther`` through two points of kinematic viscosity.
    ``pressure_law`` is ``none``, ``barus`` or ``roelands``; ``pressure_viscosity`` is the slope of ln η at ambient
    pressure. ``compressibility`` is ``none`` or ``dowson-higginson``. ``heat_share`` is the fraction of a film's
    friction power that its oil carries away. A ``grade`` such as ``5W-30`` sets density and law
    (:mod:`cranktrain.engine.oil_grades`).
    """

    @staticmethod
    def needed(given: Given) -> Needed:
        """Density, which an oil without a grade needs."""
        graded = given("grade") not in (None, q.NO_GRADE)
        return Needed() if graded else Needed(("density",), "an oil without a grade needs")

    temperature_speeds: tuple[q.Speed, ...]
    temperatures: tuple[q.OilTemperature, ...]
    supply_pressure: q.GaugePressure
    density: q.OilDensity = 0.0
    grade: q.OilGrade = q.NO_GRADE
    law: q.OilLaw = "vogel"
    vogel_a: q.VogelViscosity = 0.0
    vogel_b: q.TemperatureDifference = 0.0
    vogel_c: q.VogelTemperature = 0.0
    walther_temperatures: tuple[q.OilTemperature, ...] = ()
    walther_viscosities: tuple[q.KinematicViscosity, ...] = ()
    pressure_law: q.PressureLaw = "none"
    pressure_viscosity: q.PressureCoefficient = 0.0
    compressibility: q.Compressibility = "none"
    heat_capacity: q.HeatCapacity = 2000.0
    heat_share: q.HeatShare = 0.8


@dataclass(frozen=True, kw_only=True)
class Skirt:
    """Skirt of a piston in its liner: two layers of springs across the cylinder, and friction along it.

    Heights are above the pin. ``clearance`` is the radial play of the skirt, 0 for springs without play; ``friction``
    is a coefficient on the side forces, full above ``sliding_speed``.
    """

    upper_stiffness: q.Stiffness
    lower_stiffness: q.Stiffness
    upper_height: q.Offset
    lower_height: q.Offset
    upper_damping: q.Damping
    lower_damping: q.Damping
    clearance: q.Clearance = 0.0
    friction: q.Friction = 0.0
    sliding_speed: q.Velocity = 0.1


@dataclass(frozen=True, kw_only=True)
class PistonGuidance(Skirt):
    """Support of a piston across its cylinder by its skirt.

    ``mass_height`` is the height of the piston's centre of mass above the pin, ``tilt_inertia`` the moment of inertia
    about an axis through this centre parallel to the crank.
    """

    mass_height: q.Offset
    tilt_inertia: q.Inertia


AT_CRANK = "crank.flywheel"
"""Where a drive line begins if its table does not say otherwise."""


@dataclass(frozen=True)
class DriveLine:
    """Connecting shaft from the flywheel to the dynamometer, which either has a given speed or applies a given torque.

    Attributes
    ----------
    dynamometer_inertia : used if the torque is given; with a given speed it has no effect
    start : ``body.interface`` where the drive line begins: the crank's flywheel, or an added body that connections
        turn with the crank, for example the secondary mass of a dual-mass flywheel or a shaft behind gears
    """

    stiffness: q.TorsionalStiffness
    damping: q.TorsionalDamping
    speed_filter_time: q.Time
    dynamometer_inertia: q.Inertia = 2.0
    start: str = AT_CRANK


@dataclass(frozen=True, kw_only=True)
class MeanLoad:
    """Mean torque that the engine delivers at its flywheel over speed, balanced by the combustion (SI).

    ``propeller`` has ``torque`` at ``speed`` and grows as T (Ω/Ω_n)^``exponent``; ``power`` is a generator of
    constant power, P/Ω; ``torque`` is the same at all speeds. ``speed`` is the engine's rated speed, to which limits of
    shafts refer.
    """

    @staticmethod
    def needed(given: Given) -> Needed:
        """Torque or power, whichever the kind of load needs."""
        kind = given("kind")
        return (
            Needed(("power",) if kind == "power" else ("torque",), f"a load of kind {kind} needs") if kind else Needed()
        )

    kind: q.LoadLaw
    speed: q.LoadSpeed
    torque: q.FrictionTorque = 0.0
    power: q.Power = 0.0
    exponent: q.LoadExponent = 2.0

    def torque_at(self, speed: float) -> float:
        """Mean torque, N m, at a speed of the crank, rad/s."""
        if self.kind == "power":
            return self.power / speed
        return self.torque * (speed / self.speed) ** (self.exponent if self.kind == "propeller" else 0.0)


@dataclass(frozen=True, kw_only=True)
class AxialPath:
    """Axial path: support of the crank along its axis by the drive line (SI).

    A ``mass`` of the connecting shaft moves along the axis, held at the dynamometer by ``stiffness`` and ``damping``.
    The ``joint`` between flywheel and shaft has ``joint_stiffness`` and ``joint_damping``. A ``bolted`` joint does not
    slide; a ``spline`` slides if the force exceeds ``friction`` × torque / ``spline_radius``, see
    :mod:`cranktrain.film.laws.axial_joint`. ``force`` is a steady axial force on the flywheel, positive away from the
    pulley.
    """

    @staticmethod
    def needed(given: Given) -> Needed:
        """Radius and friction, which a spline needs."""
        why = "a spline slides by friction x torque / spline_radius; take joint bolted, or give"
        return Needed(("spline_radius", "friction"), why) if given("joint") == "spline" else Needed()

    joint: q.AxialJoint
    mass: q.Mass
    stiffness: q.SupportStiffness
    damping: q.Damping
    joint_stiffness: q.Stiffness
    joint_damping: q.Damping = 0.0
    spline_radius: q.Length = 0.0
    friction: q.Friction = 0.0
    force: q.AxialForce = 0.0


@dataclass(frozen=True, kw_only=True)
class Damper:
    """Torsional damper on the pulley: a ring coupled to its housing by a fluid, rubber or springs (SI).

    ``kind`` is ``viscous``, ``rubber`` or ``linear``. A ``linear`` damper needs ``ring_inertia`` and ``damping`` or
    ``stiffness`` alone, or ``stiffnesses`` and ``dampings`` over ``frequencies``, as makers of steel-spring dampers
    state them; runs in time use the values at ``frequency``. The other kinds need all of the following.

    ``mass`` is that of housing and ring, which the pulley carries; ``housing_inertia`` rotates with the pulley. A
    silicone fluid of ``viscosity`` at 25 °C fills the gaps at the ring's two faces (``axial_gap``) and at its outer and
    inner cylinder. Its ``law`` is ``newtonian``, ``shear-thinning`` or ``complex-modulus``, see
    :mod:`cranktrain.loads.damper`, with ln η falling by ``viscosity_slope`` over 1/T. Complex modulus and rubber are
    linearised at ``frequency``. A law holds between ``lowest_temperature`` and ``highest_temperature``. The damper's
    temperature is taken from ``temperatures`` over ``temperature_speeds``, or from its heat balance with
    ``heat_transfer`` from ``cooling_area`` to ``ambient_temperature``. Its dissipated power per cooling area should not
    exceed ``power_limit``.
    """

    @staticmethod
    def needed(given: Given) -> Needed:
        """Keys that a viscous or rubber damper needs."""
        kind, law = given("kind"), given("law") or "shear-thinning"
        if kind not in ("viscous", "rubber"):
            return Needed()
        rubber = kind == "rubber"
        fluid = ("critical_stress", "flow_exponent") if law != "newtonian" else ()
        gaps = ("ring_outer_radius", "ring_inner_radius", "ring_width", "axial_gap", "outer_gap", "inner_gap")
        keys = (
            "mass", "frequency", "lowest_temperature", "highest_temperature", "temperature_speeds", "temperatures",
            "ambient_temperature", "heat_transfer", "cooling_area", "power_limit",
            *(("stiffness", "loss_factor") if rubber else ("viscosity", "viscosity_slope", *fluid, *gaps)),
        )  # fmt: skip
        return Needed(keys, f"a {kind} damper{'' if rubber else f' of law {law}'} needs")

    kind: q.DamperKind
    ring_inertia: q.Inertia
    housing_inertia: q.AddedInertia = 0.0
    mass: q.Mass = 0.0
    frequency: q.WorkingFrequency = 0.0
    lowest_temperature: q.Temperature = 0.0
    highest_temperature: q.Temperature = 0.0
    temperature_speeds: tuple[q.Speed, ...] = ()
    temperatures: tuple[q.Temperature, ...] = ()
    ambient_temperature: q.Temperature = 0.0
    heat_transfer: q.HeatTransfer = 0.0
    cooling_area: q.Area = 0.0
    power_limit: q.HeatFlux = 0.0
    law: q.DamperLaw = "shear-thinning"
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
    damping: q.TorsionalDamping = 0.0
    frequencies: tuple[q.Frequency, ...] = ()
    stiffnesses: tuple[q.SupportTorsionalStiffness, ...] = ()
    dampings: tuple[q.TorsionalDamping, ...] = ()

    def __post_init__(self) -> None:
        """Fill in a linear damper, which is the same at all temperatures, and at all frequencies unless stated."""
        if self.kind != "linear":
            return
        warm = {
            "lowest_temperature": COLDEST, "highest_temperature": HOTTEST, "temperature_speeds": (0.0,),
            "temperatures": (ROOM,), "ambient_temperature": ROOM,
        }  # fmt: skip
        for key, value in (warm if self.frequencies else warm | {"frequency": ANY_FREQUENCY}).items():
            if not getattr(self, key):
                object.__setattr__(self, key, value)


@dataclass(frozen=True)
class StructuralDamping:
    """Damping of the crank's elastic modes: one ratio for all (``modal``) or D = α M + β K (``rayleigh``; 1/s, s).

    The modes are those of the crank with flywheel, pulley and the mean mass of the rods on its pins.

    ``torsional_ratios`` are measured damping ratios of the cranktrain's first one or two torsional modes without a
    damper. Crank level ``torsional`` uses them in place of those that it inherits; other levels compute theirs.
    """

    kind: q.DampingKind = "modal"
    ratio: q.DampingRatio = 0.01
    alpha: q.Rate = 0.0
    beta: q.Time = 0.0
    torsional_ratios: tuple[q.DampingRatio, ...] = ()


@dataclass(frozen=True)
class Combustion:
    """Single-zone closed cycle with a Wiebe burn; angles rad after firing top dead centre, pressures Pa, energy J."""

    start: q.Angle
    duration: q.Duration
    wiebe_a: q.WiebeFactor
    wiebe_m: q.WiebeExponent
    heat: q.Energy
    intake_pressure: q.GasPressure
    intake_temperature: q.Temperature
    exhaust_pressure: q.GasPressure
    intake_closes: q.Angle
    exhaust_opens: q.Angle
    wall_temperature: q.Temperature
    best_speed: q.RatedSpeed
    falloff: q.Falloff


@dataclass(frozen=True)
class Compressor:
    """Gas in the cylinders of a reciprocating compressor, in place of combustion (absolute pressures, Pa; rad/s).

    Compression and re-expansion are polytropic with ``exponent``; the clearance volume follows from
    ``cylinders.compression_ratio``. Valves open at the pressures ``suction`` and ``discharge``. Without load they are
    held open.
    """

    suction: q.CompressedGas
    discharge: q.CompressedGas
    exponent: q.Polytropic
    best_speed: q.RatedSpeed


@dataclass(frozen=True, kw_only=True)
class Block:
    """Engine block: one casting with its bottom cover, and the heads on it (m, Pa, kg/m³, kg, Hz).

    Heights are measured from the crank axis. The crankcase has upright walls ``crankcase_half_width`` to either side,
    from ``skirt_depth`` below to ``side_height`` above. From there they rise to the foot of each bank, which is at
    ``foot_height`` along the bank's axis and extends ``bank_half_width`` to either side. Above it the bank's walls,
    with the liners between them, carry the deck. Each main has a bulkhead above the axis and a housing of
    ``housing_thickness`` along the axis around its bore, ``housing_half_width`` wide to either side, ``housing_height``
    up and ``cap_depth`` down. ``head_mass`` is the mass of the head per cylinder, ``head_height`` its centre of mass
    above the deck. The last three fields control how the block is meshed and reduced.
    """

    youngs_modulus: q.Modulus
    poisson_ratio: q.PoissonRatio
    density: q.Density
    deck_height: q.Size
    deck_thickness: q.Length
    foot_height: q.Length
    bank_half_width: q.Length
    liner_thickness: q.Length
    crankcase_half_width: q.Length
    side_height: q.Length
    skirt_depth: q.Length
    wall_thickness: q.Length
    bulkhead_thickness: q.Length
    bulkhead_depth: q.Length
    housing_thickness: q.Length
    housing_half_width: q.Length
    housing_height: q.Length
    cap_depth: q.Length
    cover_thickness: q.Length
    pad_size: q.Length
    head_mass: q.Mass
    head_height: q.Length
    damping_ratio: q.DampingRatio
    mesh_size: q.Length
    fixed_modes: q.Modes
    running_cutoff_hz: q.Frequency

    @property
    def material(self) -> Material:
        """Material of block and cover."""
        return Material(self.youngs_modulus, self.poisson_ratio, self.density)


@dataclass(frozen=True, kw_only=True)
class Mounts:
    """Engine mounts: position, stiffness and damping along and about the engine's axes; one entry per mount.

    ``standing_mass``, ``standing_centre`` and ``standing_inertia`` are mass, centre (x, y, z) and inertia about it (xx,
    yy, zz, or also xy, xz, yz) of all that stands on the mounts: block, heads and what is bolted to them, such as a
    gearbox (kg, m, kg m²). Without them ``cranktrain mounts`` takes the block and heads of ``[block]``.
    """

    x: tuple[q.Offset, ...]
    y: tuple[q.Offset, ...]
    z: tuple[q.Offset, ...]
    stiffness_x: tuple[q.SupportStiffness, ...]
    stiffness_y: tuple[q.SupportStiffness, ...]
    stiffness_z: tuple[q.SupportStiffness, ...]
    stiffness_rx: tuple[q.SupportTorsionalStiffness, ...]
    stiffness_ry: tuple[q.SupportTorsionalStiffness, ...]
    stiffness_rz: tuple[q.SupportTorsionalStiffness, ...]
    damping_x: tuple[q.Damping, ...]
    damping_y: tuple[q.Damping, ...]
    damping_z: tuple[q.Damping, ...]
    damping_rx: tuple[q.TorsionalDamping, ...]
    damping_ry: tuple[q.TorsionalDamping, ...]
    damping_rz: tuple[q.TorsionalDamping, ...]
    standing_mass: q.Mass = 0.0
    standing_centre: tuple[q.Offset, ...] = ()
    standing_inertia: tuple[q.ProductOfInertia, ...] = ()

    @property
    def positions(self) -> tuple[tuple[float, float, float], ...]:
        """Position (x, y, z) of each mount, m."""
        return tuple(zip(self.x, self.y, self.z, strict=True))

    @property
    def stiffness(self) -> tuple[tuple[float, ...], ...]:
        """Stiffness of each mount along x, y, z (N/m) and about them (N m/rad)."""
        along = (self.stiffness_x, self.stiffness_y, self.stiffness_z)
        return tuple(zip(*along, self.stiffness_rx, self.stiffness_ry, self.stiffness_rz, strict=True))

    @property
    def damping(self) -> tuple[tuple[float, ...], ...]:
        """Damping of each mount along x, y, z (N s/m) and about them (N m s/rad)."""
        along = (self.damping_x, self.damping_y, self.damping_z)
        return tuple(zip(*along, self.damping_rx, self.damping_ry, self.damping_rz, strict=True))


@dataclass(frozen=True)
class Reduction:
    """Settings for the reduction of the finite-element crankshaft (counts, Hz).

    ``torsional_source`` is the source of the shaft stiffnesses of crank level ``torsional``: the ``solid`` body, free,
    ``solid-on-bearings`` at rest or ``solid-in-motion``, or the formulas ``ker-wilson`` and ``carter``, see
    :mod:`cranktrain.structure.crank.torsional`.
    """

    fixed_modes: q.Modes = 60
    running_cutoff_hz: q.Frequency = 3000.0
    consistent_mass: bool = True
    torsional_source: q.TorsionalSource = "solid"


@dataclass(frozen=True)
class Published:
    """Published results of the reference for this engine, shown next to ours; Hz and rad/s, 0 if not measured.

    No result is computed from them; only the valid range of a rigid crank and the listed orders use them.
    An engine without a reference has none.
    """

    free_torsional_hz: tuple[q.Frequency, ...] = ()
    cranktrain_hz: tuple[q.Frequency, ...] = ()
    cranktrain_shapes: tuple[str, ...] = ()
    measured_hz: tuple[q.Frequency, ...] = ()
    second_torsional_hz: q.Frequency = 0.0
    critical_orders: tuple[q.Order, ...] = ()
    critical_speeds: tuple[q.Speed, ...] = ()
    measured_critical_speeds: tuple[q.Speed, ...] = ()


USUAL_DAMPING, USUAL_REDUCTION, NOTHING_PUBLISHED = StructuralDamping(), Reduction(), Published()
"""Values of damping, reduction and published results for an engine file without these tables."""
