"""Reduced bodies of crankshaft, block and rods from their geometry. Made offline, never part of a running model."""
