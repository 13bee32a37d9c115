"""ROSS: equilibrium, stiffness and damping of a plain bearing with two axial grooves at five speeds.

Both solve Reynolds' equation with Reynolds' rupture for a smooth rigid bore and one viscosity. ROSS integrates over the
film's height as well, since its viscosity may vary there: that grid counts to its error. Each is judged against its own
finest grid, and these against each other.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from benchmarks.peer_programs.environment import Program, child
from benchmarks.peer_programs.equal_error import Point, beside, listed

from cranktrain.core.reduced_body import Array
from cranktrain.film.steady.bearing import Journal, SteadyBearing, bearing_grid

PROGRAM = Program(("ross-rotordynamics==3.1.0",), "run_ross.py", (3, 13))
BEARING = {"diameter": 0.085, "width": 0.03, "clearance": 4e-5, "viscosity": 0.01}
LOAD, GROOVE = 5000.0, math.radians(20.0)
SPEEDS = np.linspace(1000.0, 4000.0, 5) * math.pi / 30.0
OWN_GRIDS, OWN_FINEST = ((24, 6), (32, 6), (48, 8), (96, 16), (192, 16)), (576, 48)
GRIDS, FINEST = ((20, 8, 10), (40, 10, 10), (40, 20, 30), (80, 20, 30)), (120, 30, 30)
"""Elements around a pad, over the width and through the film; (40, 20, 30) is its default."""
ROUNDS, OTHER_ROUNDS = 9, 3
ERRORS = (0.05, 0.03, 0.012)

Found = tuple[Array, Array, Array]
"""Eccentricities (s,) over the clearance, stiffness and damping, (s, 2, 2)."""


def own_turn(around: int, across: int) -> tuple[float, Found]:
    """Processor seconds of a speed, the grid's making among them, and what is found."""
    began = time.process_time()
    bearing = SteadyBearing(bearing_grid("two-axial", n_phi=around, n_z=across, groove=GROOVE))
    states = [bearing.state(Journal(speed=float(speed), **BEARING), LOAD) for speed in SPEEDS]
    seconds = (time.process_time() - began) / len(SPEEDS)
    places = np.array([np.hypot(*state.eccentricity) for state in states])
    return seconds, (places, np.stack([s.stiffness for s in states]), np.stack([s.damping for s in states]))


def error(found: Found, exact: Found) -> float:
    """Largest over speeds of an entry's difference over the largest entry of its matrix."""
    worst = 0.0
    for values, wanted in zip(found[1:], exact[1:], strict=True):
        size = np.abs(wanted).max(axis=(1, 2))
        worst = max(worst, float((np.abs(values - wanted).max(axis=(1, 2)) / size).max()))
    return worst


def named(grid: Sequence[int]) -> str:
    """How a grid is written."""
    return " × ".join(map(str, grid))


def measured() -> dict[str, Any]:
    """Errors and costs of both."""
    exact = own_turn(*OWN_FINEST)[1]
    own: dict[str, list[float]] = {}
    other: dict[str, list[float]] = {}
    errors: dict[str, float] = {}
    with TemporaryDirectory() as folder:
        job = Path(folder) / "job.npz"
        np.savez(job, speeds=SPEEDS, load=LOAD, groove=GROOVE, **BEARING)
        with child(PROGRAM, job) as ross:

            def turn(grid: tuple[int, ...]) -> tuple[float, Found]:
                found = ross.turn(grid=grid, speeds=len(SPEEDS))
                places, stiffness, damping = (np.array(found[key]) for key in ("eccentricity", "stiffness", "damping"))
                return found["seconds"], (places, stiffness, damping)

            theirs = turn(FINEST)[1]
            for k in range(ROUNDS):
                for grid in OWN_GRIDS:
                    seconds, found = own_turn(*grid)
                    own.setdefault(named(grid), []).append(seconds)
                    errors[f"own {named(grid)}"] = error(found, exact)
                for grid in GRIDS if k < OTHER_ROUNDS else ():
                    seconds, found = turn(grid)
                    other.setdefault(named(grid), []).append(seconds)
                    errors[f"other {named(grid)}"] = error(found, theirs)
            version = ross.about["version"]
    ours = [Point(name, errors[f"own {name}"], statistics.median(each)) for name, each in own.items()]
    others = [Point(name, errors[f"other {name}"], statistics.median(each)) for name, each in other.items()]
    return {
        "program": f"ROSS {version}",
        "compared": "plain bearing with two axial grooves, isothermal: equilibrium, stiffness and damping",
        "cost": "processor time of one speed",
        "difference_of_references": error(theirs, exact),
        "difference_of_eccentricity": float(np.abs(theirs[0] - exact[0]).max()),
        "own": listed(ours),
        "other": listed(others),
        "at_equal_error": beside(ours, others, ERRORS),
        "not_comparable": "ROSS carries a grid through the film and the pads for viscosity by temperature, which this "
        "case does not use and ours has not",
    }
