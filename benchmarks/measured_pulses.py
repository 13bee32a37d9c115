"""Two channels of 10⁸ samples of pulses to torsional orders and twist, on one core: time and memory.

    python -m benchmarks.measured_pulses [--samples 100000000] [--folder DIR]

The file (HDF5, 32-bit floats, 0.8 GB) is made first, in its own process: inductive pick-ups of 60−2 and 120 teeth on a
shaft that runs up from 800 to 2400 rev/min, sampled at 500 kHz, noise 0.1 % of the amplitude. What is measured is
``cranktrain measured FILE --rotation front --missing 2 --second rear --second-teeth 120 --orders 0.5-12``.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

RATE, BLOCK = 500e3, 2**20
RPM = math.pi / 30.0
ONE_CORE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


def make(path: Path, samples: int) -> None:
    """Write the file in blocks."""
    import h5py

    rng = np.random.default_rng(0)
    seconds = samples / RATE
    with h5py.File(path, "w") as file:
        file.attrs["fs"] = RATE
        places = {name: file.create_dataset(name, samples, dtype="f4") for name in ("front", "rear")}
        for first in range(0, samples, BLOCK):
            t = np.arange(first, min(first + BLOCK, samples)) / RATE
            phi = RPM * (800.0 * t + 800.0 * t * t / seconds)
            common = phi + math.radians(0.3) * np.cos(3.0 * phi)
            front = common + math.radians(0.1) * np.cos(6.0 * phi + 0.5)
            s = front * (60 / math.tau)
            y = np.where(np.floor(s + 0.5) % 60 >= 58, -0.9, np.sin(math.tau * s))
            for name, values in (("front", y), ("rear", np.sin(120.0 * common))):
                places[name][first : first + t.size] = values + rng.normal(0.0, 1e-3, t.size).astype("f4")


def main() -> None:
    """Make the file, run the command, print time and memory as JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=100_000_000)
    parser.add_argument("--folder", default=None)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=asked.folder) as folder:
        path = Path(folder) / "pulses.h5"
        make(path, asked.samples)
        command = [
            sys.executable,
            "-m",
            "cranktrain.cli.main",
            "measured",
            str(path),
            "--rotation",
            "front",
            "--teeth",
            "60",
            "--missing",
            "2",
            "--second",
            "rear",
            "--second-teeth",
            "120",
            "--orders",
            "0.5-12",
            "--json",
        ]
        begin = time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=os.environ | ONE_CORE)
        seconds = time.perf_counter() - begin
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    peak = used.ru_maxrss / 1024.0**2
    told = json.loads(done.stdout)
    twist = told["orders"][-1]
    k = twist["orders"].index(6.0)
    found = [row[k] for row in twist["amplitudes"]]
    print(
        json.dumps(
            {
                "samples_per_channel": asked.samples,
                "channels": 2,
                "seconds": round(seconds, 1),
                "processor_seconds": round(used.ru_utime + used.ru_stime, 1),
                "peak_memory_gb": round(peak, 2),
                "pulses": [one["pulses"] for one in told["rotation"]],
                "twist_order_6_deg": [min(found), max(found)],
                "true_deg": 0.1,
            },
            indent=2,
        )
    )


if __name__ == "__main__":
    main()
