"""Watch of an engine by its torsion, from files of measured orders to a report."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array, Progress
from cranktrain.core.units import RPM
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE
from cranktrain_lab.watch import detector as detectors
from cranktrain_lab.watch.defects import LOAD, MISFIRE, ZERO, Defect, defects_of
from cranktrain_lab.watch.detector import Detector, Verdict
from cranktrain_lab.watch.recordings import ComplexArray, Place, Recordings, TorsionalAnswers, read_recordings
from cranktrain_lab.watch.scatter import real_rows, scatter_of

Follow = Callable[[float], None]
FEWEST = 3
"""Least number of healthy recordings to estimate scatter."""
EXPLAINED = 0.5
"""Least fraction of the squared healthy orders that the model must explain."""
LEAST_ERROR = 0.05
"""Least relative error of the model's signatures, as healthy orders do not show all errors of a torsional crank."""
LIKELY = 0.05
"""Least probability of another defect that counts as possible."""
TURN = math.radians(30.0)
"""Largest angle, rad, between the encoder's zero and firing dead centre of the first cylinder."""
STEP = 0.02
"""Step of the load (fraction of full load) for the derivative of orders by the load."""


@dataclass(frozen=True)
class Request:
    """Settings of a watch of an engine.

    Attributes
    ----------
    output, orders : output and orders of the files; without orders all common orders
    rate : rate of false alarms
    load : fraction of the full-load burn of all recordings
    damper : True if the damper is fitted
    rule, inherit : settings of the model, see :class:`TorsionalAnswers`
    seed : seed of the draws
    """

    output: str = "pulley.torsion"
    orders: Sequence[float] = ()
    rate: float = 0.01
    load: float = 1.0
    damper: bool = False
    rule: str = HARMONIC_BALANCE
    inherit: bool = True
    seed: int = 1


class Watch:
    """Signatures of an engine's defects at given operating points, for evaluating recordings.

    Parameters
    ----------
    answers : model of the engine
    place : output, speeds and orders
    say, follow : called with each stage, and with the completed fraction

    Attributes
    ----------
    own : (s, o) healthy orders of the model
    paths : signatures of the defects
    """

    def __init__(
        self, answers: TorsionalAnswers, place: Place, say: Progress = lambda stage: None,
        follow: Follow = lambda share: None,
    ) -> None:  # fmt: skip
        self.place, self.defects = place, defects_of(answers.engine, answers.damper)
        self.own: ComplexArray = answers.orders(answers.healthy, place)
        self.paths = []
        for k, defect in enumerate(self.defects):
            say(defect.words)
            self.paths.append(self._path(answers, defect))
            follow((k + 1) / len(self.defects))
        less, more = (one.of(answers.healthy, STEP) for one in self.defects if one.kind == LOAD)
        self._by_load: Array = real_rows(answers.orders(more, place) - answers.orders(less, place)) / (2.0 * STEP)
        misfires = [path for path, one in zip(self.paths, self.defects, strict=True) if one.kind == MISFIRE]
        self._by_burn = [-path.changes[1] / path.severities[1] for path in misfires] if len(misfires) > 1 else []

    def _path(self, answers: TorsionalAnswers, defect: Defect) -> detectors.Path:
        """Return the signatures of a defect at increasing severity, up to the severity at which the model fails."""
        kept, changes = [0.0], [np.zeros_like(self.own)]
        for severity in defect.severities:
            try:
                if defect.kind == ZERO:  # a shift of the zero needs no evaluation of the model
                    turn = defect.of(answers.healthy, severity).zero
                    found = self.own * np.exp(1j * turn * self.place.orders)
                else:
                    found = answers.orders(defect.of(answers.healthy, severity), self.place)
            except SolverError:
                break
            kept.append(severity)
            changes.append(found - self.own)
        if len(kept) < 2:
            raise SolverError(f"the model has no answer for '{defect.words}'")
        return detectors.Path(defect.key, np.array(kept), real_rows(np.array(changes)))

    def model_error(self, healthy: ComplexArray) -> float:
        """Return the relative error of the model's healthy orders compared with measured ``healthy`` (s, o)."""
        return math.sqrt(float(np.sum(np.abs(healthy - self.own) ** 2) / np.sum(np.abs(healthy) ** 2)))

    def zero_of(self, healthy: ComplexArray) -> float:
        """Return the angle (rad, within ± ``TURN``) by which the encoder of ``healthy`` (s, o) leads the model."""
        angles = np.linspace(-TURN, TURN, 2401)
        products = np.sum(np.conj(self.own) * healthy, axis=0)
        return float(angles[np.argmax((np.exp(-1j * np.outer(angles, self.place.orders)) @ products).real)])

    def detector(self, healthy: ComplexArray, count: int, rate: float, seed: int = 1) -> Detector:
        """Return the detector from n ``healthy`` recordings (n, s, o), for ``count`` watched ones; ``InputError``."""
        mean = healthy.mean(axis=0)
        turned = real_rows(1j * self.place.orders * mean)
        directions = np.stack((self._by_load, turned, *self._by_burn), axis=-1)
        scatter = scatter_of(real_rows(healthy), directions)
        error = max(LEAST_ERROR, self.model_error(mean))
        return Detector(self.paths, real_rows(mean), scatter, directions, (count, healthy.shape[0]), error, rate, seed)


def watch(
    engine: str | Path | Engine, measured: Sequence[str | Path], healthy: Sequence[str | Path],
    request: Request | None = None,
    say: Progress = lambda stage: None, follow: Follow = lambda share: None,
) -> dict[str, Any]:  # fmt: skip
    """Compare recordings of an engine with healthy ones, one per file, and return a report for JSON.

    Raises ``InputError`` for fewer than three healthy recordings, inconsistent files, or data of another engine.

    Returns
    -------
    ``alarm``, ``probability``, ``found``, ``possible``, ``explained``, ``defects`` (each with its statistic, severity,
    probability, smallest detectable severity, and defects it may be mistaken for), ``said`` in words
    """
    request, base = request or Request(), load_engine(engine)
    if not measured:
        raise InputError("no recording is given; name a file of orders of 'cranktrain measured --output'")
    if len(healthy) < FEWEST:
        raise InputError(
            f"{len(healthy)} healthy recordings are given; {FEWEST} or more, a file each, tell how much healthy "
            "orders scatter"
        )
    with one_thread():
        answers = TorsionalAnswers(
            base, request.load, request.damper and base.damper is not None, request.rule, request.inherit, say
        )
        read = read_recordings(
            answers.engine, measured, healthy, request.output, request.orders,
            lambda place: answers.orders(answers.healthy, place),
        )  # fmt: skip
        watched = Watch(answers, read.place, say, follow)
        zero = watched.zero_of(read.healthy.mean(axis=0))
        back = np.exp(-1j * zero * read.place.orders)
        read = read._replace(watched=read.watched * back, healthy=read.healthy * back)
        left_out = "" if answers.damper or base.damper is None else "; or the damper is fitted: add --damper"
        # Refuse healthy recordings (n, s, o) of which the model explains less than half.
        mean = read.healthy.mean(axis=0)
        if not np.any(np.abs(mean) > 0.0):
            raise InputError("the healthy recordings are zero; check their channel")
        part = 1.0 - watched.model_error(mean) ** 2
        if part < EXPLAINED:
            worst = watched.place.orders[int(np.argmax(np.sum(np.abs(mean - watched.own) ** 2, axis=0)))]
            raise InputError(
                f"engine '{base.name}' explains {100.0 * max(part, 0.0):.0f} % of the healthy recordings' squared "
                f"amplitudes, least of order {worst:g}; they are of another engine, load (--load) or reference of "
                f"phase{left_out}"
            )
        found = watched.detector(read.healthy, read.watched.shape[0], request.rate, request.seed)
        verdict = found.judge(real_rows(read.watched.mean(axis=0)))
    report = _report(watched, read, found, verdict)
    if left_out:
        report["said"].append("The engine's damper is left out, and its wear is not looked for: --damper fits it.")
    return report | {
        "engine": base.name, "false_alarms": request.rate, "zero_deg": math.degrees(zero),
    }  # fmt: skip


def _report(watched: Watch, read: Recordings, found: Detector, verdict: Verdict) -> dict[str, Any]:
    words = {defect.key: defect.words for defect in watched.defects}
    harmless = {defect.key for defect in watched.defects if defect.harmless}
    places = {path.key: k for k, path in enumerate(found.paths)}
    rows: list[dict[str, Any]] = []
    for one in verdict.findings:
        k = places[one.key]
        at = one.severity if verdict.alarm and one.severity > 0.0 else float(found.paths[k].severities[-1])
        taken = [
            {"key": key, "defect": words[key], "probability": share}
            for key, share in found.apart(k, at)
            if share >= LIKELY
        ]
        smallest = found.smallest(k)
        rows.append({
            "key": one.key, "defect": words[one.key], "statistic": one.statistic, "severity": one.severity,
            "probability": one.probability, "left": one.left, "harmless": one.key in harmless,
            "smallest": None if math.isnan(smallest) else smallest, "taken_for": taken,
        })  # fmt: skip
    possible = [row["key"] for row in rows if row["probability"] >= LIKELY] if verdict.alarm else []
    explained = verdict.explained if verdict.alarm else None
    return {
        "alarm": verdict.alarm, "probability": verdict.probability, "threshold": found.threshold,
        "found": possible[0] if possible and explained else None, "possible": possible, "explained": explained,
        "said": said(verdict, rows), "defects": rows,
        "speeds_rpm": (read.place.speeds / RPM).tolist(), "orders": read.place.orders.tolist(),
        "recordings": read.watched.shape[0], "healthy": read.healthy.shape[0],
        "model_error": watched.model_error(read.healthy.mean(axis=0)),
        "scatter": {
            "load": math.sqrt(float(found.scatter.effects[0])),
            "zero_deg": math.degrees(math.sqrt(float(found.scatter.effects[1]))),
            "burn": math.sqrt(float(found.scatter.effects[2])) if found.scatter.effects.size > 2 else None,
            "noise_mdeg": [
                1e3 * math.degrees(math.sqrt(one)) for one in found.scatter.noise[: read.place.orders.size].tolist()
            ],
        },
    }  # fmt: skip


def said(verdict: Verdict, rows: Sequence[dict[str, Any]]) -> list[str]:
    """Return the result of a watch in sentences."""
    chance = f"{verdict.probability:.2g}" if verdict.probability > 0.0 else f"below {1.0 / detectors.DRAWS:.0e}"
    if not verdict.alarm:
        return [f"No change: scatter alone is as large with a probability of {chance}."]
    first, *others = rows
    lines = [f"Changed: scatter alone is as large with a probability of {chance}."]
    if not verdict.explained:
        return [
            *lines,
            f"None of the defects explains the change. The nearest is {first['defect']}, severity "
            f"{first['severity']:.2f}; look for another cause, or for a model that is too far from the engine.",
        ]
    also = [row for row in others if row["probability"] >= LIKELY]
    # A harmless change is reported as the cause only if no defect is nearly as likely.
    cleared = first["harmless"] and all(row["harmless"] for row in also)
    what, which = "This is no defect: " if cleared else "Likeliest: ", first["defect"]
    if first["harmless"] and not cleared:
        which += ", which is no defect"
    lines.append(f"{what}{which}, severity {first['severity']:.2f}, probability {100.0 * first['probability']:.0f} %.")
    if also:
        named = ", ".join(f"{row['defect']} ({100.0 * row['probability']:.0f} %)" for row in also)
        lines.append(f"Not told apart from: {named}.")
    return lines
