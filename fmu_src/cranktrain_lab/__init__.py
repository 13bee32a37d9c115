"""The laboratory beside :mod:`cranktrain`: measured data, identification, variants, coupling, wear, studies of methods.

It imports the core, which never imports it: what the core's command line and library offer of it is listed by name in
:mod:`cranktrain.lab`.
"""
