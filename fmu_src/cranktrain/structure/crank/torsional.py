"""Crank level ``torsional``: discs on an elastic shaft, as a reduced body like that of every other level.

The shaft has nodes at the pulley, each main journal and the flywheel, and a stiffness between neighbours. Each piece of
the crankshaft is a disc that rotates with the shaft at its position. Between main journals the twist is linear, so a
pin rotates by the mean of its mains. A twist θ(z) moves a pin by θ e_z × X and rotates every other interface; mains
stay on the axis. Discs are balanced in the twist (their static moment counts only in the rigid motions), so only parts
attached off the axis couple twist and rigid motions across the axis.

Stiffnesses come from

* ``solid``: the static response of the free solid body to torques at the nodes. A shaft in pure torsion is a row of
  springs, whatever its shape: each stiffness is the torque over the twist between neighbours. The inertia is that of
  the same static responses in the solid (Ritz vectors). It includes the inertia of the bending that accompanies the
  twist of a free crank, while the bending itself is left out. Mass and inertia are the solid's.
* ``solid-on-bearings``: the same responses with the main journals on their linear springs and the thrust bearing
  closed. A crank in its bearings can bend less than a free crank, so it is stiffer in torsion.
* ``solid-in-motion``: the stiffnesses of ``solid`` times one factor, so that the cranktrain's first torsional frequency
  equals that of the solid in motion (:func:`torsional_in_motion`): journals locked across the axis,
  collar floating. One factor cannot match a second frequency, which is too low.
* ``ker-wilson``, ``carter``: formulas for one throw from the middle of a journal to that of the next,
  k = π G / (32 λ), with journal L_j, D_j, pin L_c, D_c, web thickness t and width W, throw R:

      Ker Wilson   λ = (L_j + 0.4 D_j)/D_j⁴ + (L_c + 0.4 D_c)/D_c⁴ + (R − 0.2 (D_j + D_c))/(t W³)
      Carter       λ = (L_j + 0.8 t)/D_j⁴ + 0.75 L_c/D_c⁴ + 1.5 R/(t W³)

  Carter's formula was derived for stiff webs and flexible journals and pins, Ker Wilson's for the opposite. W is the
  width of the web halfway between main and pin axis. Nose, half journals at the ends and flange are plain shafts; mass
  and inertia follow from the dimensions. BICERA's method uses charts and has no closed form, so it is not implemented.

Torsion does not depend on the speed: K_σ − C is zero in the twists, and so is G.

Sources: W. Ker Wilson, *Practical Solution of Torsional Vibration Problems*, vol. 1 (1956); T. Feese and C. Hill,
*Guidelines for Preventing Torsional Vibration Problems in Reciprocating Machinery*, Gas Machinery Conference (2002),
section 2; E. J. Nestorides, *A Handbook on Torsional Vibration* (BICERA, 1958).
"""

import math
from dataclasses import replace
from hashlib import sha256

import numpy as np
from scipy.linalg import eigh, null_space

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import Array, ReducedBody, check, damping_in_modes, rigid, signed, sliced_body
from cranktrain.core.rigid_slices import Slices, rigid_basis, rigid_motion
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Crankshaft
from cranktrain.engine.quantities import TORSIONAL_SOURCES
from cranktrain.structure.crank.modal import (
    bearing_stiffness,
    cranktrain_matrices,
    energy_shares,
    main_springs,
    named_mode,
    pulley_answers,
    rod_masses,
)
from cranktrain.structure.crank.reduction import complete_crankshaft
from cranktrain.structure.crank.sections import crank_moments, crank_pieces, interface_places
from cranktrain.structure.crank.shape import shaping, stations


def torsional_body(engine: Engine, source: str | None = None, solid: ReducedBody | None = None) -> ReducedBody:
    """Bare crankshaft in its six rigid modes and the twists of discs on a shaft.

    Raises ``InputError``: an unknown source, or a source that needs ``solid`` without it.

    Parameters
    ----------
    source : one of :data:`TORSIONAL_SOURCES`; None for ``reduction.torsional_source`` of the engine file
    solid : bare solid body of the engine; all sources named ``solid…`` need it
    """
    source = engine.reduction.torsional_source if source is None else source
    if source not in TORSIONAL_SOURCES:
        raise InputError(f"torsional source '{source}' does not exist; {nearest(source, TORSIONAL_SOURCES)}")
    if source.startswith("solid"):
        if solid is None:
            raise InputError(
                f"torsional source '{source}' needs the reduced solid crankshaft; make it by `cranktrain reduce`, "
                "or set reduction.torsional_source to ker-wilson"
            )
        base = rigid(solid)
        stiffness, omega, twists = _solid_twists(engine, solid, source == "solid-on-bearings")
        records = {key: value for key, value in solid.records.items() if key.startswith("section_")}
    else:
        base = rigid_crank(engine)
        stiffness = shaft_stiffnesses(engine, source)
        omega, twists = shaft_modes(stiffness, discs(engine, float(base.inertia[2, 2])))
        records = base.records
    twists = twists * signed(np.pad(twists[:, None, :], ((0, 0), (5, 0), (0, 0))))
    z = np.array([base.positions[base.index(name), 2] for name in shaft_nodes(engine)])
    turns = np.stack([np.interp(base.positions[:, 2], z, twist) for twist in twists.T], axis=1)
    body = with_twists(base, omega, turns)
    if source == "solid-in-motion":
        assert solid is not None
        factor = _stiffer_in_motion(engine, replace(body, records=records), solid)
        stiffness, body = factor * stiffness, with_twists(base, math.sqrt(factor) * omega, turns)
    digest = sha256(repr((base.digest, source, stiffness.tolist())).encode()).hexdigest()
    records = {**records, "shaft_stiffness": stiffness}
    body = replace(body, name=f"{engine.name} crankshaft, torsional", digest=digest, records=records)
    check(body)
    return body


def _stiffer_in_motion(engine: Engine, body: ReducedBody, solid: ReducedBody) -> float:
    """Factor on all shaft stiffnesses that makes the first torsional frequency equal to that of the solid in motion."""
    complete = twist_only(complete_crankshaft(engine, body))
    stiffness, mass = (matrix[5:, 5:] for matrix in cranktrain_matrices(engine, complete))
    own = math.sqrt(eigh(stiffness, mass, eigvals_only=True)[1]) / (2.0 * math.pi)
    return (torsional_in_motion(engine, complete_crankshaft(engine, solid)) / own) ** 2


def rigid_crank(engine: Engine) -> ReducedBody:
    """Bare crankshaft in its six rigid modes, from its dimensions alone.

    Its records hold the sections from which :mod:`cranktrain.structure.crank.modal` determines the kind of a mode.
    """
    places = interface_places(engine.crankshaft, engine.thrust.main)
    whole = Slices(np.zeros((1, 3)), crank_moments(engine)[None])
    modes = rigid_basis(whole)
    digest = sha256(repr((shaping(engine.crankshaft), engine.material, engine.thrust.main)).encode()).hexdigest()
    shapes = rigid_motion(np.array(list(places.values()))) @ modes
    motion = rigid_motion(np.zeros((1, 3))) @ modes
    name, nothing = f"{engine.name} crankshaft, rigid", np.zeros((6, 6))
    body = sliced_body(name, digest, places, whole, np.zeros(6), shapes, motion, nothing)
    return replace(body, records=sections(engine))


def shaft_stiffnesses(engine: Engine, source: str) -> Array:
    """Torsional stiffness by formula between neighbours of pulley, mains and flywheel, (mains + 1,) N m/rad."""
    c, material = engine.crankshaft, engine.material
    at = stations(c)
    shear = material.youngs_modulus / (2.0 * (1.0 + material.poisson_ratio))
    places = interface_places(c, engine.thrust.main)
    half_main = 0.5 / c.main_diameter**4
    nose = (at.nose[1] - places["pulley"][2]) / c.nose_diameter**4 + c.main_widths[0] * half_main
    flange = c.main_widths[-1] * half_main + c.flange_length / c.flange_diameter**4
    if max(c.bays) > 1:
        raise InputError(
            f"torsional source '{source}' is a formula for one pin between two mains, and "
            "crankshaft.pins_between_mains has more; use solid"
        )
    ends = zip(c.main_widths, c.main_widths[1:], c.throws, strict=False)
    throws = [throw_compliance(replace(c, throw=throw), 0.5 * (a + b), source) for a, b, throw in ends]
    return math.pi * shear / 32.0 / np.array([nose, *throws, flange])


def throw_compliance(c: Crankshaft, journal_length: float, source: str) -> float:
    """Compliance λ of a throw, 1/m³, by ``ker-wilson`` or ``carter``; ``journal_length`` of its main journal, m."""
    web = c.web_thickness * web_width(c) ** 3
    main, pin = c.main_diameter, c.pin_diameter
    if source == "ker-wilson":
        reach = c.throw - 0.2 * (main + pin)
        return (journal_length + 0.4 * main) / main**4 + (c.pin_width + 0.4 * pin) / pin**4 + reach / web
    return (journal_length + 0.8 * c.web_thickness) / main**4 + 0.75 * c.pin_width / pin**4 + 1.5 * c.throw / web


def web_width(c: Crankshaft) -> float:
    """Width of a web across its throw halfway between main and pin axis, m, which is twice the mean of its radii."""
    return c.web_main_radius + c.web_pin_radius


def sections(engine: Engine) -> dict[str, Array]:
    """Mass and inertia of the crank's pieces, lumped at the nearest interface on the axis, by record name."""
    places = interface_places(engine.crankshaft, engine.thrust.main)
    names = list(places)
    on_axis = [name for name in names if not name.startswith("pin") and name != "thrust"]
    on_axis.sort(key=lambda name: places[name][2])
    z = np.array([places[name][2] for name in on_axis])
    borders = 0.5 * (z[1:] + z[:-1])
    mass, polar, diametral = (np.zeros(z.size) for _ in range(3))
    for piece in crank_pieces(engine):
        cuts = np.clip(np.concatenate(([-np.inf], borders, [np.inf])), *piece.span)
        lengths, middles = np.diff(cuts), 0.5 * (cuts[1:] + cuts[:-1])
        radial = piece.moments[1, 1] + piece.moments[2, 2]
        mass += piece.moments[0, 0] * lengths
        polar += radial * lengths
        square = (middles - z) ** 2 + lengths**2 / 12.0
        diametral += lengths * (0.5 * radial + piece.moments[0, 0] * square)
    rows = np.array([names.index(name) for name in on_axis], dtype=float)
    return {
        "section_interface": rows,
        "section_mass": mass,
        "section_polar": polar,
        "section_diametral": diametral,
    }


def shaft_nodes(engine: Engine) -> list[str]:
    """Names of the interfaces at the shaft's nodes, along z."""
    return ["pulley", *(f"main[{i}]" for i in range(1, len(engine.crankshaft.main_widths) + 1)), "flywheel"]


def discs(engine: Engine, polar: float | None = None) -> Array:
    """Inertia (n, n), kg m², of the pieces as discs at their positions, in the rotations of the shaft's nodes.

    If ``polar`` is given, the inertias are scaled to this sum (for example that of a body with fillets).
    """
    places = interface_places(engine.crankshaft, engine.thrust.main)
    z = np.array([places[name][2] for name in shaft_nodes(engine)])
    inertia = np.zeros((z.size, z.size))
    for piece in crank_pieces(engine):
        share = np.array([np.interp(piece.middle, z, unit) for unit in np.eye(z.size)])
        inertia += piece.polar_inertia * np.outer(share, share)
    return inertia if polar is None else inertia * (polar / inertia.sum())


def shaft_matrix(stiffness: Array) -> Array:
    """Stiffness matrix (n, n) of n nodes joined in a row by n − 1 torsional springs."""
    ends = -np.diff(np.eye(stiffness.size + 1), axis=0)
    return np.asarray(ends.T @ (stiffness[:, None] * ends))


def shaft_modes(stiffness: Array, inertia: Array) -> tuple[Array, Array]:
    """Free torsional modes of discs on a shaft, without the rigid rotation.

    Parameters
    ----------
    stiffness : (n − 1,) stiffness between neighbours, N m/rad
    inertia : (n,) inertia of the discs, or (n, n) in the nodes' rotations, kg m²

    Returns
    -------
    ω (n − 1,) rad/s ascending, rotations (n, n − 1) with unit modal mass
    """
    matrix = np.diag(inertia) if inertia.ndim == 1 else inertia
    squares, twists = eigh(shaft_matrix(stiffness), matrix)
    return np.sqrt(squares[1:]), twists[:, 1:]


def _solid_twists(engine: Engine, solid: ReducedBody, supported: bool) -> tuple[Array, Array, Array]:
    """Shaft stiffnesses, ω and rotations of the nodes from static responses of the solid, see the module's top."""
    modes = np.arange(6, solid.n_modes)
    stiffness = np.diag(solid.omega**2)
    if supported:
        modes = np.setdiff1d(np.arange(solid.n_modes), 5)  # mode 5, the rotation about z, has no stiffness
        stiffness = stiffness + bearing_stiffness(engine, solid)
    stiffness = stiffness[np.ix_(modes, modes)]
    rows = np.stack([solid.shapes[solid.index(name), 5][modes] for name in shaft_nodes(engine)])
    between = np.diff(rows, axis=0)
    # Columns are responses of the solid to a torque between the ends of each spring, scaled to 1 rad of its twist.
    answers = np.linalg.solve(stiffness, between.T)
    answers = answers @ np.linalg.inv(between @ answers)
    springs = answers.T @ stiffness @ answers
    squares, turn = eigh(springs, answers.T @ answers)
    return np.diag(springs), np.sqrt(squares), rows @ answers @ turn


def twist_only(body: ReducedBody) -> ReducedBody:
    """Complete torsional crankshaft whose twists do not move its axis, as if held by its bearings.

    A free unbalanced crank would move sideways as it twists. Its modes are therefore computed with five components of
    the pulley, which lies on the axis, held at zero. The masses are unchanged in the rigid motions, and so is their
    inertia about the axis in the twists.
    """
    held = null_space(body.shapes[body.index("pulley"), :5])
    squares, modes = np.linalg.eigh(held.T @ (body.omega[:, None] ** 2 * held))
    basis, omega = held @ modes[:, 1:], np.sqrt(squares[1:])
    basis *= signed(body.shapes @ basis)
    alone = with_twists(rigid(body), omega, body.shapes[:, 5] @ basis)
    twists, damping = body.twists, body.damping
    if body.shafts:
        twists = np.hstack((twists[:, :6], twists @ basis))
    if damping.size:
        damping = np.concatenate((damping[:6], damping_in_modes(damping, body.omega, basis, omega)))
    return replace(alone, damping=damping, twists=twists)


def with_twists(base: ReducedBody, omega: Array, turns: Array) -> ReducedBody:
    """Rigid body with k torsional modes appended, of frequencies ``omega`` and interface rotations ``turns`` (m, k)."""
    k = omega.size
    shapes = np.zeros((len(base.interfaces), 6, 6 + k))
    shapes[:, :, :6] = base.shapes
    shapes[:, 5, 6:] = turns
    for row, name in enumerate(base.interfaces):
        if name.startswith("pin"):
            x, y, _ = base.positions[row]
            shapes[row, 0, 6:], shapes[row, 1, 6:] = -y * turns[row], x * turns[row]

    def square(matrix: Array, own: float = 0.0) -> Array:
        result = own * np.eye(6 + k)
        result[:6, :6] = matrix
        return result

    def longer(vector: Array) -> Array:
        return np.concatenate((vector, np.zeros((*vector.shape[:-1], k))), axis=-1)

    return replace(
        base,
        omega=np.concatenate((np.zeros(6), omega)),
        shapes=shapes,
        gyroscopic=square(base.gyroscopic),
        centrifugal=square(base.centrifugal, 1.0),
        stress_stiffness=square(base.stress_stiffness, 1.0),
        centrifugal_load=longer(base.centrifugal_load),
        euler_load=longer(base.euler_load),
        translation=longer(base.translation),
        basis=None,
    )


def torsional_in_motion(engine: Engine, crankshaft: ReducedBody) -> float:
    """First torsional frequency (Hz) of the complete ``crankshaft`` with rods on ground, its axis held in plain mains.

    The bearings are replaced by constraints, so no run is needed. At torsional frequencies oil films prevent motion of
    the journals across the axis, because the dynamic stiffness of their damping is far above that of the crank
    (:mod:`cranktrain.studies.in_motion`). Journals tilt freely, and the collar floats. Rollers have little damping and
    act by their stand-in springs, which follow from a run. On the shipped engines the mode of a run lies within 0.5 %.
    If several modes combine torsion and bending, the first torsional one has the largest response of the pulley to the
    cylinders' torques, as in :mod:`cranktrain.structure.in_motion.residues`.

    Raises ``InputError`` for a crank without a torsional mode.
    """
    stiffness = np.diag(crankshaft.omega**2)
    motions = np.eye(crankshaft.n_modes)
    if engine.plain_numbers:  # journals of plain mains do not move across the axis
        mains = [crankshaft.index(f"main[{i + 1}]") for i in engine.plain_numbers]
        motions = np.asarray(null_space(crankshaft.shapes[mains, :2].reshape(-1, crankshaft.n_modes)))
    springs = main_springs(engine)
    for i in engine.roller_mains:
        for component, value in springs[i].items():
            row = crankshaft.shapes[crankshaft.index(f"main[{i + 1}]"), component]
            stiffness += value * np.outer(row, row)
    mass = np.eye(crankshaft.n_modes) + rod_masses(engine, crankshaft)
    squares, shapes = eigh(motions.T @ stiffness @ motions, motions.T @ mass @ motions)
    # The first two modes are the crank's rigid rotation and its axial displacement.
    squares, shapes = squares[2:], motions @ shapes[:, 2:]
    shares = energy_shares(engine, crankshaft, shapes, rods=True)
    answers = pulley_answers(engine, crankshaft, shapes, squares)
    hz = np.sqrt(squares) / (2.0 * math.pi)
    first = named_mode(hz, shares, "torsional", answers=answers)
    if first is None:
        raise InputError("crankshaft has no torsional mode; set reduction.torsional_source to solid")
    return float(hz[first])
