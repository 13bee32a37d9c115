"""Orders of signals, their resonances, and comparison with measured orders."""
