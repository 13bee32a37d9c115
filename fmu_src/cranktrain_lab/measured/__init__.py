"""Measured signals: test-bench files, rotation from pulses, cylinder pressures, and orders."""
