"""Solvers that know nothing of the model's structure, on our own equations: what the stage solver is compared with."""
