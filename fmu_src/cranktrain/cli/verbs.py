"""The verbs and what each does, in a line: all that the list of them needs to load.

A line is the first of the verb's ``DESCRIPTION``, which a test compares.
"""

from __future__ import annotations

from cranktrain import lab

VERBS = {
    "modal": "Free crankshaft and cranktrain frequencies beside the reference's, and critical speeds.",
    "campbell": "Campbell diagram: frequencies of the cranktrain at rest over the speed, modes followed through "
    "crossings.",
    "reduce": "Make and check the reduced crankshaft, and block, kept in the cache; write them elsewhere.",
    "simulate": "Run at constant speed until cycles repeat; write an HDF5 result and print a summary.",
    "runup": "Orders of torsion and axial motion over speed, from steady cycles; resonances, each with the mode "
    "it belongs to.",
    "stress": "Stress tensor and von Mises stress of the solid crankshaft's surface over a cycle.",
    "fatigue": "Safety factors of the crankshaft's fillets and oil bores over the cycle, and acceptability by rule "
    "IACS UR M53.",
    "bearing-loads": "Bearings over a cycle at one speed or several: loads, films, friction, oil flow, held against "
    "limits.",
    "picture": "The crankshaft in three dimensions, in a mode or as it runs: picture (PNG), animation (GIF, MP4) or "
    "page (HTML).",
    "bearing": "One plain bearing: load, attitude, flow, friction, stiffness and damping.",
    "film-table": "Make the film table of bearings with one width-to-diameter ratio; it is kept in the cache.",
    "damper-optimum": "Optimum damping of a torsional damper, for two masses or for a torsional mode of an engine.",
    "roller": "Cylindrical roller bearing: deflection, roller loads, radial and tilting stiffness.",
    "stability": "Maps of where numerical methods become unstable or inaccurate, beside theory, drawn and explained.",
    "calibrate": "Fit values of an engine file, within bounds, so that its frequencies match targets.",
    "identify": "Find parameters of an engine from measured data: damping, damper, inertias, shafts, load, with 95 % "
    "intervals.",
    "run-in": "Axial profile that the shells of the main bearings wear to at the lowest speed of full load.",
    "tradeoff": "Accuracy against speed: error over cost of methods, levels and resolutions, with the Pareto front.",
    "plan": "The plan for a scene: which levels and step serve it, why, and with which error and computing time.",
    "vary": "Many variants of an engine: tolerances and choices as distributions; percentiles, sensitivities, "
    "Pareto front.",
    "optimize": "The variant of an engine with the least of one output, under limits of others: a damper by twist, "
    "heat and stress.",
    "explore": "A local page where knobs turn an engine's torsional vibration, and curves follow at once.",
    "plot-runup": "Pictures of a run-up: orders and twist over speed, named resonances, waterfall, colour map, "
    "Campbell diagram, motion.",
    "measured": "Show and analyse measured signals: channels, rotation from pulses, orders over speed, cylinder "
    "pressures.",
    "watch": "Find misfires, worn dampers and cracked springs from measured orders of the pulley's torsion alone.",
    "run": "Plan a scene and run it, speed by speed; write an HDF5 result and print a summary of the wanted outputs.",
    "export": "Write a result or run-up file as a table: CSV, Parquet (needs pyarrow) or NumPy's archive.",
    "report": "Report of an engine as one HTML file: verdict against the limits of its file, frequencies, "
    "vibration, bearings, origins.",
    "couple": "Couple cranktrain, combustion and valve train as FMUs, and run cycles at constant speed.",
    "harness": "Run the scenarios of a harness file and check its assertions.",
    "schema": "The JSON schema of a kind of file: engine, scene, superelement, combustion, valve-train, harness, "
    "study, targets, measured.",
    "new": "Write a complete engine file from a layout and a few sizes.",
    "engines": "The engines that ship with the package: name, title, layout, displacement and firing order.",
}
"""Line of each verb."""
FUNCTIONS = {
    "simulate": "cranktrain.cli.simulate:simulate",
    "modal": "cranktrain.cli.modal:modal",
    "campbell": "cranktrain.cli.campbell:campbell",
    "runup": "cranktrain.cli.runup:runup",
    "plot-runup": "cranktrain.cli.plot_runup:plot_runup",
    "export": "cranktrain.cli.export:export",
    "film-table": "cranktrain.cli.film_table:film_table",
    "plan": "cranktrain.cli.plan:plan",
    "run": "cranktrain.cli.run:run_scene",
    "report": "cranktrain.cli.report:report",
    "bearing": "cranktrain.cli.bearing:bearing",
    "roller": "cranktrain.cli.roller:roller",
    "new": "cranktrain.cli.new:new_engine",
    "schema": "cranktrain.cli.schema:schema",
    "engines": "cranktrain.cli.engines:engines",
    "reduce": "cranktrain.cli.reduce:reduce",
    "picture": "cranktrain.cli.picture:picture",
    "damper-optimum": "cranktrain.cli.damper:damper_optimum",
    "stress": "cranktrain.cli.stress:stress",
    "fatigue": "cranktrain.cli.fatigue:fatigue",
    "bearing-loads": "cranktrain.cli.bearing_loads:bearing_loads",
    **lab.FUNCTIONS,
}
"""Function of each verb, ``module:function``."""
