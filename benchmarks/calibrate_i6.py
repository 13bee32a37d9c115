"""Fit what the reference does not publish of diesel_i6 to the frequencies it does publish.

    python benchmarks/calibrate_i6.py

Free are the flywheel's polar inertia, the main bearings' linear stiffness (half of it sideways) and the thrust collar's
contact stiffness. What hangs on them is derived: the pulley's mass and both diametral inertias from radii of gyration
and widths. Torsion counts most (238 assembled, then 252 free), the bending list least. Prints the rounded values that
belong into the engine file and what they give; the finite elements are read from the cache.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import LumpedInertia
from cranktrain.structure.crank.modal import cranktrain_modes, first_axial, free_modes, torsional_frequencies
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft

FLYWHEEL_WIDTH = 0.06
PULLEY_WIDTH = 0.06
PULLEY_GYRATION = 0.052
SIDEWAYS = 0.5

# Name, start, bounds: flywheel kg m², bearing and contact N/m.
PARAMETERS = (
    ("flywheel.polar_inertia", 1.3, 1.0, 1.6),
    ("main_bearing.stiffness_y", 5.0e8, 3.0e8, 1.2e9),
    ("thrust.contact_stiffness", 4.0e9, 2.0e9, 6.0e9),
)
# Target, Hz, and the relative deviation that counts as one.
TARGETS = (
    ("cranktrain torsion 1", 238.0, 0.002),
    ("crankshaft torsion 1", 252.0, 0.006),
    ("crankshaft torsion 2", 690.0, 0.02),
    ("cranktrain torsion 2, mean", 650.0, 0.02),
    ("cranktrain torsion 2", 650.0, np.inf),
    ("cranktrain axial 1", 300.0, 0.01),
    ("cranktrain lowest bending", 208.0, 0.2),
)
# Bending divides the second torsion of the cranktrain among neighbours, and the largest share jumps from one to the
# next: the fit sees their mean in this band, Hz, weighted by their shares of torsion.
SECOND_BAND = (500.0, 800.0)


def disc(mass: float, polar: float, width: float, offset: float) -> LumpedInertia:
    """Disc of revolution with the diametral inertia of its width."""
    return LumpedInertia(mass, polar, 0.5 * polar + mass * width**2 / 12.0, offset)


def with_values(engine: Engine, values: np.ndarray) -> Engine:
    """Engine with the free values and what is derived from them."""
    flywheel, stiffness, contact = values
    pulley = engine.pulley.polar_inertia
    return replace(
        engine,
        flywheel=disc(engine.flywheel.mass, flywheel, FLYWHEEL_WIDTH, engine.flywheel.offset),
        pulley=disc(pulley / PULLEY_GYRATION**2, pulley, PULLEY_WIDTH, engine.pulley.offset),
        main_bearing=replace(engine.plain_mains, stiffness_x=SIDEWAYS * stiffness, stiffness_y=stiffness),
        thrust=replace(engine.thrust, contact_stiffness=contact),
    )


def frequencies(engine: Engine, body) -> np.ndarray:
    """Frequencies in the order of ``TARGETS``, Hz."""
    crankshaft = complete_crankshaft(engine, body)
    free = torsional_frequencies(*free_modes(engine, crankshaft))
    hz, shares = cranktrain_modes(engine, crankshaft)
    torsion = torsional_frequencies(hz, shares)
    bending = hz[np.argmax(shares, axis=1) == 0][0]
    band = (hz > SECOND_BAND[0]) & (hz < SECOND_BAND[1])
    second = np.average(hz[band], weights=shares[band, 1])
    return np.array([torsion[0], *free, second, torsion[1], first_axial(hz, shares), bending])


def rounded(values: np.ndarray) -> np.ndarray:
    """Three significant digits: no more is known."""
    return np.array([float(f"{v:.3g}") for v in values])


def main() -> None:
    """Fit and print."""
    threadpool_limits(1)
    engine = load_engine("diesel_i6")
    body = reduced_crankshaft(engine, progress=lambda text: print(text, file=sys.stderr))
    names, start, low, high = (list(column) for column in zip(*PARAMETERS, strict=True))
    start, low, high = np.array(start), np.array(low), np.array(high)
    target, scale = np.array([t[1] for t in TARGETS]), np.array([t[2] for t in TARGETS])

    def deviation(relative: np.ndarray) -> np.ndarray:
        return (frequencies(with_values(engine, relative * start), body) / target - 1.0) / scale

    fit = least_squares(  # the second torsion changes its bearer among neighbours: a step wider than those jumps
        deviation, np.ones_like(start), bounds=(low / start, high / start), diff_step=1e-3
    )
    values = rounded(fit.x * start)
    fitted = with_values(engine, values)
    for name, value in zip(names, values, strict=True):
        print(f"{name:40s} {value:.4g}")
    print(f"{'main_bearing.stiffness_x':40s} {fitted.plain_mains.stiffness_x:.4g}")
    print(f"{'flywheel.diametral_inertia':40s} {fitted.flywheel.diametral_inertia:.4g}")
    print(f"{'pulley.mass':40s} {fitted.pulley.mass:.4g}")
    print(f"{'pulley.diametral_inertia':40s} {fitted.pulley.diametral_inertia:.4g}")
    for (name, wanted, _), hz in zip(TARGETS, frequencies(fitted, body), strict=True):
        print(f"{name:40s} {hz:8.2f} Hz, published {wanted:g}: {100.0 * (hz / wanted - 1.0):+.2f} %")
    hz, shares = cranktrain_modes(fitted, complete_crankshaft(fitted, body))
    for f, share in zip(hz[:12], shares, strict=False):
        print(f"{f:8.1f} Hz  bending {share[0]:.2f} torsion {share[1]:.2f} axial {share[2]:.2f}")


if __name__ == "__main__":
    main()
