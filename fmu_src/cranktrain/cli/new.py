"""The verb ``new``: a complete engine file from a layout and a few sizes, or from a crankshaft in CAD."""

import tomllib
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Literal

from cranktrain import lab
from cranktrain.cli.functions import Subject, verb
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.core.units import RPM
from cranktrain.engine.file import check_name, engine_of, load_engine
from cranktrain.engine.model import Engine
from cranktrain.modules.register import module_beside
from cranktrain.results.views.found import VerbResult
from cranktrain.store.whole_file import marked, whole_file
from cranktrain.studies.design.balance import cylinder_places, free_forces
from cranktrain.studies.design.layouts import LAYOUTS, layout
from cranktrain.studies.design.sizes import (
    DAMPERS,
    FLYWHEELS,
    FUELS,
    MECHANICAL_EFFICIENCY,
    Equipment,
    Sizes,
    equipment,
    sizes,
)
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question

DESCRIPTION = f"""\
Write a complete engine file from a layout and a few sizes.

Every value follows from a stated rule of practice, which its note names; the file runs at once. Put in what is known.
NAME_combustion.toml beside it describes its combustion, from which couple and harness build an FMU.
With --cad FILE the crankshaft of a STEP file gives layout and dimensions; its mesh NAME_crank.msh with named surfaces
and a picture of what was found, NAME_crank.png, are written beside the engine file.
Layouts: {", ".join(LAYOUTS)}.
"""
KIND = marked("engine file", "[crankshaft]")
MODULE_KIND = marked("module file", "[manifolds]")
NAME = Subject("name", "NAME", "of the engine: letters, digits and _; the file is NAME.toml")
LayoutWord = Literal[
    "single", "i2", "i3", "i4", "i5", "i6", "i7", "i8", "i9", "i10", "i11", "i12", "v2", "v4", "v6", "v6_60", "v6_90",
    "v8", "v10", "v12", "v16", "boxer2", "boxer4", "boxer6",
]  # fmt: skip
NEEDED = ("layout", "bore_mm", "stroke_mm")
cad = import_module(lab.STEP_FILES)


Diameter = Annotated[float, between(1.0, 5000.0, "mm")]


@dataclass(frozen=True, kw_only=True)
class FromStep(Question):
    """Options for a STEP file, and for data that it does not contain."""

    heading = "crankshaft from CAD"
    cad: Annotated[
        words.File | None,
        Option(
            "FILE",
            "STEP file (.step, .stp) of the crankshaft alone, in any place and unit; layout and stroke follow from it",
            was="--step",
        ),
    ] = None
    main_diameter_mm: Annotated[
        Diameter | None, Option("MM", "diameter of the main journals, where other cylinders are taken for them")
    ] = None
    pin_diameter_mm: Annotated[Diameter | None, Option("MM", "diameter of the pins, likewise")] = None
    mains: Annotated[
        int | None, between(2, 40, "main journals"), Option("N", "number of main journals, as a check")
    ] = None
    pulley_end: Annotated[
        str | None,
        Option("END", "end of the pulley in the file's axes: -x, +x, -y, +y, -z or +z (write --pulley-end=-z)"),
    ] = None
    thrust_main: Annotated[
        int | None, between(1, 40, ""), Option("N", "main journal of the thrust bearing (default the middle one)")
    ] = None
    mesh_size_mm: Annotated[
        float | None, between(0.1, 1000.0, "mm"), Option("MM", "largest element edge (default 0.17 of the bore)")
    ] = None
    cad_unit: Annotated[
        str | None,
        Option("UNIT", "unit of the coordinates, where the file states a wrong one: mm, m, in", was="--step-unit"),
    ] = None


@dataclass(frozen=True, kw_only=True)
class NewEngine(FromStep):
    """Question of :func:`new_engine`."""

    heading = ""
    layout: Annotated[
        LayoutWord | None, Option("LAYOUT", f"of the cylinders: {', '.join(LAYOUTS)}", words=LAYOUTS.keys)
    ] = None
    bore_mm: Annotated[float | None, between(10.0, 1500.0, "mm"), Option("MM", "bore, mm")] = None
    stroke_mm: Annotated[float | None, between(5.0, 4000.0, "mm"), Option("MM", "stroke, mm")] = None
    bank_angle_deg: Annotated[
        float | None, between(0.0, 360.0, "deg"), Option("DEG", "between the banks of a V, deg")
    ] = None
    rod_mm: Annotated[
        float | None,
        between(10.0, 10000.0, "mm"),
        Option("MM", "rod between its eyes, mm (default: 0.3 of it is the throw)"),
    ] = None
    fuel: Annotated[
        Literal["petrol", "diesel"],
        Option("FUEL", f"{' or '.join(FUELS)} (default petrol)", words=FUELS.keys),
    ] = "petrol"
    power_kw: Annotated[
        float | None,
        between(0.01, 1e5, "kW"),
        Option("KW", "brake power at the rated speed, kW (default: of the usual mean effective pressure)"),
    ] = None
    rated_rpm: Annotated[
        words.Rpm | None, Option("RPM", "rated speed, rev/min (default: of the usual mean piston speed)")
    ] = None
    damper: Annotated[
        Literal["rubber", "viscous"] | None,
        Option(
            "KIND",
            f"torsional damper fitted to the first torsional mode: {' or '.join(DAMPERS)} (default none)",
            words=DAMPERS,
        ),
    ] = None
    flywheel: Annotated[
        Literal["solid", "dual-mass"],
        Option("KIND", f"{' or '.join(FLYWHEELS)} (default {FLYWHEELS[0]})", words=FLYWHEELS),
    ] = "solid"
    mounts: Annotated[bool, Option(help="with a block and four mounts, for --block flexible")] = False
    force: Annotated[bool, Option(help="replace an engine file of that name")] = False


@verb(NewEngine, DESCRIPTION, NAME)
def new_engine(name: str | Path, ask: NewEngine) -> Engine:
    """Design an engine. Only with a STEP file the engine file is written, with its mesh."""
    from cranktrain.studies.design.rules import document

    name = str(name)
    if ask.cad is not None:
        return load_engine(answer(name, ask)["file"])
    check_name(name, "name")
    text = document(name, _sizes(ask), equipment_of(ask)).text
    return engine_of(tomllib.loads(text), f"{name}.toml", None)


def answer(named: str, ask: NewEngine) -> VerbResult:
    """Design the engine, write its file, and read it back."""
    from cranktrain.studies.design.rules import document

    name = named[:-5] if named.lower().endswith(".toml") else named
    check_name(name, "NAME")
    path = Path(f"{name}.toml")
    beside = module_beside("combustion", path)
    for own in (path, beside, *(cad.step_files(name) if ask.cad else ())):
        if own.exists() and not ask.force:
            raise InputError(f"{own}: exists; give --force to replace it, or take another name")
    if ask.cad is not None:
        made = cad.engine_of_step(ask, name, equipment_of(ask))
        _write_combustion(beside, name, made.sizes, path)
        report = _report(made.sizes, path, equipment_of(ask)) | cad.step_report(made, name)
        return VerbResult.of(report, "new")
    found = _sizes(ask)
    text = document(name, found, equipment_of(ask)).text
    with whole_file(path, KIND) as temporary:
        temporary.write_text(text, encoding="utf-8")
        load_engine(temporary)
    _write_combustion(beside, name, found, path)
    return VerbResult.of(_report(found, path, equipment_of(ask)), "new")


def _write_combustion(beside: Path, name: str, found: Sizes, path: Path) -> None:
    """Write the module file of the combustion beside an engine file."""
    from cranktrain.studies.design.combustion_file import Aim, combustion_text

    aim = Aim(load_engine(path), found.fuel_name, found.fuel, found.imep, found.rated)
    text = combustion_text(name, path.name, aim)
    with whole_file(beside, MODULE_KIND) as temporary:
        temporary.write_text(text, encoding="utf-8")


def equipment_of(ask: NewEngine) -> Equipment:
    """Equipment of the engine that the options request, damper, flywheel and mounts."""
    return equipment(ask.damper, ask.flywheel, ask.mounts)


def _sizes(ask: NewEngine) -> Sizes:
    """Main dimensions of an engine, from the options."""
    cad.check_no_step_options(ask)
    if missing := [f"--{key.replace('_', '-')}" for key in NEEDED if getattr(ask, key) is None]:
        raise InputError(f"{', '.join(missing)} missing: give these sizes, or --cad FILE with a crankshaft")
    assert ask.layout and ask.bore_mm and ask.stroke_mm
    return sizes(
        layout(ask.layout, ask.bank_angle_deg),
        1e-3 * ask.bore_mm,
        1e-3 * ask.stroke_mm,
        ask.fuel,
        rod=None if ask.rod_mm is None else 1e-3 * ask.rod_mm,
        power=None if ask.power_kw is None else 1e3 * ask.power_kw,
        rated=None if ask.rated_rpm is None else ask.rated_rpm * RPM,
    )


def _report(s: Sizes, path: Path, equipped: Equipment) -> dict[str, Any]:
    row, places = s.layout, cylinder_places(load_engine(path))
    free = free_forces(row, places.along)._asdict()
    return {
        "file": str(path), "combustion": str(module_beside("combustion", path)), "layout": row.name,
        "cylinders": row.cylinders, "bank_angle_deg": row.bank_deg,
        "displacement_l": 1e3 * s.displacement, "rod_mm": 1e3 * s.rod_length, "fuel": s.fuel_name,
        "firing_order": list(row.order), "intervals_deg": list(row.intervals_deg), "fires_evenly": row.even,
        "free_forces": free | {"distance_mm": 1e3 * places.distance, "distance_of": places.words}, "note": row.note,
        "rated_rpm": s.rated / RPM, "lowest_rpm": s.lowest / RPM, "brake_power_kw": 1e-3 * s.brake_power,
        "imep_bar": 1e-5 * s.imep, "mechanical_efficiency": MECHANICAL_EFFICIENCY,
        "next": [
            f"cranktrain modal {path} --crank beam",
            f"cranktrain couple {path} --speed {s.best / RPM:g} --no-valvetrain",
            f"cranktrain runup {path} --from {s.lowest / RPM:g} --to {s.rated / RPM:g} --step {_step(s):g} "
            f"--crank torsional --method harmonic-balance {'--damper ' if equipped.damper else ''}--plots {path.stem}",
            *([f"cranktrain simulate {path} --speed {s.best / RPM:g} --block flexible --step-deg 0.5"]
              if equipped.mounts else []),
        ],
    }  # fmt: skip


def _step(s: Sizes) -> float:
    """Step of a first run-up, rev/min: about fifty speeds."""
    return float(f"{(s.rated - s.lowest) / RPM / 50.0:.1g}")


def show(report: VerbResult) -> None:
    """Print the files that were made, and the next commands."""
    if "mesh" in report:
        cad.show_step(report)
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
    print(f"{report['combustion']}: its combustion, for couple, harness and fmu")
    where = f"; moments times {free['distance_mm']:.4g} mm, the distance of {free['distance_of']}"
    print(
        f"Oscillating masses leave free: first order {free['first']:.3g}, moment {free['first_moment']:.3g}; second "
        f"order {free['second']:.3g}, moment {free['second_moment']:.3g} (of one cylinder's"
        f"{where if free['distance_of'] else ''})"
    )
    if report["note"]:
        print(report["note"][:1].upper() + report["note"][1:])
    print("Next:", *report["next"], sep="\n  ")
