"""The verb ``new``: a complete engine file from a layout and a few sizes, or from a crankshaft in CAD."""

from __future__ import annotations

import argparse
import math
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cranktrain import lab
from cranktrain.cli.console import number, of_words
from cranktrain.core.errors import InputError
from cranktrain.engine.file import check_name, load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain.store.whole_file import marked, whole_file
from cranktrain.studies.design.balance import cylinder_places, free_forces
from cranktrain.studies.design.layouts import LAYOUTS, layout
from cranktrain.studies.design.options import DAMPERS, FLYWHEELS, Equipment, equipment
from cranktrain.studies.design.sizes import FUELS, MECHANICAL_EFFICIENCY, Sizes, sizes

DESCRIPTION = f"""\
Write a complete engine file from a layout and a few sizes.

Every value follows from a stated rule of practice, which its note names; the file runs at once. Put in what is known.
With --step FILE the crankshaft of a STEP file gives layout and dimensions; its mesh NAME_crank.msh with named surfaces
and a picture of what was found, NAME_crank.png, are written beside the engine file.
Layouts: {", ".join(LAYOUTS)}.
"""
KIND = marked("engine file", "[crankshaft]")
NEEDED = ("layout", "bore_mm", "stroke_mm")
RPM = math.pi / 30.0
cad = import_module(lab.STEP_FILES)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("name", metavar="NAME", help="of the engine: letters, digits and _; the file is NAME.toml")
    of_words(add("--layout", metavar="LAYOUT", help=f"of the cylinders: {', '.join(LAYOUTS)}"), LAYOUTS)
    add("--bore-mm", type=number(10.0, 1500.0, "mm"), metavar="MM", help="bore, mm")
    add("--stroke-mm", type=number(5.0, 4000.0, "mm"), metavar="MM", help="stroke, mm")
    add("--bank-angle-deg", type=number(0.0, 360.0, "deg"), metavar="DEG", help="between the banks of a V, deg")
    add("--rod-mm", type=number(10.0, 10000.0, "mm"), metavar="MM", help="rod between its eyes, mm (default: 0.3 of it "
        "is the throw)")  # fmt: skip
    of_words(add("--fuel", default="petrol", metavar="FUEL", help=f"{' or '.join(FUELS)} (default petrol)"), FUELS)
    add("--power-kw", type=number(0.01, 1e5, "kW"), metavar="KW", help="brake power at the rated speed, kW (default: "
        "of the usual mean effective pressure)")  # fmt: skip
    add("--rated-rpm", type=number(SLOWEST_RPM, FASTEST_RPM, "rev/min"), metavar="RPM",
        help="rated speed, rev/min (default: of the usual mean piston speed)")  # fmt: skip
    of_words(add("--damper", metavar="KIND", help=f"torsional damper fitted to the first torsional mode: "
                 f"{' or '.join(DAMPERS)} (default none)"), DAMPERS)  # fmt: skip
    of_words(add("--flywheel", default=FLYWHEELS[0], metavar="KIND", help=f"{' or '.join(FLYWHEELS)} (default "
                 f"{FLYWHEELS[0]})"), FLYWHEELS)  # fmt: skip
    add("--mounts", action="store_true", help="with a block and four mounts, for --block flexible")
    add("--force", action="store_true", help="replace an engine file of that name")
    cad.add_step_options(parser)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Design the engine, write its file, and read it back."""
    from cranktrain.studies.design.rules import document

    name = options.name[:-5] if options.name.lower().endswith(".toml") else options.name
    check_name(name, "NAME")
    path = Path(f"{name}.toml")
    for own in (path, *(cad.step_files(name) if options.step else ())):
        if own.exists() and not options.force:
            raise InputError(f"{own}: exists; give --force to replace it, or take another name")
    if options.step is not None:
        made = cad.engine_of_step(options, name, equipment_of(options))
        report = _report(made.sizes, path, equipment_of(options)) | cad.step_report(made, name)
        if not options.json:
            cad.show_step(report)
            _show(report)
        return report
    found = _sizes(options)
    text = document(name, found, equipment_of(options)).text
    with whole_file(path, KIND) as temporary:
        temporary.write_text(text, encoding="utf-8")
        load_engine(temporary)
    report = _report(found, path, equipment_of(options))
    if not options.json:
        _show(report)
    return report


def answer(options: argparse.Namespace) -> Engine:
    """The engine itself, for the library; only one from a STEP file is written, with its mesh."""
    from cranktrain.studies.design.rules import document

    if options.step is not None:
        return load_engine(run(options)["file"])
    check_name(options.name, "name")
    with TemporaryDirectory(prefix="cranktrain-new-") as folder:
        path = Path(folder) / f"{options.name}.toml"
        path.write_text(document(options.name, _sizes(options), equipment_of(options)).text, encoding="utf-8")
        return load_engine(path)


def equipment_of(options: argparse.Namespace) -> Equipment:
    """What the options ask for beside the engine itself."""
    return equipment(options.damper, options.flywheel, options.mounts)


def _sizes(options: argparse.Namespace) -> Sizes:
    """Sizes of an engine without a STEP file."""
    cad.check_no_step_options(options)
    if missing := [f"--{key.replace('_', '-')}" for key in NEEDED if getattr(options, key) is None]:
        raise InputError(f"{', '.join(missing)} missing: give these sizes, or --step FILE with a crankshaft")
    return sizes(
        layout(options.layout, options.bank_angle_deg),
        1e-3 * options.bore_mm,
        1e-3 * options.stroke_mm,
        options.fuel,
        rod=None if options.rod_mm is None else 1e-3 * options.rod_mm,
        power=None if options.power_kw is None else 1e3 * options.power_kw,
        rated=None if options.rated_rpm is None else options.rated_rpm * RPM,
    )


def _report(s: Sizes, path: Path, equipped: Equipment) -> dict[str, Any]:
    row, places = s.layout, cylinder_places(load_engine(path))
    free = free_forces(row, places.along)._asdict()
    return {
        "file": str(path), "layout": row.name, "cylinders": row.cylinders, "bank_angle_deg": row.bank_deg,
        "displacement_l": 1e3 * s.displacement, "rod_mm": 1e3 * s.rod_length, "fuel": s.fuel_name,
        "firing_order": list(row.order), "intervals_deg": list(row.intervals_deg), "fires_evenly": row.even,
        "free_forces": free | {"distance_mm": 1e3 * places.distance, "distance_of": places.words}, "note": row.note,
        "rated_rpm": s.rated / RPM, "lowest_rpm": s.lowest / RPM, "brake_power_kw": 1e-3 * s.brake_power,
        "imep_bar": 1e-5 * s.imep, "mechanical_efficiency": MECHANICAL_EFFICIENCY,
        "next": [
            f"cranktrain modal {path} --crank beam",
            f"cranktrain runup {path} --from {s.lowest / RPM:g} --to {s.rated / RPM:g} --step {_step(s):g} "
            f"--crank torsional --steady harmonic-balance {'--damper ' if equipped.damper else ''}--plots {path.stem}",
            *([f"cranktrain simulate {path} --speed {s.best / RPM:g} --block flexible --step-deg 0.5"]
              if equipped.mounts else []),
        ],
    }  # fmt: skip


def _step(s: Sizes) -> float:
    """Step of a first run-up, rev/min: about fifty speeds."""
    return float(f"{(s.rated - s.lowest) / RPM / 50.0:.1g}")


def _show(report: dict[str, Any]) -> None:
    gaps = report["intervals_deg"]
    every = f"every {gaps[0]:g} deg" if report["fires_evenly"] else f"at {', '.join(f'{gap:g}' for gap in gaps)} deg"
    free = report["free_forces"]
    print(
        f"{report['file']}: {report['displacement_l']:.3g} l, {report['cylinders']} cylinders, fires "
        f"{'-'.join(map(str, report['firing_order']))} {every}"
    )
    print(
        f"{report['brake_power_kw']:.3g} kW at {report['rated_rpm']:.0f} rev/min "
        f"(indicated mean effective pressure {report['imep_bar']:.3g} bar)"
    )
    where = f"; moments times {free['distance_mm']:.4g} mm, the distance of {free['distance_of']}"
    print(
        f"Oscillating masses leave free: first order {free['first']:.3g}, moment {free['first_moment']:.3g}; second "
        f"order {free['second']:.3g}, moment {free['second_moment']:.3g} (of one cylinder's"
        f"{where if free['distance_of'] else ''})"
    )
    if report["note"]:
        print(report["note"][:1].upper() + report["note"][1:])
    print("Next:", *report["next"], sep="\n  ")
