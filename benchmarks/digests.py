"""Digests of the outputs of engines at every level and of every kind, to hold one version of the sources to another.

A change of names, places or structure changes no bit of a result::

    python -m benchmarks.digests before.json           # in the sources before the change
    python -m benchmarks.digests --against before.json # in the sources after it

Digests depend on the machine and its libraries, so they are compared on one machine and never kept in the repository.
``--only TEXT`` takes the cases whose name holds TEXT, ``--quick`` those that need neither a block nor a film table.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.additions import topology, with_rods
from rich.console import Console

from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import simulate
from cranktrain.dynamics.time.integrators import INTEGRATORS
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import assemble

SPEED = 2000.0 * math.pi / 30.0
SAY = Console(stderr=True).print
DISCS, RODS = "two discs", "two rods"


def cases(quick: bool) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Name, engine (with what is added to it) and settings of each case; a run is a cycle, 288 steps of 2.5 degrees."""
    plain = ("linear", "impedance", "reynolds", "ehd") if quick else ("linear", "impedance", "table", "reynolds", "ehd")
    for level in plain:
        yield f"i6 {level}", "diesel_i6", {"bearings": level}
    for level in ("linear", "roller"):
        yield f"v8 {level}", "diesel_v8", {"bearings": level}
    for level in ("rigid", "torsional", "beam"):
        yield f"i6 {level} crank", "diesel_i6", {"crank": level}
        yield f"v8 {level} crank", "diesel_v8", {"crank": level}
    yield "i6 rigid crank, held", "diesel_i6", {"crank": "rigid", "bearings": "held"}
    for name in INTEGRATORS:
        yield f"i6 {name}", "diesel_i6", {"integrator": name}
    for name in ("esdirk4", "generalised-alpha"):
        adaptive = {"integrator": name, "control": "adaptive", "tolerance": 1e-4}
        yield f"i6 adaptive {name}", "diesel_i6", adaptive
        yield f"v8 adaptive {name}", "diesel_v8", adaptive
    yield "i6 adaptive linear", "diesel_i6", {"bearings": "linear", "control": "adaptive", "tolerance": 1e-4}
    yield "i6 big ends impedance", "diesel_i6", {"big_ends": "impedance"}
    yield "v8 damper", "diesel_v8", {"damper": "fitted"}
    yield "i6 load torque", "diesel_i6", {"boundary": "torque"}
    yield "i6 guided pistons", "diesel_i6", {"pistons": "guided"}
    beam = {"crank": "beam"}
    yield "four with balancers", "examples/four_with_balancers.toml", beam
    yield "four, dual-mass flywheel", "four_petrol", beam
    yield "articulated V12", "tests/data/engines/v12_articulated.toml", beam
    yield "articulated radial", "tests/data/engines/radial5.toml", beam
    yield "two-stroke six", "two_stroke_six", beam
    yield "split-pin V6", "v6_split", beam
    yield "i6 beam floating", "diesel_i6", beam | {"big_ends": "impedance"}
    yield "i6 discs", f"diesel_i6 + {DISCS}", beam
    yield "i6 rods as bodies", f"diesel_i6 + {RODS}", beam
    if quick:
        return
    yield "i6 big ends table", "diesel_i6", {"big_ends": "table"}
    for level in ("linear", "impedance", "table", "ehd"):
        yield f"i6 block {level}", "diesel_i6", {"bearings": level, "block": "flexible"}
    yield "i6 block discs", f"diesel_i6 + {DISCS}", beam | {"block": "flexible"}
    yield "v8 block damper", "diesel_v8", {"block": "flexible", "damper": "fitted"}
    yield "v8 block big ends", "diesel_v8", {"block": "flexible", "big_ends": "impedance"}


def case_digest(engine_name: str, choices: dict[str, Any]) -> str:
    """Digest of every output at every step of a cycle at 2000 rev/min, or at a lower best speed of the engine."""
    engine_name, _, added = engine_name.partition(" + ")
    made = assemble(load_engine(engine_name), Settings(**choices), say=SAY)
    if added == DISCS:
        z = float(made.body.positions[made.body.index("flywheel"), 2])
        made = replace(made, parts=made.parts._replace(topology=topology(2, z)))
    elif added == RODS:
        made = replace(made, parts=made.parts._replace(topology=with_rods(2, made.engine, made.body)))
    speed = min(SPEED, made.engine.best_speed)
    run = simulate(made.engine, made.body, made.settings, speed, 1, parts=made.parts)
    found = hashlib.sha256(np.ascontiguousarray(run.angle).tobytes())
    for name in sorted(run.outputs):
        found.update(name.encode() + np.ascontiguousarray(run.outputs[name]).tobytes())
    return found.hexdigest()[:20]


def main() -> int:
    """Write the digests, or compare them with others; 1 where one differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", type=Path, help="where the digests go")
    parser.add_argument("--against", type=Path, metavar="FILE", help="digests of other sources to compare with")
    parser.add_argument("--only", default="", metavar="TEXT", help="cases whose name holds TEXT")
    parser.add_argument("--quick", action="store_true", help="leave out what needs a block or a film table")
    chosen = parser.parse_args()
    before = json.loads(chosen.against.read_text()) if chosen.against else {}
    found, differ = {}, 0
    for name, engine, choices in cases(chosen.quick):
        if chosen.only not in name:
            continue
        found[name] = case_digest(engine, choices)
        verdict = "" if name not in before else "equal" if found[name] == before[name] else "DIFFERS"
        differ += verdict == "DIFFERS"
        print(f"{name:28} {found[name]} {verdict}", flush=True)
        if chosen.file is not None:
            chosen.file.write_text(json.dumps(found, indent=1) + "\n")
    return 1 if differ else 0


if __name__ == "__main__":
    raise SystemExit(main())
