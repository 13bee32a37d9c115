"""One driver for all benchmarks: ``python -m benchmarks [CASE …]``, non-interactive, one JSON object on stdout.

A case is a file of this folder that prints one JSON object; files that begin with ``_`` are none. The
machine and the commit stand beside the figures, which are ratios within one run.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent


def main() -> int:
    """Run the cases named, or all; returns 1 if one failed."""
    cases = sorted(path.stem for path in FOLDER.glob("*.py") if not path.stem.startswith("_"))
    wanted = sys.argv[1:] or cases
    if unknown := [name for name in wanted if name not in cases]:
        print(f"benchmarks: unknown case '{unknown[0]}'; valid: {', '.join(cases)}", file=sys.stderr)
        return 2
    figures: dict[str, Any] = {}
    for name in wanted:
        print(f"benchmarks: {name}", file=sys.stderr, flush=True)
        began = time.perf_counter()
        done = subprocess.run(
            [sys.executable, str(FOLDER / f"{name}.py")], stdout=subprocess.PIPE, text=True, check=False
        )
        try:
            result = json.loads(done.stdout) if done.returncode == 0 else {"failed": done.returncode}
        except json.JSONDecodeError:
            result = {"failed": "printed no JSON object"}
        figures[name] = {"seconds": round(time.perf_counter() - began, 2), **result}
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=FOLDER, stdout=subprocess.PIPE, text=True, check=False
    )
    machine = {"system": platform.platform(), "processors": os.cpu_count(), "python": platform.python_version()}
    print(json.dumps({"machine": machine, "commit": commit.stdout.strip(), "cases": figures}, indent=2))
    return 1 if any("failed" in result for result in figures.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
