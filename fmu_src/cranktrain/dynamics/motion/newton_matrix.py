"""Matrix of a stage's Newton iteration on the components of all connections, kept transposed.

Components of terms come first, those of one body alone before others, since they do not couple with those of another
body; then come the components that are ports. Only components of crank and block fill the matrix.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.core.vectors import LANES, load, store
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.motion.linear_algebra import factor_rows, factor_sparse_rows, solve_rows
from cranktrain.dynamics.topology import slots as top


@kernel
def factor_newton(model, compliance, blocks, jacobian):
    """Make and factorise the Newton matrix (I − H J)ᵀ, in place in ``jacobian``. Return 0, or 1 if it is singular.

    H is the compliance of all components, J the sum of the connections' ``blocks``. ``compliance`` is kept transposed,
    [k, i] = H_ik, because it is symmetric only without gyroscopic terms. Padding rows beyond the components stay those
    of the identity.
    """
    connections = model.connections
    whole = jacobian.shape[0]
    for i in range(whole):
        row = jacobian[i]
        for j in range(whole):
            row[j] = 0.0
        row[i] = 1.0
    terms = model.links.scales.shape[0]
    n = terms + model.scales.shape[0]
    for k in range(connections.shape[0]):
        size = connections[k, at.COUPLED]
        own = 0 if connections[k, at.SHAPE] == at.OF_TERMS else terms
        for a in range(size):
            row = jacobian[own + connections[k, at.FIRST + a]]
            for b in range(0, size - 1, 2):
                first, second = own + connections[k, at.FIRST + b], own + connections[k, at.FIRST + 1 + b]
                shares = blocks[k, 4 * b + a], blocks[k, 4 * (b + 1) + a]
                subtract_shares(row, shares, compliance[first], compliance[second], n)
            if size % 2 == 1:
                last = compliance[own + connections[k, at.COUPLED + size]]
                subtract_shares(row, (blocks[k, 4 * (size - 1) + a], 0.0), last, last, n)
    return factor_rows(jacobian, whole) if terms == 0 else factor_sparse_rows(jacobian, whole)


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


@kernel
def solve_step(model, work):
    """Solve for the Newton step of all components, in place in ``work.port[U_STEP]`` and in the gaps of terms."""
    terms = model.links.scales.shape[0]
    if terms == 0:
        solve_rows(work.jacobian, work.jacobian.shape[0], work.port, at.U_STEP)
        return
    gaps = work.links.gaps[top.STEP]
    step = work.port[at.U_STEP]
    whole = work.links.newton[0]
    own = whole[terms:]
    count = model.scales.shape[0]
    for k in range(terms):
        whole[k] = gaps[k]
    for k in range(own.shape[0]):
        own[k] = step[k] if k < count else 0.0
    solve_rows(work.jacobian, work.jacobian.shape[0], work.links.newton, 0)
    for k in range(terms):
        gaps[k] = whole[k]
    for k in range(count):
        step[k] = own[k]
