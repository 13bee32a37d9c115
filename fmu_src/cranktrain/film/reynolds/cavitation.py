"""Where a film ruptures and how far its gap is filled: kernels for one grid of control volumes.

The oil balance of node i, with the pressure p and the deficit d = 1 − fill as unknowns, reads

    s_i − m_i d_i + Σ_faces [g (p_i − p_k) + c (1 − d_up)] = 0,      p ≥ 0,  d ≥ 0,  p d = 0;

g is a face's conductance, c the flow that the surfaces drag through it when it is full, d_up the deficit on the side
that this flow comes from, s − m d the rate at which the node's oil grows. Put u = p where the node is full and u = −d
where it is ruptured: the balance becomes A max(u, 0) + B min(u, 0) = b. Both A and B have a positive diagonal, no
positive entry beside it and columns whose sums are not negative, and so has every mixture of their columns. Hence the
map is an M-function: the solution exists, is unique, and depends on no first guess. Reynolds' (Swift and Stieber's)
rupture is the same problem with B = I: oil then appears where the film ruptures.

Solved by Newton's method, which here is an active set: each pass solves the band matrix of the present mixture. After
``FREE_PASSES`` passes the step is limited so that the sum of all |imbalances| falls; after ``STRICT_PASSES`` a wrong
sign within rounding is accepted. Reynolds' rupture needs no such limit: its pressures rise from pass to pass, though a
zone that starts too small grows by one layer per pass only.

Sources: Elrod, J. Lubr. Technol. 103 (1981) 350 (fill transported upwind); Giacopini et al., J. Tribol. 132 (2010)
041702 (complementarity); Rheinboldt, J. Math. Anal. Appl. 32 (1970) 274 (M-functions).
"""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.film.reynolds.band import factor_band, solve_band

STRICT_PASSES = 12
FREE_PASSES = 30
MAX_PASSES = 60
CONVERGED, SINGULAR, STALLED = 0, 1, 2
FULL_FILM, REYNOLDS, CONSERVING = 0, 1, 2
"""Modes of :func:`film_state`: no rupture; rupture that creates oil; rupture that conserves it."""


@kernel
def face_flow(g, c, p_a, p_b, d_a, d_b):
    """Flow (m³/s) through a face from node a to node b: pressure, and what the surfaces carry from upstream."""
    return g * (p_a - p_b) + c * (1.0 - (d_a if c > 0.0 else d_b))


@kernel
def oil_balance(g_x, g_z, c_x, c_z, source, store, pressure, deficit, out):
    """Oil that each node gains plus what leaves it through faces (m³/s), zero where the balance is met.

    All arrays are (n_x, n_z). Face (i, j) of ``g_x``, ``c_x`` lies between nodes i and i + 1 (the last one between the
    last and the first node: zero unless periodic), of ``g_z``, ``c_z`` between j and j + 1.
    """
    n_x, n_z = pressure.shape
    for i in range(n_x):
        for j in range(n_z):
            out[i, j] = source[i, j] - store[i, j] * deficit[i, j]
    for i in range(n_x):
        after = i + 1 if i + 1 < n_x else 0
        for j in range(n_z):
            p = pressure[i, j]
            d = deficit[i, j]
            if g_x[i, j] > 0.0:
                flow = face_flow(g_x[i, j], c_x[i, j], p, pressure[after, j], d, deficit[after, j])
                out[i, j] += flow
                out[after, j] -= flow
            if j + 1 < n_z:
                flow = face_flow(g_z[i, j], c_z[i, j], p, pressure[i, j + 1], d, deficit[i, j + 1])
                out[i, j] += flow
                out[i, j + 1] -= flow


@kernel
def _face_entries(band, width, load, a, b, g, c, p_a, p_b, d_a, d_b, empty_a, empty_b, conserving):
    """Add one face to the band matrix and right-hand side; a or b is −1 at a node with given pressure and fill."""
    known = c
    if a < 0:
        known += g * p_a
        if c > 0.0:
            known -= c * d_a
    if b < 0:
        known -= g * p_b
        if c < 0.0:
            known -= c * d_b
    if a >= 0:
        load[a, 0] -= known
        share = g
        if empty_a:
            share = c if conserving and c > 0.0 else 0.0
        band[a, width] += share
        if b >= 0:
            band[b, width + a - b] -= share
    if b >= 0:
        load[b, 0] += known
        share = g
        if empty_b:
            share = -c if conserving and c < 0.0 else 0.0
        band[b, width] += share
        if a >= 0:
            band[a, width + b - a] -= share


@kernel
def _mixture(g_x, g_z, c_x, c_z, source, store, conserving, pressure, deficit, empty, order, band, width, load):
    """Assemble the matrix whose columns belong to p at full nodes and to −d at ruptured ones."""
    n_x, n_z = pressure.shape
    band[:, :] = 0.0
    load[:, :] = 0.0
    for i in range(n_x):
        for j in range(n_z):
            a = order[i, j]
            if a >= 0:
                load[a, 0] -= source[i, j]
                if empty[i, j]:
                    band[a, width] += store[i, j] if conserving else 1.0
    for i in range(n_x):
        after = i + 1 if i + 1 < n_x else 0
        for j in range(n_z):
            if g_x[i, j] > 0.0:
                _face_entries(
                    band, width, load, order[i, j], order[after, j], g_x[i, j], c_x[i, j],
                    pressure[i, j], pressure[after, j], deficit[i, j], deficit[after, j],
                    empty[i, j], empty[after, j], conserving,
                )  # fmt: skip
            if j + 1 < n_z:
                _face_entries(
                    band, width, load, order[i, j], order[i, j + 1], g_z[i, j], c_z[i, j],
                    pressure[i, j], pressure[i, j + 1], deficit[i, j], deficit[i, j + 1],
                    empty[i, j], empty[i, j + 1], conserving,
                )  # fmt: skip


@kernel
def _spread(order, conserving, unknown, pressure, deficit, excess):
    """Turn the unknowns into pressure, deficit and (Reynolds' rupture) the oil that appears."""
    n_x, n_z = pressure.shape
    for i in range(n_x):
        for j in range(n_z):
            a = order[i, j]
            if a >= 0:
                u = unknown[a]
                pressure[i, j] = u if u > 0.0 else 0.0
                below = -u if u < 0.0 else 0.0
                deficit[i, j] = below if conserving else 0.0
                excess[i, j] = 0.0 if conserving else below


@kernel
def _imbalance(g_x, g_z, c_x, c_z, source, store, order, pressure, deficit, excess, rest):
    """Sum of |imbalance| over the free nodes; a norm in which Newton's direction always descends."""
    oil_balance(g_x, g_z, c_x, c_z, source, store, pressure, deficit, rest)
    total = 0.0
    n_x, n_z = pressure.shape
    for i in range(n_x):
        for j in range(n_z):
            if order[i, j] >= 0:
                total += abs(rest[i, j] - excess[i, j])
    return total


@kernel
def _stands(order, empty, diagonal, load, lenient):
    """Whether no full node is under tension and no ruptured one overfull (by more than rounding, if lenient)."""
    noise = 0.0
    if lenient:
        for a in range(load.shape[0]):
            noise = max(noise, 4.0e-15 * abs(diagonal[a] * load[a, 0]))
    n_x, n_z = order.shape
    for i in range(n_x):
        for j in range(n_z):
            a = order[i, j]
            if a >= 0:
                flow = diagonal[a] * load[a, 0]
                if (flow > noise) if empty[i, j] else (flow < -noise):
                    return False
    return True


@kernel
def _accept(order, conserving, empty, load, pressure, deficit, excess):
    """Write the solved unknowns where they belong, rounding included, so that the balance closes."""
    n_x, n_z = order.shape
    for i in range(n_x):
        for j in range(n_z):
            a = order[i, j]
            if a >= 0:
                u = load[a, 0]
                pressure[i, j] = 0.0 if empty[i, j] else u
                deficit[i, j] = -u if empty[i, j] and conserving else 0.0
                excess[i, j] = -u if empty[i, j] and not conserving else 0.0


@kernel
def _mark_empty(order, present, empty):
    n_x, n_z = order.shape
    for i in range(n_x):
        for j in range(n_z):
            if order[i, j] >= 0:
                empty[i, j] = present[order[i, j]] < 0.0


@kernel
def _descend(g_x, g_z, c_x, c_z, source, store, order, conserving, present, load, pressure, deficit, excess, rest):
    """Go from ``present`` towards ``load`` so far that the sum of all |imbalances| falls; both are overwritten."""
    n = load.shape[0]
    _spread(order, conserving, present, pressure, deficit, excess)
    before = _imbalance(g_x, g_z, c_x, c_z, source, store, order, pressure, deficit, excess, rest)
    for a in range(n):
        load[a, 0] -= present[a]
        present[a] += load[a, 0]
    share = 1.0
    for _ in range(20):
        _spread(order, conserving, present, pressure, deficit, excess)
        after = _imbalance(g_x, g_z, c_x, c_z, source, store, order, pressure, deficit, excess, rest)
        if after <= (1.0 - 0.1 * share) * before:
            return
        share *= 0.5
        for a in range(n):
            present[a] -= share * load[a, 0]


@kernel
def film_state(
    mode, g_x, g_z, c_x, c_z, source, store, order, pressure, deficit, empty, band, width, load, unknown, work
):  # fmt: skip
    """Pressure and deficit of every free node; returns (status, passes).

    The rounding of a wrong sign may be left in pressure and deficit, so that the oil balance closes.

    Parameters
    ----------
    mode : FULL_FILM, REYNOLDS or CONSERVING
    g_x, g_z, c_x, c_z, source, store : (n_x, n_z) as in :func:`oil_balance`; m³/(Pa s) and m³/s
    order : (n_x, n_z) int, place of each free node in the band, −1 where pressure and deficit are given
    pressure, deficit : (n_x, n_z), given at fixed nodes; the result elsewhere
    empty : (n_x, n_z) bool, first guess of the ruptured nodes, then the result; the result does not depend on it
    band, load, unknown : (n, 2 width + 1), (n, 1) and (2, n) work space, n free nodes
    work : (2, n_x, n_z) work space; ``work[0]`` leaves the oil that Reynolds' rupture makes appear (m³/s)
    """
    n = load.shape[0]
    conserving = mode == CONSERVING
    excess = work[0]
    present = unknown[0]
    diagonal = unknown[1]
    excess[:, :] = 0.0
    limit = MAX_PASSES if conserving else 2 * n + MAX_PASSES
    for turn in range(limit):
        _mixture(g_x, g_z, c_x, c_z, source, store, conserving, pressure, deficit, empty, order, band, width, load)
        for a in range(n):
            diagonal[a] = band[a, width]
        if factor_band(band, n, width) != 0:
            return SINGULAR, turn + 1
        solve_band(band, n, width, load)
        if mode == FULL_FILM or _stands(order, empty, diagonal, load, turn >= STRICT_PASSES):
            _accept(order, conserving, empty, load, pressure, deficit, excess)
            return CONVERGED, turn + 1
        if turn < FREE_PASSES or not conserving:
            for a in range(n):
                present[a] = load[a, 0]
        else:
            _descend(
                g_x, g_z, c_x, c_z, source, store, order, conserving, present, load, pressure, deficit, excess, work[1]
            )
        _mark_empty(order, present, empty)
    return STALLED, limit
