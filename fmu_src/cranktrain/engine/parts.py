"""The parts of an engine as data: frozen dataclasses in SI, one for each table of an engine file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import accumulate

from cranktrain.engine.quantities import (
    AddedInertia,
    Angle,
    Area,
    Clearance,
    Damping,
    Density,
    Energy,
    Frequency,
    GaugePressure,
    HeatCapacity,
    HeatFlux,
    HeatTransfer,
    Inertia,
    KinematicViscosity,
    Length,
    Mass,
    Number,
    Offset,
    Pressure,
    PressureCoefficient,
    Rate,
    Share,
    Speed,
    Stiffness,
    SupportStiffness,
    SupportTorsionalStiffness,
    Temperature,
    TemperatureDifference,
    Time,
    TorsionalDamping,
    TorsionalStiffness,
    Velocity,
    Viscosity,
)

SHELL_SHARE = 0.03
"""Thickness of a plain bearing's shell over its diameter; chosen."""
RING_SHARE = 0.5
"""Thickness of a roller bearing's outer ring over the diameter of its rollers; chosen."""


@dataclass(frozen=True)
class Material:
    """Linear isotropic material (Pa, 1, kg/m³)."""

    youngs_modulus: Pressure
    poisson_ratio: Number
    density: Density


@dataclass(frozen=True)
class Crankshaft:
    """Parametric crankshaft geometry, m and rad; one main journal more than there are throws."""

    throw: Length
    throw_angles: tuple[Angle, ...]
    main_diameter: Length
    main_widths: tuple[Length, ...]
    pin_diameter: Length
    pin_width: Length
    web_thickness: Length
    web_main_radius: Length
    web_pin_radius: Length
    counterweight_radius: Length
    counterweight_half_width: Length
    counterweights: tuple[bool, ...]
    nose_diameter: Length
    nose_length: Length
    flange_diameter: Length
    flange_length: Length
    fillet: Length
    oil_hole_diameter: Length
    oil_holes: bool
    mesh_size: Length

    @property
    def main_positions(self) -> tuple[float, ...]:
        """Middle of each main journal along z, m; 0 for the first."""
        throw = 2.0 * self.web_thickness + self.pin_width
        pitches = (0.5 * (a + b) + throw for a, b in zip(self.main_widths, self.main_widths[1:], strict=False))
        return tuple(accumulate(pitches, initial=0.0))

    @property
    def pin_positions(self) -> tuple[float, ...]:
        """Middle of each pin along z, m."""
        ends = (z + 0.5 * width for z, width in zip(self.main_positions, self.main_widths, strict=True))
        return tuple(end + self.web_thickness + 0.5 * self.pin_width for end in ends)[: len(self.throw_angles)]


@dataclass(frozen=True)
class LumpedInertia:
    """A rigid part fixed to an interface (kg, kg m², m); offset is along z from the interface to its centre of mass."""

    mass: Mass
    polar_inertia: Inertia
    diametral_inertia: Inertia
    offset: Offset


@dataclass(frozen=True)
class BalanceWeights:
    """Heavy inserts and weights at the webs beside main journals, as point masses that turn with the crankshaft.

    One entry per weight: number of the main journal, mass, distance from the axis, angle as a throw's, and place along
    z from the journal's middle (kg, m, rad).
    """

    mains: tuple[int, ...]
    masses: tuple[Mass, ...]
    radii: tuple[Length, ...]
    angles: tuple[Angle, ...]
    offsets: tuple[Offset, ...]


@dataclass(frozen=True)
class Rod:
    """Connecting rod: length, masses at big and small end, and the true inertia about its centre of mass."""

    length: Length
    big_end_mass: Mass
    small_end_mass: Mass
    inertia: Inertia


@dataclass(frozen=True)
class Cylinders:
    """Cylinders in the order of their numbers; angles rad, lengths m.

    ``bank_angles`` turn from the vertical in the sense of rotation. ``rod_offsets`` are the places along z of the rods'
    middles from the middles of their pins; all 0 where the tuple is empty.
    """

    bore: Length
    firing_order: tuple[int, ...]
    pins: tuple[int, ...]
    bank_angles: tuple[Angle, ...]
    piston_mass: Mass
    pin_offset: Offset
    compression_ratio: Number
    rod_offsets: tuple[Offset, ...] = ()


@dataclass(frozen=True, kw_only=True)
class PlainBearing:
    """Plain bearing: film geometry, and contact of its rough surfaces.

    Level ``impedance`` takes ``contact_height`` and ``contact_pressure``; the levels above it take the surfaces as
    Greenwood and Tripp do: ``roughness`` σ of both together, ``asperity_factor`` ηβσ, ``asperity_ratio`` σ/β,
    ``contact_modulus`` E' and boundary friction (coefficient on the contact pressure, stress on the real contact).
    ``groove`` is ``none`` or ``circumferential``. Level ``ehd`` follows the oil from a supply at ``supply_pressure``:
    the groove, or one in mid-bore that is ``supply_arc`` long and ``supply_width`` wide about ``supply_angle`` (from
    the x axis in the sense of rotation); as it comes, the upper half.
    """

    diameter: Length
    width: Length
    clearance: Length
    contact_height: Length
    contact_pressure: Pressure
    groove: str = "none"
    roughness: Length = 0.4e-6
    asperity_factor: Share = 0.05
    asperity_ratio: Share = 0.01
    contact_modulus: Pressure = 58.6e9
    boundary_friction: Number = 0.1
    boundary_shear: GaugePressure = 0.0
    supply_pressure: GaugePressure = 4.0e5
    supply_angle: Angle = 0.5 * math.pi
    supply_arc: Angle = math.pi
    supply_width: Length = 4.0e-3


@dataclass(frozen=True, kw_only=True)
class JournalBearing(PlainBearing):
    """Main bearing: a plain bearing and its linear stand-in (N/m, N s/m)."""

    stiffness_x: Stiffness
    stiffness_y: Stiffness
    damping_x: Damping
    damping_y: Damping


@dataclass(frozen=True, kw_only=True)
class RollerBearings:
    """Cylindrical roller bearings of the mains: one value per main journal, from the pulley to the flywheel (SI).

    ``rollers`` on a circle of ``pitch_diameter``, their effective ``roller_length``; ``clearance`` is the diametral
    radial clearance of the standards (play from side to side), ``profile`` the parameter p of the rollers' logarithmic
    profile (0: straight), see :mod:`cranktrain.film.laws.roller_contacts`. ``stiffness`` (N/m) and ``tilt_stiffness``
    (N m/rad) are the linear stand-ins, ``damping`` (N s/m) and ``tilt_damping`` (N m s/rad) act with every law.
    ``ring_mass`` is the outer ring's. Level ``roller`` follows ``law``: ``linear``, ``palmgren`` or ``iso16281``; with
    ``variable`` the rollers go round with their cage, else they stand still, the first one straight below the journal.
    """

    rollers: tuple[int, ...]
    roller_diameter: tuple[Length, ...]
    roller_length: tuple[Length, ...]
    pitch_diameter: tuple[Length, ...]
    clearance: tuple[Clearance, ...]
    stiffness: tuple[Stiffness, ...]
    tilt_stiffness: tuple[TorsionalStiffness, ...]
    damping: tuple[Damping, ...]
    tilt_damping: tuple[TorsionalDamping, ...]
    ring_mass: tuple[Mass, ...]
    profile: tuple[Number, ...]
    law: str = "palmgren"
    variable: bool = False


@dataclass(frozen=True)
class ThrustBearing:
    """Axial bearing at one main journal; ``clearance`` is the total axial play.

    ``contact_stiffness`` is the closed bearing's collar and shells, ``block_stiffness`` the block's share in series.
    """

    main: int
    clearance: Length
    inner_diameter: Length
    outer_diameter: Length
    pads: int
    pad_fraction: Number
    taper: Length
    contact_height: Length
    contact_stiffness: Stiffness
    block_stiffness: Stiffness
    damping: Damping


@dataclass(frozen=True, kw_only=True)
class Oil:
    """Lubricant: viscosity against temperature and pressure, and the oil temperature against engine speed (K, rad/s).

    ``law`` is ``vogel``, η = a exp(b / (T − c)), or ``walther`` through two points of kinematic viscosity.
    ``pressure_law`` is ``none``, ``barus`` or ``roelands``, with the slope of ln η at ambient pressure
    ``pressure_viscosity``. ``heat_share`` is the part of a film's friction that its oil carries away.
    """

    density: Density
    temperature_speeds: tuple[Speed, ...]
    temperatures: tuple[Temperature, ...]
    supply_pressure: GaugePressure
    law: str = "vogel"
    vogel_a: Viscosity = 0.0
    vogel_b: TemperatureDifference = 0.0
    vogel_c: Temperature = 0.0
    walther_temperatures: tuple[Temperature, ...] = ()
    walther_viscosities: tuple[KinematicViscosity, ...] = ()
    pressure_law: str = "none"
    pressure_viscosity: PressureCoefficient = 0.0
    heat_capacity: HeatCapacity = 2000.0
    heat_share: Share = 0.8


@dataclass(frozen=True, kw_only=True)
class PistonGuidance:
    """How a piston is carried across its cylinder: two layers of springs between skirt and liner.

    Heights are those above the pin; ``mass_height`` is that of the piston's centre of mass, ``tilt_inertia`` the moment
    of inertia about an axis through it along the crank. ``clearance`` is the skirt's radial play, 0 for springs without
    it; ``friction`` a coefficient on the side forces, full above ``sliding_speed``.
    """

    upper_stiffness: Stiffness
    lower_stiffness: Stiffness
    upper_height: Offset
    lower_height: Offset
    upper_damping: Damping
    lower_damping: Damping
    mass_height: Offset
    tilt_inertia: Inertia
    clearance: Clearance = 0.0
    friction: Number = 0.0
    sliding_speed: Velocity = 0.1


@dataclass(frozen=True)
class DriveLine:
    """Connecting shaft from the flywheel to the dynamometer, whose speed is given, or which a torque loads.

    ``dynamometer_inertia`` counts where the load torque is given; a given speed needs none.
    """

    stiffness: TorsionalStiffness
    damping: TorsionalDamping
    speed_filter_time: Time
    dynamometer_inertia: Inertia = 2.0


@dataclass(frozen=True, kw_only=True)
class Damper:
    """Torsional damper on the pulley: a ring that a fluid or rubber couples to its housing (SI).

    ``kind`` is ``viscous`` or ``rubber``. ``mass`` is that of housing and ring, which the pulley carries;
    ``housing_inertia`` turns with the pulley. A silicone fluid of ``viscosity`` at 25 °C fills the gaps at the ring's
    two faces (``axial_gap``) and at its outer and inner cylinder; its ``law`` is ``newtonian``, ``shear-thinning`` or
    ``complex-modulus``, see :mod:`cranktrain.loads.damper`, with ln η falling by ``viscosity_slope`` over 1/T. Complex
    modulus and rubber are linearised at ``frequency``. A law holds between ``lowest_temperature`` and
    ``highest_temperature``; the damper is as warm as ``temperatures`` say over ``temperature_speeds``, or as its heat
    balance with ``heat_transfer`` from ``cooling_area`` to ``ambient_temperature`` makes it. It should not dissipate
    more than ``power_limit`` per cooling area.
    """

    kind: str
    ring_inertia: Inertia
    housing_inertia: AddedInertia
    mass: Mass
    frequency: Frequency
    lowest_temperature: Temperature
    highest_temperature: Temperature
    temperature_speeds: tuple[Speed, ...]
    temperatures: tuple[Temperature, ...]
    ambient_temperature: Temperature
    heat_transfer: HeatTransfer
    cooling_area: Area
    power_limit: HeatFlux
    law: str = "shear-thinning"
    viscosity: Viscosity = 0.0
    viscosity_slope: TemperatureDifference = 0.0
    critical_stress: Pressure = 0.0
    flow_exponent: Share = 0.0
    ring_outer_radius: Length = 0.0
    ring_inner_radius: Length = 0.0
    ring_width: Length = 0.0
    axial_gap: Length = 0.0
    outer_gap: Length = 0.0
    inner_gap: Length = 0.0
    stiffness: TorsionalStiffness = 0.0
    loss_factor: Share = 0.0


@dataclass(frozen=True)
class StructuralDamping:
    """Damping of the elastic modes: one ratio for all (``modal``) or D = α M + β K (``rayleigh``; 1/s, s)."""

    kind: str
    ratio: Number
    alpha: Rate
    beta: Time


@dataclass(frozen=True)
class Combustion:
    """Single-zone closed cycle with a Wiebe burn; angles rad after firing top dead centre, pressures Pa, energy J."""

    start: Angle
    duration: Angle
    wiebe_a: Number
    wiebe_m: Number
    heat: Energy
    intake_pressure: Pressure
    intake_temperature: Temperature
    exhaust_pressure: Pressure
    intake_closes: Angle
    exhaust_opens: Angle
    wall_temperature: Temperature
    best_speed: Speed
    falloff: Number


@dataclass(frozen=True, kw_only=True)
class Block:
    """Engine block of one casting with its bottom cover, and the heads on it (m, Pa, kg/m³, kg, Hz).

    Heights are measured from the crank axis. The crankcase has upright walls ``crankcase_half_width`` to either side
    from ``skirt_depth`` below to ``side_height`` above; from there they rise to the foot of each bank, ``foot_height``
    along the bank's axis and ``bank_half_width`` to either side. Above it the bank's walls, with the liners between
    them, carry the deck. Each main has a bulkhead above the axis and a housing of ``housing_thickness`` along the axis
    around its bore, ``housing_half_width`` wide to either side, ``housing_height`` up and ``cap_depth`` down.
    ``head_mass`` is the head's share of one cylinder, ``head_height`` its centre of mass above the deck. The last three
    say how the block is meshed and reduced.
    """

    youngs_modulus: Pressure
    poisson_ratio: Number
    density: Density
    deck_height: Length
    deck_thickness: Length
    foot_height: Length
    bank_half_width: Length
    liner_thickness: Length
    crankcase_half_width: Length
    side_height: Length
    skirt_depth: Length
    wall_thickness: Length
    bulkhead_thickness: Length
    bulkhead_depth: Length
    housing_thickness: Length
    housing_half_width: Length
    housing_height: Length
    cap_depth: Length
    cover_thickness: Length
    pad_size: Length
    head_mass: Mass
    head_height: Length
    damping_ratio: Number
    mesh_size: Length
    fixed_modes: int
    running_cutoff_hz: Frequency

    @property
    def material(self) -> Material:
        """Material of block and cover."""
        return Material(self.youngs_modulus, self.poisson_ratio, self.density)


@dataclass(frozen=True, kw_only=True)
class Mounts:
    """Engine mounts: place of each, stiffness and damping along and about the engine's axes; one entry per mount."""

    x: tuple[Offset, ...]
    y: tuple[Offset, ...]
    z: tuple[Offset, ...]
    stiffness_x: tuple[SupportStiffness, ...]
    stiffness_y: tuple[SupportStiffness, ...]
    stiffness_z: tuple[SupportStiffness, ...]
    stiffness_rx: tuple[SupportTorsionalStiffness, ...]
    stiffness_ry: tuple[SupportTorsionalStiffness, ...]
    stiffness_rz: tuple[SupportTorsionalStiffness, ...]
    damping_x: tuple[Damping, ...]
    damping_y: tuple[Damping, ...]
    damping_z: tuple[Damping, ...]
    damping_rx: tuple[TorsionalDamping, ...]
    damping_ry: tuple[TorsionalDamping, ...]
    damping_rz: tuple[TorsionalDamping, ...]

    @property
    def positions(self) -> tuple[tuple[float, float, float], ...]:
        """Place (x, y, z) of each mount, m."""
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
    """How the finite-element crankshaft is reduced (counts, Hz).

    ``torsional_source`` says where crank level ``torsional`` has its shaft stiffnesses from: the ``solid`` body, free
    or ``solid-on-bearings``, or the formulas ``ker-wilson`` and ``carter``, see
    :mod:`cranktrain.structure.crank.torsional`.
    """

    fixed_modes: int
    running_cutoff_hz: Frequency
    consistent_mass: bool
    torsional_source: str = "solid"


@dataclass(frozen=True)
class Published:
    """The reference's results for this engine, shown beside ours; Hz and rad/s, 0 where nothing was measured.

    Nothing is computed from them.
    """

    free_torsional_hz: tuple[Frequency, ...]
    cranktrain_hz: tuple[Frequency, ...]
    cranktrain_shapes: tuple[str, ...]
    measured_hz: tuple[Frequency, ...]
    second_torsional_hz: Frequency
    critical_orders: tuple[Number, ...]
    critical_speeds: tuple[Speed, ...]
    measured_critical_speeds: tuple[Speed, ...]
