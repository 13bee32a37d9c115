"""Where a run starts: mean rotation, static equilibrium."""
