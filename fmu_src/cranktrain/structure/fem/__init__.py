"""Finite elements: meshes, elasticity, interfaces, factors, Craig–Bampton reduction."""
