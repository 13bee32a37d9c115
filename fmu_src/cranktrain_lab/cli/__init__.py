"""Verbs of the command line that belong to the laboratory, one module for each verb, as in :mod:`cranktrain.cli`."""
