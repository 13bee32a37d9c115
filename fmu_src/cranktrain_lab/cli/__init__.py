"""Verbs of the command line that belong to the laboratory, one module a verb, as in :mod:`cranktrain.cli`."""
