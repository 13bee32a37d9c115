"""Names of the virtual engine's units, and of the reconstruction that the cranktrain does itself."""

CRANKTRAIN, COMBUSTION = "cranktrain", "combustion"
OWN = "own"
