"""Matrix of a stage's Newton iteration on the components of all connections, kept transposed."""

from __future__ import annotations

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.vectors import LANES, load, store


@inlined_kernel
def start_jacobian(jacobian):
    """Set the Newton matrix to the identity, which padding rows beyond the components keep."""
    size = jacobian.shape[0]
    for i in range(size):
        row = jacobian[i]
        for j in range(size):
            row[j] = 0.0
        row[i] = 1.0


@kernel
def fill_jacobian(compliance, connections, blocks, n, jacobian):
    """Subtract (H J)ᵀ from ``jacobian`` on n components; H is the compliance, J the sum of the connections' blocks.

    ``compliance`` is kept transposed, [k, i] = H_ik, because it is symmetric only without gyroscopic terms.
    """
    for k in range(connections.shape[0]):
        size = int(connections[k, 0])
        for a in range(size):
            row = jacobian[int(connections[k, 1 + a])]
            for b in range(0, size - 1, 2):
                first, second = int(connections[k, 1 + b]), int(connections[k, 2 + b])
                shares = blocks[k, 4 * b + a], blocks[k, 4 * (b + 1) + a]
                subtract_shares(row, shares, compliance[first], compliance[second], n)
            if size % 2 == 1:
                last = compliance[int(connections[k, size])]
                subtract_shares(row, (blocks[k, 4 * (size - 1) + a], 0.0), last, last, n)


@inlined_kernel
def subtract_shares(row, shares, first, second, n):
    """Subtract two columns of n numbers, times the factors ``shares``, from ``row``."""
    of_first, of_second = shares
    i = 0
    while i + 3 < n:
        store(row, i, load(row, i) - of_first * load(first, i) - of_second * load(second, i))
        i += LANES
    for j in range(i, n):
        row[j] = row[j] - of_first * first[j] - of_second * second[j]
