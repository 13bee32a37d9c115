"""Initial state of a run: mean rotation, static equilibrium."""
