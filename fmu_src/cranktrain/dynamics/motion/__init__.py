"""Equations of motion and forces of crank, rods, pistons and block."""
