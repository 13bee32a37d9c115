"""Kernels that solve the Ritz problem of a crankshaft with other masses.

Cholesky factors of the mass matrix make the vectors orthonormal, beginning with the rotation about the axis. Jacobi
rotations then make them orthogonal in the stiffness too.

Source: G. H. Golub, C. F. Van Loan, *Matrix Computations*, section 8.5 (cyclic Jacobi).
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model import lump_slots as at
from cranktrain.dynamics.model.slots import ROTATION

SWEEPS = 60
SMALL = 1.0e-17
"""Most sweeps of Jacobi rotations, and fraction of the diagonal above which an element is eliminated."""


@kernel
def ordered(k):
    """Mode at position k of the factorisation: rotation about the axis first, then all other modes in order."""
    return 5 if k == 0 else k - 1 if k < 6 else k


@kernel
def new_modes(lumps):
    """Fill TURN of ``room`` with the new modes (r, r) as columns and OMEGA2 of ``vectors`` with their ω².

    Returns 0, or 1 if the mass matrix in MASS is not positive definite.
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
    # The inverse of the factor is lower triangular; its transpose has orthonormal vectors as columns.
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
    """Turn the elastic vectors in TURN into modes, sorted by frequency, with the largest component positive."""
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
    """Diagonalise rows and columns ``first`` to ``end`` of symmetric ``a`` by Jacobi rotations, applied to ``v``."""
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
    """Adapt MASS of a crank that only twists, so that its new elastic modes are sums of the rotation and its twists.

    Such a crank does not move across (:func:`cranktrain.structure.crank.torsional.twist_only`). A rigid motion that is
    made orthogonal to the rotation is then orthogonal to every twist.
    """
    mass = lumps.room[at.MASS]
    if lumps.traits[at.TWISTS] == 0.0:
        return
    for i in range(5):
        for j in range(6, lumps.fixed.shape[2]):
            mass[i, j] = mass[i, ROTATION] * mass[ROTATION, j] / mass[ROTATION, ROTATION]
            mass[j, i] = mass[i, j]


@kernel
def lock_journals(lumps):
    """Set the rigid motions in TURN to zero that are prevented by journals locked on their axis."""
    turn = lumps.room[at.TURN]
    if lumps.traits[at.LOCKED] > 0.0:
        for j in range(5):
            for i in range(lumps.fixed.shape[2]):
                turn[i, j] = 0.0
