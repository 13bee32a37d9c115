"""A virtual sensor: the cranktrain's FMU under measured pressures and speed, beside the measured torsion of its pulley.

``python examples/virtual_sensor.py [FOLDER]`` runs virtual_sensor.toml and prints the misfits. With ``--make`` it first
makes virtual_sensor.csv, the measurement: a run of the six with a crank of beams and fluid films at 1800 rev/min, whose
first cylinder burns 4 % more than the others, with noise on every channel.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import cranktrain as ct
from cranktrain.cli.main import main as cranktrain
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.simulation import Simulation
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.orders.harmonics import last_cycle
from cranktrain.store.hdf5 import read_result

FILE = Path(__file__).with_suffix(".toml")
SPEED_RPM, SAMPLES, SEED = 1800.0, 360, 7
NOISE = {"pressure": 0.02e5, "torsion": 2e-3, "speed": 0.3}
"""Noise of the channels: Pa, deg, rev/min."""


def make(path: Path) -> None:
    """Write the measurement."""
    engine = ct.load_engine("diesel_i6")
    made = ct.assemble(engine, ct.Settings(crank="beam", damper="fitted"))
    gas = GasTrace.from_engine(engine)
    strong = replace(gas, fired=gas.motored + 1.04 * (gas.fired - gas.motored))
    uneven = replace(gas, own=(strong, *(gas,) * (engine.n_cylinders - 1)))
    simulation = Simulation(made.engine, made.body, made.settings, uneven, made.parts)
    simulation.inputs[0] = SPEED_RPM * np.pi / 30.0
    simulation.initialize()
    run = run_cycles(simulation, None, 1e-4, None, None)
    rng = np.random.default_rng(SEED)
    angle = np.arange(SAMPLES) * (720.0 / SAMPLES)
    torsion = np.degrees(last_cycle(run.outputs["crank.angle"], run.outputs["pulley.torsion"], SAMPLES))
    columns = [angle, SPEED_RPM + NOISE["speed"] * rng.normal(size=SAMPLES)]
    for trace, phase in zip(uneven.own, engine.firing_angles, strict=True):
        own = np.interp(np.radians(angle) - phase, trace.angles, trace.fired, period=4.0 * np.pi)
        columns.append((own + NOISE["pressure"] * rng.normal(size=SAMPLES)) / 1e5)
    columns.append(torsion + NOISE["torsion"] * rng.normal(size=SAMPLES))
    names = ["crank.angle [deg]", "N_DYNO [rev/min]"]
    names += [f"cylinder[{c + 1}].pressure [bar]" for c in range(engine.n_cylinders)] + ["TORS_PULLEY [deg]"]
    rows = [",".join(f"{value:.6g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join((",".join(names), *rows)) + "\n", encoding="utf-8")


def main(folder: str = "virtual_sensor_results") -> dict[str, float]:
    """Run both scenarios; returns the root mean square of each one's misfit over its last cycle, deg."""
    code = cranktrain(["harness", str(FILE), "--output", folder, "--html", f"{folder}/report.html"])
    if code:
        raise SystemExit(code)
    found = {}
    for path in sorted(Path(folder).glob("*.h5")):
        data, _ = read_result(path)
        cycle = last_cycle(data["cranktrain/crank.angle"][0], np.degrees(data["misfit/pulley.torsion"][0]))
        found[path.stem] = float(np.sqrt(np.mean(cycle**2)))
        print(f"{path.stem.replace('_', ' ')}: misfit {1e3 * found[path.stem]:.1f} mdeg rms")
    return found


if __name__ == "__main__":
    given = [word for word in sys.argv[1:] if word != "--make"]
    if "--make" in sys.argv:
        make(FILE.with_suffix(".csv"))
    main(*given)
