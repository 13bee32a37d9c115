"""The modules of a virtual engine beside its cranktrain, each an FMU of its own.

A module is a folder: its equations, its table of variables (``interface.toml``), its documentation and its data, one
file in ``data`` for each engine that ships with it. :mod:`cranktrain.modules.register` lists them.
"""
