"""A combustion of one's own beside the cranktrain: from a file of Python to an FMU to the coupled six.

``python examples/own_combustion.py [PICTURE.png]`` makes an FMU of ``own_combustion_slave.py``, a template whose model
is some twenty lines, by pythonfmu, and couples it with the six, beside the combustion module. Variables are called as
the module's are; those without a unit, as pythonfmu makes them, are in SI. The FMU alone: ``pythonfmu build -f
examples/own_combustion_slave.py``, then ``cranktrain couple diesel_i6 --speed 2000 --combustion OwnCombustion.fmu``.
"""

from __future__ import annotations

import sys
import tempfile
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from pythonfmu import FmuBuilder

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from cranktrain.results.figures import save_figure
from cranktrain.results.orders.harmonics import last_cycle

HERE = Path(__file__).parent
_SPECIFICATION = spec_from_file_location("coupled", HERE / "coupled.py")
assert _SPECIFICATION is not None and _SPECIFICATION.loader is not None
coupled = module_from_spec(_SPECIFICATION)
_SPECIFICATION.loader.exec_module(coupled)


def draw(path: str, runs: dict[str, Any]) -> None:
    """Pressure of cylinder 1 and torsion of the pulley, from both."""
    figure, (gas, motion) = plt.subplots(1, 2, figsize=(11, 4), constrained_layout=True)
    for label, run in runs.items():
        angle = run.of("cranktrain.crank.angle")
        pressure = 1e-6 * last_cycle(angle, run.of("combustion.cylinder[1].pressure"))
        torsion = np.degrees(last_cycle(angle, run.of("cranktrain.pulley.torsion")))
        degrees = np.linspace(0.0, 720.0, len(pressure), endpoint=False)
        gas.plot((degrees + 360.0) % 720.0 - 360.0, np.where(np.isclose(degrees, 360.0), np.nan, pressure), label=label)
        motion.plot(degrees, torsion, label=label)
    gas.set(
        xlim=(-150, 180), xlabel="crank angle after firing dead centre / deg", ylabel="pressure of cylinder 1 / MPa"
    )
    motion.set(xlim=(0, 720), xlabel="crank angle / deg", ylabel="pulley torsion / deg")
    for ax in (gas, motion):
        ax.grid(alpha=0.3)
        ax.legend(frameon=False)
    figure.suptitle("Coupled six at 2000 rev/min: a combustion of one's own beside the module", fontsize=11)
    save_figure(figure, path)
    plt.close(figure)


def main(picture: str = "", fmus: tuple[Path, Path] | None = None, cycles: int = 10) -> dict[str, float]:
    """Run both; returns the indicated torque of each, N m, as the cranktrain knows it, over the last cycle."""
    with tempfile.TemporaryDirectory() as name:
        cranktrain, module = fmus or coupled.built(Path(name))
        own = Path(FmuBuilder.build_FMU(HERE / "own_combustion_slave.py", dest=name))
        runs = {label: coupled.coupled(cranktrain, fmu, cycles) for label, fmu in (("own", own), ("module", module))}
    told = {label: coupled.summary(run, coupled.SPEED) for label, run in runs.items()}
    for label, row in told.items():
        torsion = row["pulley"]["torsion_deg"]["peak_to_peak"]
        print(f"{label}: IMEP {1e-5 * row['imep_pa']:.2f} bar, pulley torsion {torsion:.3f} deg peak to peak")
    if picture:
        draw(picture, runs)
    return {label: row["indicated_torque_nm"] for label, row in told.items()}


if __name__ == "__main__":
    main(*sys.argv[1:2])
