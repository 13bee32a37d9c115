"""The register of a report's sections: each section is one row, with a function that makes it or returns nothing."""

import shlex
import sys
from collections.abc import Callable
from fnmatch import fnmatch
from typing import NamedTuple

from cranktrain.core.units import RPM
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import LAWS
from cranktrain.results.tables import (
    MEASURED,
    Table,
    cranktrain_table,
    critical_speed_table,
    free_table,
    housed_table,
    named_text,
)
from cranktrain.studies.in_motion.report import motion_table, states_text
from cranktrain.studies.report.elements import link, paragraph, picture, table
from cranktrain.studies.report.findings import QUICK_STEPS, Findings, speed_range
from cranktrain.studies.report.front import front
from cranktrain.studies.report.vibration import axial, damper, torsion, torsion_cycles, whole_torsion


class Section(NamedTuple):
    """Section of a report.

    ``make`` returns its parts as HTML, or nothing if its data are missing. ``commands``, such as ``RUN_UP``, then
    produce the data; without any the report itself does. ``needs`` are tables of the engine file, one of which the
    section cannot do without.
    """

    title: str
    make: Callable[[Findings], list[str]]
    commands: tuple[str, ...] = ()
    six: str = ""
    eight: str = ""
    """Tables and figures of the reference thesis for comparison, for the in-line six and for the V8."""
    needs: tuple[str, ...] = ()

    def making(self, found: Findings, folder: str) -> list[str]:
        """Shell commands that produce the section's data; empty if no command does."""
        engine, asked = found.engine, found.asked
        if self.lacks(engine):
            return []
        first, last, step = speed_range(engine, QUICK_STEPS, asked.speeds_rpm)
        place = shlex.quote(folder)
        words = {
            "engine": shlex.quote(asked.name),
            "folder": place,
            "stem": f"{place}/{engine.name}",
            "range": f"--from {first:g} --to {last:g} --step {step:g}",
            "speed": f"{found.speeds[1] / RPM:.0f}",
            "given": f" {shlex.join(asked.running)}" if asked.running else "",
            "ends": " --big-ends impedance" if engine.big_end_bearing is not None and engine.rods_float else "",
            "both": "" if engine.damper is None else f" --with-damper {place}/{engine.name}_runup_damped.h5",
        }
        return [text.format(**words) for text in self.commands if text != DAMPED or engine.damper is not None]

    def remedy(self, found: Findings) -> str:
        """Instruction for producing the section: commands to be pasted, or the table that the engine file lacks."""
        engine, asked = found.engine, found.asked
        if self.lacks(engine):
            return f"add {' or '.join(f'[{name}]' for name in self.needs)} to the engine file"
        if not self.commands:
            return asked.command
        folder = str(asked.folders[0]) if asked.folders else f"out/{engine.name}"
        shown = "" if asked.folders else f" --results {folder}"  # made of the engine's name, which needs no quotes
        return " && ".join([*self.making(found, folder), f"{asked.command}{shown}"])

    def lacks(self, engine: Engine) -> bool:
        """True if the engine file has none of the tables that the section needs."""
        return bool(self.needs) and all(getattr(engine, name) is None for name in self.needs)

    def reference(self, engine: str) -> str:
        """Tables and figures of the reference for comparison; empty for other engines."""
        return {"diesel_i6": self.six, "diesel_v8": self.eight}.get(engine, "")


def frequencies(found: Findings) -> list[str]:
    """Natural frequencies at rest beside the published ones, in the flexible block and on ground, and in motion."""
    modes, engine = found.modes, found.engine
    if modes is None:
        return []
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
    texts = [named, states_text(modes), quality] if engine.block is not None else [
        named, states_text(modes), quality, _NO_BLOCK]  # fmt: skip
    return [*map(table, parts), *map(paragraph, texts)]


_NO_BLOCK = "The engine file has no [block], so all frequencies are those on rigid ground."


def critical_speeds(found: Findings) -> list[str]:
    """Critical speeds of the first torsional mode beside the published ones, in the flexible block and on ground."""
    engine = found.engine
    if found.modes is None:
        return []
    ground = critical_speed_table(engine, found.modes["critical_speeds"])
    if "block" not in found.modes:
        return [table(ground)]
    first = found.modes["block"]["first_torsional_hz"]
    orders = [] if first is None else found.modes["critical_speeds"]
    housed = critical_speed_table(engine, [{**entry, "rpm": 60.0 * first / entry["order"]} for entry in orders])
    named = ((housed, "in the flexible block"), (ground, "on rigid ground"))
    return [table(one._replace(title=f"{one.title}, {where}")) for one, where in named]


def provenance(found: Findings) -> list[str]:
    """Every value of the engine file with its origin; calibrated values come first."""
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
    """Time for the report by stage, and the largest memory."""
    rows = [(what, f"{seconds:.1f}") for what, seconds in found.seconds.items()]
    if found.run_up is not None and "seconds" in found.run_up.attributes:
        rows.append(("run-up that was given", f"{float(found.run_up.attributes['seconds']):.1f}"))
    parts = [table(Table("Wall time", ("stage", "s"), tuple(rows)))]
    if (most := peak_memory()) is not None:
        parts.append(paragraph(f"Largest memory of the report's own process: {1e-9 * most:.2g} GB."))
    return [*parts, methods(found)]


def peak_memory() -> float | None:
    """Largest resident memory of this process so far, bytes; None if the system does not provide it (Windows)."""
    try:
        import resource
    except ImportError:
        return None
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(most if sys.platform == "darwin" else 1024 * most)


def methods(found: Findings) -> str:
    """Links to pages on the accuracy of the methods, which belong to the package, not to the engine."""
    ways = [link(title, place) for title, place in found.links.items()]
    made = [f"<code>{command}</code>" for command in ("cranktrain tradeoff", "cranktrain stability")]
    pages = f"Computed here: {', '.join(ways)}. " if ways else ""
    return (
        f"<p>Accuracy and limits of the methods are the same for all engines and are no part of this report. {pages}"
        f"{' and '.join(made)} compute them.</p>"
    )


def pictures(*shown: tuple[str, str]) -> Callable[[Findings], list[str]]:
    """Make a function for a section of pictures, from file names and captions."""

    def make(found: Findings) -> list[str]:
        there = [
            (path, words) for pattern, words in shown for name, path in found.pictures.items() if fnmatch(name, pattern)
        ]
        return [picture(path.read_bytes(), words) for path, words in there]

    return make


def films_over_speed(found: Findings) -> list[str]:
    """Bearings over the speed, and the error by the grid of elastic films there."""
    parts = _BEARING_PICTURES(found)
    levels = {} if found.run_up is None else found.run_up.attributes
    law, block = LAWS.get(str(levels.get("bearings"))), str(levels.get("block"))
    if parts and law is not None and block in law.film_errors:
        film, pressure = (f"{100.0 * error:.0f} %" for error in law.film_errors[block])
        parts.append(paragraph(
            f"Grid of level {law.name}: in every engine that was measured {MEASURED[block]}, the least film of each "
            f"main bearing is within {film} and its largest pressure within {pressure} of a converged grid "
            "(docs/limits.md)."
        ))  # fmt: skip
    return parts


_BEARING_PICTURES = pictures(
    ("bearings_over_speed.png", "Worst bearing over the speed, limits of the engine file, friction"),
    ("shell_loads_*.png", "Loads on the shells over a cycle, where one is largest"),
    ("journal_loads_*.png", "Loads on the journals over the same cycle"),
)
RUN_UP = (
    "cranktrain runup {engine} {range}{ends}{given} "
    "--outputs flywheel.torsion,axial.engine,axial.bearing,axial.crank,bearings --output {stem}_runup.h5"
)
DAMPED = (
    "cranktrain runup {engine} {range} --damper{given} --outputs flywheel.torsion,damper.heat "
    "--output {stem}_runup_damped.h5"
)
PLOTS = "cranktrain plot {stem}_runup.h5 --engine {engine}{both} --plots {folder}"
"""Commands that produce the data of sections, with the fields of :meth:`Section.making`: the engine as it was named,
folder, folder with the engine's name, range of speeds, highest speed, options of gas and load, level of the big ends,
and the run-up with the damper."""
FILMS = ("main_bearing", "big_end_bearing")
SECTIONS = (
    Section("Engine and verdict", front),
    Section("Natural frequencies", frequencies, six="table 7.1", eight="table 7.3"),
    Section("Critical speeds", critical_speeds, six="table 7.2", eight="table 7.4"),
    Section("Torsional vibration over the speed range", torsion, six="figures 7.2 and 7.3", eight="figure 7.8"),
    Section("With the torsional damper", damper, eight="figure 7.9", needs=("damper",)),
    Section("Torsion over a cycle at critical speeds", torsion_cycles, six="figures 7.1 and 7.2"),
    Section(
        "Torsional vibration with films", whole_torsion, (RUN_UP, DAMPED), "figures 7.2 and 7.3", "figures 7.8 and 7.9"
    ),
    Section("Axial vibration of the pulley", axial, (RUN_UP,), "figures 7.4 to 7.6"),
    Section(
        "Run-up in pictures",
        pictures(
            ("torsion_orders.png", "Torsional orders over the speed, resonances with their orders and modes"),
            ("twist_orders.png", "Orders of the twist from pulley to flywheel over the speed"),
            ("damper.png", "Torsional orders over the speed without and with the damper"),
            ("waterfall.png", "Waterfall: orders over speed and frequency"),
            ("colour_map.png", "Orders and frequencies over the speed as colours"),
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
        ("cranktrain stress {engine} --speed {speed}{given} --plots {folder} --output {stem}_stress.h5",), "figure 7.7",
    ),
    Section(
        "Fatigue of the crankshaft",
        pictures(
            ("safety_factors.png", "Safety factor of each fillet on a side view of the crankshaft"),
            ("haigh.png", "Haigh diagram: stress amplitude over mean stress of the fillets"),
        ),
        ("cranktrain fatigue {engine}{given} --plots {folder} --output {stem}_fatigue.json",),
        needs=("crank_strength",),
    ),
    Section(
        "Bearings over the speed",
        films_over_speed,
        (RUN_UP, "cranktrain bearing-loads {engine} --run-up {stem}_runup.h5 --plots {folder}"),
    ),
    Section(
        "Orbits and films",
        pictures(
            ("orbits.png", "Orbits of the journals in their clearance circles over a cycle"),
            ("least_films.png", "Least oil film of each bearing over a cycle"),
        ),
        ("cranktrain simulate {engine} --speed {speed}{ends}{given} --plots {folder} --output {stem}_{speed}rpm.h5",),
        needs=FILMS,
    ),
    Section("Values and their origins", provenance),
    Section("Run time and methods", run_time),
)  # fmt: skip
"""The register, in the order of the report."""


def _value(value: object) -> str:
    text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    return text if len(text) <= 60 else f"{text[:56]} …"
