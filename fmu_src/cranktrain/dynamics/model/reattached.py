"""Modes of a crankshaft whose flywheel, clutch, pulley or damper housing have other masses and inertias: kernels.

The parts are rigid, axisymmetric and on the crank's axis; what changes is ΔM = Bᵀ ΔZ B with the shapes B of the two
interfaces that they are fixed to, and likewise G, C, K_σ and the loads (:mod:`cranktrain.core.rigid_slices`). In the
modes that the crank has in the FMU its mass matrix is then I + ΔM and its stiffness still diag(ω²): a Ritz problem of
a few dozen coordinates, solved here by Cholesky's factors and Jacobi's rotations. Its modes are the columns of T. The
rigid motions come first and stay exact: the factorisation begins with the rotation about the axis, like
:func:`cranktrain.core.rigid_slices.rigid_modes`, so that this stays pure.

Nothing is lost where the crank has all its modes; of one that was cut, the modes and static answers that it keeps span
the new ones as well as they did the old.

Source: G. H. Golub, C. F. Van Loan, *Matrix Computations*, section 8.5 (cyclic Jacobi).
"""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model import lump_slots as at
from cranktrain.dynamics.model import numbers as to
from cranktrain.dynamics.motion.linear_algebra import factor_lu, solve_lu

MASS, FIRST, ACROSS, ALONG, MOMENTS = range(5)
"""Moments of the parts at an interface: Σ m, Σ m o, ∫ρ x², ∫ρ z² about the interface, of offsets o along the axis."""
SWEEPS = 60
SMALL = 1.0e-17
FLYWHEEL, PULLEY = range(2)


@kernel
def part_moments(numbers, slot, extra, out):
    """Add the moments of the part at a slot to ``out`` (MOMENTS,), ``extra`` (3,) being added to mass and inertias."""
    mass = numbers[slot + to.PART_MASS] + extra[0]
    polar = numbers[slot + to.PART_POLAR] + extra[1]
    diametral = numbers[slot + to.PART_DIAMETRAL] + extra[2]
    offset = numbers[slot + to.PART_OFFSET]
    out[MASS] += mass
    out[FIRST] += mass * offset
    out[ACROSS] += 0.5 * polar
    out[ALONG] += diametral - 0.5 * polar + mass * offset * offset


@kernel
def fitted_extra(numbers, fitted, extra):
    """What a damper adds to mass, polar and diametral inertia of the pulley, see loads.damper."""
    for k in range(3):
        extra[k] = 0.0
    if fitted > 0.0:
        extra[0] = numbers[to.SET_DAMPER_MASS]
        extra[1] = numbers[to.SET_HOUSING]
        extra[2] = 0.5 * (numbers[to.SET_HOUSING] + numbers[to.SET_RING])


@kernel
def moment_changes(lumps, numbers, out):
    """Changes (2, MOMENTS) of the moments at flywheel and pulley, in ``out[0:8]``; whether there are any.

    Behind them ``out`` is scratch, to 20.
    """
    fitted = lumps.traits[at.FITTED]
    changed = 0
    for side in range(2):
        for k in range(MOMENTS):
            out[8 + k] = 0.0
            out[12 + k] = 0.0
        for which in range(2):
            given = numbers if which == 0 else lumps.values
            moments = out[8 : 8 + MOMENTS] if which == 0 else out[12 : 12 + MOMENTS]
            extra = out[16:19]
            fitted_extra(given, fitted if side == PULLEY else 0.0, extra)
            part_moments(given, to.SET_FLYWHEEL if side == FLYWHEEL else to.SET_PULLEY, extra, moments)
            if side == FLYWHEEL:
                fitted_extra(given, 0.0, extra)
                part_moments(given, to.SET_CLUTCH, extra, moments)
        for k in range(MOMENTS):
            out[MOMENTS * side + k] = out[8 + k] - out[12 + k]
            if out[MOMENTS * side + k] != 0.0:
                changed = 1
    return changed


@kernel
def field_of(shapes, mode, f):
    """Field (12,), row by row of B (3, 4), of a mode at an interface with ``shapes`` (6, r)."""
    x, y, z = shapes[3, mode], shapes[4, mode], shapes[5, mode]
    f[0], f[1], f[2], f[3] = shapes[0, mode], 0.0, -z, y
    f[4], f[5], f[6], f[7] = shapes[1, mode], z, 0.0, -x
    f[8], f[9], f[10], f[11] = shapes[2, mode], -y, x, 0.0


@kernel
def turned_of(f, g):
    """Field of e_z × what a field moves."""
    for k in range(4):
        g[k] = -f[4 + k]
        g[4 + k] = f[k]
        g[8 + k] = 0.0


@kernel
def paired(moments, f, g):
    """∫ρ u·v of two fields over parts of these moments."""
    total = 0.0
    for a in range(0, 12, 4):
        total += moments[MASS] * f[a] * g[a] + moments[FIRST] * (f[a] * g[a + 3] + f[a + 3] * g[a])
        total += moments[ACROSS] * (f[a + 1] * g[a + 1] + f[a + 2] * g[a + 2]) + moments[ALONG] * f[a + 3] * g[a + 3]
    return total


@kernel
def add_changes(lumps, changes, scratch):
    """Fill MASS, GYROSCOPIC, CENTRIFUGAL and STRESS of ``room``, and the loads, with the crank's and what is added.

    ``changes`` (2, MOMENTS) flat; ``scratch`` (64,).
    """
    room = lumps.room
    vectors = lumps.vectors
    r = lumps.fixed.shape[2]
    for i in range(r):
        vectors[at.CENTRIFUGAL_LOAD, i] = lumps.loads[0, i]
        vectors[at.EULER_LOAD, i] = lumps.loads[1, i]
        for k in range(3):
            vectors[at.TRANSLATION + k, i] = lumps.gravity[k, i]
        for j in range(r):
            room[at.MASS, i, j] = 1.0 if i == j else 0.0
            room[at.GYROSCOPIC, i, j] = lumps.gyroscopic[i, j]
            room[at.CENTRIFUGAL, i, j] = lumps.centrifugal[i, j]
            room[at.STRESS, i, j] = lumps.stress[i, j]
    f, g, h = scratch[0:12], scratch[12:24], scratch[24:36]
    for side in range(2):
        moments = changes[MOMENTS * side : MOMENTS * side + MOMENTS]
        shapes = lumps.fixed[side]
        for i in range(r):
            field_of(shapes, i, f)
            turned_of(f, h)
            for j in range(r):
                field_of(shapes, j, g)
                room[at.MASS, i, j] += paired(moments, f, g)
                room[at.CENTRIFUGAL, i, j] += paired_turned(moments, h, g)
                turn_in_place(g)
                room[at.GYROSCOPIC, i, j] += paired(moments, f, g)
        add_loads(lumps, side, moments, scratch)
        add_stress(lumps, side, moments, scratch)


@kernel
def paired_turned(moments, turned, g):
    """∫ρ u·(e_z×v) of a field that is turned already and one that is not."""
    total = 0.0
    for a in range(0, 8, 4):
        b = 4 - a
        sign = -1.0 if a == 0 else 1.0
        total += sign * (
            moments[MASS] * turned[a] * g[b]
            + moments[FIRST] * (turned[a] * g[b + 3] + turned[a + 3] * g[b])
            + moments[ACROSS] * (turned[a + 1] * g[b + 1] + turned[a + 2] * g[b + 2])
            + moments[ALONG] * turned[a + 3] * g[b + 3]
        )
    return total


@kernel
def turn_in_place(g):
    """Replace a field by that of e_z × what it moves."""
    for k in range(4):
        first = g[k]
        g[k] = -g[4 + k]
        g[4 + k] = first
        g[8 + k] = 0.0


@kernel
def add_loads(lumps, side, moments, scratch):
    """Add centrifugal load, Euler load and translation of parts at an interface."""
    vectors = lumps.vectors
    shapes = lumps.fixed[side]
    f, outward, around = scratch[0:12], scratch[12:24], scratch[24:36]
    outward_field(lumps.places[side], outward)
    turned_of(outward, around)
    for i in range(lumps.fixed.shape[2]):
        field_of(shapes, i, f)
        vectors[at.CENTRIFUGAL_LOAD, i] += paired(moments, outward, f)
        vectors[at.EULER_LOAD, i] += paired(moments, around, f)
        for k in range(3):
            vectors[at.TRANSLATION + k, i] += moments[MASS] * f[4 * k] + moments[FIRST] * f[4 * k + 3]


@kernel
def outward_field(place, outward):
    """Field of X_⊥ about a place (3,)."""
    for k in range(12):
        outward[k] = 0.0
    outward[0], outward[1] = place[0], 1.0
    outward[4], outward[6] = place[1], 1.0


@kernel
def add_stress(lumps, side, moments, scratch):
    """Add K_σ of parts at an interface to STRESS of ``room``, with its exact rows and columns of the rigid modes.

    See :func:`cranktrain.core.reduced_body.with_rigid_rows`. A crank that only twists has the rigid part alone.
    """
    room = lumps.room
    shapes = lumps.fixed[side]
    r = lumps.fixed.shape[2]
    stress = room[at.STRESS]
    place = lumps.places[side]
    lean_x, lean_y = -0.5 * moments[FIRST] * place[0], -0.5 * moments[FIRST] * place[1]
    for i in range(6, r):
        for j in range(6, r):
            across = shapes[3, i] * shapes[3, j] + shapes[4, i] * shapes[4, j] + 2.0 * shapes[5, i] * shapes[5, j]
            leaning = lean_x * (shapes[3, i] * shapes[5, j] + shapes[5, i] * shapes[3, j])
            leaning += lean_y * (shapes[4, i] * shapes[5, j] + shapes[5, i] * shapes[4, j])
            stress[i, j] += moments[ACROSS] * across + leaning
    f, outward, load = scratch[0:12], scratch[12:24], scratch[24:36]
    to_modes, turned, against = room[at.PRODUCT], room[at.VECTORS], room[at.SQUARES]
    inverse_of_six(lumps.rigid, room[at.TURN], to_modes, lumps.vectors[at.PIVOTS], lumps.vectors[at.HELP])
    outward_field(place, outward)
    for j in range(r):
        field_of(shapes, j, f)
        for k in range(3):
            skewed(outward, k, load)
            turned[k, j] = paired(moments, load, f)
        # ∫ρ (e_z×r_z)·(e_z×φ_j) with the rotation about z through the origin, which is e_z×X.
        turn_in_place(f)
        turn_of_outward(outward, load)
        turned[3, j] = paired(moments, load, f)
    for k in range(6):
        for j in range(r):
            against[k, j] = 0.0
    for k in range(3):
        for l in range(3):  # noqa: E741
            one, other = 0.0, 0.0
            for m in range(6):
                one += turned[k, m] * to_modes[m, 3 + l]
                other += turned[l, m] * to_modes[m, 3 + k]
            against[3 + k, 3 + l] = 0.5 * (one + other)
    for k in range(6):
        total = 0.0
        for m in range(6):
            total += turned[3, m] * to_modes[m, k]
        against[5, k] = total
    for k in range(5):
        against[k, 5] = against[5, k]
    for i in range(6):
        for j in range(6):
            for k in range(6):
                for m in range(6):
                    stress[i, j] += lumps.rigid[k, i] * against[k, m] * lumps.rigid[m, j]
        for j in range(6, r):
            total = 0.0
            for k in range(3, 6):
                total += lumps.rigid[k, i] * turned[k - 3 if k < 5 else 3, j]
            stress[i, j] += total
            stress[j, i] += total


@kernel
def turn_of_outward(outward, load):
    """Field of e_z×(e_z×X), which is −X_⊥."""
    for k in range(12):
        load[k] = -outward[k]


@kernel
def skewed(outward, k, load):
    """Field of e_k × X_⊥."""
    a = (k + 1) % 3
    b = (k + 2) % 3
    for c in range(4):
        load[4 * k + c] = 0.0
        load[4 * a + c] = -outward[4 * b + c]
        load[4 * b + c] = outward[4 * a + c]


@kernel
def inverse_of_six(matrix, work, inverse, pivots, column):
    """Inverse of a matrix (6, 6) into the leading block of ``inverse``; 0, or 1 where it is singular."""
    for i in range(6):
        for j in range(6):
            work[i, j] = matrix[i, j]
    if factor_lu(work, 6, pivots) != 0:
        return 1
    for j in range(6):
        for i in range(6):
            column[i] = 1.0 if i == j else 0.0
        solve_lu(work, 6, pivots, column)
        for i in range(6):
            inverse[i, j] = column[i]
    return 0


@kernel
def ordered(k):
    """Place of a mode in the order of the factorisation: rotation about the axis first, then the others as they are."""
    return 5 if k == 0 else k - 1 if k < 6 else k


@kernel
def new_modes(lumps):
    """Fill TURN of ``room`` with the new modes (r, r) as columns and OMEGA2 of ``vectors`` with their ω²; 0 or 1.

    MASS holds the mass matrix. 1: that is not positive definite.
    """
    room = lumps.room
    r = lumps.fixed.shape[2]
    mass, factor, turn = room[at.MASS], room[at.PRODUCT], room[at.TURN]
    for i in range(r):
        for j in range(i + 1):
            total = mass[ordered(i), ordered(j)]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = total / factor[j, j]
            elif not total > 0.0:
                return 1
            else:
                factor[i, i] = math.sqrt(total)
    # The inverse of the factor, by columns, below the diagonal; its transposed are orthonormal vectors.
    inverse = room[at.VECTORS]
    for j in range(r):
        for i in range(r):
            inverse[i, j] = 0.0
        inverse[j, j] = 1.0 / factor[j, j]
        for i in range(j + 1, r):
            total = 0.0
            for k in range(j, i):
                total -= factor[i, k] * inverse[k, j]
            inverse[i, j] = total / factor[i, i]
    for i in range(r):
        for j in range(r):
            turn[ordered(i), ordered(j)] = inverse[j, i]
        lumps.vectors[at.OMEGA2, i] = 0.0
    elastic_modes(lumps)
    return 0


@kernel
def elastic_modes(lumps):
    """Turn the vectors in TURN behind the rigid ones into modes, by frequency, the largest component positive."""
    room, vectors = lumps.room, lumps.vectors
    r = lumps.fixed.shape[2]
    turn, squares, modes, product = room[at.TURN], room[at.SQUARES], room[at.VECTORS], room[at.PRODUCT]
    for a in range(6, r):
        for b in range(6, r):
            total = 0.0
            for i in range(6, r):
                total += turn[i, a] * lumps.omega2[i] * turn[i, b]
            squares[a, b] = total
            modes[a, b] = 1.0 if a == b else 0.0
    diagonalise(squares, modes, 6, r)
    for i in range(r):
        for j in range(6, r):
            total = 0.0
            for k in range(6, r):
                total += turn[i, k] * modes[k, j]
            product[i, j] = total
    order = vectors[at.ORDER]
    for j in range(6, r):
        order[j] = j
        k = j
        while k > 6 and squares[int(order[k - 1]), int(order[k - 1])] > squares[j, j]:
            order[k] = order[k - 1]
            k -= 1
        order[k] = j
    for j in range(6, r):
        source = int(order[j])
        vectors[at.OMEGA2, j] = squares[source, source]
        largest = 0.0
        for i in range(r):
            if abs(product[i, source]) > abs(largest):
                largest = product[i, source]
        for i in range(r):
            turn[i, j] = -product[i, source] if largest < 0.0 else product[i, source]


@kernel
def diagonalise(a, v, first, end):
    """Jacobi's rotations on rows and columns ``first`` to ``end`` of a symmetric ``a``; ``v`` takes them along."""
    for _ in range(SWEEPS):
        turned = 0
        for p in range(first, end - 1):
            for q in range(p + 1, end):
                if abs(a[p, q]) <= SMALL * math.sqrt(abs(a[p, p] * a[q, q])):
                    continue
                turned += 1
                half = 0.5 * (a[q, q] - a[p, p]) / a[p, q]
                t = 1.0 / (abs(half) + math.sqrt(half * half + 1.0))
                t = -t if half < 0.0 else t
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                for k in range(first, end):
                    one, other = a[k, p], a[k, q]
                    a[k, p] = c * one - s * other
                    a[k, q] = s * one + c * other
                for k in range(first, end):
                    one, other = a[p, k], a[q, k]
                    a[p, k] = c * one - s * other
                    a[q, k] = s * one + c * other
                    one, other = v[k, p], v[k, q]
                    v[k, p] = c * one - s * other
                    v[k, q] = s * one + c * other
                a[p, q] = 0.0
                a[q, p] = 0.0
        if turned == 0:
            return


@kernel
def keep_twists(lumps):
    """Fold what moves a twist as a rigid body across into its rotation about the axis, and lock what is locked.

    A crank that only twists keeps its place across (:func:`cranktrain.structure.crank.torsional.twist_only`).
    """
    turn = lumps.room[at.TURN]
    r = lumps.fixed.shape[2]
    if lumps.traits[at.TWISTS] > 0.0:
        for j in range(6, r):
            for i in range(5):
                turn[5, j] += turn[i, j] * lumps.rigid[5, i] / lumps.rigid[5, 5]
                turn[i, j] = 0.0
    if lumps.traits[at.LOCKED] > 0.0:
        for j in range(5):
            for i in range(r):
                turn[i, j] = 0.0
