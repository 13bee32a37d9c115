r"""Weights that integrate the film pressure along ζ from the pressures on the axial lines.

At a closing edge the pressure is not a polynomial of ζ, because it falls where the film is thin. The flow across the
bore is smooth there. Between two lines, with t from 0 to 1, spacing d, a film of height H linear in t and the flow

    q = −H³ p_ζ = q_c + q′ d (t − ½)

the integral of the pressure is exactly

    ∫ p dζ = d (H p + H′ p′)/(H + H′) + d³ q′ C/G,      G = 2 H² H′²/(H + H′),

with the variance C of t under the weight 1/H³, by two Gauss points ⅓ (H₊ H₋)³/(H₊³ + H₋³)². The pressure of the wider
end has the larger weight, because most of the pressure drop lies at the narrow end. q′ is the difference of the flows G
Δp/d of the spacings before and after, over the distance of their middles. At an end of the bore and at a supply, where
the flow jumps, q′ is taken from the spacing itself and one neighbour. For H = H′ the weights are those of the
trapezoidal rule with a curvature term.

At a closed edge the heights of neighbouring lines differ by factors of ten and more, and the term of q′ would give
large weights of both signs. The term is therefore bounded: no line loses more than half of its part of the two spacings
to each of two neighbours, so no weight is negative.

The heights are taken at the start of the step, so the weights are constant within a solution and the tangents are
exact. The resulting error is the relative change of the film within a step times the correction to the trapezoidal
rule.
"""

from cranktrain.core.kernel import inlined_kernel
from cranktrain.core.side_by_side import choose, get, least_of, put, spread
from cranktrain.film.elastic import workspace as at
from cranktrain.film.elastic.balance import side_conductance

NEAR, FAR = 0.5 - 0.5 / 3.0**0.5, 0.5 + 0.5 / 3.0**0.5
"""Points of Gauss's two-point rule on [0, 1]."""


@inlined_kernel
def column_weights(work, group, position, n_z):
    """Compute the weights of a column's pressures along ζ at the step's start, in row WEIGHT; row OPEN has the gaps."""
    nodes = work.nodes[group]
    lines = work.lines
    first = position * (n_z + 2)
    supply = work.supply[group]
    none = spread(0.0, nodes)
    for line in range(n_z + 2):
        put(nodes, (at.CHANGE, first + line), none)
        # Weight of each line without the term of the flow's slope q′, by which a line loses at most half of its weight.
        h = get(nodes, (at.OPEN, first + line))
        part = none
        if line > 0:
            nearer = get(nodes, (at.OPEN, first + line - 1))
            part = (lines[line, at.ZETA] - lines[line - 1, at.ZETA]) * h / (h + nearer)
        if line <= n_z:
            beyond = get(nodes, (at.OPEN, first + line + 1))
            part = part + (lines[line + 1, at.ZETA] - lines[line, at.ZETA]) * h / (h + beyond)
            over = side_conductance(h, beyond)[0] / spread(lines[line + 1, at.ZETA] - lines[line, at.ZETA], nodes)
            put(nodes, (at.CHANGE, first + line), over)
        put(nodes, (at.AFTER, first + line), part)
        put(nodes, (at.WEIGHT, first + line), part)
    for line in range(n_z + 1):
        # The flow jumps at a supply, whose position differs between lanes.
        f = position * n_z + line
        before = none
        after = none
        if line > 0:
            before = 1.0 - get(supply, f - 1)
        if line < n_z:
            after = 1.0 - get(supply, f)
        _bend(work, group, first, line, before, after, n_z)


@inlined_kernel
def _bend(work, group, first, line, before, after, n_z):
    """Add the flow slope's term for the spacing after a line; ``before``, ``after`` are 1 if that neighbour counts."""
    nodes = work.nodes[group]
    lines = work.lines
    q = first + line
    own = get(nodes, (at.OPEN, q))
    beyond = get(nodes, (at.OPEN, q + 1))
    zeta = lines[line, at.ZETA]
    length = lines[line + 1, at.ZETA] - zeta
    near = own + NEAR * (beyond - own)
    far = own + FAR * (beyond - own)
    near = near * near * near
    far = far * far * far
    both = near + far
    variance = near * far / (3.0 * both * both)
    over = get(nodes, (at.CHANGE, q))
    last = line - 1 if line > 0 else line
    next_one = line + 1 if line < n_z else line
    at_low = zeta + lines[line + 1, at.ZETA]
    apart = after * (lines[next_one, at.ZETA] + lines[min(next_one + 1, n_z + 1), at.ZETA] - at_low)
    apart = apart + before * (at_low - (lines[last, at.ZETA] + lines[last + 1, at.ZETA]))
    counts = apart > 0.0
    low_over = choose(before > 0.0, get(nodes, (at.CHANGE, first + last)), over)
    high_over = choose(after > 0.0, get(nodes, (at.CHANGE, first + next_one)), over)
    high_part = choose(after > 0.0, get(nodes, (at.AFTER, first + min(next_one + 1, n_z + 1))),
                       get(nodes, (at.AFTER, q + 1)))  # fmt: skip
    low_part = choose(before > 0.0, get(nodes, (at.AFTER, first + last)), get(nodes, (at.AFTER, q)))
    bend = 2.0 * length * length * variance / (over * choose(counts, apart, 1.0))
    # Both flows have equal and opposite weights, so a uniform flow adds nothing. The bound keeps weights positive.
    bend = least_of(bend, 0.5 * high_part / high_over)
    bend = least_of(bend, 0.5 * low_part / low_over)
    bend = choose(counts, bend, 0.0)
    by_high = bend * high_over
    by_low = bend * low_over
    # In each lane this is weights[high] += by_high, weights[high + 1] -= by_high, and for ``low`` with opposite signs.
    after_high = choose(after > 0.0, by_high, 0.0)
    here_high = by_high - after_high
    before_low = choose(before > 0.0, by_low, 0.0)
    here_low = by_low - before_low
    _add(nodes, first + next_one, after_high)
    if line < n_z:
        _add(nodes, first + next_one + 1, 0.0 - after_high)
    _add(nodes, q, here_high - here_low)
    _add(nodes, q + 1, here_low - here_high)
    _add(nodes, first + last, 0.0 - before_low)
    _add(nodes, first + last + 1, before_low)


@inlined_kernel
def _add(nodes, q, value):
    put(nodes, (at.WEIGHT, q), get(nodes, (at.WEIGHT, q)) + value)
