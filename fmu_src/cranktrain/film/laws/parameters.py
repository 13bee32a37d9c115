"""Columns of a bearing's parameters, in the order of :func:`cranktrain.film.laws.bearings.bearing_parameters`."""

CLEARANCE, KAPPA2, FACTOR, CONTACT_HEIGHT, CONTACT_LOAD = range(5)
K_X, K_Y, C_X, C_Y, RADIUS, WIDTH, VISCOSITY, RELIEF_DEPTH, RELIEF_SHARE, RELIEF_EXPONENT, COLUMNS = range(5, 16)
