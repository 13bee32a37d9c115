"""Run the six's FMU by itself, and driven by files: ``python examples/csv_driven.py [PICTURE.png]``.

By itself the FMU needs no input: its built-in gas trace drives it at 2000 rev/min. ``fmu_pressures.csv`` gives it that
trace as pressures, over the time, at the angle that the crank is expected to have; ``fmu_run_up.csv`` a rising speed;
``fmu_input.py`` wrote both. ``fmpy simulate --input-file`` does the same from the command line.
"""

from __future__ import annotations

import io
import math
import sys
import tempfile
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from fmpy import read_csv, simulate_fmu

import cranktrain as ct
from cranktrain.results.figures import save_figure

HERE = Path(__file__).parent
STEP = 1.0e-4
RUNS = {"by itself": None, "pressures": "fmu_pressures.csv", "run-up": "fmu_run_up.csv"}


def simulated(fmu: Path, file: str | None, stop: float) -> Any:
    """Outputs of the FMU in FMPy, with inputs from a file."""
    with redirect_stdout(io.StringIO()):  # FMPy names each input that the file leaves at its start
        return simulate_fmu(
            str(fmu),
            stop_time=stop,
            output_interval=STEP,
            input=None if file is None else read_csv(str(HERE / file)),
            output=["frame.speed", "pulley.torsion"],
        )


def draw(path: str, runs: dict[str, Any]) -> None:
    """Torsion with the gas built in and from the file; torsion while the speed rises."""
    figure, (same, rising) = plt.subplots(1, 2, figsize=(12, 4), constrained_layout=True)
    for label, style in (("by itself", "-"), ("pressures", "--")):
        run = runs[label]
        shown = run["time"] > run["time"][-1] - 4.0 * math.pi / (2000.0 * math.pi / 30.0)
        text = {"by itself": "built-in gas trace", "pressures": "fmu_pressures.csv"}[label]
        same.plot(1e3 * run["time"][shown], np.degrees(run["pulley.torsion"][shown]), style, label=text)
    same.set(xlabel="time / ms", ylabel="pulley torsion / deg", title="2000 rev/min, the last cycle")
    same.legend(frameon=False)
    run = runs["run-up"]
    rising.plot(run["frame.speed"] * 30.0 / math.pi, np.degrees(run["pulley.torsion"]), lw=0.8)
    rising.set(xlabel="speed / (rev/min)", ylabel="pulley torsion / deg", title="fmu_run_up.csv")
    for ax in (same, rising):
        ax.grid(alpha=0.3)
    save_figure(figure, path)
    plt.close(figure)


def main(picture: str = "", fmu: Path | None = None, stop: float = 0.5) -> float:
    """Run all; returns torsion, peak to peak over the last cycle, from the file over that with the gas built in."""
    with tempfile.TemporaryDirectory() as folder:
        fmu = fmu or ct.build_fmu("diesel_i6", folder, film_table=False, block=False)
        runs = {label: simulated(fmu, file, stop) for label, file in RUNS.items()}
    cycle = round(4.0 * math.pi / (2000.0 * math.pi / 30.0) / STEP)
    own, given = (float(np.ptp(runs[label]["pulley.torsion"][-cycle:])) for label in ("by itself", "pressures"))
    print(
        f"pulley torsion: {math.degrees(own):.3f} deg peak to peak by itself, {math.degrees(given):.3f} from the file"
    )
    if picture:
        draw(picture, runs)
    return given / own


if __name__ == "__main__":
    main(*sys.argv[1:2])
