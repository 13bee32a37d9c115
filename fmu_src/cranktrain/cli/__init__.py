"""The command line: one file a verb.

Loading this package prepares the process of the command for signals: see :mod:`cranktrain.cli.signals`.
"""

from cranktrain.cli.signals import guard

guard()
