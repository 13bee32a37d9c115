"""The register of a report's sections: each section is one row, with a function that makes it or returns nothing."""

from __future__ import annotations

import platform
import shlex
from collections.abc import Callable
from fnmatch import fnmatch
from typing import NamedTuple

from cranktrain import __version__
from cranktrain.engine.model import Engine
from cranktrain.results.tables import (
    Table,
    cranktrain_table,
    critical_speed_table,
    free_table,
    housed_table,
    named_text,
)
from cranktrain.structure.crank.modal import critical_speeds as at_orders
from cranktrain.studies.in_motion.report import motion_table
from cranktrain.studies.report.elements import paragraph, picture, table
from cranktrain.studies.report.findings import QUICK_STEPS, RPM, Findings, speed_range
from cranktrain.studies.report.vibration import axial, damper, torsion, torsion_cycles, whole_torsion


class Section(NamedTuple):
    """Section of a report.

    ``make`` returns its parts as HTML, or nothing if its data are missing. ``commands``, such as ``RUN_UP``, then
    produce the data, or a text names the way to produce them.
    """

    title: str
    make: Callable[[Findings], list[str]]
    commands: tuple[str, ...] | str = ()
    six: str = ""
    eight: str = ""
    """Tables and figures of the reference that it stands beside, of the in-line six and of the V8."""

    def making(self, name: str, folder: str, engine: Engine) -> list[str]:
        """Commands that make what the section needs, by the engine as it was named; none where no command does."""
        texts = () if isinstance(self.commands, str) else self.commands
        speeds = *speed_range(engine, QUICK_STEPS), engine.speeds[1] / RPM
        return [text.format(shlex.quote(name), shlex.quote(folder), engine.name, *speeds) for text in texts]

    def remedy(self, engine: Engine, name: str = "") -> str:
        """Instruction for producing the section, in words, by the engine as it was named."""
        if isinstance(self.commands, str):
            return self.commands
        name = name or engine.name
        last = f"cranktrain report {shlex.quote(name)} --pictures FOLDER"
        return "; ".join([*self.making(name, "FOLDER", engine), last])

    def reference(self, engine: str) -> str:
        """What of the reference it stands beside; empty for engines that the reference does not have."""
        return {"diesel_i6": self.six, "diesel_v8": self.eight}.get(engine, "")


def frequencies(found: Findings) -> list[str]:
    """Natural frequencies at rest beside the published ones, in the flexible block and on ground, and in motion."""
    modes, engine = found.modes, found.engine
    ground = cranktrain_table(engine, modes["cranktrain"])
    parts = [ground]
    if "block" in modes:
        parts = [housed_table(engine, modes["block"]), ground._replace(title=f"{ground.title}; on rigid ground")]
    error = modes["reduction"]["max_relative_error"]
    quality = (
        f"Finite elements: {modes['reduction']['dofs_full']} degrees of freedom reduced to "
        f"{modes['reduction']['modes']} modes, largest error to 1000 Hz {100.0 * error:.2g} %."
    )
    parts.append(free_table(engine, modes["crankshaft_free"]))
    if modes.get("in_motion", {}).get("modes"):
        parts.insert(0, motion_table(modes["in_motion"]))
    named = named_text(modes["cranktrain"], engine.reduction.running_cutoff_hz)
    return [*map(table, parts), paragraph(named), paragraph(_STATES), paragraph(quality)]


_STATES = (
    "At rest the crank stands on springs that stand in for its bearings, and its thrust collar is closed. In motion it "
    "vibrates about the settled cycle of a run, on its films or rollers as they are there: resonances of run-ups are "
    "those of the modes in motion."
)


def critical_speeds(found: Findings) -> list[str]:
    """Critical speeds of the first torsional mode beside the published ones, in the flexible block and on ground."""
    engine = found.engine
    ground = critical_speed_table(engine, found.modes["critical_speeds"])
    if "block" not in found.modes:
        return [table(ground)]
    housed = critical_speed_table(engine, at_orders(engine, found.modes["block"]["first_torsional_hz"]))
    named = ((housed, "in the flexible block"), (ground, "on rigid ground"))
    return [table(one._replace(title=f"{one.title}, {where}")) for one, where in named]


def provenance(found: Findings) -> list[str]:
    """Every value of the engine file with its origin; what was calibrated stands first."""
    rows = [(key, _value(value), unit, origin, note) for key, value, unit, origin, note in found.origins]
    fitted = tuple(row for row in rows if row[3] == "calibrated")
    header = ("value", "", "unit", "origin", "note")
    counts = ", ".join(
        f"{sum(row[3] == origin for row in rows)} {origin}" for origin in dict.fromkeys(r[3] for r in rows)
    )
    everything = table(Table(f"All values of {found.engine.name}", header, tuple(rows)))
    parts = [paragraph(f"Of {len(rows)} values {counts}.")]
    parts += [table(Table("Calibrated values and the numbers they were fitted to", header, fitted))] if fitted else []
    return [*parts, f"<details><summary>All {len(rows)} values</summary>{everything}</details>"]


def run_time(found: Findings) -> list[str]:
    """Time for the report, by stage."""
    rows = [(what, f"{seconds:.1f}") for what, seconds in found.seconds.items()]
    if found.run_up is not None and "seconds" in found.run_up.attributes:
        rows.append(("run-up that was given", f"{float(found.run_up.attributes['seconds']):.1f}"))
    where = f"Cranktrain {__version__}, Python {platform.python_version()}, {platform.machine()}."
    return [table(Table("Wall time", ("stage", "s"), tuple(rows))), paragraph(where)]


def pictures(*shown: tuple[str, str]) -> Callable[[Findings], list[str]]:
    """Maker of a section of pictures by their file names, each with what it shows."""

    def make(found: Findings) -> list[str]:
        there = [
            (path, words) for pattern, words in shown for name, path in found.pictures.items() if fnmatch(name, pattern)
        ]
        return [picture(path.read_bytes(), words) for path, words in there]

    return make


RUN_UP = (
    "cranktrain runup {0} --from {3:g} --to {4:g} --step {5:g} --big-ends impedance "
    "--outputs flywheel.torsion,axial.engine,axial.bearing,axial.crank,bearings --output {1}/{2}_runup.h5"
)
DAMPED = (
    "cranktrain runup {0} --from {3:g} --to {4:g} --step {5:g} --damper --outputs flywheel.torsion "
    "--output {1}/{2}_runup_damped.h5"
)
PLOTS = "cranktrain plot-runup {1}/{2}_runup.h5 --engine {0} --with-damper {1}/{2}_runup_damped.h5 --plots {1}"
"""Commands that make what sections show: {0} engine as it was named, {1} folder, {2} the engine's name, {3} to {5}
first and last speed of a run-up and its step, {6} the engine's highest speed; rev/min."""
STABILITY = (
    "oil_whirl", "cold_start", "step_film_stiffness", "variable_inertia", "rotating_damping", "mode_truncation",
    "contact_ringing", "cosimulation",
)  # fmt: skip
SECTIONS = (
    Section("Natural frequencies", frequencies, six="table 7.1", eight="table 7.3"),
    Section("Critical speeds", critical_speeds, six="table 7.2", eight="table 7.4"),
    Section("Torsional vibration over the speed range", torsion, six="figures 7.2 and 7.3", eight="figure 7.8"),
    Section("With the torsional damper", damper, "add [damper] to the engine file", eight="figure 7.9"),
    Section("Torsion over a cycle at critical speeds", torsion_cycles, six="figures 7.1 and 7.2"),
    Section(
        "Torsional vibration with films", whole_torsion, (RUN_UP, DAMPED), "figures 7.2 and 7.3", "figures 7.8 and 7.9"
    ),
    Section("Axial vibration of the pulley", axial, (RUN_UP,), "figures 7.4 to 7.6"),
    Section(
        "Run-up in pictures",
        pictures(
            ("torsion_orders.png", "Torsional orders over the speed, resonances with their orders and modes"),
            ("damper.png", "Torsional orders over the speed without and with the damper"),
            ("waterfall.png", "Waterfall: orders over speed and frequency"),
            ("campbell.png", "Campbell diagram: modes over the speed, crossed by orders"),
            ("torsion_histories.png", "Torsion over a cycle at its peaks"),
            ("torsion_harmonics.png", "Orders of the torsion at its peaks"),
            ("axial_orders.png", "Axial orders over the speed"),
            ("axial_parts.png", "Parts of the axial motion over the speed"),
            ("axial_histories.png", "Axial motion over a cycle at its peaks"),
            ("axial_harmonics.png", "Orders of the axial motion and of its parts at its peaks"),
        ),
        (RUN_UP, DAMPED, PLOTS), "figures 7.1 to 7.6", "figures 7.8 and 7.9",
    ),
    Section(
        "Stress of the crankshaft",
        pictures(
            ("stresses.png", "Von Mises stress of the crankshaft's surface every 90 degrees of crank angle"),
            ("stress_envelope.png", "Greatest von Mises stress of each place over the cycle"),
        ),
        ("cranktrain stress {0} --speed {6:.0f} --plots {1} --output {1}/{2}_stress.h5",), "figure 7.7",
    ),
    Section(
        "Fatigue of the crankshaft",
        pictures(
            ("safety_factors.png", "Safety factor of each fillet on a side view of the crankshaft"),
            ("haigh.png", "Haigh diagram: stress amplitude over mean stress of the fillets"),
        ),
        ("cranktrain fatigue {0} --plots {1}",),
    ),
    Section(
        "Bearings over the speed",
        pictures(
            ("bearings_over_speed.png", "Worst bearing over the speed, limits of the engine file, friction"),
            ("shell_loads_*.png", "Loads on the shells over a cycle, where one is largest"),
            ("journal_loads_*.png", "Loads on the journals over the same cycle"),
        ),
        (RUN_UP, "cranktrain bearing-loads {0} --run-up {1}/{2}_runup.h5 --plots {1}"),
    ),
    Section(
        "Orbits and films",
        pictures(
            ("orbits.png", "Orbits of the journals in their clearance circles over a cycle"),
            ("least_films.png", "Least oil film of each bearing over a cycle"),
        ),
        ("cranktrain simulate {0} --speed {6:.0f} --big-ends impedance --plots {1} --output {1}/{2}_{6:.0f}rpm.h5",),
    ),
    Section(
        "Accuracy against speed of computation",
        pictures(("overall.png", "Error over cost of methods, levels and resolutions, with the Pareto front")),
        ("cranktrain tradeoff --output {1}",),
    ),
    Section(
        "Where methods fail",
        pictures(*((f"{name}.png", f"Stability map: {name.replace('_', ' ')}") for name in STABILITY)),
        ("cranktrain stability --output {1}",),
    ),
    Section("Values and their origins", provenance),
    Section("Run time", run_time),
)  # fmt: skip
"""The register, in the order of the report."""


def _value(value: object) -> str:
    text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    return text if len(text) <= 60 else f"{text[:56]} …"
