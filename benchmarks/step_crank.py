"""A crankshaft by its dimensions, and by a mesh of its STEP file: dimensions found, frequencies over element size.

    python -m benchmarks.step_crank [--engine diesel_i6] [--sizes-mm 18 14 10 8]
    python -m benchmarks.step_crank --engine single_petrol --layout single --sizes-mm 16 12 8 6 5

The engine's own geometry is written as STEP, turned and shifted, and goes through what ``cranktrain new --cad`` does.
``dimensions`` has each dimension in mm, given and found, ``dimensions_off_mm`` the largest difference, and
``by_dimensions_percent`` how far the frequencies of a crank of the found dimensions are off, at the largest size.
Both meshes have the same largest edge. ``difference_percent`` is the largest difference of the first ten elastic
frequencies between both meshes; ``beyond_finest_percent`` is the largest excess of the parametric mesh's frequencies
over those at the finest size. Size 8 takes 9 GB.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Crankshaft
from cranktrain.structure.crank.reduction import reduction_task
from cranktrain.structure.fem.craig_bampton import Flexibility, eigenmodes, rigid_motions
from cranktrain_lab.cad.found_crank import write_crank_mesh
from cranktrain_lab.cad.recognition import Given, find_crank
from cranktrain_lab.cad.step_engine import Stated, step_engine
from cranktrain_lab.cad.step_file import read_step

MODES = 10
LENGTHS = (
    "throw", "main_diameter", "main_widths", "pin_diameter", "pin_width", "web_thickness", "web_main_radius",
    "web_pin_radius", "counterweight_radius", "counterweight_half_width", "nose_diameter", "nose_length",
    "flange_diameter", "flange_length", "fillet",
)  # fmt: skip
# The CAD kernel can end its process, so it writes in one of its own.
WRITER = """
import sys
from netgen import occ
from cranktrain.engine.file import load_engine
from cranktrain.structure.crank.shape import crankshaft_shape
shape = crankshaft_shape(load_engine(sys.argv[1]).crankshaft).Scale(occ.Pnt(0, 0, 0), 1000)
shape = shape.Rotate(occ.Axis(occ.Pnt(10, 20, 30), occ.gp_Dir(1, 2, 0.5)), 77).Move(occ.Vec(120, -340, 55))
shape.WriteStep(sys.argv[2])
"""


def frequencies(engine: Engine, mesh: Path | None) -> tuple[Array, int]:
    """First elastic frequencies of the free crankshaft, rad/s, and the number of elements."""
    model = reduction_task(engine, mesh).model(lambda stage: None)
    flexibility = Flexibility.of(model.stiffness, model.mass, rigid_motions(model))
    return eigenmodes(flexibility.solve, model.mass, MODES)[0], int(model.mesh.t.shape[1])


def compared(wanted: Crankshaft, found: Crankshaft) -> dict[str, dict[str, Any]]:
    """Dimensions of both cranks, mm."""
    return {
        key: {name: np.round(1e3 * np.array(getattr(one, key)), 5).tolist() for name, one in pair.items()}
        for pair in [{"given": wanted, "found": found}]
        for key in LENGTHS
    }


def main() -> None:
    """Mesh, solve and print for each size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--engine", default="diesel_i6")
    parser.add_argument("--layout", default=None, help="of an engine that is not in-line")
    parser.add_argument("--sizes-mm", type=float, nargs="+", default=[18.0, 14.0, 10.0])
    asked = parser.parse_args()
    engine, runs = load_engine(asked.engine), list[dict[str, Any]]()
    own: list[Array] = []
    with tempfile.TemporaryDirectory() as folder:
        step, mesh = Path(folder) / "crank.step", Path(folder) / "crank.msh"
        subprocess.run([sys.executable, "-c", WRITER, asked.engine, str(step)], check=True, stdout=subprocess.DEVNULL)
        for size in asked.sizes_mm:
            begin = time.perf_counter()
            crank = replace(engine.crankshaft, mesh_size=1e-3 * size)
            plain, count = frequencies(replace(engine, crankshaft=crank), None)
            stated = Stated(layout=asked.layout, bore=engine.cylinders.bore, mesh_size=1e-3 * size)
            made = step_engine(find_crank(read_step(step), Given()), stated)
            if size == max(asked.sizes_mm):
                lengths = compared(crank, made.dimensions.crankshaft)
                same = replace(made.dimensions.crankshaft, mesh_size=1e-3 * size)
                again = frequencies(replace(engine, crankshaft=same), None)[0]
                by_dimensions = 100.0 * float(np.abs(again / plain - 1.0).max())
            write_crank_mesh(mesh, made.found, made.dimensions.crankshaft, made.sizes.thrust_main)
            found, elements = frequencies(engine, mesh)
            own.append(plain)
            runs.append(
                {
                    "size_mm": size, "elements": count, "elements_of_step": elements,
                    "difference_percent": round(100.0 * float(np.abs(found / plain - 1.0).max()), 3),
                    "seconds": round(time.perf_counter() - begin, 1),
                    "peak_memory_gb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0**2, 2),
                }
            )  # fmt: skip
    finest = own[int(np.argmin(asked.sizes_mm))]
    for run, plain in zip(runs, own, strict=True):
        run["beyond_finest_percent"] = round(100.0 * float((plain / finest - 1.0).max()), 2)
    off = max(float(np.abs(np.subtract(one["found"], one["given"])).max()) for one in lengths.values())
    told = {"engine": asked.engine, "dimensions_off_mm": off, "by_dimensions_percent": round(by_dimensions, 6)}
    print(json.dumps(told | {"dimensions": lengths, "runs": runs}, indent=2))


if __name__ == "__main__":
    main()
