"""Elastic films side by side in the lanes of vector registers."""
