"""Where a film ruptures and how far its gap is filled: kernels for one grid of control volumes.

The oil balance of node i, with the pressure p and the deficit d = 1 − fill as unknowns, reads

    s_i − m_i d_i + Σ_faces [g (p_i − p_k) + c (1 − d_up)] = 0,      p ≥ 0,  d ≥ 0,  p d = 0;

g is a face's conductance, c the flow that the surfaces drag through it when it is full, d_up the deficit on the side
that this flow comes from, s − m d the rate at which the node's oil grows. Put u = p where the node is full and u = −d
where it is ruptured: the balance becomes A max(u, 0) + B min(u, 0) = b. Both A and B have a positive diagonal, no
positive entry beside it and columns whose sums are not negative, and so has every mixture of their columns. Hence the
map is an M-function: the solution exists, is unique, and depends on no first guess. Reynolds' (Swift and Stieber's)
rupture is the same problem with B = I: oil then appears where the film ruptures.

A liquid whose density grows with pressure fills a full node by more than one: 1 + e + k p in place of 1 − d, the
tangent of its density (:mod:`cranktrain.film.reynolds.liquid`). The surfaces carry what is compressed weighted between
both sides of a face, so that the entries beside the diagonal stay negative, and voids from upstream.

The problem is solved by Newton's method, which here is an active-set method: each pass solves the band matrix of the
current mixture. After ``FREE_PASSES`` passes the step is limited so that the sum of all |imbalances| falls. After
``STRICT_PASSES`` a wrong sign within rounding is accepted. Reynolds' rupture needs no limit of the step, because its
pressures rise from pass to pass; a zone that starts too small grows by only one layer per pass.

Sources: Elrod, J. Lubr. Technol. 103 (1981) 350 (fill transported upwind); Giacopini et al., J. Tribol. 132 (2010)
041702 (complementarity); Rheinboldt, J. Math. Anal. Appl. 32 (1970) 274 (M-functions).
"""

from __future__ import annotations

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
"""Modes of :func:`film_state`: no rupture; rupture that creates oil; rupture that conserves it."""


class Liquid(NamedTuple):
    """Content of full nodes in excess of their volume, (n_x, n_z) each; zeros: incompressible."""

    excess: Array  # e
    slope: Array  # k, 1/Pa
    swell: Array  # by which a full node's growth rises with its content, m³/s
    ahead_x: Array  # share of the content downstream in what is carried through a face between two full nodes
    ahead_z: Array


class Balance(NamedTuple):
    """Terms of the oil balance, (n_x, n_z) each.

    Face (i, j) of ``g_x``, ``c_x`` lies between nodes i and i + 1 (the last one between the last and the first node:
    zero unless periodic), of ``g_z``, ``c_z`` between j and j + 1.
    """

    g_x: Array  # conductance, m³/(Pa s)
    g_z: Array
    c_x: Array  # flow that the surfaces carry through the full face, m³/s
    c_z: Array
    source: Array  # m³/s
    store: Array
    liquid: Liquid


class Unknowns(NamedTuple):
    """Nodes and their state, (n_x, n_z) each."""

    order: NDArray[np.int64]  # place of each free node in the band, −1 where pressure and deficit are given
    pressure: Array  # Pa, given at fixed nodes; the result elsewhere
    deficit: Array
    empty: NDArray[np.bool_]  # first guess of the ruptured nodes, then the result; the result does not depend on it
    excess: Array  # oil that Reynolds' rupture makes appear, m³/s


class Space(NamedTuple):
    """Memory for n free nodes."""

    band: Array  # (n, 2 width + 1)
    width: int
    load: Array  # (n, 1)
    unknown: Array  # (2, n)
    rest: Array  # (n_x, n_z)


class Side(NamedTuple):
    """One side of a face."""

    place: int  # in the band; −1 at a node with given pressure and fill
    pressure: float
    full: bool
    content: float  # beyond 1, as far as it does not depend on the unknown
    slope: float  # of the content by the unknown


@kernel
def oil_balance(balance, pressure, deficit, out):
    """Residual of the oil balance (m³/s) into ``out``: growth of each node plus outflow through its faces."""
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
    """Node (i, j) in a known state as a Side."""
    d = deficit[i, j]
    content = -d if d != 0.0 else liquid.excess[i, j] + liquid.slope[i, j] * pressure[i, j]
    return Side(place, pressure[i, j], d == 0.0, content, 0.0)


@kernel
def _carried_shares(c, ahead, one, other):
    """Weights of both sides' contents in the carried flow: compression from both, voids from upstream."""
    first = 1.0 - ahead if c > 0.0 else ahead
    upstream = 1.0 if c > 0.0 else 0.0
    return first if one.full else upstream, 1.0 - first if other.full else 1.0 - upstream


@kernel
def _face_flow(g, c, ahead, one, other):
    """Flow (m³/s) through a face between two known Sides: driven by pressure, and carried by the surfaces."""
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
    """A node as a side of a face."""
    place = film.order[i, j]
    if place < 0:
        return _given_side(film.pressure, film.deficit, liquid, place, i, j)
    if film.empty[i, j]:
        return Side(place, 0.0, False, 0.0, 1.0 if conserving else 0.0)
    return Side(place, 0.0, True, liquid.excess[i, j], liquid.slope[i, j])


@kernel
def _mixture(balance, film, conserving, space):
    """Assemble the matrix whose columns belong to p at full nodes and to −d at ruptured ones, into ``space``."""
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
    """Turn the unknowns into pressure, deficit and (Reynolds' rupture) the oil that appears."""
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
    """Sum of |imbalance| over the free nodes; a norm in which Newton's direction always descends; ``rest``: scratch."""
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
    """Whether no full node is under tension and no ruptured one overfull (by more than rounding, if lenient)."""
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
    """Write the solved unknowns where they belong, rounding included, so that the balance closes."""
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
    """Take the nodes whose unknown is negative as ruptured."""
    n_x, n_z = film.order.shape
    for i in range(n_x):
        for j in range(n_z):
            if film.order[i, j] >= 0:
                film.empty[i, j] = present[film.order[i, j]] < 0.0


@kernel
def _descend(balance, film, conserving, present, space):
    """Go from ``present`` towards ``space.load`` so far that the sum of |imbalances| falls; both are overwritten."""
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
    """Pressure and deficit of every free node; returns (status, passes).

    The rounding of a wrong sign may be left in pressure and deficit, so that the oil balance closes.

    Parameters
    ----------
    mode : FULL_FILM, REYNOLDS or CONSERVING
    balance, film, space : Balance, Unknowns (in: given values and first guess; out: the result), Space
    most : passes after which to stop, STALLED, with the last pressures and ruptured nodes; 0: as many as it takes
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
