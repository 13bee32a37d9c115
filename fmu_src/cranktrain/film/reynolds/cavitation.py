"""Kernels that find rupture and fill of a film on a grid of control volumes.

The oil balance of node i, with the pressure p and the deficit d = 1 − fill as unknowns, reads

    s_i − m_i d_i + Σ_faces [g (p_i − p_k) + c (1 − d_up)] = 0,      p ≥ 0,  d ≥ 0,  p d = 0;

with the conductance g of a face, the flow c that the surfaces drag through a full face, the deficit d_up upstream of
this flow, and the growth rate s − m d of the node's oil. Put u = p at a full node and u = −d at a ruptured one. The
balance becomes A max(u, 0) + B min(u, 0) = b. Both A and B have a positive diagonal, no positive off-diagonal entry and
columns whose sums are not negative, and so has every mixture of their columns. Hence the map is an M-function: the
solution exists, is unique, and does not depend on the initial guess. Reynolds' (Swift and Stieber's) rupture is the
same problem with B = I; oil then appears where the film ruptures.

A liquid whose density grows with pressure fills a full node by more than one: 1 + e + k p in place of 1 − d, the
tangent of its density (:mod:`cranktrain.film.reynolds.liquid`). In the flow carried through a face, compression is a
weighted mean of both sides, so that off-diagonal entries stay negative, and voids come from upstream.

The problem is solved by Newton's method, which here is an active-set method: each pass solves the band matrix of the
current mixture. After ``FREE_PASSES`` passes the step is limited so that the sum of all |imbalances| falls. After
``STRICT_PASSES`` a wrong sign within rounding is accepted. Reynolds' rupture needs no limit of the step, because its
pressures rise from pass to pass; a zone that starts too small grows by only one layer per pass.

Sources: Elrod, J. Lubr. Technol. 103 (1981) 350 (fill transported upwind); Giacopini et al., J. Tribol. 132 (2010)
041702 (complementarity); Rheinboldt, J. Math. Anal. Appl. 32 (1970) 274 (M-functions).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.film.reynolds.band import factor_band, solve_band

STRICT_PASSES = 12
FREE_PASSES = 30
MAX_PASSES = 60
CONVERGED, SINGULAR, STALLED = 0, 1, 2
FULL_FILM, REYNOLDS, CONSERVING = 0, 1, 2
"""Modes of :func:`film_state`: no rupture, rupture that creates oil, rupture that conserves oil."""


class Liquid(NamedTuple):
    """Content of full nodes above their volume, 1 + e + k p, (n_x, n_z) each; zeros for an incompressible liquid."""

    excess: Array  # e of the content 1 + e + k p
    slope: Array  # k of the content 1 + e + k p, 1/Pa
    swell: Array  # growth rate of a full node's oil per unit of content, m³/s
    ahead_x: Array  # weight of the downstream content in the flow carried between two full nodes
    ahead_z: Array


class Balance(NamedTuple):
    """Coefficients of the oil balance, (n_x, n_z) each.

    Face (i, j) of ``g_x``, ``c_x`` lies between nodes i and i + 1 (the last one between the last and the first node:
    zero unless periodic), of ``g_z``, ``c_z`` between j and j + 1.
    """

    g_x: Array  # conductance, m³/(Pa s)
    g_z: Array
    c_x: Array  # flow that the surfaces carry through a full face, m³/s
    c_z: Array
    source: Array  # growth rate s of a full node's oil, m³/s
    store: Array
    liquid: Liquid


class Unknowns(NamedTuple):
    """State of the nodes, (n_x, n_z) each."""

    order: NDArray[np.int64]  # row of each free node in the band, −1 where pressure and deficit are given
    pressure: Array  # Pa; input at fixed nodes, result elsewhere
    deficit: Array
    empty: NDArray[np.bool_]  # ruptured nodes: initial guess, then the result, which does not depend on the guess
    excess: Array  # oil that Reynolds' rupture creates, m³/s


class Space(NamedTuple):
    """Scratch memory for n free nodes."""

    band: Array  # (n, 2 width + 1)
    width: int
    load: Array  # (n, 1) right-hand side, then solution
    unknown: Array  # (2, n) present unknowns, and diagonal of the matrix
    rest: Array  # (n_x, n_z) residual of the oil balance


class Side(NamedTuple):
    """One side of a face."""

    place: int  # row in the band; −1 at a node with given pressure and fill
    pressure: float
    full: bool
    content: float  # content above 1, without the part that depends on the unknown
    slope: float  # derivative of the content by the unknown


@kernel
def oil_balance(balance, pressure, deficit, out):
    """Compute the residual of the oil balance (m³/s) in ``out``: growth of each node plus outflow through its faces."""
    g_x, g_z, c_x, c_z, source, store, liquid = balance
    n_x, n_z = pressure.shape
    for i in range(n_x):
        for j in range(n_z):
            out[i, j] = source[i, j] - store[i, j] * deficit[i, j]
            if deficit[i, j] == 0.0:
                out[i, j] += liquid.swell[i, j] * (liquid.excess[i, j] + liquid.slope[i, j] * pressure[i, j])
    for i in range(n_x):
        after = i + 1 if i + 1 < n_x else 0
        for j in range(n_z):
            here = _given_side(pressure, deficit, liquid, -1, i, j)
            if g_x[i, j] > 0.0:
                there = _given_side(pressure, deficit, liquid, -1, after, j)
                flow = _face_flow(g_x[i, j], c_x[i, j], liquid.ahead_x[i, j], here, there)
                out[i, j] += flow
                out[after, j] -= flow
            if j + 1 < n_z:
                there = _given_side(pressure, deficit, liquid, -1, i, j + 1)
                flow = _face_flow(g_z[i, j], c_z[i, j], liquid.ahead_z[i, j], here, there)
                out[i, j] += flow
                out[i, j + 1] -= flow


@kernel
def _given_side(pressure, deficit, liquid, place, i, j):
    """Return node (i, j) with known pressure and deficit as a Side."""
    d = deficit[i, j]
    content = -d if d != 0.0 else liquid.excess[i, j] + liquid.slope[i, j] * pressure[i, j]
    return Side(place, pressure[i, j], d == 0.0, content, 0.0)


@kernel
def _carried_shares(c, ahead, one, other):
    """Return the weights of both sides' contents in the carried flow: compression from both, voids from upstream."""
    first = 1.0 - ahead if c > 0.0 else ahead
    upstream = 1.0 if c > 0.0 else 0.0
    return first if one.full else upstream, 1.0 - first if other.full else 1.0 - upstream


@kernel
def _face_flow(g, c, ahead, one, other):
    """Return the flow (m³/s) through a face between two known Sides: pressure flow plus flow carried by surfaces."""
    first, second = _carried_shares(c, ahead, one, other)
    return g * (one.pressure - other.pressure) + c * (1.0 + first * one.content + second * other.content)


@kernel
def _face_entries(space, g, c, ahead, one, other):
    """Add one face between two Sides to the band matrix and right-hand side."""
    band, width, load = space.band, space.width, space.load
    a, b = one.place, other.place
    first, second = _carried_shares(c, ahead, one, other)
    known = _face_flow(g, c, ahead, one, other)
    if a >= 0:
        load[a, 0] -= known
        by = (g if one.full else 0.0) + c * first * one.slope
        band[a, width] += by
        if b >= 0:
            band[b, width + a - b] -= by
    if b >= 0:
        load[b, 0] += known
        by = (g if other.full else 0.0) - c * second * other.slope
        band[b, width] += by
        if a >= 0:
            band[a, width + b - a] -= by


@kernel
def _side(film, liquid, conserving, i, j):
    """Return a node with its unknown as a Side."""
    place = film.order[i, j]
    if place < 0:
        return _given_side(film.pressure, film.deficit, liquid, place, i, j)
    if film.empty[i, j]:
        return Side(place, 0.0, False, 0.0, 1.0 if conserving else 0.0)
    return Side(place, 0.0, True, liquid.excess[i, j], liquid.slope[i, j])


@kernel
def _mixture(balance, film, conserving, space):
    """Assemble the band matrix, with columns of A at full nodes and of B at ruptured nodes, in ``space``."""
    n_x, n_z = film.pressure.shape
    liquid = balance.liquid
    space.band[:, :] = 0.0
    space.load[:, :] = 0.0
    for i in range(n_x):
        for j in range(n_z):
            a = film.order[i, j]
            if a >= 0:
                space.load[a, 0] -= balance.source[i, j]
                if film.empty[i, j]:
                    space.band[a, space.width] += balance.store[i, j] if conserving else 1.0
                else:
                    space.load[a, 0] -= liquid.swell[i, j] * liquid.excess[i, j]
                    space.band[a, space.width] += liquid.swell[i, j] * liquid.slope[i, j]
    for i in range(n_x):
        after = i + 1 if i + 1 < n_x else 0
        for j in range(n_z):
            here = _side(film, liquid, conserving, i, j)
            if balance.g_x[i, j] > 0.0:
                there = _side(film, liquid, conserving, after, j)
                _face_entries(space, balance.g_x[i, j], balance.c_x[i, j], liquid.ahead_x[i, j], here, there)
            if j + 1 < n_z:
                there = _side(film, liquid, conserving, i, j + 1)
                _face_entries(space, balance.g_z[i, j], balance.c_z[i, j], liquid.ahead_z[i, j], here, there)


@kernel
def _spread(film, conserving, unknown):
    """Convert the unknowns to pressure, deficit and (Reynolds' rupture) created oil."""
    n_x, n_z = film.pressure.shape
    for i in range(n_x):
        for j in range(n_z):
            a = film.order[i, j]
            if a >= 0:
                u = unknown[a]
                film.pressure[i, j] = u if u > 0.0 else 0.0
                below = -u if u < 0.0 else 0.0
                film.deficit[i, j] = below if conserving else 0.0
                film.excess[i, j] = 0.0 if conserving else below


@kernel
def _imbalance(balance, film, rest):
    """Return the sum of |residual| over free nodes, which Newton's direction always decreases; ``rest`` is scratch."""
    oil_balance(balance, film.pressure, film.deficit, rest)
    total = 0.0
    n_x, n_z = film.pressure.shape
    for i in range(n_x):
        for j in range(n_z):
            if film.order[i, j] >= 0:
                total += abs(rest[i, j] - film.excess[i, j])
    return total


@kernel
def _settled(film, diagonal, load, lenient):
    """True if no full node is in tension and no ruptured node overfull (by more than rounding, if lenient)."""
    noise = 0.0
    if lenient:
        for a in range(load.shape[0]):
            noise = max(noise, 4.0e-15 * abs(diagonal[a] * load[a, 0]))
    n_x, n_z = film.order.shape
    for i in range(n_x):
        for j in range(n_z):
            a = film.order[i, j]
            if a >= 0:
                flow = diagonal[a] * load[a, 0]
                if (flow > noise) if film.empty[i, j] else (flow < -noise):
                    return False
    return True


@kernel
def _accept(film, conserving, load):
    """Write the unknowns to pressure, deficit and excess, wrong signs by rounding included, so the balance closes."""
    n_x, n_z = film.order.shape
    for i in range(n_x):
        for j in range(n_z):
            a = film.order[i, j]
            if a >= 0:
                u = load[a, 0]
                empty = film.empty[i, j]
                film.pressure[i, j] = 0.0 if empty else u
                film.deficit[i, j] = -u if empty and conserving else 0.0
                film.excess[i, j] = -u if empty and not conserving else 0.0


@kernel
def _mark_empty(film, present):
    """Mark the nodes with a negative unknown as ruptured."""
    n_x, n_z = film.order.shape
    for i in range(n_x):
        for j in range(n_z):
            if film.order[i, j] >= 0:
                film.empty[i, j] = present[film.order[i, j]] < 0.0


@kernel
def _descend(balance, film, conserving, present, space):
    """Step from ``present`` towards ``space.load``, so far that the sum of |residuals| decreases; overwrites both."""
    load = space.load
    n = load.shape[0]
    _spread(film, conserving, present)
    before = _imbalance(balance, film, space.rest)
    for a in range(n):
        load[a, 0] -= present[a]
        present[a] += load[a, 0]
    share = 1.0
    for _ in range(20):
        _spread(film, conserving, present)
        after = _imbalance(balance, film, space.rest)
        if after <= (1.0 - 0.1 * share) * before:
            return
        share *= 0.5
        for a in range(n):
            present[a] -= share * load[a, 0]


@kernel
def film_state(mode, balance, film, space, most):
    """Solve for pressure and deficit of every free node. Return status and number of passes.

    Pressure and deficit may keep a wrong sign within rounding, so that the oil balance closes.

    Parameters
    ----------
    mode : FULL_FILM, REYNOLDS or CONSERVING
    balance, film, space : Balance, Unknowns (in: given values and initial guess; out: the result), Space
    most : limit of passes, after which the status is STALLED with the last pressures and ruptured nodes; 0: no limit
    """
    load = space.load
    n = load.shape[0]
    conserving = mode == CONSERVING
    present = space.unknown[0]
    diagonal = space.unknown[1]
    film.excess[:, :] = 0.0
    limit = MAX_PASSES if conserving else 2 * n + MAX_PASSES
    if most > 0:
        limit = most
    for turn in range(limit):
        _mixture(balance, film, conserving, space)
        for a in range(n):
            diagonal[a] = space.band[a, space.width]
        if factor_band(space.band, n, space.width) != 0:
            return SINGULAR, turn + 1
        solve_band(space.band, n, space.width, load)
        if mode == FULL_FILM or _settled(film, diagonal, load, turn >= STRICT_PASSES):
            _accept(film, conserving, load)
            return CONVERGED, turn + 1
        if turn < FREE_PASSES or not conserving:
            for a in range(n):
                present[a] = load[a, 0]
        else:
            _descend(balance, film, conserving, present, space)
        _mark_empty(film, present)
    _spread(film, conserving, present)
    return STALLED, limit
