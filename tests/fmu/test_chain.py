"""The build command with real blocks: engine file to FMU, as a user gives it, and the whole engine run by fmpy."""

import json
import os
import re
import subprocess
import sys

import pytest

from cranktrain.engine.file import engine_path, load_engine
from cranktrain.fmu import archive

COARSER = {
    "diesel_i6": {"crankshaft": 25, "block": 70},
    "diesel_v8": {"crankshaft": 50, "block": 60},
}
"""Largest element edges, mm."""


def coarse_file(name, folder):
    """Engine file with coarser meshes and fewer modes of the block."""
    text = engine_path(name).read_text(encoding="utf-8")
    for table, size in COARSER[name].items():
        pattern = rf"(?s)(\n\[{table}\]\n.*?\nmesh_size = \{{ value = )[0-9.]+"
        text, count = re.subn(pattern, rf"\g<1>{size}", text, count=1)
        assert count == 1
    text, count = re.subn(r"(?s)(\n\[block\]\n.*?\nfixed_modes = \{ value = )[0-9]+", r"\g<1>30", text, count=1)
    assert count == 1
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize("name", list(COARSER))
def test_from_engine_file_to_the_whole_engine_in_fmpy(name, tmp_path, script, cache):
    done = subprocess.run(
        [sys.executable, str(archive.ROOT / "build_fmu.py"), str(coarse_file(name, tmp_path)), "-o", str(tmp_path),
         "--no-film-table"],
        capture_output=True, text=True, timeout=3600, env={**os.environ, "CRANKTRAIN_CACHE": str(cache)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    fmu = done.stdout.splitlines()[-1]
    ran = script(
        """
import json
import numpy as np
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
assert validate_fmu(sys.argv[1]) == []
levels = {"block.level": "flexible", "damper.level": "fitted", "speed": 188.5}
result = simulate_fmu(sys.argv[1], start_values=levels, stop_time=1.2, output_interval=2e-4)
assert all(np.isfinite(result[name]).all() for name in result.dtype.names)
last = result["time"] > 1.2 - 6 * 4 * np.pi / 188.5
mean = lambda name: float(result[name][last].mean())
print(json.dumps({name: mean(name) for name in result.dtype.names}))
""",
        fmu,
    )
    mean = json.loads(ran.stdout)
    # Over some cycles the mounts hold the engine against the torque that it gives to its shaft; the rest is its swing.
    mounts = load_engine(name).mounts
    moment = 0.0
    for i, (x, y, _) in enumerate(mounts.positions, 1):
        moment += x * mean[f"mount[{i}].force.y"] - y * mean[f"mount[{i}].force.x"] + mean[f"mount[{i}].moment.z"]
    assert moment == pytest.approx(mean["shaft.torque"], rel=0.02)
    assert mean["shaft.torque"] > 500.0 and mean["damper.heat"] > 10.0
