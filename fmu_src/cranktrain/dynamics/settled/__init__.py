"""Cycles that repeat: how far a cycle is from the periodic one, and how to reach that in a few cycles."""
