"""The reference master on two coupled masses: growth a step and motion, as derived independently.

Values: tests/data/cosimulation.json.
"""

import math

import numpy as np
import pytest
from expected import data
from some import some
from two_mass_units import units

from cranktrain_lab.coupling.master import Exchange, Master
from cranktrain_lab.stability.two_mass import TwoMass

DATA = data("cosimulation")[0]["expected"]
DECOMPOSITIONS = {"FD": "force/displacement", "DD": "displacement/displacement"}
SCHEMES = {"J": ("jacobi", 1), "GS": ("gauss-seidel", 1), "GS12": ("gauss-seidel", 1), "GS21": ("gauss-seidel", -1)}


def label(case):
    return f"{case['decomp']}-{case['scheme']}"


def master(case, start=(1.0, 0.0, 0.0, 0.0)):
    masses, links = units(TwoMass(**case["par"]), DECOMPOSITIONS[case["decomp"]], start)
    scheme, order = SCHEMES[case["scheme"]]
    made = Master(masses[::order], links, Exchange(scheme, "hold"), {"first": ["x1", "v1"], "second": ["x2", "v2"]})
    made.initialize()
    return made


def growth(case, step, steps=4000):
    """Factor by which the motion grows a step, in the long run."""
    made = master(case)
    sizes = np.empty(steps)
    for k in range(steps):
        made.step(made.time + step)
        sizes[k] = np.linalg.norm(made.newest)
    half = steps // 2
    return math.exp(np.polyfit(np.arange(half), np.log(sizes[-half:]), 1)[0])


@pytest.mark.parametrize("case", DATA["cases"], ids=label)
def test_growth_of_each_scheme(case):
    # A shorter step fades too slowly, a longer one overflows.
    for step, radius in some((float(h), rho) for h, rho in case["rho"].items() if 0.1 <= float(h) <= 0.5):
        assert growth(case, step, 1500) == pytest.approx(radius, abs=3e-5)


def test_motion_after_twenty_steps():
    case = next(c for c in DATA["cases"] if (c["decomp"], c["scheme"]) == ("FD", "J"))
    made = master(case)
    for _ in range(20):
        made.step(made.time + 0.2)
    found = [made.newest[made.names.index(name)] for name in ("first.x1", "first.v1", "second.x2", "second.v2")]
    assert found == pytest.approx(DATA["trajectory_A_FD_J_H0p2_20steps_from_x1_1"], rel=1e-10)
