r"""Wear of a bearing shell by rough contact (Archard's law), and decrease of roughness by running in.

The lining wears by the contact pressure p_c of the asperities and the sliding speed v of the journal,

    ∂w/∂t (φ, ζ) = (k/p_H) max(0, p_c(h, σ) − p_c(h_e, σ)) v,

with the wear coefficient k and the hardness p_H of the lining. Running in ends at the gap h_e, beyond which contact is
taken as elastic. For h_e = ∞ this is Archard's law, whose wear never ends but becomes ever slower. The journal is hard
and does not wear.

Contact work smooths the surfaces. The combined roughness σ falls from that of new surfaces σ₀ to that of run-in ones,
σ_∞ = r σ₀, with the depth w̄ that is worn where the surfaces touch (the mean of ∂w/∂t weighted by itself):

    dσ/dw̄ = −(σ − σ_∞)/ℓ

ℓ is of the order of σ₀, because the highest summits wear first. ηβσ, nearly equal for all surfaces, stays constant.
With a constant number η of asperities per area their tips therefore become blunt as β ~ 1/σ, and σ/β falls as σ².

Sources: J. F. Archard, J. Appl. Phys. 24 (1953) 981; ηβσ of about 0.05 on surfaces of all kinds: J. A. Greenwood,
J. H. Tripp, Proc. Inst. Mech. Eng. 185 (1970) 625. The exponential form, r, ℓ and h_e are chosen.
"""

import math
from dataclasses import dataclass, replace

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import kernel
from cranktrain.core.types import Array
from cranktrain.engine.parts import PlainBearing
from cranktrain.film.contact import asperity as rough

COEFFICIENT = 1.0e-8
"""Wear coefficient k of lubricated bearing metals. Surveys of wear coefficients give 1e-9 to 1e-6 for good lubrication
(E. Rabinowicz, Friction and Wear of Materials, Wiley, 1965). The value within this range is chosen and should be
calibrated. Only the product of k and time matters."""
END_GAP = 0.5
"""Gap of the mean planes at which running in ends, over σ₀; chosen, equal to that of the passes of ``run-in``."""
RUN_IN_ROUGHNESS, RUN_IN_DEPTH = 0.5, 1.0
"""Run-in roughness σ_∞ and depth ℓ, both over σ₀; chosen."""
# Settings of worn_rates: clearance (m), (k/p_H) v (m/(s Pa)), pressure without wear (Pa), cycle fraction of a sample.
CLEARANCE, WEAR_SPEED, BEARABLE, SHARE, SETTINGS = range(5)
# Indices of the position of a journal in the shell.
X, Y, TILT_X, TILT_Y = range(4)
# Indices of the maps of worn_rates: wear rate (m/s), decrease of this rate with the wear (1/s), contact pressure (Pa).
RATE, DECREASE, PRESSURE, MAPS = range(4)


@dataclass(frozen=True)
class WearLaw:
    """Parameters of running in.

    Attributes
    ----------
    coefficient : Archard's wear coefficient k
    end_gap : h_e/σ₀; infinite if wear does not end
    run_in_roughness, run_in_depth : σ_∞/σ₀ and ℓ/σ₀
    """

    coefficient: float = COEFFICIENT
    end_gap: float = END_GAP
    run_in_roughness: float = RUN_IN_ROUGHNESS
    run_in_depth: float = RUN_IN_DEPTH

    def __post_init__(self) -> None:
        for name, low, high, example in (
            ("coefficient", 0.0, 1e-2, "lubricated bearing metals have 1e-9 to 1e-6"),
            ("end_gap", -3.0, math.inf, "0.5 of the roughness is usual, inf lets wear go on"),
            ("run_in_roughness", 0.01, 1.0, "1 keeps the roughness of new surfaces"),
            ("run_in_depth", 0.01, 1e3, "1 is a depth of the roughness itself"),
        ):
            value = getattr(self, name)
            if not low <= value <= high or (name == "coefficient" and value == 0.0):
                raise InputError(f"wear: {name} {value:g} is not within {low:g} to {high:g}; {example}")

    def per_work(self, bearing: PlainBearing) -> float:
        """Return k/p_H: worn volume per contact load and sliding distance, m³/J."""
        return self.coefficient / bearing.hardness

    def smoothed(self, bearing: PlainBearing, sigma: float, depth: float) -> float:
        """Return the roughness (m) of surfaces of roughness ``sigma`` (m) after a further ``depth`` (m) of wear.

        ``bearing`` has the new surfaces.
        """
        last = self.run_in_roughness * bearing.roughness
        return last + (sigma - last) * math.exp(-depth / (self.run_in_depth * bearing.roughness))


def worn_surfaces(bearing: PlainBearing, sigma: float) -> PlainBearing:
    """Return ``bearing`` with its new surfaces worn to the roughness ``sigma``, m: ηβσ constant, σ/β with σ²."""
    ratio = sigma / bearing.roughness
    return replace(bearing, roughness=sigma, asperity_ratio=bearing.asperity_ratio * ratio * ratio)


def end_pressure(constants: Array, table: Array, gap: float) -> float:
    """Return the contact pressure (Pa) at the ``gap`` (m) where wear ends; 0 for an infinite gap."""
    return float(rough.contact_pressure(gap, constants, table)[0]) if math.isfinite(gap) else 0.0


# Kernels -------------------------------------------------------------------------------------------------------------


@kernel
def worn_rates(place, shell, line, angles, constants, table, settings, maps):
    """Add one sample of a cycle to the wear maps of a shell. Return the sample's largest pressure (Pa), least gap (m).

    ``place`` (4,) is the position of the journal in the shell's axes, m; ``shell`` (n_ζ,) the excess of the shell's
    radius over a straight shell, m; ``line`` (2, n_ζ) ζ and weight (m) of slices; ``angles`` (2, n_φ) cos, sin of even
    angles; ``constants`` and ``table`` of :mod:`cranktrain.film.contact.asperity`; ``settings``
    (SETTINGS,). ``maps`` (MAPS, n_φ, n_ζ): rate of wear, m/s; its decrease with the wear, 1/s; contact pressure, Pa.
    """
    reach = rough.HIGHEST * constants[rough.SIGMA]
    speed = settings[WEAR_SPEED]
    share = settings[SHARE]
    highest = 0.0
    least = math.inf
    for k in range(line.shape[1]):
        x = place[X] + line[0, k] * place[TILT_X]
        y = place[Y] + line[0, k] * place[TILT_Y]
        room = settings[CLEARANCE] + shell[k]
        nearest = room - math.sqrt(x * x + y * y)
        least = min(least, nearest)
        if nearest >= reach:
            continue
        for j in range(angles.shape[1]):
            h = room - x * angles[0, j] - y * angles[1, j]
            if h >= reach:
                continue
            p, slope, _ = rough.contact_pressure(h, constants, table)
            highest = max(highest, p)
            maps[PRESSURE, j, k] += share * p
            if p > settings[BEARABLE]:
                maps[RATE, j, k] += share * speed * (p - settings[BEARABLE])
                maps[DECREASE, j, k] -= share * speed * slope
    return highest, least
