"""Columns of a bearing's parameters, as :func:`cranktrain.film.laws.register.bearing_parameters` packs them."""

LAW, CLEARANCE, KAPPA2, FACTOR, CONTACT_HEIGHT, CONTACT_LOAD = 0, 1, 2, 3, 4, 5
K_X, K_Y, C_X, C_Y, RADIUS, WIDTH, VISCOSITY = 6, 7, 8, 9, 10, 11, 12
