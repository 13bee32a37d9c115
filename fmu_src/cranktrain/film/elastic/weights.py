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

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.film.contact.gap import open_gap
from cranktrain.film.elastic.balance import side_conductance
from cranktrain.film.elastic.grid import CHANGE, FILM, N_PHI, N_Z, ROUGHNESS, WEIGHT, ZETA
from cranktrain.film.elastic.height import node_films

NEAR, FAR = 0.5 - 0.5 / 3.0**0.5, 0.5 + 0.5 / 3.0**0.5
"""Points of Gauss's two-point rule on [0, 1]."""


@kernel
def film_weights(film, place, shift, nodes):
    """Compute the weights of all nodes and both ends, in ``nodes[WEIGHT]``, for a film at ``place`` (4,) and ``shift``.

    Arguments are as in :func:`cranktrain.film.elastic.height.node_films`. Rows FILM and CHANGE are overwritten.
    """
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    h = nodes[FILM]
    conductance = nodes[CHANGE]
    weights = nodes[WEIGHT]
    node_films(film, place, shift, h)
    for q in range(h.shape[0]):
        h[q], _, _ = open_gap(h[q], film.constants[ROUGHNESS])
        weights[q] = 0.0
    for i in range(int(film.constants[N_PHI])):
        first = i * lines
        for line in range(n_z + 1):
            q = first + line
            over, _, _ = side_conductance(h[q], h[q + 1])
            conductance[q] = over / (film.lines[line + 1, ZETA] - film.lines[line, ZETA])
        for line in range(n_z + 1):
            # The flow jumps at a supply, so its change is taken from neighbours on the same side of the supply.
            before = line > 0 and film.supply[i * n_z + line - 1] == 0.0
            after = line < n_z and film.supply[i * n_z + line] == 0.0
            _add_spacing(film, first, line, line - 1 if before else line, line + 1 if after else line, nodes)


@inlined_kernel
def _add_spacing(film, first, line, low, high, nodes):
    """Add the weights of the interval after a ``line``; intervals ``low`` and ``high`` give the flow's slope q′."""
    h = nodes[FILM]
    weights = nodes[WEIGHT]
    conductance = nodes[CHANGE]
    q = first + line
    own = h[q]
    beyond = h[q + 1]
    zeta = film.lines[line, ZETA]
    length = film.lines[line + 1, ZETA] - zeta
    share = own / (own + beyond)
    weights[q] += length * share
    weights[q + 1] += length * (1.0 - share)
    if low == high:
        return
    near = own + NEAR * (beyond - own)
    far = own + FAR * (beyond - own)
    near = near * near * near
    far = far * far * far
    variance = near * far / (3.0 * (near + far) * (near + far))
    apart = film.lines[high, ZETA] + film.lines[high + 1, ZETA] - film.lines[low, ZETA] - film.lines[low + 1, ZETA]
    bend = 2.0 * length * length * variance / (conductance[q] * apart)
    # Both flows have equal and opposite weights, so a uniform flow adds nothing. The bound keeps weights positive.
    bend = min(bend, 0.5 * _wedge_weight(film, h, first, high + 1) / conductance[first + high])
    bend = min(bend, 0.5 * _wedge_weight(film, h, first, low) / conductance[first + low])
    by_high = bend * conductance[first + high]
    by_low = bend * conductance[first + low]
    weights[first + high] += by_high
    weights[first + high + 1] -= by_high
    weights[first + low] -= by_low
    weights[first + low + 1] += by_low


@inlined_kernel
def _wedge_weight(film, h, first, line):
    """Return the weight of a line from the spacings on both sides, without the term of the flow's slope q′."""
    n_z = int(film.constants[N_Z])
    q = first + line
    weight = 0.0
    if line > 0:
        weight += (film.lines[line, ZETA] - film.lines[line - 1, ZETA]) * h[q] / (h[q] + h[q - 1])
    if line <= n_z:
        weight += (film.lines[line + 1, ZETA] - film.lines[line, ZETA]) * h[q] / (h[q] + h[q + 1])
    return weight
