"""Identification of engine parameters, with confidence intervals, from orders, frequencies, shapes and decays."""
