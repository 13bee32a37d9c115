"""Crankshafts: shape, sections, and bodies of every level of detail."""
