"""What the laboratory, :mod:`cranktrain_lab`, adds to the command line and to the library: the one file that names it.

All of it is loaded when it is asked for; no module of this package imports the laboratory.
"""

VERBS = (
    "calibrate", "couple", "explore", "harness", "identify", "measured", "optimize", "run-in", "stability", "tradeoff",
    "vary", "watch",
)  # fmt: skip
"""Verbs whose modules are in its ``cli``."""
CLI = "cranktrain_lab.cli"
FUNCTIONS = {"couple": f"{CLI}.couple:couple"}
"""Function of each verb, ``module:function``."""
NAMES = {
    "Variants": "cranktrain_lab.variants.results.variants",
    "couple": "cranktrain_lab.cli.couple",
    "explore": "cranktrain_lab.library.explore",
    "optimize": "cranktrain_lab.library.variants",
    "read_measured": "cranktrain_lab.measured.reading",
    "vary": "cranktrain_lab.library.variants",
}
"""Names of the library and their modules."""
FILE_KINDS = {
    "harness": ("Harness file of cranktrain", "cranktrain_lab.harness.tables:HarnessTable"),
    "study": ("Study of variants of cranktrain", "cranktrain_lab.variants.tables:StudyTable"),
    "targets": ("Targets file of cranktrain", "cranktrain_lab.calibration.targets:TargetsTable"),
    "measured": ("Measured file of cranktrain", "cranktrain_lab.identification.tables:MeasuredTable"),
}
"""Kinds of files that people write: titles of their schemas, and where their tables are."""
ORDER_CURVES = "cranktrain_lab.measured.order_table:curves_of_file"
"""Reader of measured orders from files that are no text tables."""
STEP_FILES = "cranktrain_lab.cli.new_from_step"
"""Module of ``new --step``."""
