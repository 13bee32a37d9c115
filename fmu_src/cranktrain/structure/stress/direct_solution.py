"""Direct finite-element solution of a crankshaft at an instant of a run, as a check of stresses from modes.

The bare crankshaft carries the loads L at its interfaces, including those of rigid parts fixed to it, and its own
inertia in the turning frame. Inertia relief removes the imbalance due to rounding and linearisation:

    u = G [Wᵀ L − M (Φ a + 2Ω e_z×Φ v + Ω̇ e_z×(X + Φ q) − Ω² (X + Φ q)_⊥ − g)]

with the modal position q, velocity v and acceleration a of the run. The structural damping force D v acts on the mass
like an acceleration, so it is added to a. Loads act on the undeformed body, because stress stiffness is left out.
"""

from dataclasses import dataclass

import numpy as np

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.rigid_slices import TURN, second_moments, skew
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.structure.crank.reduction import attached_parts
from cranktrain.structure.fem.elasticity import component_dofs, sample
from cranktrain.structure.stress.stress_modes import ShapedCrank

ARM = 0.1
"""Distance from a part's centre, m, of the points that represent its inertia; the result does not depend on it."""


@dataclass(frozen=True, eq=False)
class Instants:
    """Motion and loads of a bare crankshaft of n modes and m interfaces at k instants, in axes of the frame (SI).

    Attributes
    ----------
    position, velocity, acceleration : (k, n) modal coordinates; the acceleration includes damping force over modal mass
    loads : (k, m, 6) force and moment at each interface, without those of attached parts
    speed, speed_rate : (k,) Ω, Ω̇
    gravity : (k, 3) m/s²
    """

    position: Array
    velocity: Array
    acceleration: Array
    loads: Array
    speed: Array
    speed_rate: Array
    gravity: Array


def direct_solution(crank: ShapedCrank, engine: Engine, at: Instants) -> tuple[Array, Array]:
    """Displacement (ndof, k) of the bare crankshaft, and relative size (k,) of the load removed by inertia relief.

    ``engine``: engine with the rigid parts that are fixed to the crankshaft in the run.
    """
    model, modes = crank.model, crank.reduced.modes
    loads = at.loads + part_loads(engine, crank.reduced.body, at)
    dofs = component_dofs(model.basis)
    position = sample(model, lambda x: x)

    def turned(field: Array) -> Array:
        result = np.empty_like(field)
        result[dofs] = np.einsum("ab,bsk->ask", TURN, field[dofs])
        return result

    speed, rate = at.speed, at.speed_rate
    place = position[:, None] + modes @ at.position.T
    field = modes @ at.acceleration.T + 2.0 * speed * turned(modes @ at.velocity.T)
    field += rate * turned(place) + speed**2 * turned(turned(place))
    field[dofs] -= at.gravity.T[:, None, :]
    force = crank.interfaces.averaging.T @ loads.reshape(len(loads), -1).T - model.mass @ field
    free = crank.reduced.flexibility
    left = np.abs(free.rigid.T @ force).max(axis=0) / np.abs(free.rigid.T @ (model.mass @ field)).max(axis=0)
    return free.solve(force), left


def part_loads(engine: Engine, body: ReducedBody, at: Instants) -> Array:
    """Loads (k, m, 6) of the rigid parts that are fixed to the interfaces of a bare body: inertia and weight."""
    loads = np.zeros_like(at.loads)
    for name, mass, inertia, offset in rigid_parts(engine):
        row = body.index(name)
        shape = body.shapes[row]
        points, masses = point_masses(mass, inertia, offset)
        u, v, a = (coordinates @ shape.T for coordinates in (at.position, at.velocity, at.acceleration))
        for point, share in zip(points, masses, strict=True):
            lever = skew(point).T  # r ↦ θ×r
            moved = u[:, :3] + u[:, 3:] @ lever.T
            rate = v[:, :3] + v[:, 3:] @ lever.T
            acceleration = a[:, :3] + a[:, 3:] @ lever.T + 2.0 * at.speed[:, None] * (rate @ TURN.T)
            place = body.positions[row] + point + moved
            acceleration += at.speed_rate[:, None] * (place @ TURN.T)
            acceleration += at.speed[:, None] ** 2 * (place @ TURN.T @ TURN.T)
            force = share * (at.gravity - acceleration)
            loads[:, row, :3] += force
            loads[:, row, 3:] += np.cross(place - body.positions[row] - u[:, :3], force)
    return loads


def rigid_parts(engine: Engine) -> list[tuple[str, float, Array, Array]]:
    """Interface, mass, inertia (3, 3) about the centre of mass and offset (3,) of each part fixed to the crankshaft."""
    parts = [
        (name, p.mass, np.diag([p.diametral_inertia, p.diametral_inertia, p.polar_inertia]), np.array([0, 0, p.offset]))
        for name, p in attached_parts(engine)
    ]
    w = engine.balance_weights
    if w is not None:
        for main, mass, r, angle, z in zip(w.mains, w.masses, w.radii, w.angles, w.offsets, strict=True):
            offset = np.array([-r * np.sin(angle), r * np.cos(angle), z])
            parts.append((f"main[{main}]", mass, np.zeros((3, 3)), offset))
    return parts


def point_masses(mass: float, inertia: Array, offset: Array) -> tuple[Array, Array]:
    """Points (7, 3) and masses (7,) that have this mass, inertia about the centre of mass and offset of the centre."""
    moments, axes = np.linalg.eigh(second_moments(inertia))
    shares = np.repeat(moments / (2.0 * ARM**2), 2)
    arms = np.repeat(axes.T, 2, axis=0) * np.tile([ARM, -ARM], 3)[:, None]
    return np.vstack((offset, offset + arms)), np.append(mass - shares.sum(), shares)
