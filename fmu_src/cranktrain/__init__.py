"""Cranktrain: the dynamics of an engine's cranktrain, as a library and as an FMI 2.0 co-simulation unit."""

__version__ = "0.1.0"
