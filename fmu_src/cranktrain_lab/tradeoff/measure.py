"""Evaluation of runs of cases: cost from the processor's clock, error against a reference with equal start.

References keep all cycles, so that a run of fewer cycles is judged over its own last one. The change in the last cycle
is a separate error. Repeats are interleaved, case after case, because the machine's speed drifts; the cost is their
median.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Any

import numpy as np

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.reduced_body import Array
from cranktrain.core.types import Progress
from cranktrain.dynamics.simulation import Simulation
from cranktrain.film.laws.register import bearing_law
from cranktrain.store.kept import Kept, digest
from cranktrain_lab.tradeoff.case import Case, OtherMethod, Unstable
from cranktrain_lab.tradeoff.point import OTHERS, OUTPUTS, UNSETTLED, Point
from cranktrain_lab.tradeoff.runs import Recorded, assembled, run, started

HIGH_ORDERS = (12.0, 40.0)
"""Range of orders of pulley torsion with a separate error, because a coarse pressure trace affects them."""
SLOW = 5.0
"""Duration, s, above which a run is not repeated, because a long run averages over drifts of the machine's speed."""


@dataclass(frozen=True)
class Entry:
    """Point to measure: the choice, its case, the reference case, and further parameters.

    ``other`` runs the case in place of the stage solver.
    """

    family: str
    label: str
    case: Case
    reference: Case
    error_kind: str
    more: dict[str, Any] = field(default_factory=dict)
    other: OtherMethod | None = None


def key_of(case: Case) -> str:
    """Return the key of a case in the store."""
    from cranktrain.structure.crank.reduction import input_digest

    return digest(__file__, case, input_digest(case.engine))


def recorded(case: Case, store: Kept, say: Progress | None = None) -> tuple[Array, float]:
    """Return values of a case over all cycles and their interval (degrees), from the store or by a run."""
    key = key_of(case)
    kept = store.arrays(key)
    if kept is None:
        got = run(case, say)
        kept = {"values": got.values, "interval": np.array(got.interval), "seconds": np.array(got.seconds)}
        kept["unsettled"] = np.array(math.nan if got.unsettled is None else got.unsettled)
        store.keep_arrays(key, kept)
    return kept["values"], float(kept["interval"])


def differences(values: Array, interval: float, exact: Array, exact_interval: float, cycles: int) -> Array:
    """Return the relative error (rows,) in the last of ``cycles``; the reference may have more cycles."""
    every = interval / exact_interval
    if abs(every - round(every)) > 1e-9:
        raise InputError(
            f"outputs every {interval:g} deg do not fall on those of the reference, {exact_interval:g} deg"
        )
    rows = min(values.shape[0], exact.shape[0])
    per_cycle, fine = round(720.0 / interval), round(720.0 / exact_interval)
    wanted = exact[:rows, (cycles - 1) * fine : cycles * fine]
    against = wanted[:, round(every) - 1 :: round(every)]
    difference = values[:rows, (cycles - 1) * per_cycle : cycles * per_cycle] - against
    scale = np.std(wanted, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.sqrt(np.mean(difference**2, axis=1)) / scale)


def named_errors(errors: Array, bearings: int, films: bool) -> dict[str, float | None]:
    """Return errors by names of ``OUTPUTS`` and ``OTHERS``. For films and forces the worst main bearing counts."""

    def worst(rows: Array) -> float | None:
        finite = rows[np.isfinite(rows)]
        return float(finite.max()) if finite.size else None

    least = worst(errors[2 : 2 + bearings]) if films else None
    both = {"pulley_torsion": worst(errors[0:1]), "pulley_axial": worst(errors[1:2]), "bearing_film": least}
    rest = errors[2 + bearings :]
    return {**both, "shaft_torque": worst(rest[0:1]), "bearing_force": worst(rest[1:])}


def settling(got: Recorded, case: Case, films: bool) -> float | None:
    """Return the largest relative change of ``OUTPUTS`` in the last cycle, or None if the run has one cycle."""
    if case.cycles < 2:
        return None
    count = round(720.0 / got.interval)
    before = got.values[:, : got.values.shape[1] - count]
    changed = differences(got.values[:, count:], got.interval, before, got.interval, case.cycles - 1)
    named = named_errors(changed, len(case.engine.crankshaft.main_widths), films)
    return max((value for name in OUTPUTS if (value := named[name]) is not None), default=None)


def high_order_error(values: Array, interval: float, exact: Array, exact_interval: float, cycles: int) -> float:
    """Return the relative error of pulley torsion in the orders of ``HIGH_ORDERS``, in the last cycle."""

    def lines(rows: Array, every: float) -> Array:
        per_cycle = round(720.0 / every)
        cycle = rows[0, (cycles - 1) * per_cycle : cycles * per_cycle]
        # Samples lie at ends of intervals, so the first sample is one interval after the cycle's start.
        found = np.fft.rfft(cycle) / per_cycle
        turned = found * np.exp(-2j * math.pi * np.arange(found.size) / per_cycle)
        low, high = (round(2.0 * order) for order in HIGH_ORDERS)
        return np.asarray(turned[low:high])

    ours, theirs = lines(values, interval), lines(exact, exact_interval)
    n = min(ours.size, theirs.size)
    return float(np.linalg.norm(ours[:n] - theirs[:n]) / np.linalg.norm(theirs[:n]))


def measured(
    entries: Sequence[Entry],
    store: Kept,
    repeats: int = 1,
    say: Progress | None = None,
    advance: Callable[[], None] | None = None,
) -> list[Point]:
    """Measure entries and return their points. Stored runs are not repeated, and each run is stored at once.

    ``say`` receives the name of each run before it starts; ``advance`` is called after each run, also a stored one.
    """
    told = say or (lambda stage: None)
    for turn in range(repeats):
        for entry in entries:
            key = _entry_key(entry)
            kept = store.entry(key)
            done = 0 if kept is None else len(kept["costs"])
            failed = kept is not None and kept["status"] != "ok"
            slow = kept is not None and any(cost * entry.case.simulated > SLOW for cost in kept["costs"])
            if not (failed or slow or done > turn):
                told(f"{entry.family}: {entry.label}" + (f", repeat {turn + 1}" if turn else ""))
                store.keep(key, _measure(entry, store, kept, told))
            if advance is not None:
                advance()
    return [_point(entry, store.entry(_entry_key(entry)) or {}) for entry in entries]


def _entry_key(entry: Entry) -> str:
    other = [] if entry.other is None else [entry.other.key]
    return digest(__file__, key_of(entry.case), key_of(entry.reference), *other)


def _measure(entry: Entry, store: Kept, kept: dict[str, Any] | None, say: Progress) -> dict[str, Any]:
    """Run an entry once more and return its data for the store."""
    case, other = entry.case, entry.other
    unsettled: list[float | None] = []

    def begin(wanted: Case) -> Simulation:
        simulation, left = started(wanted, say)
        unsettled.append(left)
        return simulation

    try:
        exact, exact_interval = recorded(entry.reference, store, say)
        if other is None:
            got = run(case, say)
        else:
            values, used, counts = other.run(case, begin)
            got = Recorded(values, case.kept_deg, used / case.simulated, counts, *unsettled[:1])
    except Unstable as problem:
        return _failure("unstable", problem)
    except CranktrainError as problem:
        return _failure(f"failed: {problem}", problem)
    if kept is not None and kept["costs"]:
        return {**kept, "costs": [*kept["costs"], got.seconds]}
    errors = differences(got.values, got.interval, exact, exact_interval, case.cycles)
    laws = [bearing_law(one.levels.bearings) for one in (case, entry.reference)]
    films = all(law.film for law in laws)
    named = named_errors(errors, len(case.engine.crankshaft.main_widths), films)
    if not all(law.carries for law in laws):
        named["pulley_axial"] = named["bearing_force"] = None
    status, found = ("ok", {}) if other is None else other.judged(case, begin)
    details: dict[str, Any] = {**got.counts, **found}
    details["settling"] = settling(got, case, films)
    left = float((store.arrays(key_of(entry.reference)) or {}).get("unsettled", math.nan))
    starts = zip(UNSETTLED, (got.unsettled, None if math.isnan(left) else left), strict=True)
    details |= {name: unsettled for name, unsettled in starts if unsettled is not None}
    details["modes"] = assembled(case, say).body.n_modes
    details["high_orders"] = high_order_error(got.values, got.interval, exact, exact_interval, case.cycles)
    return {
        "costs": [got.seconds],
        "status": status,
        "error": {name: named[name] for name in OUTPUTS},
        "other_errors": {name: named[name] for name in OTHERS},
        "details": details,
    }


def _failure(status: str, problem: Exception) -> dict[str, Any]:
    """Return the data for the store of an entry whose run failed."""
    details = {"why": " ".join(str(problem).split())}
    errors = {"error": dict.fromkeys(OUTPUTS), "other_errors": dict.fromkeys(OTHERS)}
    return {"costs": [], "status": status, **errors, "details": details}


def _point(entry: Entry, kept: dict[str, Any]) -> Point:
    """Return the point of an entry from its stored data."""
    details = kept["details"]
    parameters = {
        **entry.case.parameters(), **entry.more, **details, "error_kind": entry.error_kind,
        "repeats": len(kept["costs"]),
    }  # fmt: skip
    return Point(
        family=entry.family,
        label=entry.label,
        parameters=parameters,
        seconds_per_simulated_second=median(kept["costs"]) if kept["costs"] else None,
        error=kept["error"],
        status=kept["status"],
        other_errors=kept["other_errors"],
    )
