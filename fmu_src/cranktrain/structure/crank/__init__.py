"""Crankshafts: shape, cross-sections, and reduced bodies of every crank level."""
