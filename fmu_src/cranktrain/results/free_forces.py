"""Free forces and moments of an engine's moving masses by order, with its parts rigid and its speed constant.

The force of a mass on its engine is minus the rate of its momentum. With the position x(θ) of a mass m at crank angle θ
and speed Ω, F = −m Ω² d²x/dθ². An order k of x, X_k, gives m k² Ω² X_k. Positions are those of the exact slider-crank
with offsets and articulated rods, so all orders are included and not only the first two of its series. Small end and
piston move along their cylinder, the big end moves with its pin. Crank and counterweights rotate, and so do rigid
bodies in rotating frames, at the order of their gear ratio. Moments are those of the forces about the middle of the
main journals, across the crank. Source: F. Köhler and H. Flierl, *Verbrennungsmotoren*, chapter on mass balance.
"""

import cmath
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.engine.additions import BodyTable, FrameTable
from cranktrain.engine.articulated_rod import piston_height, rod_end, rods_of
from cranktrain.engine.model import Engine
from cranktrain.results.columns import NOTHING
from cranktrain.results.tables import Table
from cranktrain.structure.crank.sections import crank_moments

HIGHEST_ORDER = 12
SAMPLES = 360
"""Number of crank angles of a revolution at which positions are evaluated; it resolves orders up to half of it."""
LEAST = 1.0e-6
"""Fraction of the sum of all orders of all single masses, above which an order is listed."""

ROUNDING = 1.0e-12
"""Components below this fraction of the sum of all orders of single masses are rounding errors and set to 0."""

Complex = NDArray[np.complex128]


def free_forces(engine: Engine, speed: float) -> dict[str, Any]:
    """Free forces (N) and moments (N m) at a speed (rad/s); keys carry units.

    ``orders`` has one entry per unbalanced order: ``force_n`` and ``moment_nm`` are the largest magnitudes over a
    revolution, the other keys amplitudes of components. A moment about x comes from forces along y. Added bodies that
    are elastic or move with a rod are not included; ``left_out`` names them.
    """
    place = np.array(engine.crankshaft.main_positions)
    middle = 0.5 * float(place[0] + place[-1])
    forces, size, left_out = mass_forces(engine, middle)
    size = speed**2 * size
    rows = []
    for order in range(1, HIGHEST_ORDER + 1):
        exact = zip(speed**2 * forces[order], size, strict=True)
        force, moment = (np.where(np.abs(one) > ROUNDING * of, one, 0.0) for one, of in exact)
        if largest(force) > LEAST * size[0] or largest(moment) > LEAST * size[1]:
            (x, y), (across, up) = np.abs(force).tolist(), np.abs(moment).tolist()
            rows.append({
                "order": order, "force_n": largest(force), "force_x_n": x, "force_y_n": y,
                "moment_nm": largest(moment), "moment_x_nm": up, "moment_y_nm": across,
            })  # fmt: skip
    return {"speed_rpm": speed / RPM, "about_z_m": middle, "left_out": left_out, "orders": rows}


def mass_forces(engine: Engine, middle: float) -> tuple[Complex, Array, list[str]]:
    """Free forces and their moments over Ω² by order, about a position z = ``middle`` (m) of the crank's axis.

    Returns
    -------
    amplitudes a of Re[a exp(ikθ)] for orders k = 0 to :data:`HIGHEST_ORDER` (k, 2, 2): forces along x and y in kg m,
    and the sums of both times the distance along z in kg m²; sums of magnitudes (2,) of all single masses; names of
    bodies that are not included
    """
    forces, size = _reciprocating(engine, middle)
    turning, more = _turning(engine, middle)
    forces[1] += turning
    left_out = []
    for body in engine.body:
        own = _added(engine, body, middle)
        if own is None or own[0] > HIGHEST_ORDER:
            left_out.append(body.name)
        else:
            forces[own[0]] += own[1]
            more += np.abs(own[1]).sum(axis=1)
    return forces, size + more, left_out


def free_force_table(found: Mapping[str, Any]) -> Table:
    """Table of free forces and moments by order."""
    header = ("order", "force / N", "across / N", "up / N", "moment / N m", "pitching / N m", "yawing / N m")
    keys = ("force_n", "force_x_n", "force_y_n", "moment_nm", "moment_x_nm", "moment_y_nm")
    rows = tuple(
        (f"{row['order']}", *(f"{row[key]:.4g}" if row[key] else NOTHING for key in keys)) for row in found["orders"]
    )
    title = f"Free forces and moments of the masses at {found['speed_rpm']:.0f} rev/min, largest and by component"
    return Table(title, header, rows)


def largest(resultant: Complex) -> float:
    """Largest magnitude over θ of Re[a exp(iθ)] for a plane vector a, the semi-major axis of its ellipse."""
    square: Array = np.abs(resultant) ** 2
    return math.sqrt(0.5 * (float(square.sum()) + abs(complex((resultant**2).sum()))))


def _reciprocating(engine: Engine, middle: float) -> tuple[Complex, Array]:
    """Forces and moments over Ω² of pistons and rods by order (0 to highest, 2, 2), and sums of magnitudes (2,)."""
    angle: Array = np.arange(SAMPLES, dtype=np.float64) * (2.0 * math.pi / SAMPLES)
    found = np.zeros((HIGHEST_ORDER + 1, 2, 2), dtype=np.complex128)
    size = np.zeros(2)
    square = np.arange(HIGHEST_ORDER + 1) ** 2
    for c, (rod, bank, z) in enumerate(
        zip(rods_of(engine), engine.cylinders.bank_angles, engine.cylinder_positions, strict=True)
    ):
        aside, up = np.array([math.cos(bank), math.sin(bank)]), np.array([-math.sin(bank), math.cos(bank)])
        end, height = rod_end(engine, c, angle), piston_height(engine, c, angle)[0]
        along = (engine.cylinders.piston_mass + rod.small_end_mass) * height + rod.big_end_mass * end.y
        across = rod.big_end_mass * end.x
        momentum = along[:, None] * up + across[:, None] * aside
        orders = (2.0 / SAMPLES) * np.fft.rfft(momentum, axis=0)[: HIGHEST_ORDER + 1]
        own = square[:, None] * orders
        found += own[:, None, :] * np.array([1.0, z - middle])[:, None]
        size += np.abs(own).sum() * np.array([1.0, abs(engine.crankshaft.main_positions[-1])])
    return found, size


def _turning(engine: Engine, middle: float) -> tuple[Complex, Array]:
    """Force and moment over Ω² (2, 2) of crank, counterweights and balance weights in order 1, and magnitudes (2,)."""
    moments = crank_moments(engine)
    first = complex(moments[0, 1], moments[0, 2])
    second = complex(moments[3, 1], moments[3, 2]) - middle * first
    if (w := engine.balance_weights) is not None:
        for main, mass, radius, angle, z in zip(w.mains, w.masses, w.radii, w.angles, w.offsets, strict=True):
            own = mass * radius * 1j * cmath.exp(1j * angle)
            first += own
            second += own * (engine.crankshaft.main_positions[main - 1] + z - middle)
    found = np.array([turning(first), turning(second)])
    return found, np.abs(found).sum(axis=1)


def turning(static: complex, forward: bool = True) -> Complex:
    """Amplitudes a along x and y of a vector x + iy that rotates by exp(iθ) or exp(−iθ), which equals Re[a exp(iθ)]."""
    return np.array([static, -1j * static]) if forward else np.array([static.conjugate(), 1j * static.conjugate()])


def _added(engine: Engine, body: BodyTable, middle: float) -> tuple[int, Complex] | None:
    """Order, and force and moment over Ω² (2, 2), of an added body; None if it is elastic or moves with a rod."""
    frames = {"rest": FrameTable("rest", 0.0), "crank": FrameTable("crank")} | {one.name: one for one in engine.frame}
    frame = frames[body.frame]
    if body.made_of_files_or_elements or frame.motion != "turning" or not float(frame.ratio).is_integer():
        return None
    x, y, z = body.centre
    static, ratio = body.mass * complex(x - frame.axis[0], y - frame.axis[1]), round(frame.ratio)
    vector = ratio**2 * turning(static, ratio > 0)
    return abs(ratio), np.array([vector, (z - middle) * vector])
