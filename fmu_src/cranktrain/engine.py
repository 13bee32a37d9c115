"""The engine as data: frozen dataclasses in SI, read from an engine file.

Angles are radians here; an engine file gives each value with its unit and its origin.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """Linear isotropic material (Pa, 1, kg/m³)."""

    youngs_modulus: float
    poisson_ratio: float
    density: float


@dataclass(frozen=True)
class Crankshaft:
    """Parametric crankshaft geometry, m and rad; one main journal more than there are throws."""

    throw: float
    throw_angles: tuple[float, ...]
    main_diameter: float
    main_widths: tuple[float, ...]
    pin_diameter: float
    pin_width: float
    web_thickness: float
    web_main_radius: float
    web_pin_radius: float
    counterweight_radius: float
    counterweight_half_width: float
    counterweights: tuple[bool, ...]
    nose_diameter: float
    nose_length: float
    flange_diameter: float
    flange_length: float
    fillet: float
    oil_hole_diameter: float
    oil_holes: bool
    mesh_size: float


@dataclass(frozen=True)
class LumpedInertia:
    """A rigid part fixed to an interface (kg, kg m², m); offset is along z from the interface to its centre of mass."""

    mass: float
    polar_inertia: float
    diametral_inertia: float
    offset: float


@dataclass(frozen=True)
class Rod:
    """Connecting rod: length, masses at big and small end, and the true inertia about its centre of mass."""

    length: float
    big_end_mass: float
    small_end_mass: float
    inertia: float


@dataclass(frozen=True)
class Cylinders:
    """Cylinders in the order of their numbers; angles rad, lengths m."""

    bore: float
    firing_order: tuple[int, ...]
    pins: tuple[int, ...]
    bank_angles: tuple[float, ...]
    piston_mass: float
    pin_offset: float
    compression_ratio: float


@dataclass(frozen=True)
class JournalBearing:
    """Plain bearing: film geometry, contact at the roughness height, and its linear stand-in (N/m, N s/m)."""

    diameter: float
    width: float
    clearance: float
    contact_height: float
    contact_pressure: float
    stiffness_x: float
    stiffness_y: float
    damping_x: float
    damping_y: float


@dataclass(frozen=True)
class ThrustBearing:
    """Axial bearing at one main journal; ``clearance`` is the total axial play.

    ``contact_stiffness`` is the closed bearing's collar and shells, ``block_stiffness`` the block's share in series with it.
    """

    main: int
    clearance: float
    inner_diameter: float
    outer_diameter: float
    pads: int
    pad_fraction: float
    taper: float
    contact_height: float
    contact_stiffness: float
    block_stiffness: float
    damping: float


@dataclass(frozen=True)
class Oil:
    """Lubricant: Vogel law η = a exp(b / (T − c)), and the oil temperature against engine speed (K, rad/s)."""

    density: float
    vogel_a: float
    vogel_b: float
    vogel_c: float
    temperature_speeds: tuple[float, ...]
    temperatures: tuple[float, ...]
    supply_pressure: float


@dataclass(frozen=True)
class DriveLine:
    """Connecting shaft from the flywheel to the dynamometer, whose speed is given."""

    stiffness: float
    damping: float
    speed_filter_time: float


@dataclass(frozen=True)
class StructuralDamping:
    """Damping of the elastic modes: one ratio for all (``modal``) or D = α M + β K (``rayleigh``; 1/s, s)."""

    kind: str
    ratio: float
    alpha: float
    beta: float


@dataclass(frozen=True)
class Combustion:
    """Single-zone closed cycle with a Wiebe burn; angles rad after firing top dead centre, pressures Pa, energy J."""

    start: float
    duration: float
    wiebe_a: float
    wiebe_m: float
    heat: float
    intake_pressure: float
    intake_temperature: float
    exhaust_pressure: float
    intake_closes: float
    exhaust_opens: float
    wall_temperature: float
    best_speed: float
    falloff: float


@dataclass(frozen=True)
class Reduction:
    """How the finite-element crankshaft is reduced (counts, Hz)."""

    fixed_modes: int
    running_cutoff_hz: float
    consistent_mass: bool


@dataclass(frozen=True)
class Published:
    """The reference's results for this engine, shown beside ours; Hz and rad/s. Nothing is computed from them."""

    free_torsional_hz: tuple[float, ...]
    cranktrain_hz: tuple[float, ...]
    cranktrain_shapes: tuple[str, ...]
    measured_hz: tuple[float, ...]
    second_torsional_hz: float
    critical_orders: tuple[float, ...]
    critical_speeds: tuple[float, ...]
    measured_critical_speeds: tuple[float, ...]


@dataclass(frozen=True)
class Engine:
    """One engine, complete."""

    name: str
    title: str
    material: Material
    crankshaft: Crankshaft
    flywheel: LumpedInertia
    pulley: LumpedInertia
    rod: Rod
    cylinders: Cylinders
    main_bearing: JournalBearing
    thrust: ThrustBearing
    oil: Oil
    drive_line: DriveLine
    damping: StructuralDamping
    combustion: Combustion
    reduction: Reduction
    published: Published

    @property
    def n_cylinders(self) -> int:
        """Number of cylinders."""
        return len(self.cylinders.firing_order)
