"""Nested dissection: an elimination order of a sparse matrix with little fill.

A small set of nodes (the cut) divides a graph into two halves, and each half is divided again; the cut is eliminated
after both halves. The halves come from a breadth-first sweep that starts at one end of a longest path through the
graph. The cut is the smallest set of nodes that covers all edges between the halves (König, from a maximum matching).
On a crankshaft the first cuts are cross-sections. If positions of nodes are known, sweeps along their principal axes
are tried too, because in a coarse body with a fine ring all nodes are few edges away from the ring, and a breadth-first
sweep would cut the ring along its whole length.

Reference: A. George, *Nested dissection of a regular finite element mesh*, SIAM J. Numer. Anal. 10 (1973) 345;
C. Ashcraft and J. Liu, *Applications of the Dulmage–Mendelsohn decomposition and network flow to graph bisection
improvement*, SIAM J. Matrix Anal. Appl. 19 (1998) 325.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_bipartite_matching

from cranktrain.core.types import Array, Integers

# Fractions of all nodes tried as one side of a cut, in addition to the levels of the breadth-first sweep.
SHARES = (0.4, 0.45, 0.5, 0.55, 0.6)
# Penalty of an uneven cut: fraction by which the cost of the cut rises if one side is empty.
UNEVENNESS = 0.5


def nested_dissection(
    graph: sparse.csr_matrix, leaf: int, places: Array | None = None
) -> tuple[list[Integers], list[int]]:
    """Groups of nodes in the order of elimination, and the tree that they form.

    Parameters
    ----------
    graph : (n, n) csr with symmetric pattern
    leaf : groups up to this size are not cut further
    places : (n, 3) positions of the nodes, if known

    Returns
    -------
    groups : disjoint sets of nodes, together 0 … n − 1; a group comes after all groups that it separates
    parents : parent of each group in the elimination tree, −1 for a root
    """
    groups: list[Integers] = []
    parents: list[int] = []

    def emit(nodes: Integers, children: list[int]) -> list[int]:
        groups.append(nodes)
        parents.append(-1)
        for child in children:
            parents[child] = len(groups) - 1
        return [len(groups) - 1]

    def dissect(nodes: Integers, part: sparse.csr_matrix) -> list[int]:
        if len(nodes) <= leaf:
            return emit(nodes, [])
        n_components, component = connected_components(part, directed=False)
        if n_components > 1:
            members = [np.flatnonzero(component == k) for k in range(n_components)]
            return [root for m in members for root in dissect(nodes[m], part[m][:, m])]
        side = bisection(part, None if places is None else places[nodes])
        halves = [np.flatnonzero(side == k) for k in (0, 1)]
        if min(len(half) for half in halves) == 0:
            return emit(nodes, [])
        below = [root for half in halves for root in dissect(nodes[half], part[half][:, half])]
        return emit(nodes[side == 2], below)

    dissect(np.arange(graph.shape[0]), graph)
    return groups, parents


def bisection(graph: sparse.csr_matrix, places: Array | None = None) -> Integers:
    """Bisect a connected graph. Return 0 or 1 for the side of each node (n,), or 2 if it belongs to the cut.

    ``places`` (n, 3) are positions of the nodes, if known.
    """
    n = graph.shape[0]
    order = np.zeros(1, dtype=np.intp)
    for _ in range(3):
        order, predecessor = breadth_first_order(graph, int(order[-1]))
    least, most = SHARES[0] * n, SHARES[-1] * n
    shares = [int(n * share) for share in SHARES]
    place = np.empty(n, dtype=np.intp)
    place[order] = np.arange(n)
    before = place[predecessor[order[1:]]]
    starts = [0, 1]
    while starts[-1] < n:
        starts.append(1 + int(np.searchsorted(before, starts[-1])))
    sweeps = [(order, sorted({*shares, *starts}))]
    if places is not None:
        axes = np.linalg.eigh(np.cov(places.T))[1]
        sweeps += [(np.argsort(along, kind="stable"), shares) for along in (places @ axes).T]
    best, answer = np.inf, np.zeros(n, dtype=np.intp)
    for order, cuts in sweeps:
        for cut in (c for c in cuts if least <= c <= most and 0 < c < n):
            first, second = order[:cut], order[cut:]
            across = graph[first][:, second]
            rows, columns = np.flatnonzero(np.diff(across.indptr)), np.unique(across.indices)
            in_rows, in_columns = vertex_cover(across[rows][:, columns])
            left = (cut - in_rows.sum()) / n
            cost = (in_rows.sum() + in_columns.sum()) * (1 + UNEVENNESS * abs(2 * left - 1))
            if cost < best:
                best = cost
                answer = np.zeros(n, dtype=np.intp)
                answer[second] = 1
                answer[first[rows[in_rows]]] = 2
                answer[second[columns[in_columns]]] = 2
    return answer


def vertex_cover(edges: sparse.csr_matrix) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Smallest set of rows and columns that together contain every entry of a sparse matrix (König's theorem)."""
    column_of = maximum_bipartite_matching(edges, perm_type="column")
    row_of = np.full(edges.shape[1], -1)
    matched = np.flatnonzero(column_of >= 0)
    row_of[column_of[matched]] = matched
    rows, columns = column_of < 0, np.zeros(edges.shape[1], dtype=bool)
    newest = np.flatnonzero(rows)
    while len(newest):
        reached = np.unique(edges[newest].indices)
        reached = reached[~columns[reached]]
        columns[reached] = True
        newest = row_of[reached]
        newest = newest[(newest >= 0)]
        newest = newest[~rows[newest]]
        rows[newest] = True
    return ~rows, columns
