"""Crankshafts from STEP files: recognition of dimensions in their faces, and the resulting engine file."""
