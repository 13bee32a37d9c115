"""Equations of motion: what acts on crank, rods, pistons and block."""
