"""The verb ``new`` with a STEP file: options, engine file, mesh and picture, and printed report."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.console import say, stages
from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.engine.file import load_engine
from cranktrain.store.whole_file import check_place, marked, whole_file

if TYPE_CHECKING:
    from cranktrain.cli.new import NewEngine
    from cranktrain.studies.design.sizes import Equipment
    from cranktrain_lab.cad.step_engine import StepEngine

MESH = marked("mesh", "$MeshFormat")
STATING = ("main_diameter_mm", "pin_diameter_mm", "mains", "pulley_end", "thrust_main", "mesh_size_mm", "cad_unit")
"""Options for data that a STEP file does not contain."""


def check_no_step_options(ask: NewEngine) -> None:
    """Refuse options of a STEP file without one; ``InputError``."""
    given = [key for key in STATING if getattr(ask, key) is not None]
    if given:
        raise InputError(f"--{given[0].replace('_', '-')} needs --cad FILE; leave it out")


def step_files(name: str) -> tuple[Path, Path]:
    """Paths of the mesh and the picture of an engine's crankshaft."""
    return Path(f"{name}_crank.msh"), Path(f"{name}_crank.png")


def engine_of_step(ask: NewEngine, name: str, equipment: Equipment) -> StepEngine:
    """Find the crank in the STEP file, write engine file, mesh and picture."""
    from cranktrain.studies.design.rules import document
    from cranktrain_lab.cad.found_crank import write_crank_mesh
    from cranktrain_lab.cad.picture import save_found
    from cranktrain_lab.cad.recognition import Given, find_crank
    from cranktrain_lab.cad.step_engine import Stated, step_engine
    from cranktrain_lab.cad.step_file import read_step

    mesh, picture = step_files(name)
    check_place(mesh, MESH)
    given = Given(ask.main_diameter_mm, ask.pin_diameter_mm, ask.mains, ask.pulley_end)
    stated = Stated(
        ask.layout, ask.bank_angle_deg, _mm(ask.bore_mm), _mm(ask.stroke_mm), ask.fuel,
        rod=_mm(ask.rod_mm), power=None if ask.power_kw is None else 1e3 * ask.power_kw,
        rated=None if ask.rated_rpm is None else ask.rated_rpm * RPM, thrust_main=ask.thrust_main,
        mesh_size=_mm(ask.mesh_size_mm),
    )  # fmt: skip
    with stages(f"{name}: {ask.cad}") as stage:
        stage("surface")
        solid = read_step(str(ask.cad), ask.cad_unit)
        made = step_engine(find_crank(solid, given), stated)
        text = document(name, made.sizes, equipment).text
        stage("mesh")
        with whole_file(mesh, MESH) as temporary:
            write_crank_mesh(temporary, made.found, made.dimensions.crankshaft, made.sizes.thrust_main)
            with whole_file(Path(f"{name}.toml"), marked("engine file", "[crankshaft]")) as engine:
                engine.write_text(text, encoding="utf-8")
                load_engine(engine)
        save_found(picture, made.found, made.told)
    return made


def _mm(value: float | None) -> float | None:
    return None if value is None else 1e-3 * value


def step_report(made: StepEngine, name: str) -> dict[str, Any]:
    """Dictionary of the recognised dimensions: lengths in mm, angles in deg, volume in cm³."""
    found, crank = made.found, made.dimensions.crankshaft
    mesh, picture = step_files(name)
    journals = {
        kind: [
            {"diameter_mm": 2.0 * one.cylinder.radius, "width_mm": one.width,
             "z_mm": 0.5 * (one.start + one.end), "fillets_mm": list(one.fillets)}
            for one in group
        ]
        for kind, group in (("mains", found.mains), ("pins", found.pins))
    }  # fmt: skip
    for entry, angle, throw in zip(journals["pins"], crank.throw_angles, crank.throws, strict=True):
        entry |= {"angle_deg": math.degrees(angle), "throw_mm": 1e3 * throw}
    return {
        "mesh": str(mesh), "picture": str(picture), **journals, "pins_between_mains": list(found.bays),
        "volume_cm3": 1e-3 * found.solid.volume, "ends_mm": list(found.ends), "told": list(made.told),
        "next": [f"cranktrain reduce {name}.toml --mesh {mesh}", f"cranktrain modal {name}.toml --mesh {mesh}"],
    }  # fmt: skip


def show_step(report: dict[str, Any]) -> None:
    """Print the recognised dimensions."""
    for what, kind in (("Main journals", "mains"), ("Pins", "pins")):
        rows = report[kind]
        sizes = ", ".join(sorted({f"{row['diameter_mm']:.2f} x {row['width_mm']:.2f}" for row in rows}))
        print(f"{what}: {len(rows)}, diameter x width {sizes} mm")
    throws = ", ".join(f"{pin['throw_mm']:.2f} mm at {pin['angle_deg'] % 360.0:.2f} deg" for pin in report["pins"])
    print(f"Throws: {throws}")
    for told in report["told"]:
        say(f"note: {told}")
    print(f"Mesh with named surfaces: {report['mesh']}; picture of what was found: {report['picture']}")
