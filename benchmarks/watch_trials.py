"""Detection rate against false alarms of ``cranktrain watch``, on synthetic recordings with known defects.

``python -m benchmarks.watch_trials [--picture docs/watch.png]``: true orders are those of runs in time with a crank of
beams on fluid films, one level above the detector's torsional crank. Every recording has its own load, encoder zero
and burn of each cylinder, and noise on every order. A set of healthy recordings makes a detector, which judges
recordings of each defect and severity, and healthy ones. Prints JSON, and rows of a table in Markdown on
stderr.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from benchmarks._watch_chart import draw

from cranktrain.core.threads import one_thread
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Damper
from cranktrain.structure.assembly import assemble
from cranktrain.studies.run_up.steady import Job, SteadyRuns
from cranktrain_lab.watch.defects import LOAD, MISFIRE, Case, Defect
from cranktrain_lab.watch.recordings import ComplexArray, Place, TorsionalAnswers
from cranktrain_lab.watch.scatter import real_rows
from cranktrain_lab.watch.watch import Watch

SPRINGS = "diesel_i6 with springs"
ENGINES = ("diesel_i6", SPRINGS, "diesel_v8", "four_petrol")
OUTPUT, HIGHEST, SPEEDS = "pulley.torsion", 6.0, 4
NOISE, LOADS, TURNS, BURNS = math.radians(5e-3), 0.02, math.radians(0.1), 0.01
"""Scatter of one recording: noise of an order, rad; load; encoder zero, rad; burn of each cylinder."""
HEALTHY, SETS, TRIALS = 10, 12, 25
"""Healthy recordings of a set, sets, and judged recordings of each defect and severity beside each set."""
QUIET = 200
"""Judged healthy recordings beside each set."""
SEVERITIES = {
    MISFIRE: (0.01, 0.02, 0.04, 0.08, 1.0),
    "damper": (0.1, 0.2, 0.35, 0.6, 0.9),
    "shaft": (0.1, 0.2, 0.35, 0.6, 0.9),
}
SHOWN = {MISFIRE: 0.02, "damper": 0.1, "shaft": 0.2}
LARGE = {MISFIRE: 0.04, "damper": 0.35, "shaft": 0.35}
"""Severities of the curves against false alarms, and of the matrix."""
RATE, SETTLE = 0.01, 1e-5
RATES = (0.01, 0.05, 0.1)


class Truth(NamedTuple):
    """Orders (s, o) of an engine by its true model: healthy, and by defect and severity; slopes by burn and load."""

    healthy: ComplexArray
    defects: dict[tuple[str, float], ComplexArray]
    burns: list[ComplexArray]
    load: ComplexArray


class Judged(NamedTuple):
    """Judged recordings of one condition: probabilities, and names of what was found (empty: no alarm)."""

    probabilities: list[float]
    names: list[str]


def engine_of(name: str) -> Engine:
    """Engine of a name; the six with a damper of steel springs at 190 Hz for ``SPRINGS``."""
    engine = load_engine("diesel_i6" if name == SPRINGS else name).without_additions
    if name != SPRINGS:
        return engine
    own = engine.damper
    assert own is not None
    stiffness = own.ring_inertia * (2.0 * math.pi * 190.0) ** 2
    damping = 0.3 * math.sqrt(stiffness * own.ring_inertia)
    springs = Damper(
        kind="linear", ring_inertia=own.ring_inertia, housing_inertia=own.housing_inertia, mass=own.mass,
        stiffness=stiffness, damping=damping,
    )  # fmt: skip
    return replace(engine, damper=springs)


def true_orders(case: Case, place: Place, crank: str) -> ComplexArray:
    """Orders (s, o) of a case by runs in time."""
    settings = Settings(crank=crank, damper="none" if case.engine.damper is None else "fitted")
    made = assemble(case.engine, settings)
    runs = SteadyRuns(Job(made, case.gas, SETTLE, max(HIGHEST, 24.0), (place.output,)))
    starts: list[Any] = []
    rows = []
    for speed in place.speeds.tolist():
        steady = runs.at(speed, starts[-2:][::-1])
        starts.append(steady.start)
        rows.append(steady.amplitudes[place.output][np.round(2.0 * place.orders).astype(int) - 1])
    return np.array(rows)


def truth_of(answers: TorsionalAnswers, defects: Sequence[Defect], place: Place, crank: str) -> Truth:
    """True orders of all conditions."""
    ask = partial(true_orders, place=place, crank=crank)
    healthy = ask(answers.healthy)
    found, burns, load = {}, [], healthy
    for defect in defects:
        if defect.kind == LOAD:
            load = (ask(defect.of(answers.healthy, 0.05)) - healthy) / 0.05
        if defect.harmless:
            continue
        for severity in SEVERITIES[defect.kind]:
            found[defect.key, severity] = ask(defect.of(answers.healthy, severity))
        if defect.kind == MISFIRE:
            first = SEVERITIES[MISFIRE][min(2, len(SEVERITIES[MISFIRE]) - 1)]
            burns.append((healthy - found[defect.key, first]) / first)
    return Truth(healthy, found, burns, load)


def recorded(truth: Truth, orders: ComplexArray, place: Place, count: int, rng: np.random.Generator) -> ComplexArray:
    """Recordings (n, s, o) of an engine whose true orders are ``orders`` (s, o)."""
    n, s = count, orders.shape[0]
    found = orders + LOADS * rng.normal(size=(n, s, 1)) * truth.load
    for slope in truth.burns:
        found = found + BURNS * rng.normal(size=(n, s, 1)) * slope
    found = found * np.exp(1j * TURNS * rng.normal(size=(n, s, 1)) * place.orders)
    return np.asarray(found + NOISE * (rng.normal(size=found.shape) + 1j * rng.normal(size=found.shape)))


def trials(name: str, crank: str, seed: int) -> dict[str, Any]:
    """All trials of an engine."""
    engine, began = engine_of(name), time.perf_counter()
    answers = TorsionalAnswers(engine, 1.0, engine.damper is not None)
    low, high = engine.speeds
    speeds = low + (high - low) * (np.arange(SPEEDS) + 0.5) / SPEEDS
    place = Place(OUTPUT, speeds, 0.5 * np.arange(1, round(2.0 * HIGHEST) + 1))
    watch = Watch(answers, place)
    truth = truth_of(answers, watch.defects, place, crank)
    made = time.perf_counter() - began
    rng = np.random.default_rng(seed)
    conditions: dict[tuple[str, float], Judged] = {key: Judged([], []) for key in truth.defects}
    quiet = Judged([], [])
    for k in range(SETS):
        detector = watch.detector(recorded(truth, truth.healthy, place, HEALTHY, rng), 1, RATE, k)
        for judged, orders, count in (
            (quiet, truth.healthy, QUIET), *((conditions[key], own, TRIALS) for key, own in truth.defects.items())
        ):  # fmt: skip
            for one in recorded(truth, orders, place, count, rng):
                verdict = detector.judge(real_rows(one))
                judged.probabilities.append(verdict.probability)
                best = verdict.findings[0].key if verdict.explained else "unexplained"
                judged.names.append(best if verdict.alarm else "")
    return {
        "engine": name, "crank": crank, "seed": seed, "speeds_rpm": (speeds * 30.0 / math.pi).round(1).tolist(),
        "made_seconds": made, "seconds": time.perf_counter() - began, "model_error": watch.model_error(truth.healthy),
        "words": {one.key: one.words for one in watch.defects}, "kinds": {one.key: one.kind for one in watch.defects},
        "quiet": quiet.probabilities, "conditions": conditions,
    }  # fmt: skip


def said(found: dict[str, Any]) -> dict[str, Any]:
    """What is printed of an engine."""
    quiet = np.array(found["quiet"])
    rows = {}
    for (key, severity), judged in found["conditions"].items():
        alarms = np.array(judged.probabilities) <= RATE
        named = np.array([name == key for name in judged.names])
        rows[f"{key} {severity:g}"] = {
            "detected": round(float(alarms.mean()), 3),
            "named": round(float(named[alarms].mean()), 3) if alarms.any() else None,
        }
    false = {f"{rate:g}": round(float((quiet <= rate).mean()), 4) for rate in RATES}
    shown = ("engine", "crank", "seed", "speeds_rpm", "model_error", "made_seconds", "seconds")
    kept = {key: found[key] for key in shown}
    return kept | {"recordings": quiet.size, "false_alarms": false, "defects": rows}


def table(found: dict[str, Any]) -> str:
    """Detection rates of an engine as rows of Markdown: misfires of all cylinders together."""
    by_kind: dict[str, dict[float, list[tuple[float, float]]]] = {}
    for (key, severity), judged in found["conditions"].items():
        alarms = np.array(judged.probabilities) <= RATE
        named = float(np.mean([name == key for name in judged.names]))
        word = "misfire of a cylinder" if found["kinds"][key] == MISFIRE else found["words"][key]
        by_kind.setdefault(word, {}).setdefault(severity, []).append((float(alarms.mean()), named))
    lines = []
    for word, by_severity in by_kind.items():
        cells = []
        for severity, pairs in by_severity.items():
            detected, named = np.mean(pairs, axis=0)
            cells.append(f"{100.0 * severity:g} %: {100.0 * detected:.0f} / {100.0 * named:.0f}")
        lines.append(f"| `{found['engine']}` | {word} | {' · '.join(cells)} |")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, print and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--engines", nargs="+", default=list(ENGINES))
    parser.add_argument("--crank", default="beam", help="of the true model (default beam)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--picture")
    given = parser.parse_args(arguments)
    whole = []
    with one_thread():
        for name in given.engines:
            whole.append(trials(name, given.crank, given.seed))
            print(table(whole[-1]), file=sys.stderr, flush=True)
    print(json.dumps([said(found) for found in whole]))
    if given.picture:
        draw(whole, given.picture, RATE, SHOWN, LARGE)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
