"""``python -m cranktrain``: the command line, as the script ``cranktrain`` runs it."""

import sys

from cranktrain.cli.main import main

sys.exit(main())
