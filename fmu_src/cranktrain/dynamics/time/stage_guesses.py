"""What a stage's first guess takes from the stages before it.

A guess is Taylor's series from the nearest known time, and what that series missed at the same stage a step ago. What
series miss goes with the jerk; so how much more they missed at the stages that are solved already tells how much more
the next one will miss. By how much depends on the method, and on whether a port moves freely or is led by a film.

``WEIGHTS[method][stage][j]`` is therefore fitted, once for each method, by ``python -m benchmarks.stage_guesses``:
least squares over the Newton ports of the six, with beam and solid crank, aligned and tilted films, steps of 1.25 to 10
degrees, 1000 to 2600 rev/min. One set of weights does for all of them within the spread of a set of their own, and
leaves a third to a twentieth of what the guesses missed. Weights decide how many iterations a stage takes, never to
what it converges. A method without weights guesses without.
"""

from __future__ import annotations

WEIGHTS: dict[str, tuple[tuple[float, ...], ...]] = {
    "sdirk3": (
        (),
        (0.73,),
        (0.45, -2.48),
    ),
    "sdirk4": (
        (),
        (-0.07,),
        (0.33, -0.29),
        (0.06, 0.05, 0.23),
        (-0.99, 0.06, 2.72, -5.06),
    ),
    "esdirk3": (
        (),
        (0.0,),
        (0.0, -0.27),
        (0.0, 0.42, 2.24),
    ),
    "esdirk4": (
        (),
        (0.0,),
        (0.0, -0.30),
        (0.0, 0.31, 1.27),
        (0.0, -0.47, -2.37, 0.19),
        (0.0, -0.07, -0.26, 0.67, -0.96),
    ),
    "esdirk5": (
        (),
        (0.0,),
        (0.0, -0.33),
        (0.0, -0.10, -0.25),
        (0.0, -2.38, -9.15, -2.34),
        (0.0, -0.03, -0.14, -0.21, -0.02),
        (0.0, 0.36, 1.81, -2.85, 0.06, 1.72),
        (0.0, -0.46, -2.32, 1.54, -0.09, 0.39, 1.05),
    ),
    "esdirk47": (
        (),
        (0.0,),
        (0.0, 0.47),
        (0.0, -0.16, -0.51),
        (0.0, 0.49, 0.90, 4.08),
        (0.0, -1.06, -1.39, -8.39, 2.22),
        (0.0, -0.35, -0.48, 0.38, -1.71, -0.90),
    ),
    "esdirk57": (
        (),
        (0.0,),
        (0.0, 0.21),
        (0.0, 0.02, -0.29),
        (0.0, -0.15, 1.11, 4.99),
        (0.0, 0.36, 0.20, -2.73, 0.0),
        (0.0, 0.17, 0.0, -1.47, 0.59, -1.34),
    ),
}
