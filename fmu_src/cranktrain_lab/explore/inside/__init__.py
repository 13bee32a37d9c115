"""View inside a running crankshaft over one cycle: stresses, orbits, films and loads of bearings."""
