"""Optional equipment of a new engine: torsional damper, dual-mass flywheel, mounts with a block.

Damper. The first torsional mode of the cranktrain (beams, at rest, with the housing on the pulley) has the frequency f
and at the pulley the effective inertia I. The ring has μ I. Rubber is tuned by Den Hartog's rule for equal peaks,

    f_ring = f / (1 + μ),   k = μ I (2π f_ring)²

A viscous ring has Houdaille's damping (:mod:`cranktrain.studies.torsion.damper_optimum`) at a working amplitude and the
temperature of the rated speed: its oil is chosen for it.

Dual-mass flywheel. Primary and secondary mass share the flywheel's inertia. The springs are so soft that the mode in
which engine and secondary mass swing against each other lies at half the firing frequency of the lowest speed, well
below isolation, which begins at 1/√2 of it. A soft shaft behind holds the gearbox.

Sources: J. P. Den Hartog, Mechanical Vibrations (1956), sections 3.3 and 3.4; Shin-Etsu, KF-96 (silicone oils).
"""

import math
from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.units import RPM
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Damper
from cranktrain.loads.damper import damper_parameters, equivalent_damping
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.crank.level import bare_crank
from cranktrain.studies.design.document import Block, Document, Entry, chosen, derived
from cranktrain.studies.design.fitting import STEEL, crank_inertia
from cranktrain.studies.design.sizes import Sizes
from cranktrain.studies.torsion.damper_optimum import houdaille_optimum
from cranktrain.studies.torsion.housed_crank import housed_crank

SHARES = {"rubber": 0.25, "viscous": 0.7}
"""Inertia of the damper's ring over the effective inertia of the first torsional mode, by kind of damper; chosen from
usual ranges 0.2 to 0.4 (rubber) and 0.5 to 1 (viscous)."""
HOUSING = 0.3
"""Inertia of a viscous damper's housing over the inertia of its ring; chosen."""
LOSS_FACTOR = 0.25
"""Loss factor of the rubber; chosen, natural rubber and EPDM of dampers have 0.1 to 0.35."""
RING_RADIUS = {"rubber": (0.62, 0.85), "viscous": (0.68, 1.08)}
"""Inner and outer radius of the damper's ring over the cylinder bore, by kind of damper; chosen."""
GAP = 4e-3
"""Gaps of a viscous damper over the cylinder bore; chosen, 0.4 mm for a bore of 100 mm."""
AMPLITUDE = math.radians(0.1)
"""Twist of a viscous damper for which its oil is chosen, rad."""
HOT, AMBIENT = 363.15, 323.15
"""Temperature of a damper at the rated speed, and of the air around it, K."""
OIL_SLOPE, OIL_STRESS, OIL_EXPONENT = 1757.0, 4.0e4, 0.3
STIFFEST_OIL = 970.0
"""Viscosity at 25 degC of silicone oil of 1 000 000 mm²/s, Pa s."""
ROUNDS = 6
NEAR = 0.12
"""Relative distance from the first torsional frequency within which other modes count as part of this mode."""
COOLING = 80.0
"""Heat transfer coefficient of a damper rotating in air, W/(m² K)."""
SECONDARY = 0.5
"""Inertia of the secondary mass of a dual-mass flywheel over that of the whole flywheel; chosen."""
BELOW_FIRING = 0.5
"""Natural frequency of a dual-mass flywheel over the firing frequency at the lowest speed; chosen."""
HELD = 0.5
"""Stiffness of the shaft behind a dual-mass flywheel over the stiffness of the flywheel's springs; chosen."""
WIDEST_TWIST = math.radians(70.0)
"""Largest twist of bow springs under the full-load torque, rad; the springs' channels limit it."""


def damper(s: Sizes, engine: Engine, kind: str) -> Block:
    """Table of a damper fitted to the first torsional mode; ``InputError`` if a ring hardly affects this mode."""
    share, (inner, outer) = SHARES[kind], RING_RADIUS[kind]
    housing = HOUSING if kind == "viscous" else 0.0
    body = bare_crank(engine, "beam")
    gyration = math.sqrt(0.5 * (inner**2 + outer**2)) * s.bore
    ring, hz, inertia = 0.1 * STEEL * s.bore**5, 0.0, 0.0
    # The ring's inertia is iterated, because housing and ring change the mode whose inertia determines them.
    for _ in range(ROUNDS):
        mass = ring / gyration**2 * (1.0 + housing)
        trial = Damper(kind="linear", ring_inertia=ring, housing_inertia=housing * ring, mass=mass, damping=1.0)
        hz, inertia = _torsion(replace(engine, damper=trial), body)
        ring = share * inertia
    area = 2.0 * math.pi * outer * (outer + 0.3) * s.bore**2
    mode = f"effective inertia at the pulley, {inertia:.3g} kg m^2, of the first torsional mode"
    own = _rubber(ring, hz, share) if kind == "rubber" else _viscous(s, ring, hz, share)
    return Block("damper", "A run uses the damper only when asked to (--damper); the pulley above is without it.", (
        chosen("kind", kind, "", "viscous or rubber"),
        derived("ring_inertia", ring, "kg m^2", f"{share:g} of the {mode}"),
        *((derived("housing_inertia", housing * ring, "kg m^2", f"{housing:g} of the ring's"),) if housing else ()),
        derived("mass", mass, "kg", f"ring from {inner:g} to {outer:g} B{', and its housing' if housing else ''}"),
        derived("frequency", hz, "Hz", "first torsional mode without the ring (beams, at rest)"),
        *own,
        chosen("lowest_temperature", -25.0, "degC", "from here the law is taken to hold"),
        chosen("highest_temperature", 150.0 if kind == "viscous" else 110.0, "degC", "what oil or rubber lasts at"),
        derived("temperature_speeds", (s.lowest / RPM, s.rated / RPM), "rev/min", "lowest and rated speed"),
        chosen("temperatures", (65.0, HOT - 273.15), "degC", "at those speeds, linear between"),
        chosen("ambient_temperature", AMBIENT - 273.15, "degC", "air around it, for the heat balance"),
        chosen("heat_transfer", COOLING, "W/(m^2 K)", "turning in air, for the heat balance"),
        derived("cooling_area", area, "m^2", f"outside of a disc {outer:g} B in radius and 0.3 B wide"),
        chosen("power_limit", 5.0, "kW/m^2", "dissipated power per cooling area, warned of above"),
    ))  # fmt: skip


def _torsion(engine: Engine, body: ReducedBody) -> tuple[float, float]:
    """Frequency, Hz, and effective inertia at the pulley, kg m², of the first torsional mode and bending modes near it.

    Modes that lie close share the rotation of the pulley, Σ h², in parts that a small change moves to and fro; their
    sum does not change.
    """
    crank = housed_crank(engine, body)
    turn = (crank.hub @ crank.shapes) ** 2
    mode = float(crank.omega[crank.torsional[0]])
    near = np.abs(crank.omega / mode - 1.0) < NEAR
    whole = float(turn[near].sum())
    return math.sqrt(float(turn[near] @ crank.omega[near] ** 2) / whole) / (2.0 * math.pi), 1.0 / whole


def _rubber(ring: float, hz: float, share: float) -> tuple[Entry, ...]:
    """Spring and loss factor of a rubber damper."""
    tuned = hz / (1.0 + share)
    return (
        derived("stiffness", ring * (2.0 * math.pi * tuned) ** 2, "N m/rad", f"ring on its rubber at {tuned:.4g} Hz: "
                "mode over 1 + ring share, for equal peaks (Den Hartog, 3.3)"),
        chosen("loss_factor", LOSS_FACTOR, "1", "rubber has 0.1 to 0.35; both peaks would be least at "
               f"{math.sqrt(1.5 * share / (1.0 + share)):.2f}"),
    )  # fmt: skip


def _viscous(s: Sizes, ring: float, hz: float, share: float) -> tuple[Entry, ...]:
    """Ring, gaps and silicone oil of a viscous damper with Houdaille's optimum damping at its working amplitude."""
    damping = 4.0 * math.pi * hz * ring / share * houdaille_optimum(share).damping_ratio
    inner, outer = (radius * s.bore for radius in RING_RADIUS["viscous"])
    width = ring / (0.5 * math.pi * STEEL * (outer**4 - inner**4))
    gap = GAP * s.bore
    made = Damper(
        kind="viscous", ring_inertia=ring, mass=1.0, frequency=hz, lowest_temperature=248.15,
        highest_temperature=423.15, temperature_speeds=(1.0,), temperatures=(HOT,), ambient_temperature=AMBIENT,
        heat_transfer=COOLING, cooling_area=1.0, power_limit=1.0, viscosity=1.0, viscosity_slope=OIL_SLOPE,
        critical_stress=OIL_STRESS, flow_exponent=OIL_EXPONENT, ring_outer_radius=outer, ring_inner_radius=inner,
        ring_width=width, axial_gap=gap, outer_gap=gap, inner_gap=gap,
    )  # fmt: skip
    rate, low, high = 2.0 * math.pi * hz * AMPLITUDE, 1.0, STIFFEST_OIL

    def reached(viscosity: float) -> float:
        return equivalent_damping(damper_parameters(replace(made, viscosity=viscosity), HOT), rate)

    if reached(high) < damping:
        raise InputError(
            f"--damper viscous: the first torsional mode, {hz:.0f} Hz, needs {damping:.3g} N m s/rad, more than "
            "silicone oil gives in the usual gaps; a crank so stiff needs no damper, or take --damper rubber"
        )
    for _ in range(60):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if reached(middle) < damping else (low, middle)
    note = f"thin gap, {GAP:g} B"
    return (
        chosen("law", "shear-thinning", "", "newtonian, shear-thinning or complex-modulus"),
        derived("viscosity", high, "Pa s", f"at 25 degC without shear; Houdaille's {damping:.3g} N m s/rad at a "
                f"twist of {math.degrees(AMPLITUDE):g} deg and {HOT - 273.15:.0f} degC, see cranktrain damper-optimum"),
        chosen("viscosity_slope", OIL_SLOPE, "K", "dimethyl silicone (Shin-Etsu, KF-96)"),
        chosen("critical_stress", OIL_STRESS, "Pa", "a fifth of the rubber plateau of dimethyl silicone"),
        chosen("flow_exponent", OIL_EXPONENT, "1", "Carreau's n; silicone oils of high viscosity have 0.2 to 0.5"),
        derived("ring_outer_radius", 1e3 * outer, "mm", f"{RING_RADIUS['viscous'][1]:g} B"),
        derived("ring_inner_radius", 1e3 * inner, "mm", f"{RING_RADIUS['viscous'][0]:g} B"),
        derived("ring_width", 1e3 * width, "mm", "of a steel ring of these radii and the inertia"),
        *(derived(f"{where}_gap", 1e3 * gap, "mm", note) for where in ("axial", "outer", "inner")),
    )  # fmt: skip


def with_dual_mass(made: Document, s: Sizes) -> Document:
    """Engine file with a dual-mass flywheel in place of its flywheel; ``InputError`` if no springs fit."""
    engine = made.engine
    whole, secondary = engine.flywheel, SECONDARY * engine.flywheel.polar_inertia
    front = crank_inertia(s, engine) + engine.pulley.polar_inertia + whole.polar_inertia - secondary
    firing = s.lowest / (2.0 * math.pi) * engine.firings
    unit = np.array([[1.0, -1.0], [-1.0, 1.0 + HELD]])
    squares = eigh(unit, np.diag([front, secondary]), eigvals_only=True)
    springs = (2.0 * math.pi * BELOW_FIRING * firing) ** 2 / float(squares[1])
    torque = GasTrace.from_engine(engine).imep * engine.displacement / (4.0 * math.pi)
    if torque > springs * WIDEST_TWIST:
        raise InputError(
            f"--flywheel dual-mass: springs below the {firing:.3g} Hz of the firings at {s.lowest / RPM:.0f} rev/min "
            f"would twist by {math.degrees(torque / springs):.0f} deg under the full load's {torque:.3g} N m; bow "
            f"springs have {math.degrees(WIDEST_TWIST):.0f} deg. Take more cylinders, or leave the option out"
        )
    left = 1.0 - SECONDARY
    part = f"{left:g} of the whole flywheel; the secondary mass is in [drive_line_chain]"
    entries = tuple(
        derived(entry.key, left * entry.value, entry.unit, f"{part}. Whole: {entry.note}")
        if entry.unit != "mm" else entry
        for block in made.blocks if block.name == "flywheel" for entry in block.entries
    )  # fmt: skip
    ring = f"{math.radians(springs):.3g} N m/deg; engine and secondary mass swing at {BELOW_FIRING * firing:.3g} Hz, "
    ring += f"{BELOW_FIRING:g} of the firings at {s.lowest / RPM:.0f} rev/min; full load twists by "
    ring += f"{math.degrees(torque / springs):.0f} deg; the shaft behind has {HELD:g} of it and holds the gearbox"
    own = 0.02 * springs / (2.0 * math.pi * BELOW_FIRING * firing)
    damping = [own, 0.6 * math.sqrt(HELD * springs * (front + secondary))]
    return made.with_blocks(
        Block("flywheel", "Primary mass of the dual-mass flywheel, a disc on the crank's flange.", entries),
        Block("drive_line_chain", "Bow springs drive the secondary mass; a soft shaft leads to the dynamometer.", (
            chosen("discs", ["secondary"], "", "with clutch and gearbox input"),
            derived("inertias", [secondary], "kg m^2", f"{SECONDARY:g} of the whole flywheel"),
            chosen("starts", ["flywheel", "secondary"], "", "of the shafts"),
            chosen("ends", ["secondary", "dynamometer"], "", "of the shafts"),
            derived("stiffnesses", [springs, HELD * springs], "N m/rad", ring),
            derived("dampings", damping, "N m s/rad", "springs: loss factor 0.02 at the mode; shaft: 0.3 of critical"),
            derived("frictions", [0.05 * torque, 0.0], "N m", "bow springs in their channel: 0.05 of full load"),
        )),
    )  # fmt: skip
