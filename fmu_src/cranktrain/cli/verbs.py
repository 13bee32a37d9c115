"""Table of all verbs by group, with a line for each, so that the list of verbs loads no other module.

The line is the first line of the verb's ``DESCRIPTION``; a test compares both. The first word of a two-word name is the
family, such as ``bearing table``.
"""

from cranktrain import lab

GROUPS = {
    "engine files": {
        "engines": "The engines that ship with the package: name, title, layout, displacement and firing order.",
        "new": "Write a complete engine file from a layout and a few sizes.",
        "schema": "The JSON schema of a kind of file: engine, scene, superelement, combustion, valve-train, harness, "
        "study, targets, panels, measured.",
        "reduce": "Make and check the reduced crankshaft, and block, kept in the cache; write them elsewhere.",
    },
    "vibration": {
        "modal": "Free crankshaft and cranktrain frequencies beside the reference's, and critical speeds.",
        "campbell": "Campbell diagram: frequencies of the cranktrain at rest over the speed, modes followed through "
        "crossings.",
        "simulate": "Run at constant speed until cycles repeat; write an HDF5 result and print a summary.",
        "runup": "Orders of torsion and axial motion over speed, from steady cycles; resonances, each with the mode "
        "it belongs to.",
        "plot": "Pictures of a run-up: orders and twist over speed, named resonances, waterfall, colour map, "
        "Campbell diagram, motion.",
        "compare": "Differences of a result from another or from measured orders, by cycle, orders and peaks, with "
        "a verdict.",
        "mounts": "The rigid engine on its mounts: six named modes, mount forces by order over speed, start and stop.",
        "picture": "The crankshaft in three dimensions, in a mode or as it runs: picture (PNG), animation (GIF, MP4) "
        "or page (HTML).",
        "noise": "Velocity of the block's outer surfaces, third-octave levels by panel, and the sound power that they "
        "radiate.",
        "damper-optimum": "Optimum damping of a torsional damper, for two masses or for a torsional mode of an engine.",
    },
    "bearings": {
        "bearing plain": "One plain bearing: load, attitude, flow, friction, stiffness and damping.",
        "bearing roller": "Cylindrical roller bearing: deflection, roller loads, radial and tilting stiffness.",
        "bearing table": "Make the film table of bearings with one width-to-diameter ratio; it is kept in the cache.",
        "bearing-loads": "Bearings over a cycle at one speed or several: loads, films, friction, oil flow, held "
        "against limits.",
        "run-in": "Axial profile that the shells of the main bearings wear to at the lowest speed of full load.",
    },
    "strength": {
        "stress": "Stress tensor and von Mises stress of the solid crankshaft's surface over a cycle.",
        "fatigue": "Safety factors of the crankshaft's fillets and oil bores over the cycle, and acceptability by rule "
        "IACS UR M53.",
    },
    "plan and report": {
        "plan": "The plan for a scene: which levels and step serve it, why, and with which error and computing time.",
        "report": "Report of an engine as one HTML file: verdict against the limits of its file, frequencies, "
        "vibration, bearings, origins.",
        "export": "Write a result or run-up file as a table: CSV, Parquet (needs pyarrow) or NumPy's archive.",
    },
    "test bench": {
        "measured": "Show and analyse measured signals: channels, rotation from pulses, orders over speed, cylinder "
        "pressures.",
        "identify": "Find parameters of an engine from measured data: damping, damper, inertias, shafts, load, with "
        "95 % intervals.",
        "watch": "Find misfires, worn dampers and cracked springs from measured orders of the pulley's torsion alone.",
    },
    "FMUs and coupling": {
        "fmu": "Build the FMU of an engine, a scene, or a module.",
        "couple": "Couple cranktrain, combustion and valve train as FMUs, and run cycles at constant speed.",
        "harness": "Run the scenarios of a harness file and check its assertions.",
    },
    "studies": {
        "vary": "Many variants of an engine: tolerances and choices as distributions; percentiles, sensitivities, "
        "Pareto front.",
        "optimize": "The variant of an engine with the least of one output, under limits of others: a damper by "
        "twist, heat and stress.",
        "explore": "A local page where knobs turn an engine's torsional vibration, and curves follow at once.",
        "tradeoff": "Accuracy against speed: error over cost of methods, levels and resolutions, with the Pareto "
        "front.",
        "stability": "Maps of where numerical methods become unstable or inaccurate, beside theory, drawn and "
        "explained.",
    },
}
"""Description of each verb in one line, by group."""
VERBS = {name: line for group in GROUPS.values() for name, line in group.items()}
"""Description of each verb in one line."""
FAMILIES = {
    family: tuple(name.partition(" ")[2] for name in VERBS if name.startswith(f"{family} "))
    for family in dict.fromkeys(name.partition(" ")[0] for name in VERBS if " " in name)
}
"""Second words of each family of verbs."""
FORMER = {
    "calibrate": "identify ENGINE TARGETS",
    "film-table": "bearing table",
    "plot-runup": "plot",
    "roller": "bearing roller",
    "run": "plan SCENE --run",
}
"""Names of verbs before the first release, with the present command."""
FUNCTIONS = {
    "simulate": "cranktrain.cli.simulate:simulate",
    "modal": "cranktrain.cli.modal:modal",
    "campbell": "cranktrain.cli.campbell:campbell",
    "runup": "cranktrain.cli.runup:runup",
    "plot": "cranktrain.cli.plot:plot",
    "compare": "cranktrain.cli.compare:compare",
    "export": "cranktrain.cli.export:export",
    "plan": "cranktrain.cli.plan:plan_or_run",
    "report": "cranktrain.cli.report:report",
    "bearing plain": "cranktrain.cli.bearing:bearing",
    "bearing roller": "cranktrain.cli.roller:roller",
    "bearing table": "cranktrain.cli.film_table:film_table",
    "new": "cranktrain.cli.new:new_engine",
    "schema": "cranktrain.cli.schema:schema",
    "engines": "cranktrain.cli.engines:engines",
    "reduce": "cranktrain.cli.reduce:reduce",
    "picture": "cranktrain.cli.picture:picture",
    "damper-optimum": "cranktrain.cli.damper:damper_optimum",
    "stress": "cranktrain.cli.stress:stress",
    "fatigue": "cranktrain.cli.fatigue:fatigue",
    "bearing-loads": "cranktrain.cli.bearing_loads:bearing_loads",
    "fmu": "cranktrain.cli.fmu:fmu",
    **lab.FUNCTIONS,
}
"""Function of each verb, ``module:function``."""
