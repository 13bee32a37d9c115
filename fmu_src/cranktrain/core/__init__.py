"""Foundation of all other packages: errors, jit decorator, cache folder, digests of sources, reduced bodies, units."""
