"""Small files of a test bench with a known content, as the README's command lines read them.

    python examples/bench_samples.py [FOLDER]

writes into ``examples/bench``, or a folder:

* ``run.csv``: edges of a 60-2 wheel on the six's pulley, times in s, over a run-up of 6 s from 1000 to 2200 rev/min;
* ``ok1.csv`` to ``ok4.csv`` and ``today.csv``: orders of the pulley's torsion, four recordings of the healthy engine
  and one in which cylinder 3 burns a fifth less;
* ``crank.step``: crankshaft of the shipped single of 96 mm bore.

All torsion is that of the torsional crank on its damper, with noise of 3 mdeg on every order of a recording.
"""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

from cranktrain.core.types import Array
from cranktrain.engine.file import load_engine
from cranktrain_lab.measured.order_table import write_orders
from cranktrain_lab.measured.tracking import Orders
from cranktrain_lab.watch.defects import MISFIRE
from cranktrain_lab.watch.recordings import ComplexArray, Place, TorsionalAnswers
from cranktrain_lab.watch.watch import Watch

ENGINE, CYLINDER, LOST = "diesel_i6", 3, 0.2
"""Engine, the cylinder that burns less, and by how much."""
TEETH, MISSING, SECONDS, FROM, TO = 60, 2, 6.0, 1000.0, 2200.0
HALVES = 0.5 * np.arange(1, 25)
WATCHED = (1200.0, 1500.0, 1800.0, 2100.0)
NOISE, HEALTHY = math.radians(3e-3), 4
RPM = math.pi / 30.0
CRANK = """
import sys
from netgen import occ
from cranktrain.engine.file import load_engine
from cranktrain.structure.crank.shape import crankshaft_shape
shape = crankshaft_shape(load_engine("single_petrol").crankshaft)
shape.Scale(occ.Pnt(0, 0, 0), 1000.0).WriteStep(sys.argv[1])
"""


def edges(speeds: Array, orders: ComplexArray) -> Array:
    """Times (k,) s of the wheel's edges in a run-up whose torsion has ``orders`` (s, o) at ``speeds`` (s,) rad/s."""
    t = np.arange(0.0, SECONDS, 1e-5)
    slope = (TO - FROM) * RPM / SECONDS
    rate, angle = FROM * RPM + slope * t, FROM * RPM * t + 0.5 * slope * t**2
    for k, order in enumerate(HALVES):
        swing = np.interp(rate, speeds, orders[:, k].real) + 1j * np.interp(rate, speeds, orders[:, k].imag)
        angle = angle + (swing * np.exp(1j * order * angle)).real
    places = np.arange(1, int(angle[-1] / (2.0 * math.pi) * TEETH))
    places = places[places % TEETH < TEETH - MISSING]
    return np.interp(places * 2.0 * math.pi / TEETH, angle, t)


def recording(path: Path, place: Place, orders: ComplexArray, rng: np.random.Generator) -> None:
    """Write the orders (s, o) of one recording with noise."""
    noisy = orders + NOISE * (rng.normal(size=orders.shape) + 1j * rng.normal(size=orders.shape))
    errors = np.full(orders.shape, NOISE)
    fits = np.full(len(place.speeds), 8)
    found = Orders(place.speeds, place.orders, noisy, errors, np.ones(orders.shape), fits, 2, "torsion", "rad")
    write_orders(path, [found], [place.output], wheel=f"{TEETH}-{MISSING}")


def step_crank(path: Path) -> None:
    """Write the crank of the single, in a process of its own for the CAD kernel; without the day it was made."""
    subprocess.run([sys.executable, "-c", CRANK, str(path)], check=True)
    text = re.sub(r"\d{4}-\d\d-\d\dT[\d:]+", "2026-01-01T00:00:00", path.read_text("utf-8"))
    path.write_text(text, "utf-8")


def main(folder: Path | str = Path(__file__).parent / "bench") -> Path:
    """Write all files; their folder."""
    folder = Path(folder)
    folder.mkdir(exist_ok=True)
    answers = TorsionalAnswers(load_engine(ENGINE), 1.0, damper=True)
    speeds = np.arange(FROM, TO + 1.0, 25.0) * RPM
    times = edges(speeds, answers.orders(answers.healthy, Place("pulley.torsion", speeds, HALVES)))
    rows = "\n".join(f"{t:.7f}" for t in times)
    (folder / "run.csv").write_text(f"pulley / s\n{rows}\n", "utf-8")

    place = Place("pulley.torsion", np.array(WATCHED) * RPM, HALVES[:12])
    defect = next(one for one in Watch(answers, place).defects if one.key == f"{MISFIRE}[{CYLINDER}]")
    rng = np.random.default_rng(1)
    healthy = answers.orders(answers.healthy, place)
    for k in range(1, HEALTHY + 1):
        recording(folder / f"ok{k}.csv", place, healthy, rng)
    recording(folder / "today.csv", place, answers.orders(defect.of(answers.healthy, LOST), place), rng)
    step_crank(folder / "crank.step")
    return folder


if __name__ == "__main__":
    print(main(*sys.argv[1:2]))
