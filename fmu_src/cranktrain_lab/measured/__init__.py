"""Measured signals: files of test benches, rotation from pulses, cylinder pressures, orders."""
