"""Names of the virtual engine's units, and of the reconstructions of pressures between communication points."""

from cranktrain_lab.coupling.reconstruction import DEGREES

CRANKTRAIN, COMBUSTION, VALVETRAIN = "cranktrain", "combustion", "valvetrain"
OWN = "own"
STAGES = "stages"
"""Scheme and input rule of the cranktrain with inputs set at the stages of its integrator."""
RECONSTRUCTIONS = (OWN, *DEGREES)
"""Reconstructions of pressures: by the cranktrain itself (``OWN``), or by the master with a polynomial."""
