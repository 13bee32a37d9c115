"""Names of the virtual engine's units, and of who reconstructs pressures between communication points."""

from cranktrain_lab.coupling.reconstruction import DEGREES

CRANKTRAIN, COMBUSTION, VALVETRAIN = "cranktrain", "combustion", "valvetrain"
OWN = "own"
STAGES = "stages"
"""Scheme, and rule of the cranktrain: it is given its inputs at the stages of its integrator."""
RECONSTRUCTIONS = (OWN, *DEGREES)
"""The cranktrain itself, or the master by a polynomial."""
