"""Names of the virtual engine's units, and of who reconstructs pressures between communication points."""

from cranktrain.coupling.reconstruction import DEGREES

CRANKTRAIN, COMBUSTION, VALVETRAIN = "cranktrain", "combustion", "valvetrain"
OWN = "own"
RECONSTRUCTIONS = (OWN, *DEGREES)
"""The cranktrain itself, or the master by a polynomial."""
