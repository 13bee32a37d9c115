"""The integrators' part of the trade-off study at 2000 rev/min, measured anew: ``python benchmarks/tradeoff.py``.

Error against cost of every integrator and of SciPy's solvers on the same equations, as ``cranktrain tradeoff --family
integrators`` measures them, but nothing is taken from what earlier runs kept. Prints one JSON object.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from cranktrain.store.kept import Kept
from cranktrain.studies.tradeoff.study import default_scenes, study


def main() -> int:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        found = study(
            default_scenes(quick=True), ["integrators"], store=Kept(Path(folder)),
            say=lambda stage: print(f"tradeoff: {stage}", file=sys.stderr, flush=True),
        )  # fmt: skip
    print(json.dumps(found.as_dict()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
