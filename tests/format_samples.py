"""Small files of each format, as a release writes them: ``python tests/format_samples.py tests/data/formats/1.0``.

Run once at a release whose formats differ from the last one's; what was written by a release is never made anew. Later
versions open all of them (``tests/regression/test_formats.py``).
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import numpy as np

import cranktrain as ct
from cranktrain.engine.file import engine_path
from cranktrain.film.table.database import TableSettings
from cranktrain.modules.register import module_files
from cranktrain.store.bodies import export_body
from cranktrain.store.film_tables import film_table
from cranktrain_lab.wear.records import OVER_TIME, WearHistory

ENGINE = "single_petrol"
LEVELS = {"crank": "torsional", "bearings": "held"}
TABLE = TableSettings(0.35, resolution="coarse", tilt=False)
STUDY = """title = "sample"
engine = "single_petrol"
outputs = ["twist"]
[speeds]
from = 1000
to = 2000
points = 3
[vary]
"flywheel.mass" = { low = "-5 %", high = "+5 %" }
[design]
n = 4
"""
EXAMPLES = Path(__file__).parents[1] / "examples"


def wear() -> WearHistory:
    """A history of two main bearings at two times."""
    of_engine = {"time", "speed", "gas_load"}
    rows = {name: np.linspace(0.1, 1.0, 2) if name in of_engine else np.ones((2, 2)) for name in OVER_TIME}
    rows["profile"] = np.full((2, 2, 3), 1e-6)
    ends = {"zeta": np.array([-1.0, 0.0, 1.0]), "weight": np.array([0.01, 0.02, 0.01])}
    about = {"attributes": {"engine": ENGINE}, "settled": True, "worn": np.full((2, 4, 3), 2e-6)}
    return WearHistory(bearings=np.array([1.0, 2.0]), **about, **ends, **rows)


def main(folder: Path) -> None:
    """Write the samples into a new folder."""
    folder.mkdir(parents=True)
    run = ct.simulate(ENGINE, speed_rpm=2000, cycles=1, integrator="esdirk4", step_deg=6.0, **LEVELS)
    run.save(folder / "run.h5")
    speeds = {"from_rpm": 1000, "to_rpm": 1400, "step_rpm": 200}
    ct.runup(ENGINE, **speeds, output=folder / "run_up.h5", method="linear", **LEVELS)
    body = ct.rigid_body("wheel", 5.0, np.diag([0.03, 0.03, 0.05]), (0, 0, 0), {"gear": (0, 0, 0.1)})
    for name in ("body.h5", "body.npz", "body"):
        export_body(folder / name, body)
    film_table(TABLE, folder / "film_table.h5", workers=1)
    study = folder / "study.toml"
    study.write_text(STUDY, "utf-8")
    ct.vary(study, output=folder / "variants", workers=1)
    wear().save(folder / "wear.h5")
    shutil.copyfile(engine_path(ENGINE), folder / "engine.toml")
    for name, path in module_files().items():
        if name.endswith("_i6"):  # combustion and valve train
            shutil.copyfile(path, folder / f"{name}.toml")
    for name in ("scene.toml", "harness.toml", "diesel_i6_measured.toml", "diesel_i6_pulley.targets.toml"):
        shutil.copyfile(EXAMPLES / name, folder / name)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
