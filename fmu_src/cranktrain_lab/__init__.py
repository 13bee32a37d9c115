"""The laboratory beside :mod:`cranktrain`: measured data, identification, variants, coupling, wear, studies of methods.

It imports the core, which never imports it. :mod:`cranktrain.lab` lists by name the parts that the core's command line
and library offer.
"""
