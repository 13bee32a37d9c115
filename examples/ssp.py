"""Write the coupled six as an SSP and run it in FMPy's SSP simulator, beside the reference master.

``python examples/ssp.py [PICTURE.png]`` builds both FMUs, writes ``VirtualEngineI6.ssp`` into a folder of its own, runs
it, and prints how far pulley torsion and mean effective pressure are from the reference master's at the same steps.
What FMPy's simulator does otherwise: it ignores the parameter sets in the SSP, so that every unit runs at its start
values; all inputs are 0 in the first step; all units step at once with what was known before; and a row bears the time
of its step's begin.
"""

from __future__ import annotations

import math
import sys
import tempfile
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from fmpy.ssp.simulation import simulate_ssp
from scipy.interpolate import CubicSpline

from cranktrain.results.figures import save_figure
from cranktrain_lab.coupling.ssp import write_ssp
from cranktrain_lab.coupling.virtual_engine import Partners, virtual_engine

_SPECIFICATION = spec_from_file_location("coupled", Path(__file__).with_name("coupled.py"))
assert _SPECIFICATION is not None and _SPECIFICATION.loader is not None
coupled = module_from_spec(_SPECIFICATION)
_SPECIFICATION.loader.exec_module(coupled)


def written(path: Path, fmus: tuple[Path, Path], stop: float) -> Path:
    """The SSP of both FMUs; ``cranktrain couple ENGINE --export-ssp`` writes the same."""
    engine = virtual_engine(Partners(*fmus, {}), coupled.SPEED, "jacobi", "own")
    units = {name: (unit, unit.path) for name, unit in engine.units.items()}
    return write_ssp(path, path.stem, units, engine.connections, engine.values, engine.outputs, stop)


def draw(path: str, angle_deg: Any, ours: Any, theirs: Any) -> None:
    """Torsion over the last cycle from both masters, and their difference."""
    figure, (both, off) = plt.subplots(2, 1, figsize=(9, 6), sharex=True, constrained_layout=True)
    both.plot(angle_deg, ours, label="reference master, Gauss–Seidel")
    both.plot(angle_deg, theirs, "--", label="FMPy's SSP simulator")
    both.set(ylabel="pulley torsion / deg", xlim=(0, 720))
    both.set_title("coupled six at 2000 rev/min, 1 degree", fontsize=10, loc="left")
    both.legend(frameon=False)
    off.plot(angle_deg, 1e3 * (theirs - ours), color="0.3")
    off.set(xlabel="crank angle / deg", ylabel="difference / mdeg")
    for ax in (both, off):
        ax.grid(alpha=0.3)
    save_figure(figure, path)
    plt.close(figure)


def main(picture: str = "", fmus: tuple[Path, Path] | None = None, cycles: int = 10) -> tuple[float, float]:
    """Run both; returns the relative differences of torsion (peak to peak) and mean effective pressure."""
    with tempfile.TemporaryDirectory() as name:
        fmus = fmus or coupled.built(Path(name))
        stop = cycles * 4.0 * math.pi / coupled.SPEED
        theirs = simulate_ssp(
            str(written(Path(name) / "VirtualEngineI6.ssp", fmus, stop)), stop_time=stop, step_size=coupled.STEP
        )
        ours = coupled.coupled(*fmus, cycles)
    angle = (cycles - 1) * 4.0 * math.pi + np.linspace(0.0, 4.0 * math.pi, 1440, endpoint=False)
    at, motion = "cranktrain.crank.angle", "cranktrain.pulley.torsion"
    pairs = (ours.of(at), ours.of(motion)), (theirs[at], theirs[motion])
    torsion = [np.degrees(CubicSpline(*pair)(angle)) for pair in pairs]
    swing = float(np.ptp(torsion[1]) / np.ptp(torsion[0])) - 1.0
    pressure = "combustion.indicated.pressure_mean"
    mean = float(theirs[pressure][-1] / ours.of(pressure)[-1]) - 1.0
    print(
        f"FMPy's SSP simulator against the reference master: torsion {swing:+.2%}, mean effective pressure {mean:+.2%}"
    )
    if picture:
        draw(picture, np.degrees(angle - angle[0]), *torsion)
    return swing, mean


if __name__ == "__main__":
    main(*sys.argv[1:2])
