"""The command line: one file a verb.

Loading this package prepares the process of the command for signals: see :mod:`cranktrain.cli.outside`.
"""

from cranktrain.cli.outside import guard

guard()
