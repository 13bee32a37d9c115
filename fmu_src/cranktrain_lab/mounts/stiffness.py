"""Dynamic stiffness of an engine's mounts over frequency, and its form with internal states for runs in time.

A mount has one component for each direction. With the relative displacement x its force is K(s) x, with

    K(s) = k + c s + Σ k_b D_b/(k_b + D_b),    D_b = c_b s + m_b s²

A branch b is a spring k_b in series with a damper c_b and a mass m_b that moves against the ground: fluid in its track,
or without mass a Maxwell element. A measured table K(ω) has no states. Its fit has these branches, chosen from fixed
families with all coefficients positive, so that the fitted mount is stable and passive (non-negative least squares,
C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, 1974; relative errors of all points count alike).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls

from cranktrain.core.errors import InputError
from cranktrain.core.rigid_slices import rigid_motion
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.engine.mount_dynamics import AXES

Complex = NDArray[np.complex128]
DIRECTIONS = 6
"""Components of a mount: forces along, then moments about x, y, z."""
GOOD, BAD = 0.05, 0.5
"""Relative error of a fit above which a run in time warns, and above which it is refused."""
_REACH, _POLES = 3.0, 9
"""Range of the Maxwell elements' corner frequencies beyond a table's, as a ratio, and their number."""


class Branch(NamedTuple):
    """Spring k_b (N/m) of the component ``row`` in series with a damper c_b (N s/m) and a mass m_b (kg)."""

    row: int
    stiffness: float
    damping: float
    mass: float

    def at(self, omega: float | Array) -> Complex:
        """Dynamic stiffness at angular frequencies, rad/s."""
        below = 1j * omega * self.damping - np.square(omega) * self.mass
        return np.asarray(self.stiffness * below / (self.stiffness + below))


class Support(NamedTuple):
    """All mounts of an engine, with c components.

    Attributes
    ----------
    motion : (c, 6) displacement of each component per displacement of and rotation about the engine's centre
    stiffness, damping : (c,) constant part, N/m and N s/m, or N m/rad and N m s/rad
    branches : of all components
    tables : (n,) angular frequencies, rad/s, and (n,) complex stiffness by component, in place of all else
    """

    motion: Array
    stiffness: Array
    damping: Array
    branches: tuple[Branch, ...]
    tables: dict[int, tuple[Array, Complex]]

    def at(self, omega: float) -> Complex:
        """Dynamic stiffness (c,) of each component at an angular frequency, rad/s."""
        found: Complex = self.stiffness + 1j * omega * self.damping
        for branch in self.branches:
            found[branch.row] += branch.at(omega)
        for row, (known, values) in self.tables.items():
            found[row] = np.interp(omega, known, values)
        return found

    def whole(self, omega: float) -> Complex:
        """Dynamic stiffness (6, 6) of all mounts for motions of the engine's centre."""
        return np.asarray(self.motion.T @ (self.at(omega)[:, None] * self.motion))


def support_of(engine: Engine, centre: Array) -> Support:
    """Mounts of an engine with its centre of mass (3,), m; ``InputError`` for an engine without mounts."""
    mounts = engine.mounts
    if mounts is None:
        raise InputError(f"engine '{engine.name}' has no [mounts]; add them, or make an engine with new --mounts")
    motion = rigid_motion(np.array(mounts.positions) - centre).reshape(-1, DIRECTIONS)
    branches: list[Branch] = []
    tables: dict[int, tuple[Array, Complex]] = {}
    for one in engine.mount_dynamics:
        for row in [DIRECTIONS * (mount - 1) + AXES.index(axis) for mount in one.mounts for axis in one.axes]:
            if one.frequencies:
                values = np.array(one.stiffness) * (1.0 + 1j * np.array(one.loss_factors))
                tables[row] = 2.0 * np.pi * np.array(one.frequencies), values
            else:
                branches.append(Branch(row, one.fluid_stiffness, one.fluid_damping, one.fluid_mass))
    return Support(motion, np.ravel(mounts.stiffness), np.ravel(mounts.damping), tuple(branches), tables)


def with_states(support: Support) -> tuple[Support, float]:
    """Mounts with each table replaced by its fit, and the largest relative error of a fit at a table's points."""
    stiffness, damping, branches, worst = support.stiffness.copy(), support.damping.copy(), [*support.branches], 0.0
    for row, table in support.tables.items():
        k, c, own, error = fitted(*table)
        stiffness[row], damping[row], worst = k, c, max(worst, error)
        branches += [one._replace(row=row) for one in own]
    return support._replace(stiffness=stiffness, damping=damping, branches=tuple(branches), tables={}), worst


def fitted(omega: Array, values: Complex) -> tuple[float, float, list[Branch], float]:
    """Fit of a table: k, c and branches, and the largest relative error at its points.

    Maxwell elements are tried first. Fluid with a mass is added if they miss the table by more than :data:`GOOD`, for
    example at the dip and the peak of a hydraulic mount.

    Parameters
    ----------
    omega, values : (n,) rad/s and complex stiffness, N/m
    """
    corners = np.geomspace(omega[0] / _REACH, _REACH * omega[-1], _POLES)
    family = [Branch(0, 1.0, 1.0 / corner, 0.0) for corner in corners]
    best = _positive(omega, values, family)
    if best[1] > GOOD:
        grid = [(np.log(w), np.log(z)) for w in np.geomspace(omega[0], omega[-1], 12) for z in (0.1, 0.3, 0.8)]
        start = min(grid, key=lambda one: _positive(omega, values, [*family, _fluid(one)])[2])

        def residual(one: Array) -> Array:
            coefficients, _, _ = _positive(omega, values, [*family, _fluid(one)])
            return _relative(omega, values, [*family, _fluid(one)]) @ coefficients - _ones(omega)

        end = least_squares(residual, start).x
        family = [*family, _fluid(end)]
        best = _positive(omega, values, family)
    (k, c, *shares), error, _ = best
    found = [
        Branch(0, share, share * one.damping, share * one.mass)
        for share, one in zip(shares, family, strict=True) if share > 0.0
    ]  # fmt: skip
    return float(k), float(c), found, error


def _fluid(logarithms: Array | tuple[float, float]) -> Branch:
    """Branch of unit stiffness from the logarithms of its natural frequency (rad/s) and damping ratio."""
    frequency, ratio = np.exp(logarithms)
    return Branch(0, 1.0, 2.0 * ratio / frequency, 1.0 / frequency**2)


def _relative(omega: Array, values: Complex, family: list[Branch]) -> Array:
    """Contributions (2n, 2 + f) of k, c and branches of unit stiffness over the table's values, real and imaginary."""
    columns = np.column_stack((np.ones_like(omega), 1j * omega, *(one.at(omega) for one in family))) / values[:, None]
    return np.vstack((columns.real, columns.imag))


def _ones(omega: Array) -> Array:
    return np.repeat((1.0, 0.0), omega.size)


def _positive(omega: Array, values: Complex, family: list[Branch]) -> tuple[Array, float, float]:
    """Coefficients that are not negative, the largest relative error at a point, and the root of the sum of squares."""
    matrix = _relative(omega, values, family)
    size = np.linalg.norm(matrix, axis=0)
    coefficients, norm = nnls(matrix / size, _ones(omega))
    missed = np.hypot(*(matrix @ (coefficients / size) - _ones(omega)).reshape(2, -1))
    return coefficients / size, float(missed.max()), float(norm)
