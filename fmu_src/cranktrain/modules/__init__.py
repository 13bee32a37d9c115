"""Modules of a virtual engine other than its cranktrain, each an FMU of its own.

A module is a folder with its equations, its table of variables (``interface.toml``), its documentation and its data
(one file in ``data`` for each engine that has one). :mod:`cranktrain.modules.register` lists the modules.
"""
