"""The trade-off study with other solvers beside ours: explicit methods, Radau and SciPy's on the same equations.

    python benchmarks/tradeoff.py                                      # the six at 2000 rev/min, integrators alone
    python benchmarks/tradeoff.py examples/six_at_2000.toml --output out/tradeoff      # all families, with charts

Error against cost as ``cranktrain tradeoff`` measures it, which knows our own integrators only. Without ``--output``
the integrators are measured anew, and nothing is taken from what earlier runs kept; with it all families are, runs are
kept in the cache, and the study's charts and tables are written. Prints one JSON object: the study, and under
``against_scipy`` by scene and error what the best of ours costs beside the best of SciPy.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.other_solvers.entries import other_entries, speedups

from cranktrain.store.kept import Kept
from cranktrain_lab.tradeoff.files import write_files
from cranktrain_lab.tradeoff.point import in_scene
from cranktrain_lab.tradeoff.study import chosen_families, default_scenes, scenes_of, study


def main(arguments: list[str] | None = None) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Accuracy against speed with other solvers beside ours.")
    parser.add_argument("scene", nargs="?", metavar="SCENE", help="scene file (.toml) in place of the six at 2000")
    parser.add_argument("--quick", action="store_true", help="fewer points, one scene, one run each")
    parser.add_argument("--output", metavar="FOLDER", help="measure all families, and write charts and tables here")
    options = parser.parse_args(arguments)
    scenes = default_scenes(quick=True) if options.scene is None else scenes_of(options.scene, options.quick)
    with tempfile.TemporaryDirectory() as folder:
        found = study(
            scenes, ["integrators"] if options.output is None else chosen_families(None), options.quick,
            store=Kept(Path(folder)) if options.output is None else None,
            say=lambda stage: print(f"tradeoff: {stage}", file=sys.stderr, flush=True), others=other_entries,
        )  # fmt: skip
    if options.output is not None:
        write_files(found, Path(options.output))
    against = {scene.name: speedups(in_scene(found.points, scene.name)) for scene in scenes}
    print(json.dumps({**found.as_dict(), "against_scipy": against}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
