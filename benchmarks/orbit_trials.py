"""Coverage of values identified from measured orbits of main journals: synthetic orbits with noise, fitted in time.

    python -m benchmarks.orbit_trials --engines diesel_i6 single_petrol four_petrol v12_petrol --trials 40
    python -m benchmarks.orbit_trials --engines diesel_i6 --truth-crank solid --truth-bearings table --trials 20

Each trial draws a clearance and a temperature of the oil, runs the engine to its steady cycle with them, adds noise and
an unknown place of the probes to the orbits of its middle main, and identifies both by runs of ``--crank`` on films of
level impedance. A value is covered if the interval of 95 % that the command prints holds the true one.
``--truth-crank`` and ``--truth-bearings`` take the orbits from other levels, so that intervals must hold an error of
the model as well.

Prints a line of JSON for each engine with the machine's load, and a row for each value on stderr.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import tempfile
import time
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import cranktrain as ct
from cranktrain.core.errors import CranktrainError
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.results.orders.harmonics import CYCLE
from cranktrain.structure.assembly import assemble
from cranktrain.studies.run_up.steady import Job, SteadyRuns
from cranktrain_lab.identification.orbit_runs import HIGHEST, Series

RPM = math.pi / 30.0
ZERO_C = 273.15
POINTS = 360
CLEARANCES = (0.85, 1.2)
"""True clearances over the engine file's, from which a trial draws."""
TEMPERATURES = (80.0, 110.0)
"""True temperatures of the oil from which a trial draws, degC."""
PLACE = 8e-6
"""Standard deviation of the unknown place of the probes, m."""
KEYS = ("main_bearing.clearance", "oil.temperatures")
PARAMETERS = """[parameters]
"main_bearing.clearance" = { low = "-40 %", high = "+60 %" }
"oil.temperatures" = { low = "60 degC", high = "130 degC" }
"""


def main() -> None:
    """Run the trials of each engine."""
    options = argparse.ArgumentParser(description=__doc__)
    add = options.add_argument
    add("--engines", nargs="+", default=["diesel_i6", "single_petrol", "four_petrol", "v12_petrol"])
    add("--trials", type=int, default=40)
    add("--crank", default="beam")
    add("--truth-crank", default="beam")
    add("--truth-bearings", default="impedance")
    add("--speeds", type=int, default=1, help="measured, spread over those of the engine")
    add("--noise-um", type=float, default=0.5)
    add("--seed", type=int, default=1)
    given = options.parse_args()
    warnings.simplefilter("ignore")
    for name in given.engines:
        with one_thread(), tempfile.TemporaryDirectory() as folder:
            run(name, given, Path(folder))


def run(name: str, given: argparse.Namespace, folder: Path) -> None:
    """All trials of one engine; prints them."""
    engine = load_engine(name).without_additions
    assert engine.main_bearing is not None
    middle = engine.plain_numbers[len(engine.plain_numbers) // 2] + 1
    speeds = np.linspace(*engine.speeds, given.speeds + 2)[1:-1]
    rows: list[dict[str, Any]] = []
    for trial in range(given.trials):
        rng = np.random.default_rng([given.seed, trial])
        clearance = engine.main_bearing.clearance * rng.uniform(*CLEARANCES)
        warm = rng.uniform(*TEMPERATURES)
        began = time.perf_counter()
        try:
            true = _true(engine, clearance, warm)
            path = _measured(true, middle, speeds, given, rng, folder)
            found = ct.identify(name, path, method="time", crank=given.crank, bootstrap=0)
        except CranktrainError as error:
            print(f"{name}, trial {trial}: {error}", file=sys.stderr)
            continue
        own = {row["key"]: row for row in found["parameters"]}
        truth = dict(zip(KEYS, (1e6 * clearance, warm), strict=True))
        rows.append(
            {
                key: {
                    "away": own[key]["value"] - truth[key], "half": 0.5 * (own[key]["high"] - own[key]["low"]),
                    "covered": own[key]["low"] <= truth[key] <= own[key]["high"],
                }
                for key in KEYS
            }
            | {"seconds": time.perf_counter() - began, "answers": found["levels"][-1]["answers"]}
        )  # fmt: skip
    said = _said(name, given, rows) | {"bearing": f"main[{middle}]", "rpm": (speeds / RPM).round(1).tolist()}
    for key, unit in zip(KEYS, ("um", "K"), strict=True):
        print(
            f"{name}, {key}: covered {said['covered'][key]} of {len(rows)}, error rms {said['rms'][key]:.3g} {unit}, "
            f"half interval {said['half'][key]:.3g} {unit}",
            file=sys.stderr, flush=True,
        )  # fmt: skip
    print(json.dumps(said), flush=True)


def _true(engine: Engine, clearance: float, warm: float) -> Engine:
    """The engine with a clearance, m, and a temperature of its oil, degC."""
    assert engine.main_bearing is not None
    oil = replace(engine.oil, temperatures=tuple(warm + ZERO_C for _ in engine.oil.temperatures))
    return replace(engine, main_bearing=replace(engine.main_bearing, clearance=clearance), oil=oil)


def _measured(
    engine: Engine, bearing: int, speeds: Array, given: argparse.Namespace, rng: np.random.Generator, folder: Path
) -> Path:
    """Measured file of an engine's orbits, with noise."""
    settings = Settings(
        crank=given.truth_crank, bearings=given.truth_bearings, damper="none" if engine.damper is None else "fitted"
    )
    names = [f"bearing[{bearing}].position.{axis}" for axis in "xy"]
    runs = SteadyRuns(Job(assemble(engine, settings), None, 1e-4, HIGHEST, tuple(names)))
    text, angles = PARAMETERS, np.linspace(0.0, CYCLE, POINTS, endpoint=False)
    for speed in speeds.tolist():
        own = runs.at(speed)
        mean = complex(*(float(own.extremes[name][1]) for name in names))
        orbit = 1e6 * Series(mean, np.array([own.amplitudes[name] for name in names])).at(angles)
        orbit = orbit + complex(*(1e6 * PLACE * rng.normal(size=2)))
        orbit = orbit + given.noise_um * (rng.normal(size=POINTS) + 1j * rng.normal(size=POINTS))
        file = folder / f"{speed / RPM:.0f}.csv"
        lines = [f"{math.degrees(a):.3f},{z.real:.4f},{z.imag:.4f}" for a, z in zip(angles, orbit, strict=True)]
        file.write_text("\n".join(["crank_angle [deg],x [um],y [um]", *lines]) + "\n", "utf-8")
        text += f'[[orbit]]\nfile = "{file.name}"\nbearing = "main[{bearing}]"\nrpm = {speed / RPM:.6f}\n'
    path = folder / "measured.toml"
    path.write_text(text, "utf-8")
    return path


def _said(name: str, given: argparse.Namespace, rows: list[dict[str, Any]]) -> dict[str, Any]:
    def of(part: str, by: Any) -> dict[str, Any]:
        return {key: by([row[key][part] for row in rows]) for key in KEYS}

    return {
        "engine": name, "seed": given.seed, "trials": len(rows), "crank": given.crank,
        "truth": f"{given.truth_crank}, {given.truth_bearings}", "load": os.getloadavg()[0],
        "covered": of("covered", sum), "rms": of("away", lambda own: float(np.sqrt(np.mean(np.square(own))))),
        "mean": of("away", lambda own: float(np.mean(own))), "half": of("half", lambda own: float(np.median(own))),
        "answers": float(np.mean([row["answers"] for row in rows])) if rows else None,
        "seconds": float(np.mean([row["seconds"] for row in rows])) if rows else None,
    }  # fmt: skip


if __name__ == "__main__":
    main()
