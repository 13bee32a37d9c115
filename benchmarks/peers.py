"""Other people's programs beside ours in one run, at equal error: ``make bench-peers``, or with names of some.

    python -m benchmarks.peers [scipy exudyn ross opentorsion calculix]

Each comparison takes what both sides can have alike and leaves out the rest on both; what remains unlike is said. Costs
are processor time, one thread, medians over rounds in which every case takes its turn. Programs live in virtual
environments of their own in the cache, made at first use; CalculiX is Debian's package calculix-ccx. A program that
cannot be had is listed with the reason. Prints one JSON object.
"""

from __future__ import annotations

import json
import os
import sys
from importlib import import_module
from pathlib import Path

if __name__ == "__main__":
    os.environ.update({f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")})
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.peer_programs.environment import Absent

PEERS = {
    "scipy": "scipy_solvers",
    "exudyn": "exudyn_crank",
    "ross": "ross_bearing",
    "opentorsion": "torsional_run_up",
    "calculix": "calculix_modes",
}
"""By name, the module of ``peer_programs`` whose ``measured`` compares it with ours."""


def main(*names: str) -> int:
    """Compare those named, or all; print."""
    if unknown := [name for name in names if name not in PEERS]:
        print(f"peers: unknown program '{unknown[0]}'; valid: {', '.join(PEERS)}", file=sys.stderr)
        return 2
    found: dict[str, object] = {}
    for name in names or tuple(PEERS):
        print(f"peers: {name}", file=sys.stderr, flush=True)
        try:
            found[name] = import_module(f"benchmarks.peer_programs.{PEERS[name]}").measured()
        except Absent as reason:
            found[name] = {"absent": str(reason)}
    print(json.dumps(found, indent=1, ensure_ascii=False))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
