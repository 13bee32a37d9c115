"""Arrays of one elastic film for :mod:`cranktrain.film.elastic.film`: grid, bore shapes, compliance.

The grid is fixed to the bore. It has n_φ evenly spaced nodes around, and n_z nodes between the two ends ζ = ±1,
concentrated at the edges; the ends carry no unknown. Bore shapes are given at all n_z + 2 axial lines, because the
least film of a tilted journal lies at an end. Supply acts at nodes. A circumferential groove narrower than the axial
spacing is a line. A small hole is a single node; its flow depends on the grid, because its size is the node's area.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.film.contact.asperity import CONSTANTS as CONTACT_CONSTANTS
from cranktrain.film.contact.asperity import contact_table
from cranktrain.film.contact.gap import STRAIGHT, relief

# Indices of a film's constants: grid sizes, dimensions, oil, supply pressure and roughness, in SI units.
N_PHI, N_Z, N_SHAPES, RADIUS, WIDTH, CLEARANCE, VISCOSITY, SUPPLY_PRESSURE, ROUGHNESS = range(9)
# Further constants: pressure step of the oil table (Pa; 0: constant oil), row of the oil, 1 for a compressible oil.
OIL_STEP, OIL_ROW, COMPRESSIBLE = 9, 10, 11
# Tolerances of a solution, further constants of a film:
# STEP_LIMIT: largest relative change of the film in the last Newton step; the error is about the square of this change.
# MOVE_LIMIT: largest change of a pressure over the highest pressure, or of a void fraction, in the last Newton step.
# SIDE_LIMIT: largest unknown of the wrong sign.
# AROUND_LIMIT: fraction of the transport around the ring that the matrix may neglect.
STEP_LIMIT, MOVE_LIMIT, SIDE_LIMIT, AROUND_LIMIT = 12, 13, 14, 15
CONSTANTS = 16

# Indices of the result of elastic_film, ``out[:OUT_SIZE]``.
FORCE, STIFFNESS, DAMPING, PRESSURE_MAX, FILM_MIN, FILM_MIN_ANGLE, FILM_MIN_ZETA = 0, 4, 20, 36, 37, 38, 39
SIDE_FLOW, SUPPLY_FLOW, FRICTION_TORQUE, CONTACT_LOAD, CONTACT_SHARE, FILL_MEAN, OIL = 40, 41, 42, 43, 44, 45, 46
ITERATIONS, CLIPPED = 47, 48
OUT_SIZE = 49

LIMITS = (1.0e-4, 1.0e-3, 1.0e-11, 1.0e-9)
"""STEP_LIMIT to AROUND_LIMIT of a fully converged film."""
SMOOTH = 5.0e-4
"""Roughness over the clearance used for smooth surfaces, so that overlapping surfaces still have a gap."""

# Columns of ElasticFilm.trig and ElasticFilm.lines.
COS, SIN, FACE_COS, FACE_SIN = range(4)
ZETA, LINE_WIDTH, PROFILE = range(3)
# Rows of ElasticFilm.sides: 1/(Δζ w) towards the next and towards the previous line.
AFTER_SIDE, BEFORE_SIDE = 0, 1
BLOCK = 8
"""Number of right-hand sides that are solved together."""


class ElasticFilm(NamedTuple):
    """Data of one elastic film as contiguous float64 arrays for the kernels."""

    constants: Array
    """(CONSTANTS,) grid sizes, dimensions (SI) and tolerances."""
    trig: Array
    """(n_phi, 4) cosine and sine of nodes, cosine and sine of the faces after them: columns COS to FACE_SIN."""
    lines: Array
    """(n_z + 2, 3) ζ, width w (also weight of contact pressure), relief of the shell over the clearance: columns ZETA
    to PROFILE."""
    sides: Array
    """(2, n_z + 2) 1/(Δζ w) towards the next and the previous line: rows AFTER_SIDE, BEFORE_SIDE."""
    shapes: Array
    """(n_phi (n_z + 2) + n_phi n_z, 8 m) shapes at nodes, then at circumferential faces; column 0 is zero."""
    supply: Array
    """(n_phi n_z,) 1 for nodes at supply pressure, else 0."""
    compliance: Array
    """(k, 4 + k) m/N: derivatives of δ by the forces on the journal (F_x, F_y, Q_x, Q_y) and by the shape loads."""
    contact: Array
    """(CONSTANTS,) constants of :func:`cranktrain.film.contact.asperity.contact_constants`; σ = 0: smooth surfaces."""
    oil: Array
    """(b, n, 2) tables of :mod:`cranktrain.film.elastic.oil`; not used if the oil is constant."""
    contact_table: Array
    """(n, 2) result of :func:`cranktrain.film.contact.asperity.contact_table`."""


class OilTables(NamedTuple):
    """Tables of the reduced pressure q and its slope r/f (density over viscosity) of b oils, over even pressures."""

    step: float  # pressure spacing, Pa
    values: Array  # (b, n, 2): q (Pa) and r/f
    compressible: bool


@dataclass(frozen=True)
class ElasticGrid:
    """Grid on the developed bore, with evenly spaced columns around and graded lines across.

    Parameters
    ----------
    n_phi : int
        nodes around, at least 12
    n_z : int
        nodes between the ends, at least 5
    edge : float
        concentration of the axial nodes at the ends, ζ = (1 − edge) s + edge sin(π s/2) for even s; 0 (uniform) to 0.9
    groove : float
        half width of a groove in mid-bore over that of the bore, or 0; its edges are lines
    lands : tuple of float
        ζ of the n_z/2 − 1 lines between a groove's edge and an end; if empty, these are placed by ``edge``

    Raises
    ------
    InputError
        if the grid is too coarse
    """

    n_phi: int = 72
    n_z: int = 7
    edge: float = 0.3
    groove: float = 0.0
    lands: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.n_phi < 12 or self.n_z < 5:
            raise InputError(f"elastic film: grid {self.n_phi} x {self.n_z} is too coarse; give at least 12 x 5")
        if not 0.0 <= self.edge <= 0.9:
            raise InputError(f"elastic film: concentration of nodes at the ends is {self.edge:g}; give 0 to 0.9")
        if not 0.0 <= self.groove < 1.0:
            raise InputError(f"elastic film: the groove covers {self.groove:g} of the width; give 0 to below 1")
        if self.lands and (2 * len(self.lands) + 2 != self.n_z or not (np.diff((0.0, *self.lands, 1.0)) > 0.0).all()):
            raise InputError(
                f"elastic film: lines at {self.lands} do not fit {self.n_z} lines; give half as many less one, rising"
                " between 0 and 1"
            )

    @property
    def size(self) -> int:
        """Number of node unknowns of one film."""
        return self.n_phi * self.n_z

    @property
    def angles(self) -> Array:
        """Angles of the nodes from the x axis, (n_phi,), rad."""
        return 2.0 * math.pi * np.arange(self.n_phi) / self.n_phi

    @property
    def zetas(self) -> Array:
        """ζ of the axial lines including both ends, (n_z + 2,)."""
        if self.groove == 0.0:
            return self._gathered(np.linspace(-1.0, 1.0, self.n_z + 2))
        if self.lands:
            # A groove wider than half of the first line's ζ moves the lines towards the end.
            shrunk = min(1.0, (1.0 - self.groove) / (1.0 - 0.5 * self.lands[0]))
            land = np.array([self.groove, *(1.0 - shrunk * (1.0 - np.array(self.lands))), 1.0])
            return np.concatenate([-land[::-1], land])
        # The groove has as many spacings as on even lines, at least one or two; each land has at least two.
        spacings = self.n_z + 1
        even = 1 - self.n_z % 2
        inside = 2 * max(round(0.5 * (self.groove * spacings - even)), 1 - even) + even
        inside = min(inside, spacings - 4)
        land = self.groove + (1.0 - self.groove) * self._gathered(np.linspace(0.0, 1.0, (spacings - inside) // 2 + 1))
        return np.concatenate([-land[::-1], np.linspace(-self.groove, self.groove, inside + 1)[1:-1], land])

    def _gathered(self, s: Array) -> Array:
        """Return ζ of lines at even parameters s, from 0 (middle) to 1 (end)."""
        return (1.0 - self.edge) * s + self.edge * np.sin(0.5 * math.pi * s)

    def film(
        self,
        diameter: float,
        width: float,
        clearance: float,
        viscosity: float,
        shapes: Array | None = None,
        compliance: Array | None = None,
        supply: Array | None = None,
        supply_pressure: float = 0.0,
        load_coupling: Array | None = None,
        contact: Array | None = None,
        oil: OilTables | None = None,
        profile: tuple[float, float, float] = STRAIGHT,
    ) -> ElasticFilm:
        """Make the data of one film.

        Parameters
        ----------
        diameter, width, clearance, viscosity : float, m, m, m (radial), Pa s
        shapes : (k, n_phi, n_z + 2) float, optional
            radial displacement of the bore (plus that of the journal) per unit of δ, positive if the film opens
        compliance : (k,) or (k, k) float, m/N, optional
            C in δ = C ∫ S p dA; compliances of journal and bore add
        supply, supply_pressure : (n_phi, n_z) float, optional, and Pa (gauge)
            1 for nodes at supply pressure, else 0
        load_coupling : (k, 4) float, m/N, optional
            g of :class:`cranktrain.film.elastic.bore_compliance.BoreCompliance`: δ += g ∫ (cos φ, sin φ, ζ cos φ, ζ sin
            φ) p dA
        contact : (CONSTANTS,) float, optional
            :func:`cranktrain.film.contact.asperity.contact_constants` of rough surfaces
        oil : OilTables, optional
            :func:`cranktrain.film.elastic.oil.oil_tables`; if None, viscosity and density are constant
        profile : (float, float, float), optional
            depth (m), width fraction and exponent of the shell's relief, see :mod:`cranktrain.film.contact.gap`

        Raises
        ------
        InputError
            if a value is out of range or a shape does not fit the grid
        """
        _check_sizes(diameter, width, clearance, viscosity, supply_pressure)
        forms = np.zeros((0, self.n_phi, self.n_z + 2)) if shapes is None else np.asarray(shapes, dtype=float)
        if forms.ndim != 3 or forms.shape[1:] != (self.n_phi, self.n_z + 2):
            raise InputError(
                f"elastic film: bore shapes have shape {forms.shape}; give (k, {self.n_phi}, {self.n_z + 2}),"
                " values at all nodes and both ends"
            )
        k = len(forms)
        c = _square(np.zeros(0) if compliance is None else np.asarray(compliance, dtype=float), k)
        way = np.zeros((k, 4)) if load_coupling is None else np.asarray(load_coupling, dtype=float)
        if way.shape != (k, 4) or not np.isfinite(way).all():
            raise InputError(f"elastic film: load coupling has shape {way.shape}; give ({k}, 4) finite values")
        rough = np.zeros(CONTACT_CONSTANTS) if contact is None else np.asarray(contact, dtype=float)
        if rough.shape != (CONTACT_CONSTANTS,) or not (np.isfinite(rough).all() and (rough >= 0.0).all()):
            raise InputError("elastic film: contact must be the constants of asperity.contact_constants")
        mask = np.zeros((self.n_phi, self.n_z)) if supply is None else np.asarray(supply, dtype=float)
        if mask.shape != (self.n_phi, self.n_z) or not np.isin(mask, (0.0, 1.0)).all():
            raise InputError(f"elastic film: the supply mask must be {self.n_phi} x {self.n_z} of 0 and 1")
        behind = self.angles + math.pi / self.n_phi
        trig = np.array([np.cos(self.angles), np.sin(self.angles), np.cos(behind), np.sin(behind)])
        rough_share = rough[0] / clearance if rough[0] > 0.0 else SMOOTH
        constants = [self.n_phi, self.n_z, k, 0.5 * diameter, width, clearance, viscosity, supply_pressure, rough_share]
        step, values, compressible = (0.0, np.zeros((1, 2, 2)), False) if oil is None else oil
        constants += [step, 0.0, float(compressible), *LIMITS]
        gaps = np.diff(self.zetas)
        # Contact pressure need not vanish at an end, so it is integrated by the trapezoidal rule.
        widths = 0.5 * (np.append(gaps, 0.0) + np.append(0.0, gaps))
        # Straight shells call no kernel, because small films are made at import.
        g = np.array([relief(zeta, profile) if profile[0] else 0.0 for zeta in self.zetas]) / clearance
        return ElasticFilm(
            np.array(constants, dtype=float),
            np.ascontiguousarray(trig.T),
            np.ascontiguousarray(np.column_stack([self.zetas, widths, g])),
            _per_side(self.zetas, widths),
            _shape_table(forms),
            np.ascontiguousarray(mask.ravel()),
            # Film pressure acts on the journal along −(cos φ, sin φ).
            np.ascontiguousarray(np.concatenate([-way, c], axis=1)),
            rough,
            values,
            contact_table() if rough[0] > 0.0 else np.zeros((8, 2)),
        )


def _check_sizes(diameter: float, width: float, clearance: float, viscosity: float, supply_pressure: float) -> None:
    """Raise ``InputError`` for a dimension that is not positive and finite, or a negative supply pressure."""
    sizes = {"diameter": diameter, "width": width, "clearance": clearance, "viscosity": viscosity}
    for name, value in sizes.items():
        if not (value > 0.0 and math.isfinite(value)):
            raise InputError(f"elastic film: {name} is {value:g}; give a positive value in SI units")
    if not (supply_pressure >= 0.0 and math.isfinite(supply_pressure)):
        raise InputError(f"elastic film: supply pressure is {supply_pressure:g} Pa; give a gauge pressure >= 0")


def _shape_table(forms: Array) -> Array:
    """Return shapes ``forms`` (k, n_phi, n_z + 2) at nodes and circumferential faces in the layout of the kernels."""
    k, n_phi, lines = forms.shape
    nodes = forms.reshape(k, n_phi * lines)
    inside = forms[:, :, 1:-1]
    # Interpolation to faces is cubic, because the conductance depends on the third power of the film there.
    faces = (9.0 * (inside + np.roll(inside, -1, 1)) - np.roll(inside, 1, 1) - np.roll(inside, -2, 1)) / 16.0
    table = np.zeros((n_phi * (2 * lines - 2), BLOCK * ((k + BLOCK) // BLOCK)))
    table[:, 1 : k + 1] = np.concatenate([nodes, faces.reshape(k, n_phi * (lines - 2))], axis=1).T
    return table


def _square(compliance: Array, k: int) -> Array:
    """Return a compliance as a matrix (k, k) after checking it."""
    c = np.diag(compliance) if compliance.ndim == 1 else compliance
    if c.shape != (k, k):
        raise InputError(f"elastic film: compliance of shape {compliance.shape} does not fit {k} bore shapes")
    if k and not (np.isfinite(c).all() and np.allclose(c, c.T, rtol=1e-9, atol=0.0)):
        raise InputError("elastic film: the compliance must be finite and symmetric")
    if k and np.linalg.eigvalsh(c).min() < -1e-12 * abs(c).max():
        raise InputError("elastic film: the compliance has a negative eigenvalue; that of an elastic bore has none")
    return c


def _per_side(zetas: Array, width: Array) -> Array:
    """Return 1/(Δζ w) of each line towards the next and the previous line, (2, n_z + 2); 0 beyond the ends."""
    per_side = np.zeros((2, zetas.size))
    gaps = np.diff(zetas)
    per_side[AFTER_SIDE, :-1] = 1.0 / (gaps * width[:-1])
    per_side[BEFORE_SIDE, 1:] = 1.0 / (gaps * width[1:])
    return per_side
