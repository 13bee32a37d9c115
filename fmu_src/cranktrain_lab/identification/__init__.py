"""Identification: parameters of an engine from measured orders, frequencies, shapes and decays, with intervals."""
