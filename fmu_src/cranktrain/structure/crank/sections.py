"""Pieces of a crankshaft from its dimensions: positions, and mass, centre and moments of their cross-sections.

Nose, main journals, webs, pins, flange and fillets lie along z as in :mod:`cranktrain.structure.crank.shape`. The
section of a piece is constant along z; a fillet is a ring with its mean moments; oil holes are left out. A section is
described by its moments per unit length about the crank's axis,

    ∫ρ [1, x, y][1, x, y]ᵀ dA

The width of a web is that of the hull of the circles about main and pin axis, or of its counterweight if this is wider.
The moments of a web are sums over strips across its throw.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Crankshaft
from cranktrain.structure.crank.shape import Outline, pin_centre, pin_fillets, stations, web_outline

_STRIPS, _FINE = 40, 200
"""Number of strips of a web, and number of quadrature points in each strip."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of the crankshaft with constant cross-section.

    Attributes
    ----------
    kind : ``nose``, ``main``, ``web``, ``pin``, ``flange`` or ``fillet``
    number : number among the pieces of its kind, from 1
    span : (2,) begin and end along z, m
    axis : (2,) x and y of the piece's own axis (of the main axis for a web), m
    angle : angle of the throw of a web or pin, rad
    moments : (3, 3) per unit length about the crank's axis: kg/m, kg, kg m
    """

    kind: str
    number: int
    span: tuple[float, float]
    axis: tuple[float, float]
    angle: float
    moments: Array

    @property
    def length(self) -> float:
        """Length along z, m."""
        return self.span[1] - self.span[0]

    @property
    def middle(self) -> float:
        """Middle along z, m."""
        return 0.5 * (self.span[0] + self.span[1])

    @property
    def polar_inertia(self) -> float:
        """Moment of inertia about the crank's axis, kg m²."""
        return float(self.length * (self.moments[1, 1] + self.moments[2, 2]))


def crank_pieces(engine: Engine) -> list[Piece]:
    """Journals, webs, fillets and ends of the bare crankshaft as pieces, in the order of z."""
    return list(_pieces(engine.crankshaft, engine.material.density))


@lru_cache(maxsize=4)
def _pieces(c: Crankshaft, density: float) -> tuple[Piece, ...]:
    """Pieces of a crankshaft of one density, cached because a torsional crank needs them several times."""
    at = stations(c)
    origin = (0.0, 0.0)
    pieces = [Piece("nose", 1, at.nose, origin, 0.0, _disc(density, c.nose_diameter, origin))]
    main = _disc(density, c.main_diameter, origin)
    pieces += [Piece("main", i, span, origin, 0.0, main) for i, span in enumerate(at.mains, 1)]
    for i, span in enumerate(at.pins, 1):
        x, y, _ = pin_centre(c, i)
        angle = c.throw_angles[i - 1]
        pieces.append(Piece("pin", i, span, (x, y), angle, _disc(density, c.pin_diameter, (x, y))))
    for j, span in enumerate(at.webs, 1):
        outline = web_outline(c, j)
        moments = moved(_turned(density * web_moments(outline), outline.angle), outline.origin)
        pieces.append(Piece("web", j, span, origin, outline.angle, moments))
    pieces += _fillets(c, density)
    pieces.append(Piece("flange", 1, at.flange, origin, 0.0, _disc(density, c.flange_diameter, origin)))
    for piece in pieces:
        piece.moments.flags.writeable = False
    return tuple(sorted(pieces, key=lambda piece: piece.span))


def fillet_rise(c: Crankshaft, distance: Array) -> Array:
    """Radial height of a fillet above its journal (p,), m, at distances (p,) from the adjoining face."""
    inside = c.fillet - np.minimum(distance, c.fillet)
    return np.asarray(c.fillet - np.sqrt(c.fillet**2 - inside**2))


def _fillets(c: Crankshaft, density: float) -> list[Piece]:
    """Rings of all fillets: behind the nose, at pins, and at main journals except where the nose meets the first."""
    if c.fillet == 0.0:
        return []
    at, origin = stations(c), (0.0, 0.0)
    rear = [(c.nose_diameter, origin, at.nose[1])]
    rear += [(c.main_diameter, origin, span[1]) for span in at.mains]
    front = [(c.main_diameter, origin, span[0]) for span in at.mains[1:]]
    for i, span in enumerate(at.pins, 1):
        axis, (before, behind) = pin_centre(c, i)[:2], pin_fillets(c, i)
        if behind > 0.0:
            rear.append((c.pin_diameter, axis, span[1]))
        if before > 0.0:
            front.append((c.pin_diameter, axis, span[0]))
    distance: Array = c.fillet * (np.arange(_FINE, dtype=np.float64) + 0.5) / _FINE
    places = [(d, axis, (z - c.fillet, z)) for d, axis, z in rear]
    places += [(d, axis, (z, z + c.fillet)) for d, axis, z in front]
    rings = []
    for k, (diameter, axis, span) in enumerate(places, 1):
        whole = _disc(density, (diameter + 2.0 * fillet_rise(c, distance))[:, None, None], axis)
        ring = np.mean(whole, axis=0) - _disc(density, diameter, axis)
        rings.append(Piece("fillet", k, span, axis, 0.0, ring))
    return rings


def bare_outline(c: Crankshaft, throw: float) -> Outline:
    """Outline of a web at a main journal without counterweight; its pin lies at +y, ``throw`` (m) from the axis."""
    return Outline(c.web_main_radius, c.web_pin_radius, throw, 0.0)


def web_width(outline: Outline, eta: Array) -> Array:
    """Width (p,), m, of a web across its throw at positions η (p,) along it, counterweight included."""
    big, small, throw = outline.low, outline.high, outline.apart
    width = np.maximum(_chord(eta, big), _chord(eta - throw, small))
    if throw > abs(big - small):
        sine = (big - small) / throw
        cosine = math.sqrt(1.0 - sine**2)
        low, high = big * sine, throw + small * sine
        straight = 2.0 * cosine * (big + (small - big) * (eta - low) / (high - low))
        width = np.maximum(width, np.where((eta >= low) & (eta <= high), straight, 0.0))
    if outline.weight_radius > 0.0:
        disc = np.minimum(_chord(eta, outline.weight_radius), 2.0 * outline.weight_half_width)
        width = np.maximum(width, np.where(eta <= 0.0, disc, 0.0))
    return width


def web_strips(outline: Outline, count: int) -> tuple[Array, Array]:
    """Strips of a web: middles η_i (count,) and moments ∫[1, ξ, η − η_i][1, ξ, η − η_i]ᵀ dA (count, 3, 3)."""
    low = -max(outline.low, outline.weight_radius)
    borders = np.linspace(low, max(outline.apart + outline.high, outline.low), count + 1)
    middles, step = 0.5 * (borders[1:] + borders[:-1]), (borders[1] - borders[0]) / _FINE
    own: Array = step * (np.arange(_FINE, dtype=np.float64) + 0.5 - 0.5 * _FINE)
    width = web_width(outline, (middles[:, None] + own).ravel()).reshape(count, _FINE)
    moments = np.zeros((count, 3, 3))
    moments[:, 0, 0] = step * width.sum(axis=1)
    moments[:, 0, 2] = moments[:, 2, 0] = step * (width * own).sum(axis=1)
    moments[:, 2, 2] = step * (width * own**2).sum(axis=1)
    moments[:, 1, 1] = step * (width**3).sum(axis=1) / 12.0
    return middles, moments


def web_moments(outline: Outline) -> Array:
    """Moments ∫[1, ξ, η][1, ξ, η]ᵀ dA (3, 3) of a web about its first axis, m² to m⁴; η points to its second axis."""
    middles, moments = web_strips(outline, _STRIPS)
    shift = np.tile(np.eye(3), (_STRIPS, 1, 1))
    shift[:, 2, 0] = middles
    return np.asarray((shift @ moments @ shift.swapaxes(1, 2)).sum(axis=0))


def piece_moments(piece: Piece) -> Array:
    """Moments ∫ρ [1, x, y, z][1, x, y, z]ᵀ (4, 4) of a piece about the frame's origin, kg to kg m²."""
    start, end = piece.span
    powers = [(end ** (k + 1) - start ** (k + 1)) / (k + 1) for k in range(3)]
    result = np.empty((4, 4))
    result[:3, :3] = piece.moments * powers[0]
    result[3, :3] = result[:3, 3] = piece.moments[0] * powers[1]
    result[3, 3] = piece.moments[0, 0] * powers[2]
    return result


def crank_moments(engine: Engine) -> Array:
    """Moments (4, 4) of the bare crankshaft about the frame's origin, in the form of :func:`piece_moments`."""
    return np.sum([piece_moments(piece) for piece in crank_pieces(engine)], axis=0)


def interface_places(crankshaft: Crankshaft, thrust_main: int) -> dict[str, tuple[float, float, float]]:
    """Interface positions by name, m: middles of journals, pins, nose (without its fillet), outer face of the flange.

    Order and positions are those of the solid body. Interface ``thrust`` lies in the middle of its journal.
    """
    at = stations(crankshaft)
    mains = {f"main[{i}]": (0.0, 0.0, 0.5 * sum(span)) for i, span in enumerate(at.mains, 1)}
    pins = {f"pin[{i}]": pin_centre(crankshaft, i) for i in range(1, len(at.pins) + 1)}
    nose = 0.5 * (at.nose[0] + at.nose[1] - crankshaft.fillet)
    ends = {"pulley": (0.0, 0.0, nose), "flywheel": (0.0, 0.0, at.flange[1])}
    return mains | pins | ends | {"thrust": mains[f"main[{thrust_main}]"]}


def _disc(density: float, diameter: float | Array, axis: tuple[float, float]) -> Array:
    """Moments (3, 3) per length of a round section about the crank's axis; (k, 3, 3) for diameters (k, 1, 1)."""
    area = 0.25 * math.pi * diameter**2
    place = np.array([1.0, *axis])
    own = np.diag([0.0, 1.0, 1.0]) * area * diameter**2 / 16.0
    return np.asarray(density * (area * np.outer(place, place) + own))


def _chord(distance: Array, radius: float) -> Array:
    """Chord of a circle at a distance from its centre."""
    return np.asarray(2.0 * np.sqrt(np.maximum(radius**2 - distance**2, 0.0)))


def moved(moments: Array, origin: tuple[float, float]) -> Array:
    """Moments (3, 3) of a section about the axis x = y = 0, from its moments about the point ``origin``, m."""
    shift = np.eye(3)
    shift[1:, 0] = origin
    return np.asarray(shift @ moments @ shift.T)


def _turned(moments: Array, angle: float) -> Array:
    """Moments in x, y of a web from its moments in ξ, η, for a throw at ``angle`` from +y about z."""
    cos, sin = math.cos(angle), math.sin(angle)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]])
    return np.asarray(turn @ moments @ turn.T)
