"""Names of the functions that the laboratory, :mod:`cranktrain_lab`, adds to the command line and to the library.

Their modules are loaded at first use. No module of this package imports the laboratory, and only this one names it.
"""

CLI = "cranktrain_lab.cli"
FUNCTIONS = {
    "couple": f"{CLI}.couple:couple",
    "explore": f"{CLI}.explore:explore_page",
    "harness": f"{CLI}.harness:harness",
    "identify": f"{CLI}.identify:identify",
    "measured": f"{CLI}.measured:analyse_measured",
    "mounts": f"{CLI}.mounts:mounts",
    "noise": f"{CLI}.noise:noise",
    "optimize": f"{CLI}.optimize:optimize_file",
    "run-in": f"{CLI}.run_in:run_in",
    "stability": f"{CLI}.stability:stability",
    "tradeoff": f"{CLI}.tradeoff:tradeoff",
    "vary": f"{CLI}.vary:vary_file",
    "watch": f"{CLI}.watch:watch",
}
"""Function of each verb, ``module:function``."""
NAMES = {
    name: f"{CLI}.{module}"
    for module, names in {
        "couple": ("couple", "Couple"), "explore": ("explore",), "harness": ("harness", "RunHarness"),
        "identify": ("identify", "Identify"), "measured": ("analyse_measured", "AnalyseMeasured"),
        "mounts": ("mounts", "Mounts"),
        "noise": ("noise", "Noise"),
        "run_in": ("run_in", "RunIn"), "stability": ("stability", "Stability"), "tradeoff": ("tradeoff", "TradeOff"),
        "variants": ("optimize", "vary"), "watch": ("watch", "Watch"),
    }.items()
    for name in names
}  # fmt: skip
NAMES |= {"Variants": "cranktrain_lab.variants.results.variants", "read_measured": "cranktrain_lab.measured.reading"}
"""Names of the library and their modules."""
FILE_KINDS = {
    "harness": ("Harness file of cranktrain", "cranktrain_lab.harness.tables:HarnessTable"),
    "study": ("Study of variants of cranktrain", "cranktrain_lab.variants.tables:StudyTable"),
    "targets": ("Targets file of cranktrain", "cranktrain_lab.calibration.targets:TargetsTable"),
    "panels": ("Panels file of cranktrain noise", "cranktrain_lab.noise.own_panels:PanelsTable"),
    "measured": ("Measured file of cranktrain", "cranktrain_lab.identification.tables:MeasuredTable"),
}
"""Kinds of files that people write: titles of their schemas, and where their tables are."""
ORDER_CURVES = "cranktrain_lab.measured.order_table:curves_of_file"
"""Reader of measured orders from files that are no text tables."""
STEP_FILES = "cranktrain_lab.cli.new_from_step"
"""Module of ``new --cad``."""
