"""Strength of the crankshaft over a run: loads in it, stresses, fatigue, and the rule of classification societies."""
