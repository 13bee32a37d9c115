"""What a communication step does between the units' own code: kernels, so that no Python is left in it."""
