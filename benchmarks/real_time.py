"""Worst times of steps in real time: ``chrt -f 50 taskset -c 1 python -m benchmarks.real_time``.

A C host (``_native_host.c``) runs native FMUs of the six, two fours and the V8 in steps of one millisecond while
the speed goes from a third of the rated speed to it and back, 50 s each way. First each engine at its default levels
over 10^6 steps, then, over a tenth of them, with ``solver.work_limit`` at the iterations that 99 % of the steps keep
to, and at other levels. A level whose first 500 steps take longer than they last is not run on. Wall and processor
time over the length of a step; ``still`` is the longest pause of an empty loop over 10^5 steps. Wall times mean
something on an idle core alone, at a real-time priority, which the processes that this one starts inherit. Prints one
JSON object.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.native_fmu import Timed, compiled

from cranktrain.core.units import RPM
from cranktrain.engine.file import load_engine
from cranktrain.fmu.build import build_fmu

STEP, SWEEP = 1.0e-3, 100.0
"""Communication step, and the time of a sweep over the speeds and back; s."""
ENGINES = "diesel_i6", "generator_four", "four_petrol", "diesel_v8"
STEPS, TRIED, SHARE = 1_000_000, 500, 10
"""Steps at the default levels; steps after which a slow level is given up; other runs have a SHARE-th of the steps."""
LEVELS = {
    "torsional": {"crank.level": "torsional", "block.level": "ground"},
    "beam, linear": {"crank.level": "beam", "bearing.level": "linear", "block.level": "ground"},
    "beam, impedance": {"crank.level": "beam", "bearing.level": "impedance", "block.level": "ground"},
    "solid, impedance": {"crank.level": "solid", "bearing.level": "impedance", "block.level": "ground"},
    "solid, table": {"crank.level": "solid", "bearing.level": "table", "block.level": "ground"},
    "solid, impedance, block": {"crank.level": "solid", "bearing.level": "impedance", "block.level": "flexible"},
    "solid, ehd": {"crank.level": "solid", "bearing.level": "ehd", "block.level": "ground"},
}  # fmt: skip
READ = "solver.iterations", "solver.limited"


def figures(timed: Timed, sweep: str, count: int, levels: dict[str, str], limit: float = 0.0) -> dict[str, Any]:
    """Figures of an FMU at some levels."""
    places = timed.places
    settings = [f"sweep:{places['speed']}={sweep}", *(f"read:{places[name]}" for name in READ)]
    settings += [f"text:{places[name]}={text}" for name, text in levels.items()]
    if limit:
        settings.append(f"real:{places['solver.work_limit']}={limit}")
    found = timed("steps", STEP, TRIED, settings)
    if found["mean"] < 1.0:
        found = timed("steps", STEP, count, settings)
    iterations, cut = (str(places[name]) for name in READ)
    kept = {key: found[key] for key in ("mean", "wall", "processor")}
    return {**kept, "iterations": found[iterations], "cut_short": found[f"sum {cut}"]}


def main(arguments: list[str] | None = None) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.real_time", description=__doc__)
    parser.add_argument("--steps", type=int, default=STEPS, help="of an engine at its default levels")
    parser.add_argument("--engines", nargs="+", default=ENGINES)
    chosen = parser.parse_args(arguments)
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        host = compiled(Path(folder))
        for name in chosen.engines:
            engine = load_engine(name)
            has_block = engine.block is not None and engine.mounts is not None
            speeds = engine.rated_speed / 3.0, engine.rated_speed
            timed = Timed(host, build_fmu(engine, folder, platforms=("linux64",), levels="all"))
            sweep = f"{speeds[0]!r}:{speeds[1]!r}:{SWEEP}"
            of_engine: dict[str, Any] = {"speeds_rpm": [round(speed / RPM) for speed in speeds]}
            if "still" not in result:
                result["still"] = timed("still", STEP, chosen.steps // SHARE)["largest"]
            of_engine["default"] = free = figures(timed, sweep, chosen.steps, {})
            limit = free["iterations"]["of_a_hundred"]
            of_engine["limited"] = {"limit": limit, **figures(timed, sweep, chosen.steps // SHARE, {}, limit)}
            for title, levels in LEVELS.items():
                if engine.main_bearing is None:  # on rollers
                    if levels.get("bearing.level") in ("table", "ehd"):
                        continue
                    title = title.replace("impedance", "roller")
                    levels = {key: text.replace("impedance", "roller") for key, text in levels.items()}
                if has_block or levels["block.level"] == "ground":
                    print(f"{name}: {title}", file=sys.stderr, flush=True)
                    of_engine[title] = figures(timed, sweep, chosen.steps // SHARE, levels)
            result[name] = of_engine
            print(json.dumps({name: of_engine}, indent=1), file=sys.stderr, flush=True)
    print(json.dumps(result, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
