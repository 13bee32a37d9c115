"""The library's functions, one a verb, from the options that the command line declares.

A verb's module declares its options once, as argparse has them. :mod:`keywords` reads them as keywords,
:mod:`writing` writes a function with all of them in its signature into ``functions``, and :mod:`calling` runs the verb
with what a script gives. ``python -m cranktrain.cli.library`` writes the functions anew after a verb has changed.
"""
