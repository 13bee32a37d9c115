"""The virtual engine's SSP in other people's masters and in ours: ``python benchmarks/foreign_masters.py``.

The six at 2000 rev/min, CYCLES cycles, 1 degree. Outputs of the last cycle are compared over the crank's angle, since
masters that initialize units apart from each other start with another wind-up of the dynamometer's shaft: RMS of the
difference over that of the output's alternating part; IMEP and mean shaft torque relative. What the reference master's
own Jacobi scheme differs by stands among the others. Native FMUs, which need no Python in a master's environment, are
run beside Python's. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.masters.environment import MASTERS, NotHere, run

import cranktrain as ct
from cranktrain.core.reduced_body import Array
from cranktrain_lab.coupling.run import Steps
from cranktrain_lab.coupling.run import run as run_coupled
from cranktrain_lab.coupling.ssp import write_ssp
from cranktrain_lab.coupling.virtual_engine import Partners, VirtualEngine, virtual_engine

SPEED = 2000.0 * math.pi / 30.0
CYCLES = 10
ANGLE = "cranktrain.crank.angle"
OUTPUTS = (
    ANGLE, "cranktrain.pulley.torsion", "cranktrain.pulley.axial", "cranktrain.shaft.torque",
    "combustion.indicated.pressure_mean",
)  # fmt: skip


def export(engine: VirtualEngine, path: Path, stop: float) -> Path:
    """The engine as an SSP."""
    units = {name: (unit, unit.path) for name, unit in engine.units.items()}
    return write_ssp(path, path.stem, units, engine.connections, engine.values, engine.outputs, stop)


def reference(engine: VirtualEngine, step: float, count: int) -> Array:
    """Outputs after each step of the reference master, (count, outputs)."""
    master = engine.master()
    try:
        master.initialize()
        found = run_coupled(master, count * step, Steps(step))
    finally:
        master.close()
    return np.column_stack([found.of(name) for name in OUTPUTS])[1:]


def differences(rows: Array, truth: Array) -> dict[str, float]:
    """Of one run from another, over 720 equal steps of the crank's angle."""
    end = min(rows[-2, 0], truth[-2, 0])
    at = end - np.radians(np.arange(720.0))
    one, other = (np.asarray(CubicSpline(run[:, 0], run, axis=0)(at)) for run in (rows, truth))
    off = np.sqrt(np.mean((one - other) ** 2, axis=0)) / np.maximum(other.std(axis=0), 1e-300)
    mean = one.mean(axis=0) / other.mean(axis=0) - 1.0
    wanted = {"torsion": off, "axial": off, "mean_torque": mean, "imep": mean}
    return {what: float(kind[1 + k]) for k, (what, kind) in enumerate(wanted.items())}


def measure(folder: Path, platforms: tuple[str, ...]) -> dict[str, object]:
    """Differences by master, of Python's FMUs or of native ones."""
    step, count = math.radians(1.0) / SPEED, 720 * CYCLES
    partners = Partners(
        ct.build_fmu("diesel_i6", folder, film_table=False, block=False, platforms=platforms),
        ct.build_fmu("combustion_i6", folder, platforms=platforms), {},
        ct.build_fmu("valvetrain_i6", folder, platforms=platforms),
    )  # fmt: skip
    engines = {scheme: virtual_engine(partners, SPEED, scheme, "own") for scheme in ("gauss-seidel", "jacobi")}
    truth = reference(engines["gauss-seidel"], step, count)
    figures: dict[str, object] = {"jacobi": differences(reference(engines["jacobi"], step, count), truth)}
    ssp = export(engines["jacobi"], folder / "VirtualEngineI6.ssp", count * step)
    for name in MASTERS:
        print(f"foreign masters: {name}", file=sys.stderr, flush=True)
        try:
            figures[name] = differences(run(name, ssp, step, count, OUTPUTS, native=bool(platforms)), truth)
        except NotHere as error:
            figures[name] = {"failed": str(error)}
    return figures


def main() -> int:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        figures = measure(Path(folder, "python"), ())
        native = measure(Path(folder, "native"), ("linux64",))
    figures |= {f"{name}, native": row for name, row in native.items()}
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
