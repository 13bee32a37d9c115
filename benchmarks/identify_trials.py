"""Coverage of identified intervals: synthetic measurements with noise, fitted by a model of a lower level.

    python -m benchmarks.identify_trials --engines diesel_i6 diesel_v8 --trials 100

Each trial draws true parameters, answers for them by the level above (harmonic balance; with ``--truth time`` a run in
time of ``--crank``), adds noise, and identifies by the level below. A parameter is covered if its interval of 95 %
holds the true value. Engines without a damper are given none. Prints a row for each parameter, and a JSON line for each
engine with the machine's load.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
import warnings
from dataclasses import replace
from typing import Any

import numpy as np

from cranktrain.core.errors import CranktrainError
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.structure.fem.factor import one_thread
from cranktrain.studies.identification.comparison import Comparison
from cranktrain.studies.identification.confidence import confidence_of
from cranktrain.studies.identification.data import Data, Strand
from cranktrain.studies.identification.estimate import estimate
from cranktrain.studies.identification.ladder import Ask, climb
from cranktrain.studies.identification.model import TorsionalModel
from cranktrain.studies.identification.parameters import (
    Sought,
    inner_values,
    outer_values,
    sought_parameters,
)
from cranktrain.studies.identification.tables import MeasuredTable, SoughtTable

SPEEDS, ORDERS = 24, 5
NOISE = 0.004
"""Noise over the root mean square of the largest order."""
RATIOS = (0.02, 0.03)
"""Damping ratios about which true ones are drawn, in place of those that a run of the crank above would give."""
SPREAD = {"damper.viscosity": 0.3, "damping.torsional_ratios[1]": 0.3, "load": 0.05, "crank.stiffness": 0.02}
"""Half width of the logarithm from which a true value is drawn; bounds are three times as far."""


def main() -> None:
    """Run the trials of each engine."""
    options = argparse.ArgumentParser(description=__doc__)
    add = options.add_argument
    add("--engines", nargs="+", default=["diesel_i6", "diesel_v8", "four_petrol"])
    add("--trials", type=int, default=100)
    add("--truth", choices=["harmonic-balance", "time"], default="harmonic-balance")
    add("--crank", default="beam", help="of runs in time")
    add("--level", choices=["linear", "harmonic-balance"], default="linear")
    add("--draws", type=int, default=100, help="different true parameters; then noise alone differs")
    add("--sobol", action="store_true", help="with the starts of a Sobol sequence, as the command takes them")
    add("--seed", type=int, default=1)
    given = options.parse_args()
    warnings.simplefilter("ignore")
    for name in given.engines:
        with one_thread():
            _trials(name, given)


def _trials(name: str, given: argparse.Namespace) -> None:
    engine = load_engine(name).without_additions
    damper = engine.damper is not None and engine.damper.kind == "viscous"
    keys = [key for key in SPREAD if damper or not key.startswith("damper.")]
    if given.truth == "time" and given.crank != "torsional":
        # Stiffness and damping of a torsional crank stand for those of the crank above, which has others.
        keys = [key for key in keys if not key.startswith("crank.")]
    read = MeasuredTable(parameters={key: SoughtTable() for key in keys})
    engine = replace(engine, damping=replace(engine.damping, torsional_ratios=RATIOS))
    sought = tuple(_bounded(one) for one in sought_parameters(engine, read.parameters, ["pulley"], 1.0))
    model = TorsionalModel(engine, _empty(engine), sought, 1.0, damper, True)
    rng, rows, seconds, truths = np.random.default_rng(given.seed), [], [], []
    widths = [SPREAD[one.key] for one in sought]
    for trial in range(given.trials):
        if trial < given.draws:
            u = inner_values(sought, [one.start for one in sought]) + rng.uniform(-1, 1, len(sought)) * widths
            truths.append((u, _true(model, outer_values(sought, u), given)))
        u, orders = truths[trial % len(truths)]
        if orders is None:
            continue
        noise = NOISE * max(math.sqrt(float(np.mean(np.abs(one) ** 2))) for one in orders)
        model.data = _noisy(model.data, orders, noise, rng)
        began = time.perf_counter()
        comparison = Comparison(model, model.data, sought)
        if given.sobol or given.level != "linear":
            found = climb(model, comparison, Ask(given.level, seed=trial))
        else:
            found = _without_starts(model, comparison)
        sure = confidence_of(comparison, found.estimate, found.shift)
        seconds.append(time.perf_counter() - began)
        away = found.estimate.inner - u
        rows.append((away, sure.deviations, np.abs(away) <= sure.reach * sure.deviations))
        if (trial + 1) % 10 == 0:
            _print(name, sought, rows, seconds)
    print(json.dumps(_said(name, sought, rows, seconds, given)), flush=True)


def _without_starts(model: TorsionalModel, comparison: Comparison) -> Any:
    """Linear level from the engine's own values, and what harmonic balance would move."""
    from cranktrain.studies.identification.ladder import Climbed, moved_by

    found = estimate(comparison, 1, start=comparison.start)
    high = model.balanced(outer_values(comparison.sought, found.inner))
    return Climbed(found, (), moved_by(comparison, found, high, comparison.answers(found.inner).strands))


def _true(model: TorsionalModel, values: Any, given: argparse.Namespace) -> Any:
    try:
        return model.balanced(values) if given.truth != "time" else model.in_time(values, given.crank, 1e-3)
    except CranktrainError as error:
        print(f"no truth: {error}")
        return None


def _bounded(one: Sought) -> Sought:
    far = math.exp(3.0 * SPREAD[one.key])
    return replace(one, low=one.start / far, high=one.start * far)


def _empty(engine: Engine) -> Data:
    """Places of the data: the major orders of the engine from its third half order on, over its speeds."""
    low, high = engine.speeds
    speeds = np.linspace(low, high, SPEEDS)
    firing = engine.firings
    orders = [firing * k for k in (0.5, 1.0, 1.5, 2.0, 3.0)][:ORDERS]
    strands = tuple(
        Strand("pulley", "pulley.torsion", order, speeds, np.zeros(SPEEDS, dtype=complex), np.full(SPEEDS, math.nan),
               np.zeros(SPEEDS, dtype=bool), True)
        for order in orders
        if order <= 24.0
    )  # fmt: skip
    return Data(strands)


def _noisy(data: Data, orders: Any, noise: float, rng: np.random.Generator) -> Data:
    strands = []
    for one, own in zip(data.strands, orders, strict=True):
        drawn = noise * (rng.normal(size=own.size) + 1j * rng.normal(size=own.size))
        strands.append(replace(one, values=own + drawn))
    return replace(data, strands=tuple(strands))


def _print(name: str, sought: Any, rows: Any, seconds: Any) -> None:
    print(f"{name}: {len(rows)} trials, {np.mean(seconds):.1f} s each, load {os.getloadavg()[0]:.1f}")
    for k, one in enumerate(sought):
        away, spread = (np.array([row[j][k] for row in rows]) for j in (0, 1))
        inside = sum(bool(row[2][k]) for row in rows)
        print(
            f"  {one.key:28s} covered {inside:3d} of {len(rows)}, error rms {100 * np.sqrt(np.mean(away**2)):6.2f} %, "
            f"95 % of them within {100 * np.percentile(np.abs(away), 95):6.2f} %, mean deviation "
            f"{100 * spread.mean():6.2f} %",
            flush=True,
        )


def _said(name: str, sought: Any, rows: Any, seconds: Any, given: argparse.Namespace) -> dict[str, Any]:
    return {
        "engine": name, "seed": given.seed, "trials": len(rows),
        "truth": given.truth, "level": given.level, "load": os.getloadavg()[0],
        "seconds": float(np.mean(seconds)) if seconds else None,
        "covered": {one.key: int(sum(bool(row[2][k]) for row in rows)) for k, one in enumerate(sought)},
        "rms_percent": {
            one.key: 100.0 * float(np.sqrt(np.mean([row[0][k] ** 2 for row in rows]))) for k, one in enumerate(sought)
        },
    }  # fmt: skip


if __name__ == "__main__":
    main()
