"""Coefficients of the methods, each as a table in the slots of :mod:`cranktrain.dynamics.time.table`.

In a stage of every method here q = Q + c_q a and v = V + c_v a, where the true acceleration a is unknown:

* diagonally implicit Runge–Kutta methods with equal diagonal γ (c_q = (hγ)², c_v = hγ), all stiffly accurate and
  L-stable: ``backward-euler`` (order 1, 1 stage), ``tr-bdf2`` (2, first stage explicit; Bank et al. 1985), ``sdirk2``
  (2 stages; Alexander 1977), ``sdirk3`` (3 stages; Alexander 1977), ``sdirk4`` (4, 5 stages; Hairer & Wanner II, table
  IV.6.5), and with an explicit first stage and stages of order two, which keep their order where films are stiff,
  ``esdirk3``, ``esdirk4`` and ``esdirk5`` (3, 5 and 7 implicit stages; Kennedy & Carpenter 2003, the implicit halves of
  their ARK3(2)4L[2]SA, ARK4(3)6L[2]SA and ARK5(4)8L[2]SA), ``esdirk47`` (order 4, 6 implicit stages of half the γ of
  ``esdirk4``; the implicit half of ARK4(3)7L[2]SA1, Kennedy & Carpenter, Appl. Numer. Math. 136 (2019) 183) and
  ``esdirk57`` (order 5, 6 implicit stages; ESDIRK5(4)7L[2]SA2, Kennedy & Carpenter, Appl. Numer. Math. 146 (2019) 221);
* methods with one implicit stage, of Newmark's form q₁ = q₀ + h v₀ + h² [(½−β) ā₀ + β ā₁], v₁ likewise with γ:
  generalised-α in the form of Arnold & Brüls (2007) with an auxiliary acceleration ā in addition to the true one,
  (1−α_m) ā₁ + α_m ā₀ = (1−α_f) v̇₁ + α_f v̇₀, so that a mass matrix which varies with the state keeps second order;
  c_q = βκh², c_v = γκh, κ = (1−α_f)/(1−α_m). ``generalised-alpha`` takes ρ∞ in [0, 1]. With α_m = 0 it is ``hht``,
  which takes α in [−1/3, 0] (Hilber, Hughes & Taylor 1977), with both zero the ``trapezoidal`` rule;
* ``bdf2``, two steps: c_q = (2h/3)², c_v = 2h/3. After a change of the step Taylor's series replaces the last step.
"""

import math

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.time.table import (
    ALPHA_F,
    ALPHA_M,
    BETA,
    C_Q,
    C_V,
    EXPLICIT_FIRST,
    FIRST_STAGE,
    GAMMA,
    HEAD,
    NODE,
    STAGES,
    WIDTH,
)


def one_stage(c_q: float, c_v: float) -> Array:
    """Table of a method with one implicit stage at the end of the step; ``c_q`` is c_q/h², ``c_v`` is c_v/h."""
    table = np.zeros((2, WIDTH))
    table[HEAD, [STAGES, C_Q, C_V]] = 1, c_q, c_v
    table[FIRST_STAGE, NODE] = 1.0
    return table


def runge_kutta(matrix: list[list[float]], embedded: list[float] | None = None) -> Array:
    """Table of a stiffly accurate diagonally implicit method; its first stage is explicit if a_11 is 0.

    ``embedded`` are the weights of its embedded solution.
    """
    s = len(matrix)
    a = np.zeros((s, s))
    for row, values in zip(a, matrix, strict=True):
        row[: len(values)] = values
    table = np.zeros((s + 1 + (embedded is not None), WIDTH))
    gamma = float(a[-1, -1])
    table[HEAD, [STAGES, C_Q, C_V, EXPLICIT_FIRST]] = s, gamma * gamma, gamma, a[0, 0] == 0.0
    table[FIRST_STAGE : s + 1, :s] = a
    table[FIRST_STAGE : s + 1, NODE] = a.sum(axis=1)
    if embedded is not None:
        table[s + 1, :s] = a[-1] - embedded
    return table


def newmark(alpha_m: float, alpha_f: float, beta: float, gamma: float) -> Array:
    """Table of a method of Newmark's form."""
    kappa = (1.0 - alpha_f) / (1.0 - alpha_m)
    table = one_stage(beta * kappa, gamma * kappa)
    table[HEAD, [ALPHA_M, ALPHA_F, BETA, GAMMA]] = alpha_m, alpha_f, beta, gamma
    return table


def generalised_alpha(rho: float) -> Array:
    """Table of generalised-α with spectral radius 0 ≤ ``rho`` ≤ 1 at infinite frequency (Chung & Hulbert 1993)."""
    alpha_f, alpha_m = rho / (rho + 1.0), (2.0 * rho - 1.0) / (rho + 1.0)
    gamma = 0.5 - alpha_m + alpha_f
    return newmark(alpha_m, alpha_f, 0.25 * (gamma + 0.5) ** 2, gamma)


def hht(alpha: float) -> Array:
    """Table of the method of Hilber, Hughes and Taylor, −1/3 ≤ ``alpha`` ≤ 0."""
    return newmark(0.0, -alpha, 0.25 * (1.0 - alpha) ** 2, 0.5 - alpha)


def trapezoidal() -> Array:
    """Table of the trapezoidal rule."""
    return newmark(0.0, 0.0, 0.25, 0.5)


def bdf2() -> Array:
    """Table of the two-step backward differentiation formula."""
    return one_stage(2.0 / 3.0 * (2.0 / 3.0), 2.0 / 3.0)


def backward_euler() -> Array:
    """Table of the implicit Euler method."""
    return runge_kutta([[1.0]])


def tr_bdf2() -> Array:
    """Table of TR-BDF2."""
    g, w = _TWO_STAGES, 0.25 * math.sqrt(2.0)
    return runge_kutta([[0.0], [g, g], [w, w, g]])


def sdirk2() -> Array:
    """Table of Alexander's method of order two."""
    g = _TWO_STAGES
    return runge_kutta([[g], [1 - g, g]])


def sdirk3() -> Array:
    """Table of Alexander's method of order three."""
    # The root of γ³ − 3γ² + 3γ/2 − 1/6 between 1/6 and 1/2: L-stability of the three-stage method of order three.
    roots = np.roots([1.0, -3.0, 1.5, -1.0 / 6.0]).real
    g = float(next(r for r in roots if 1.0 / 6.0 < r < 0.5))
    b1, b2 = -0.25 * (6 * g * g - 16 * g + 1), 0.25 * (6 * g * g - 20 * g + 5)
    return runge_kutta([[g], [0.5 * (1 - g), g], [b1, b2, g]])


def sdirk4() -> Array:
    """Table of Hairer and Wanner's method of order four."""
    return runge_kutta(
        [
            [1 / 4],
            [1 / 2, 1 / 4],
            [17 / 50, -1 / 25, 1 / 4],
            [371 / 1360, -137 / 2720, 15 / 544, 1 / 4],
            [25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4],
        ],
        [59 / 48, -17 / 96, 225 / 32, -85 / 12, 0.0],
    )


def esdirk3() -> Array:
    """Table of Kennedy and Carpenter's method of order three."""
    return _explicit_first(
        1767732205903 / 4055673282236,
        [
            [1767732205903 / 4055673282236],
            [2746238789719 / 10658868560708, -640167445237 / 6845629431997],
            [1471266399579 / 7840856788654, -4482444167858 / 7529755066697, 11266239266428 / 11593286722821],
        ],
        [
            2756255671327 / 12835298489170,
            -10771552573575 / 22201958757719,
            9247589265047 / 10645013368117,
            2193209047091 / 5459859503100,
        ],
    )


def esdirk4() -> Array:
    """Table of Kennedy and Carpenter's method of order four."""
    return _explicit_first(
        1 / 4,
        [
            [1 / 4],
            [8611 / 62500, -1743 / 31250],
            [5012029 / 34652500, -654441 / 2922500, 174375 / 388108],
            [15267082809 / 155376265600, -71443401 / 120774400, 730878875 / 902184768, 2285395 / 8070912],
            [82889 / 524892, 0.0, 15625 / 83664, 69875 / 102672, -2260 / 8211],
        ],
        [
            4586570599 / 29645900160,
            0.0,
            178811875 / 945068544,
            814220225 / 1159782912,
            -3700637 / 11593932,
            61727 / 225920,
        ],
    )


def esdirk5() -> Array:
    """Table of Kennedy and Carpenter's method of order five."""
    return _explicit_first(
        41 / 200,
        [
            [41 / 200],
            [41 / 400, -567603406766 / 11931857230679],
            [683785636431 / 9252920307686, 0.0, -110385047103 / 1367015193373],
            [
                3016520224154 / 10081342136671,
                0.0,
                30586259806659 / 12414158314087,
                -22760509404356 / 11113319521817,
            ],
            [
                218866479029 / 1489978393911,
                0.0,
                638256894668 / 5436446318841,
                -1179710474555 / 5321154724896,
                -60928119172 / 8023461067671,
            ],
            [
                1020004230633 / 5715676835656,
                0.0,
                25762820946817 / 25263940353407,
                -2161375909145 / 9755907335909,
                -211217309593 / 5846859502534,
                -4269925059573 / 7827059040749,
            ],
            [
                -872700587467 / 9133579230613,
                0.0,
                0.0,
                22348218063261 / 9555858737531,
                -1143369518992 / 8141816002931,
                -39379526789629 / 19018526304540,
                32727382324388 / 42900044865799,
            ],
        ],
        [
            -975461918565 / 9796059967033,
            0.0,
            0.0,
            78070527104295 / 32432590147079,
            -548382580838 / 3424219808633,
            -33438840321285 / 15594753105479,
            3629800801594 / 4656183773603,
            4035322873751 / 18575991585200,
        ],
    )


def esdirk47() -> Array:
    """Table of Kennedy and Carpenter's method of order four with six implicit stages."""
    second, third, fourth, fifth = (
        624185399699 / 4186980696204,
        1258591069120 / 10082082980243,
        -436103496990 / 5971407786587,
        -2207373168298 / 14430576638973,
    )
    return _explicit_first(
        247 / 2000,
        [
            [247 / 2000],
            [second, second],
            [third, third, -322722984531 / 8455138723562],
            [fourth, fourth, -2689175662187 / 11046760208243, 4431412449334 / 12995360898505],
            [
                fifth,
                fifth,
                242511121179 / 3358618340039,
                3145666661981 / 7780404714551,
                5882073923981 / 14490790706663,
            ],
            [
                0.0,
                0.0,
                9164257142617 / 17756377923965,
                -10812980402763 / 74029279521829,
                1335994250573 / 5691609445217,
                2273837961795 / 8368240463276,
            ],
        ],
        [
            0.0,
            0.0,
            4469248916618 / 8635866897933,
            -621260224600 / 4094290005349,
            696572312987 / 2942599194819,
            1532940081127 / 5565293938103,
            2441 / 20000,
        ],
    )


def esdirk57() -> Array:
    """Table of Kennedy and Carpenter's method of order five with six implicit stages."""
    gamma = 23 / 125
    nodes = [
        2 * gamma, 7121331996143 / 11335814405378, 49 / 353, 3706679970760 / 5295570149437, 347 / 382, 1.0,
    ]  # fmt: skip
    behind_first = [
        [],
        [791020047304 / 3561426431547],
        [-158159076358 / 11257294102345, -85517644447 / 5003708988389],
        [-1653327111580 / 4048416487981, 1514767744496 / 9099671765375, 14283835447591 / 12247432691556],
        [
            -4540011970825 / 8418487046959,
            -1790937573418 / 7393406387169,
            10819093665085 / 7266595846747,
            4109463131231 / 7386972500302,
        ],
        [
            -188593204321 / 4778616380481,
            2809310203510 / 10304234040467,
            1021729336898 / 2364210264653,
            870612361811 / 2470410392208,
            -1307970675534 / 8059683598661,
        ],
    ]
    embedded = [
        -582099335757 / 7214068459310,
        615023338567 / 3362626566945,
        3192122436311 / 6174152374399,
        6156034052041 / 14430468657929,
        -1011318518279 / 9693750372484,
        1914490192573 / 13754262428401,
    ]
    below = [[c - sum(row) - gamma, *row] for c, row in zip(nodes, behind_first, strict=True)]
    return _explicit_first(gamma, below, [1.0 - sum(embedded), *embedded])


def _explicit_first(gamma: float, below: list[list[float]], embedded: list[float]) -> Array:
    """Table of a method with explicit first stage, from the coefficients below its diagonal."""
    return runge_kutta([[0.0]] + [[*row, gamma] for row in below], embedded)


_TWO_STAGES = 1.0 - 0.5 * math.sqrt(2.0)
"""Diagonal coefficient γ of the L-stable methods of order two with two implicit stages."""
