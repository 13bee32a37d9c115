"""Checks of an engine's tables against each other, beyond the bounds of single values."""
