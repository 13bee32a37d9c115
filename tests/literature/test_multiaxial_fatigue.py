"""Findley's criterion on measured limits of bending and torsion together, in phase and out of it."""

import math

import numpy as np
import pytest
from expected import data

from cranktrain.results.strength.critical_plane import findley_constants, worst_plane

(STEEL,) = data("multiaxial_fatigue")
TURN = np.linspace(0.0, 2.0 * math.pi, 360, endpoint=False)


def tensors(bending, shear, phase=0.0):
    found = np.zeros((TURN.size, 6))
    found[:, 0], found[:, 3] = bending * np.sin(TURN), shear * np.sin(TURN - phase)
    return found


def present(history):
    """What the criterion makes of a history, over what is endured."""
    k, limit = findley_constants(STEEL["bending_limit"], STEEL["torsion_limit"])
    plane = worst_plane(history, k)
    return (plane.shear + k * plane.normal) / limit


@pytest.mark.parametrize("row", STEEL["limits"], ids=lambda row: "/".join(map(str, row)))
def test_measured_limits(row):
    bending, shear, phase = row
    # Findley's error on this steel; the scatter of such limits is about as large.
    assert present(tensors(bending, shear, math.radians(phase))) == pytest.approx(1.0, abs=0.1)


def test_the_two_limits_that_it_is_made_from():
    # 5 degrees between planes: at most 0.2 % less.
    assert present(tensors(STEEL["bending_limit"], 0.0)) == pytest.approx(1.0, abs=2e-3)
    assert present(tensors(0.0, STEEL["torsion_limit"])) == pytest.approx(1.0, abs=2e-3)
