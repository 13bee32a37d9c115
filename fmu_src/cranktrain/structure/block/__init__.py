"""The engine block: shape, mesh, reduced body, bores."""
