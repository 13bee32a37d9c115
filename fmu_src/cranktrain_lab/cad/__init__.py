"""Crankshafts of STEP files: what is found in their faces, and the engine file that follows."""
