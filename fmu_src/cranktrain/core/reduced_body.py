"""Reduced body: the one form in which every body reaches the dynamics.

In a frame that turns at Ω about z a body with modal coordinates q obeys

    q̈ + (D + 2Ω G) q̇ + [diag(ω²) + Ω² (K_σ − C) + Ω̇ G] q = Ω² f_c − Ω̇ f_e + Σ Φᵀ f

with G_ij = ∫ρ φ_i·(e_z×φ_j), C_ij = ∫ρ (e_z×φ_i)·(e_z×φ_j), f_c,i = ∫ρ φ_i·X_⊥, f_e,i = ∫ρ φ_i·(e_z×X) and K_σ the
geometric stiffness of the stress that the centrifugal load of Ω = 1 rad/s produces. Modes are normalised to unit
modal mass; the first six are the exact rigid-body motions (three translations, then rotations about x, y, z through the
frame's origin, made orthonormal), with ω = 0. The rotation about z stays pure and is neutral: its row and column of
K_σ − C are zero, for an unbalanced body too.

A part fixed to the body afterwards (:func:`attach`) adds exact rigid-body terms (:mod:`cranktrain.core.rigid_slices`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256

import numpy as np

from cranktrain.core.argument_checks import given_kind, given_number, given_numbers
from cranktrain.core.errors import InputError, StoreError, nearest
from cranktrain.core.rigid_slices import (
    Slices,
    fields,
    part_moments,
    rigid_basis,
    rigid_modes,
    rigid_motion,
    second_moments,
    skew,
)
from cranktrain.core.types import Array

SCHEMA = 1


@dataclass(frozen=True, eq=False)
class ReducedBody:
    """A body described by n modes and their shapes at m interfaces (SI).

    Attributes
    ----------
    name : str
    omega : (n,) natural angular frequencies, rad/s; the first six are 0
    interfaces : m names, e.g. ``main[1]``, ``pin[1]``, ``pulley``, ``flywheel``, ``thrust``
    positions : (m, 3) undeformed position of each interface node, m
    shapes : (m, 6, n) translation (m) and rotation (rad) of each interface per unit modal coordinate
    gyroscopic, centrifugal, stress_stiffness : (n, n) G, C, K_σ
    centrifugal_load, euler_load : (n,) f_c, f_e
    translation : (3, n) ∫ρ φ_i·e_k, the modal projection of a unit acceleration field (gravity)
    mass : kg
    centre : (3,) centre of mass, m
    inertia : (3, 3) inertia tensor about the frame's origin, kg m²
    digest : content digest of the inputs from which the body was made
    quality : figures of merit of the reduction, by name
    records : arrays that travel with the body for reports (section masses, frequencies of the full model); no physics
    damping : (n,) modal damping of the body itself, 1/s; empty if the engine's structural damping applies
    shafts : names of the shafts and damped discs of the table from which the body was made
    twists : (s, n) twist of each per unit modal coordinate
    shaft_laws : (s, 3) stiffness (N m/rad, contained in ``omega``), viscous damping (N m s/rad) and loss factor of
        each; the last two are not contained in ``damping``
    basis : (n0, n) these modes in terms of the modes of the body they were derived from; None for an original body
    """

    name: str
    omega: Array
    interfaces: tuple[str, ...]
    positions: Array
    shapes: Array
    gyroscopic: Array
    centrifugal: Array
    stress_stiffness: Array
    centrifugal_load: Array
    euler_load: Array
    translation: Array
    mass: float
    centre: Array
    inertia: Array
    damping: Array = field(default_factory=lambda: np.zeros(0))
    shafts: tuple[str, ...] = ()
    twists: Array = field(default_factory=lambda: np.zeros((0, 0)))
    shaft_laws: Array = field(default_factory=lambda: np.zeros((0, 3)))
    digest: str = ""
    quality: dict[str, float] = field(default_factory=dict)
    records: dict[str, Array] = field(default_factory=dict)
    basis: Array | None = None

    @property
    def n_modes(self) -> int:
        """Number of modal coordinates."""
        return int(self.omega.size)

    @property
    def frequencies_hz(self) -> Array:
        """Natural frequencies, (n,) Hz."""
        return np.asarray(self.omega / (2.0 * np.pi))

    @property
    def brings_damping(self) -> bool:
        """True if the body has its own damping, so that the engine's structural damping does not apply to it."""
        return self.damping.size > 0 or bool(self.shaft_laws[:, 1:].any())

    def index(self, interface: str) -> int:
        """Row of an interface by name; ``KeyError`` if the body has none of that name."""
        try:
            return self.interfaces.index(interface)
        except ValueError:
            raise KeyError(f"body '{self.name}' has no interface '{interface}'") from None


def check(body: ReducedBody) -> None:
    """Raise ``StoreError`` if array shapes or values are impossible for a reduced body."""
    n, m = body.omega.size, len(body.interfaces)
    shapes = {
        "positions": (m, 3),
        "shapes": (m, 6, n),
        "gyroscopic": (n, n),
        "centrifugal": (n, n),
        "stress_stiffness": (n, n),
        "centrifugal_load": (n,),
        "euler_load": (n,),
        "translation": (3, n),
        "centre": (3,),
        "inertia": (3, 3),
    }
    if body.damping.size:
        shapes["damping"] = (n,)
    if body.shafts:
        shapes |= {"twists": (len(body.shafts), n), "shaft_laws": (len(body.shafts), 3)}
    for name, shape in {"omega": (n,), **shapes}.items():
        array = getattr(body, name)
        if array.shape != shape:
            raise StoreError(f"body '{body.name}': '{name}' is {array.shape}, needs {shape}; make it anew")
        if not np.isfinite(array).all():
            raise StoreError(f"body '{body.name}': '{name}' holds values that are not finite; make it anew")
    if n < 6 or m < 1 or np.any(body.omega[:6] != 0.0) or np.any(body.omega[6:] <= 0.0):
        raise StoreError(f"body '{body.name}': needs an interface, six rigid modes and positive ω; make it anew")


def rigid_coordinates(body: ReducedBody) -> Array:
    """Rigid motion of the frame's origin, rows t_x … r_z, in each of the six rigid modes, columns; (6, 6)."""
    at_interface = np.eye(6)
    at_interface[:3, 3:] = -skew(body.positions[0])
    return np.asarray(np.linalg.solve(at_interface, body.shapes[0, :, :6]), dtype=np.float64)


def with_rigid_rows(stress: Array, centrifugal: Array, rigid: Array, turned_load: Array) -> Array:
    """K_σ with the exact rows and columns of the rigid modes.

    A translation does not turn the stress, so its terms are zero. For a rotation Ψ and an elastic mode the term is the
    work of the turned load, ∫ρ (Ψ×X_⊥)·φ; for two rotations its symmetric part, ∫ρ [Ψ·Ψ' X·X_⊥ − sym (Ψ·X)(Ψ'·X_⊥)].
    Rotation about z is neutral, so its row equals that of C.

    Parameters
    ----------
    stress, centrifugal : (n, n) K_σ, valid between elastic modes, and C
    rigid : (6, 6) from :func:`rigid_coordinates`
    turned_load : (3, n) ∫ρ (e_k×X_⊥)·φ_j
    """
    to_modes = np.linalg.inv(rigid)
    rotations = turned_load[:, :6] @ to_modes[:, 3:]
    among = np.zeros((6, 6))
    among[3:, 3:] = 0.5 * (rotations + rotations.T)
    against = np.zeros((6, stress.shape[0] - 6))
    against[3:] = turned_load[:, 6:]
    spin = to_modes[:, 5] @ centrifugal[:6]
    among[5, :] = among[:, 5] = spin[:6] @ to_modes
    against[5] = spin[6:]
    result = 0.5 * (stress + stress.T)
    result[:6, :6] = rigid.T @ among @ rigid
    result[:6, 6:] = rigid.T @ against
    result[6:, :6] = result[:6, 6:].T
    return result


def turning_stiffness(body: ReducedBody, about_centre: bool = False) -> Array:
    """Stiffness K_σ − C (n, n) of a rotating body, with unsymmetric rigid-body terms: rows are forces, columns motions.

    Stress exerts no resultant force on a body, so the rows of translations are those of −C: if an unbalanced body
    rotates relative to the frame, its centrifugal force rotates with it. The same holds for centrifugal moments, so the
    tilt rows in the column of rotation about z are those of −C. Centrifugal forces have no moment about the frame's
    axis, nor about a parallel axis through the displaced centre of mass. So the row of the rotation about the frame's
    axis is zero, or with ``about_centre`` that about the parallel axis. K_σ itself is symmetric; the forces on a body
    in a rotating frame are not.
    """
    rigid = rigid_coordinates(body)
    stress = body.stress_stiffness.copy()
    if np.linalg.matrix_rank(rigid) < 6:
        return stress - body.centrifugal  # a torsional crank has no other rigid motion
    tells = np.zeros((6, body.n_modes))
    tells[:, :6] = rigid
    fields = np.linalg.inv(rigid)
    stress -= tells[:3].T @ (fields[:, :3].T @ stress[:6])
    turned = fields[:, 3:5].T @ stress[:6, :6] @ fields[:, 5]
    stress -= np.outer(tells[3:5].T @ turned, tells[5])
    found = stress - body.centrifugal
    if about_centre:
        x, y = body.centre[:2]
        found -= np.outer(tells[5], (fields @ [y, -x, 0.0, 0.0, 0.0, 1.0]) @ found[:6])
    return np.asarray(found)


def attach(
    body: ReducedBody, interface: str, mass: float, inertia: Array, offset: Sequence[float] | Array
) -> ReducedBody:
    """Body with a rigid part fixed to one of its interfaces, in modes of body and part together.

    The part adds its rigid-body terms to M, G, C, K_σ, f_c and f_e. A disc on the axis thus gets the textbook terms of
    the rotating frame, Coriolis (2 J_d − J_p) Ω and stiffness (J_p − J_d) Ω². The stress that an unbalanced part causes
    in the elastic body is included in the rigid rows of K_σ only. Raises ``InputError`` for an unknown interface, a
    negative mass or an inertia that no rigid part can have.

    Parameters
    ----------
    interface : name of the interface to which the part is fixed
    mass : kg
    inertia : (3, 3) about the part's own centre of mass, kg m²
    offset : (3,) from the interface to the part's centre of mass, m
    """
    inertia, offset = np.asarray(inertia, dtype=float), np.asarray(offset, dtype=float)
    _check_part(body, interface, mass, inertia)
    row = body.index(interface)
    part = Slices(body.positions[row][None], part_moments(mass, inertia, offset)[None])
    motion, about_origin, total = body.shapes[row][None], part.total(), body.mass + mass
    own = part.terms(motion)
    heavier = replace(
        body,
        gyroscopic=body.gyroscopic + own.gyroscopic,
        centrifugal=body.centrifugal + own.centrifugal,
        stress_stiffness=body.stress_stiffness
        + with_rigid_rows(own.stress_stiffness, own.centrifugal, rigid_coordinates(body), own.turned_load),
        centrifugal_load=body.centrifugal_load + own.centrifugal_load,
        euler_load=body.euler_load + own.euler_load,
        translation=body.translation + own.translation,
        mass=total,
        centre=(body.mass * body.centre + about_origin[0, 1:]) / total,
        inertia=body.inertia + np.trace(about_origin[1:, 1:]) * np.eye(3) - about_origin[1:, 1:],
        digest=_derived(body, interface, mass, inertia.tolist(), offset.tolist()),
    )
    return _renormalised(heavier, np.eye(body.n_modes) + part.paired(fields(motion), fields(motion)))


def sliced_body(
    name: str,
    digest: str,
    interfaces: Mapping[str, Sequence[float] | Array],
    slices: Slices,
    omega: Array,
    shapes: Array,
    motion: Array,
    stress: Array,
) -> ReducedBody:
    """Reduced body made of rigid slices in given modes; the first six modes are rigid and orthonormal in the mass.

    Parameters
    ----------
    interfaces : names and positions, m
    omega, shapes : (n,) rad/s and (m, 6, n), see :class:`ReducedBody`
    motion : (s, 6, n) motion of the slices in the modes
    stress : (n, n) stress stiffness apart from that of the slices themselves, valid between elastic modes
    """
    total, own = slices.total(), slices.terms(motion)
    body = ReducedBody(
        name=name,
        omega=omega,
        interfaces=tuple(interfaces),
        positions=np.array(list(interfaces.values()), dtype=float),
        shapes=shapes,
        gyroscopic=own.gyroscopic,
        centrifugal=own.centrifugal,
        stress_stiffness=stress + own.stress_stiffness,
        centrifugal_load=own.centrifugal_load,
        euler_load=own.euler_load,
        translation=own.translation,
        mass=float(total[0, 0]),
        centre=total[0, 1:] / total[0, 0],
        inertia=np.trace(total[1:, 1:]) * np.eye(3) - total[1:, 1:],
        digest=digest,
    )
    stiffness = with_rigid_rows(body.stress_stiffness, own.centrifugal, rigid_coordinates(body), own.turned_load)
    body = replace(body, stress_stiffness=stiffness)
    check(body)
    return body


def rigid_body(
    name: str,
    mass: float,
    inertia: Array,
    centre: Sequence[float] | Array,
    interfaces: Mapping[str, Sequence[float] | Array],
) -> ReducedBody:
    """Rigid body with a mass (kg) and interfaces at positions (3,), m.

    Parameters
    ----------
    inertia : (3, 3) about the centre of mass, kg m²
    centre : (3,) centre of mass, m

    Raises
    ------
    InputError
        no interface, a mass that is not positive, or an impossible inertia
    """
    given_number(mass, f"body '{name}': mass")
    given_kind(interfaces, Mapping, f"body '{name}': interfaces", "give a dictionary of names and places")
    centre = np.array(given_numbers(centre, 3, f"body '{name}': centre"))
    for interface, place in interfaces.items():
        given_numbers(place, 3, f"body '{name}': interface '{interface}'")
    if np.shape(inertia) != (3, 3) or not np.isfinite(np.asarray(inertia, dtype=float)).all():
        raise InputError(
            f"body '{name}': inertia is no tensor of 3 x 3 finite numbers; give one, e.g. np.diag(moments)"
        )
    inertia = np.asarray(inertia, dtype=float)
    smallest = np.linalg.eigvalsh(second_moments(inertia))[0]
    possible = np.allclose(inertia, inertia.T) and smallest >= -1e-9 * np.trace(inertia)
    if not (mass > 0.0 and possible and np.linalg.eigvalsh(inertia)[0] > 0.0):
        raise InputError(
            f"body '{name}' with {mass:g} kg and moments of inertia {np.diag(inertia).tolist()} kg m2 is no rigid "
            "body; mass and moments must be positive, and no moment may exceed the sum of the other two"
        )
    if not interfaces:
        raise InputError(f"body '{name}' has no interface; give it at least one")
    whole = Slices(np.zeros((1, 3)), part_moments(mass, inertia, centre)[None])
    basis = rigid_basis(whole)
    shapes = rigid_motion(np.array(list(interfaces.values()), dtype=float)) @ basis
    return sliced_body(name, "", interfaces, whole, np.zeros(6), shapes, basis[None], np.zeros((6, 6)))


def truncate(body: ReducedBody, cutoff_hz: float, loaded: Sequence[tuple[str, int]] = ()) -> ReducedBody:
    """Body in its modes up to a frequency, completed so that the static response to the ``loaded`` ports stays exact.

    For each ``(interface, component)`` (components 0–5: forces along and moments about x, y, z) the static response of
    the dropped modes to a unit load is kept as a residual attachment mode. These modes are made orthonormal within the
    space of the dropped modes (Rubin 1975; Craig, *Structural Dynamics*, 2006, section 17.6). Raises ``InputError`` for
    an unknown interface or component.
    """
    for name, component in loaded:
        if name not in body.interfaces or component not in range(6):
            raise InputError(
                f"body '{body.name}' carries no load at '{name}' component {component}; "
                f"{nearest(name, body.interfaces)}, components 0 to 5"
            )
    n = body.n_modes
    kept = np.flatnonzero(body.omega <= 2.0 * np.pi * cutoff_hz)
    dropped = np.setdiff1d(np.arange(n), kept)
    basis = np.eye(n)[:, kept]
    if loaded and dropped.size:
        loads = np.stack([body.shapes[body.index(name), component, dropped] for name, component in loaded], axis=1)
        answers = loads / body.omega[dropped, None] ** 2
        vectors, sizes, _ = np.linalg.svd(answers / np.linalg.norm(answers, axis=0), full_matrices=False)
        independent = vectors[:, sizes > 1e-9 * sizes[0]]
        _, turn = np.linalg.eigh(independent.T @ (body.omega[dropped, None] ** 2 * independent))
        residual = np.zeros((n, independent.shape[1]))
        residual[dropped] = independent @ turn
        basis = np.hstack((basis, residual))
    omega = np.sqrt(np.einsum("ij,i,ij->j", basis, body.omega**2, basis))
    shorter = in_modes(body, basis, omega)
    return replace(shorter, digest=_derived(body, cutoff_hz, [list(pair) for pair in loaded]))


def rigid(body: ReducedBody) -> ReducedBody:
    """Body reduced to its six rigid modes."""
    return replace(in_modes(body, np.eye(body.n_modes)[:, :6], np.zeros(6)), digest=_derived(body, "rigid"))


def signed(shapes: Array) -> Array:
    """Signs (n,) of n modes that make the first large interface component of each mode positive.

    Rotations are scaled to the size of the translations, so the choice does not depend on the unit of length. The first
    component above 90 % of the largest decides, so the choice between components of equal size is unique.
    """
    translation, rotation = (np.abs(part).max(initial=0.0) for part in (shapes[:, :3], shapes[:, 3:]))
    flat = np.concatenate((shapes[:, :3] * rotation, shapes[:, 3:] * translation), axis=1).transpose(2, 0, 1)
    flat = flat.reshape(shapes.shape[2], 6 * shapes.shape[0])
    size = np.abs(flat)
    first = np.argmax(size >= 0.9 * size.max(axis=1, keepdims=True), axis=1)
    return np.where(flat[np.arange(flat.shape[0]), first] < 0.0, -1.0, 1.0)


def _check_part(body: ReducedBody, interface: str, mass: float, inertia: Array) -> None:
    """Raise ``InputError`` for an unknown interface, or mass and inertia that no rigid part can have."""
    if interface not in body.interfaces:
        raise InputError(f"body '{body.name}' has no interface '{interface}'; {nearest(interface, body.interfaces)}")
    smallest = np.linalg.eigvalsh(second_moments(inertia))[0]
    if not (mass >= 0.0 and np.array_equal(inertia, inertia.T) and smallest >= -1e-9 * np.trace(inertia)):
        raise InputError(
            f"part at '{interface}' with {mass:g} kg and moments of inertia {np.diag(inertia).tolist()} kg m2 is no "
            "rigid body; the mass must not be negative and no moment may exceed the sum of the other two"
        )


def damping_in_modes(damping: Array, omega: Array, basis: Array, found: Array) -> Array:
    """Modal damping (r,) 1/s of r new modes with frequencies ``found``; ``basis`` (n, r) are their old coordinates.

    Damping of an elastic mode is structural: its loss per cycle does not depend on frequency. A mode of frequency ω
    therefore has c = Σ c_i ω_i b_i²/ω. If all modes have the same damping ratio, they keep it whatever is attached.
    Damping of rigid modes is viscous.

    Parameters
    ----------
    damping, omega : (n,) 1/s and rad/s of the old modes; ``found`` (r,) is in rad/s

    Source: C. D. Johnson, D. A. Kienholz, AIAA J. 20 (1982) 1284, modal strain energy method.
    """
    squares = basis**2
    elastic = omega > 0.0
    lost = np.where(elastic, damping * omega, 0.0) @ squares
    viscous = np.where(elastic, 0.0, damping) @ squares
    return np.asarray(viscous + np.where(found > 0.0, lost / np.where(found > 0.0, found, 1.0), 0.0))


def in_modes(body: ReducedBody, basis: Array, omega: Array) -> ReducedBody:
    """Body in new modes, given as columns (n, r) in the body's present modes."""
    return replace(
        body,
        omega=omega,
        shapes=body.shapes @ basis,
        gyroscopic=basis.T @ body.gyroscopic @ basis,
        centrifugal=basis.T @ body.centrifugal @ basis,
        stress_stiffness=basis.T @ body.stress_stiffness @ basis,
        centrifugal_load=body.centrifugal_load @ basis,
        euler_load=body.euler_load @ basis,
        translation=body.translation @ basis,
        damping=body.damping @ basis**2 if body.damping.size else body.damping,
        twists=body.twists @ basis if body.shafts else body.twists,
        basis=basis if body.basis is None else body.basis @ basis,
    )


def _renormalised(body: ReducedBody, mass: Array) -> ReducedBody:
    """Body with modal mass ``mass`` (n, n), transformed to orthonormal modes: first rigid, then elastic ones."""
    n = body.n_modes
    motions = np.zeros((n, 6))
    motions[:6] = np.linalg.inv(rigid_coordinates(body))
    rigid_basis = motions @ rigid_modes(motions.T @ mass @ motions)
    factor = np.linalg.cholesky(mass)
    complete, _ = np.linalg.qr(factor.T @ rigid_basis, mode="complete")
    elastic_space = np.linalg.solve(factor.T, complete[:, 6:])
    squares, turn = np.linalg.eigh(elastic_space.T @ (body.omega[:, None] ** 2 * elastic_space))
    elastic = elastic_space @ turn
    elastic *= signed(body.shapes @ elastic)
    basis, omega = np.hstack((rigid_basis, elastic)), np.concatenate((np.zeros(6), np.sqrt(squares)))
    damping = damping_in_modes(body.damping, body.omega, basis, omega) if body.damping.size else body.damping
    return replace(in_modes(body, basis, omega), damping=damping)


def _derived(body: ReducedBody, *change: object) -> str:
    """Digest of a body derived from ``body`` by ``change``."""
    return sha256(repr((body.digest, change)).encode()).hexdigest()
