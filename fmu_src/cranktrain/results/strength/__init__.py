"""Strength of the crankshaft over a run: section loads, stresses, fatigue, and the classification societies' rule."""
