"""Coverage of identified intervals: synthetic measurements with noise, fitted by a model of a lower level.

    python -m benchmarks.identify_trials --engines diesel_i6 diesel_v8 --trials 100 --record trials.jsonl

Each trial draws true parameters, answers for them by a level above the fitted one (harmonic balance, or with ``--truth
time`` a run in time of ``--crank``), adds noise, and identifies. The data are those of a torsional measurement: all
half orders up to 12 that rise above the noise for the engine as it is, at the pulley, with ``--flywheel`` at both ends.
A parameter is covered if the interval of 95 % that the command prints, that of the profile, holds the true value.
Engines without a damper are given none. A crank that bends has a damping of its own; it is sought as for a real
engine, and counts for nothing. The mean error is the bias that the lower level brings in; ``--draws`` says how many
true engines are run, and all trials beyond differ in their noise alone. ``--decay 0.05`` adds a free decay of the first
torsional mode without the damper's ring, measured to 5 %, as the command advises where the orders hardly know the
damping ratio. ``--signals`` says for the first trial what each further signal would leave of the deviations, and what
the command advises. ``--teeth-mdeg 10`` adds a constant of 10 mdeg and random phase to each whole order, as a toothed
wheel does; the fit takes it as unknown, with ``--even-teeth`` it does not. ``--encoder flywheel`` lets the
pressures of the truth follow the angle of the flywheel in place of each pin's own, while the fit takes the pins'. With
``--above next`` intervals contain the step to the next crank that bends, as those of the command do by default.

``--record FILE`` keeps truths and trials as lines of JSON and goes on from there. Prints a row for each parameter, and
a line of JSON for each engine with the machine's load.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import CranktrainError
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array
from cranktrain.engine.file import load_engine
from cranktrain.engine.levels import ENCODERS
from cranktrain.structure.assembly import Assembly
from cranktrain_lab.identification.advice import advised
from cranktrain_lab.identification.comparison import Comparison
from cranktrain_lab.identification.confidence import confidence_of, profiles
from cranktrain_lab.identification.data import RATIO, Data, Scalar, Strand
from cranktrain_lab.identification.estimate import estimate
from cranktrain_lab.identification.further_signals import Signal, further_signals
from cranktrain_lab.identification.ladder import Ask, Climbed, climb, levels_beyond
from cranktrain_lab.identification.model import TorsionalModel
from cranktrain_lab.identification.parameters import CRANK, Sought, inner_values, outer_values, sought_parameters
from cranktrain_lab.identification.tables import NONE, SoughtTable

HIGHEST = 12.0
NOISE = 0.004
"""Noise over the root mean square of the largest order at the pulley."""
RATIOS = (0.02, 0.03)
"""Damping ratios about which true ones are drawn, in place of those that a run of the crank above would give."""
SPREAD = {"damper.viscosity": 0.3, "damping.torsional_ratios[1]": 0.3, "load": 0.05, "crank.stiffness": 0.02}
"""Half width of the logarithm from which a true value is drawn; bounds are three times as far.

A crank that bends is stiffer in its films by more than that, so the bounds of its stiffness are the command's."""
OWN = ("damping.torsional_ratios[1]",)
"""Parameters of a torsional crank that a crank of another level does not have."""


def main() -> None:
    """Run the trials of each engine."""
    options = argparse.ArgumentParser(description=__doc__)
    add = options.add_argument
    add("--engines", nargs="+", default=["diesel_i6", "diesel_v8", "four_petrol"])
    add("--trials", type=int, default=100)
    add("--truth", choices=["linear", "harmonic-balance", "time"], default="harmonic-balance")
    add("--crank", default="beam", help="of runs in time")
    add("--level", choices=["linear", "harmonic-balance", "time"], default="linear", help="fitted; time: by --crank")
    add("--above", default=NONE, help="crank above the fitted one, asked once at the estimate; the command's is next")
    add("--speeds", type=int, default=24)
    add("--flywheel", action="store_true", help="measured at the flywheel too")
    add("--decay", type=float, help="deviation of a free decay of the first mode, without the damper's ring")
    add("--teeth-mdeg", type=float, default=0.0, help="constant error of whole orders, as a wheel has, mdeg")
    add("--even-teeth", action="store_true", help="fitted as if the wheel had no such error")
    add("--encoder", choices=ENCODERS, default="pin", help="whose angle the pressures of the truth follow")
    add("--signals", action="store_true", help="deviations of the first trial with each further signal")
    add("--draws", type=int, default=100, help="different true parameters; then noise alone differs")
    add("--sobol", action="store_true", help="with the starts of a Sobol sequence, as the command takes them")
    add("--seed", type=int, default=1)
    add("--record", type=Path, help="lines of JSON to go on from")
    given = options.parse_args()
    if given.truth == "time" and given.encoder != "pin":
        options.error("--encoder goes with --truth harmonic-balance or linear; for runs in time leave it pin")
    warnings.simplefilter("ignore")
    for name in given.engines:
        with one_thread():
            Trials(name, given).run()


@dataclass(frozen=True)
class Drawn:
    """True parameters (p,) u, and the orders of each strand."""

    inner: Array
    orders: tuple[Any, ...]


class Encoded(TorsionalModel):
    """A torsional crank whose pressures follow the angle of a place, ``encoder``."""

    encoder = "pin"

    def assembly(self, values: Array) -> Assembly:
        """That of the values, with the encoder."""
        made = super().assembly(values)
        return replace(made, settings=replace(made.settings, encoder=self.encoder))


class Trials:
    """Trials of one engine."""

    def __init__(self, name: str, given: argparse.Namespace) -> None:
        self.name, self.given = name, given
        engine = load_engine(name).without_additions
        damper = engine.damper is not None and engine.damper.kind == "viscous"
        keys = [key for key in SPREAD if damper or not key.startswith("damper.")]
        if given.level == "time" and given.crank != "torsional":
            keys = [key for key in keys if key not in OWN]
        else:
            engine = replace(engine, damping=replace(engine.damping, torsional_ratios=RATIOS))
        self.engine = engine
        read = {key: SoughtTable() for key in keys}
        self.sought = tuple(
            _bounded(one, given.truth == "time" and given.crank != "torsional")
            for one in sought_parameters(self.engine, read, ["pulley"], 1.0)
        )
        self.low: Array = inner_values(self.sought, [one.start for one in self.sought])
        self.model = TorsionalModel(self.engine, self._places(), self.sought, 1.0, damper, True)
        own = self.model.answers(outer_values(self.sought, self.low)).strands
        sizes = [_rms(one) for one in own]
        # Chosen for the engine as it is: what a tester sees of the first run-up.
        seen = [s for s, size in zip(self.model.data.strands, sizes, strict=True) if size > NOISE * max(sizes)]
        decay = () if given.decay is None else (Scalar("decay", RATIO, 1, 0.02, given.decay, False),)
        self.model = TorsionalModel(self.engine, Data(tuple(seen), decay), self.sought, 1.0, damper, True)
        self.true = Encoded(self.engine, self.model.data, self.sought, 1.0, damper, True)
        self.true.encoder = given.encoder
        scored = given.truth != "time" or given.crank == "torsional"
        self.counted = [k for k, one in enumerate(self.sought) if scored or one.key not in OWN]
        self.key = f"{name}, {given.truth} {given.crank}, {given.level}, {given.speeds}, {given.flywheel}, {given.seed}"
        if given.above != NONE:
            self.key += f", {given.above}"
        if given.teeth_mdeg:
            self.key += f", teeth {given.teeth_mdeg} mdeg, {given.even_teeth}"
        if given.encoder != "pin":
            self.key += f", encoder {given.encoder}"
        if given.decay is not None:
            self.key += f", decay {given.decay}"
        self.drawn: dict[int, Drawn | None] = {}
        self.rows: dict[int, dict[str, Any]] = {}
        self._read()

    def _places(self) -> Data:
        """Places of the data: half orders over the engine's speeds."""
        count = self.given.speeds
        speeds, still = np.linspace(*self.engine.speeds, count), np.zeros(count)
        strands = [
            Strand(
                place,
                f"{place}.torsion",
                0.5 * k,
                speeds,
                still.astype(complex),
                still + math.nan,
                still > 1.0,
                True,
                wheel=self.given.teeth_mdeg > 0.0 and not self.given.even_teeth and k % 2 == 0,
            )
            for place in (["pulley", "flywheel"] if self.given.flywheel else ["pulley"])
            for k in range(1, round(2.0 * HIGHEST) + 1)
        ]
        return Data(tuple(strands))

    def run(self) -> None:
        """All trials that the record does not have; prints and records them."""
        for trial in range(self.given.trials):
            if trial in self.rows:
                continue
            truth = self._truth(trial % self.given.draws)
            if truth is None:
                continue
            began = time.perf_counter()
            self.rows[trial] = self._trial(trial, truth) | {"seconds": time.perf_counter() - began}
            self._write({"trial": trial, **self.rows[trial]})
            if (trial + 1) % 20 == 0:
                self._print()
        said = self._said()
        if self.given.signals and (truth := self._truth(0)) is not None:
            said |= self._signals(truth)
        print(json.dumps(said), flush=True)

    def _signals(self, truth: Drawn) -> dict[str, Any]:
        """Deviations that the linear model gives with each further signal, and the advice of the command."""
        comparison = self._measured(0, truth)[0]
        found = self._fitted(comparison, 0)
        own, keys = found.estimate.information + comparison.known, [one.key for one in self.sought]
        none = Signal("none", "none", np.zeros_like(own), agreed=True)
        percent = {
            one.states: dict(zip(keys, (100.0 * np.sqrt(np.diag(np.linalg.inv(own + one.information)))).tolist(),
                                 strict=True))
            for one in [none, *further_signals(self.model, comparison, found.estimate.inner)]
        }  # fmt: skip
        sure = confidence_of(comparison, found.estimate, found.moves)
        advice = advised(self.model, comparison, found, sure, Ask(self.given.level, self.given.crank))
        return {"signals_percent": percent, "advice": [row["text"] for row in advice]}

    def _measured(self, trial: int, truth: Drawn) -> tuple[Comparison, list[Strand]]:
        """Model and data of a trial, with its noise."""
        rng = np.random.default_rng([self.given.seed, trial, 1])
        noise = NOISE * max(map(_rms, truth.orders))
        strands = [
            replace(one, values=own + noise * (rng.normal(size=own.size) + 1j * rng.normal(size=own.size)))
            for one, own in zip(self.model.data.strands, truth.orders, strict=True)
        ]
        decay = self._decay(truth, rng)
        teeth = math.radians(1e-3 * self.given.teeth_mdeg) * np.exp(1j * rng.uniform(0.0, math.tau, len(strands)))
        strands = [
            replace(one, values=one.values + constant) if one.order % 1.0 == 0.0 else one
            for one, constant in zip(strands, teeth.tolist(), strict=True)
        ]
        self.model.data = Data(tuple(strands), decay)
        return Comparison(self.model, self.model.data, self.sought), strands

    def _trial(self, trial: int, truth: Drawn) -> dict[str, Any]:
        comparison, strands = self._measured(trial, truth)
        found = self._fitted(comparison, trial)
        sure = confidence_of(comparison, found.estimate, found.moves)
        ends = profiles(comparison, found.estimate, sure)
        away = found.estimate.inner - truth.inner
        return {
            "bias": [comparison.biases[one.name].of(self._place(k)).relative for k, one in enumerate(strands)],
            "away": away.tolist(), "moved": found.moves.sum(axis=0).tolist(), "deviation": sure.deviations.tolist(),
            "covered": [low <= u <= high for (low, high), u in zip(ends, truth.inner.tolist(), strict=True)],
            "by_covariance": (np.abs(away) <= sure.reach * sure.deviations).tolist(),
        }  # fmt: skip

    def _decay(self, truth: Drawn, rng: np.random.Generator) -> tuple[Scalar, ...]:
        """The measured decay of a trial, a random number after those of the orders."""
        true = self.model.numbers(outer_values(self.sought, truth.inner)).tolist()
        return tuple(
            replace(one, value=value * math.exp(one.deviation * rng.normal()))
            for one, value in zip(self.model.data.scalars, true, strict=True)
        )

    def _place(self, k: int) -> int:
        """Place of the ``k``-th strand in its set."""
        return sum(one.name == self.model.data.strands[k].name for one in self.model.data.strands[:k])

    def _fitted(self, comparison: Comparison, trial: int) -> Climbed:
        """As the command does it; without ``--sobol`` from the engine's own values alone."""
        ask = Ask(self.given.level, self.given.crank, seed=trial, above=self.given.above)
        if self.given.sobol or self.given.level != "linear":
            return climb(self.model, comparison, ask)
        found = estimate(comparison, 1, start=comparison.start)
        return Climbed(found, (), levels_beyond(self.model, None, comparison, found, ask))

    def _truth(self, draw: int) -> Drawn | None:
        if draw in self.drawn:
            return self.drawn[draw]
        rng = np.random.default_rng([self.given.seed, draw, 0])
        u = self.low + rng.uniform(-1, 1, self.low.size) * [SPREAD[one.key] for one in self.sought]
        values = outer_values(self.sought, u)
        try:
            if self.given.truth == "time":
                plain = self.given.crank == "torsional"
                kept = self.model.sought
                self.model.sought = tuple(one for one in kept if plain or one.key not in OWN)
                some = [v for v, one in zip(values.tolist(), kept, strict=True) if plain or one.key not in OWN]
                try:
                    orders = self.model.in_time(np.array(some), self.given.crank, 1e-3)
                finally:
                    self.model.sought = kept
            else:
                answer = self.true.balanced if self.given.truth != "linear" else self._linear
                orders = answer(values)
        except CranktrainError as error:
            print(f"no truth: {error}")
            self.drawn[draw] = None
            return None
        self.drawn[draw] = Drawn(u, orders)
        listed = [[one.real.tolist(), one.imag.tolist()] for one in orders]
        self._write({"truth": draw, "inner": u.tolist(), "orders": listed})
        return self.drawn[draw]

    def _linear(self, values: Array) -> Any:
        return self.true.answers(values).strands

    def _read(self) -> None:
        if self.given.record is None or not self.given.record.is_file():
            return
        for line in self.given.record.read_text("utf-8").splitlines():
            row = json.loads(line)
            if row.pop("key") != self.key:
                continue
            if "trial" in row:
                self.rows[row.pop("trial")] = row
            else:
                orders = tuple(np.array(re) + 1j * np.array(im) for re, im in row["orders"])
                self.drawn[row["truth"]] = Drawn(np.array(row["inner"]), orders)

    def _write(self, row: dict[str, Any]) -> None:
        if self.given.record is not None:
            with self.given.record.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"key": self.key, **row}) + "\n")

    def _print(self) -> None:
        rows = list(self.rows.values())
        print(f"{self.name}: {len(rows)} trials, load {os.getloadavg()[0]:.1f}")
        for k in self.counted:
            away, spread = (np.array([row[part][k] for row in rows]) for part in ("away", "deviation"))
            inside = sum(row["covered"][k] for row in rows)
            print(
                f"  {self.sought[k].key:28s} covered {inside:3d} of {len(rows)}, error rms "
                f"{100 * np.sqrt(np.mean(away**2)):6.2f} % (mean {100 * away.mean():+.2f} %), 95 % of them within "
                f"{100 * np.percentile(np.abs(away), 95):6.2f} %, mean deviation {100 * spread.mean():6.2f} %",
                flush=True,
            )

    def _said(self) -> dict[str, Any]:
        rows = list(self.rows.values())

        def of(value: Any) -> dict[str, Any]:
            return {self.sought[k].key: value(k) for k in self.counted}

        return {
            "engine": self.name, "seed": self.given.seed, "trials": len(rows), "truth": self.given.truth,
            "level": self.given.level, "orders": len(self.model.data.strands), "speeds": self.given.speeds,
            "load": os.getloadavg()[0], "seconds": float(np.mean([row["seconds"] for row in rows])) if rows else None,
            "covered": of(lambda k: sum(row["covered"][k] for row in rows)),
            "by_covariance": of(lambda k: sum(row["by_covariance"][k] for row in rows)),
            "rms_percent": of(lambda k: 100.0 * math.sqrt(float(np.mean([row["away"][k] ** 2 for row in rows])))),
            "mean_percent": of(lambda k: 100.0 * float(np.mean([row["away"][k] for row in rows]))),
            "bias_percent": self._biases(rows),
            "left_percent": of(lambda k: 100.0 * math.sqrt(float(np.mean([_left(row, k) ** 2 for row in rows])))),
            "moved_percent": of(lambda k: 100.0 * float(np.mean([row["moved"][k] for row in rows]))),
            "deviation_percent": of(lambda k: 100.0 * float(np.mean([row["deviation"][k] for row in rows]))),
        }  # fmt: skip

    def _biases(self, rows: list[dict[str, Any]]) -> dict[str, float]:
        """Median over the trials of the relative bias that is found of each order, %."""
        found = [row["bias"] for row in rows if "bias" in row]
        names = [f"{one.name}, order {one.order:g}" for one in self.model.data.strands]
        return dict(zip(names, (100.0 * np.median(found, axis=0)).round(2).tolist(), strict=True)) if found else {}


def _left(row: dict[str, Any], k: int) -> float:
    """Error of a parameter after the move to the levels above."""
    return float(row["away"][k] + row["moved"][k])


def _rms(values: Any) -> float:
    return math.sqrt(float(np.mean(np.abs(values) ** 2)))


def _bounded(one: Sought, bending: bool) -> Sought:
    """With bounds three times as far as true values are drawn; the stiffness of a truth that bends has its own."""
    if bending and one.key == CRANK:
        return one
    far = math.exp(3.0 * SPREAD[one.key])
    return replace(one, low=one.start / far, high=one.start * far)


if __name__ == "__main__":
    main()
