"""Look inside a running crankshaft: its stresses, its bearings' orbits and films, and their loads over one cycle."""
