"""Identification of an engine's parameters from measured data: from the measured file to a report and an engine file.

A file of ``[targets]`` alone is a calibration, with the same search and with intervals from the targets' tolerances.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, SolverError, StoreError
from cranktrain.core.threads import one_thread
from cranktrain.core.typed_file import record
from cranktrain.core.types import Array, Progress
from cranktrain.core.units import RPM
from cranktrain.core.user_file import read_toml, user_path
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.store.engine_text import engine_text, new_path
from cranktrain.structure.assembly import assemble
from cranktrain_lab.identification import checks
from cranktrain_lab.identification.advice import advised, remedy_for
from cranktrain_lab.identification.bending import Bending, targets_of
from cranktrain_lab.identification.comparison import Comparison
from cranktrain_lab.identification.confidence import Confidence, bootstrap, confidence_of, profiles, told_apart
from cranktrain_lab.identification.data import MOUNTS, TARGET, Orbit, Scalar, read_data
from cranktrain_lab.identification.ladder import Ask, Climbed, climb
from cranktrain_lab.identification.model import TIME, TorsionalModel
from cranktrain_lab.identification.orbit_runs import check_films
from cranktrain_lab.identification.orbits import check_orbits, read_orbits
from cranktrain_lab.identification.parameters import LOAD, RATIOS, Sought, outer_values, sought_parameters
from cranktrain_lab.identification.residuals import held_out, number_rows, residual_rows
from cranktrain_lab.identification.tables import MeasuredTable
from cranktrain_lab.identification.written import identified_text, write_identified

Follow = Callable[[float, float], None]
AT_BOUND = 1e-3
"""Distance of a parameter from a bound, as a fraction of the range, below which it counts as at the bound."""
MOST_LOAD = 1.4
"""Ratio of identified load to full load of the engine file above which the amplitudes are doubted."""
PEAK_TO_PEAK = (
    "amplitudes are zero to peak: peak-to-peak ones are twice as large, r.m.s. values 0.71 times; or combustion.heat "
    "is too small"
)


@dataclass(frozen=True)
class Request:
    """Settings of an identification: levels and seed, number of bootstrap draws, and whether to compute profiles."""

    ask: Ask
    draws: int = 400
    profile: bool = True


def read_measured_file(path: str | Path) -> tuple[MeasuredTable, Path]:
    """Read a measured file and return its tables and path; ``InputError`` is one line with file and key."""
    place = user_path(path)
    document = read_toml(place, "measured file", "give the path of a MEASURED.toml")
    try:
        return record(MeasuredTable, document), place
    except InputError as error:
        raise InputError(f"{place.name}: {error}") from None


def identify(
    engine: str | Path | Engine, measured: str | Path, out: str | Path | None = None, *, request: Request | None = None,
    say: Progress = lambda stage: None, follow: Follow = lambda share, cost: None,
) -> dict[str, Any]:  # fmt: skip
    """Identify engine parameters from a measured file, return a report for JSON, and write engine file ``out``, if any.

    Raises ``InputError`` for unusable files, an ``out`` that exists, data of another engine, a parameter without
    influence on the data, or contradicting sets; raises ``SolverError`` if the model cannot be evaluated.

    Returns
    -------
    ``parameters`` (value, interval, deviation, profile, bootstrap), ``told_apart`` in words, ``levels``, ``above``
    (values that levels above the fitted one would give, in ascending order), ``advice`` (signals that would narrow wide
    intervals most), ``doubts`` (warnings on unlikely values, in words), ``orders``, ``numbers``, ``held_out``,
    ``systematic``, ``interrupted``, ``file``, ``refused`` (why the new file was not written)
    """
    request = request or Request(Ask())
    _ = request.ask.crank_above  # raises InputError before the long work begins
    read, place = read_measured_file(measured)
    base, old = load_engine(engine), engine_text(engine)
    new = new_path(Path(out)) if out is not None else None
    try:
        with one_thread():
            if read.orbit:
                check_films(request.ask.level, request.ask.crank)
            if request.ask.level == TIME:
                checks.check_crank(base, read.parameters, request.ask.crank)
            model, comparison = prepared(base, read, place, say)

            def text(rows: Sequence[Mapping[str, Any]], interrupted: bool = False) -> str:
                whole = replace(base, damping=model.engine.damping)
                return identified_text(
                    old.text, whole, model.sought, rows, place.name, old.name, interrupted=interrupted
                )

            if new is not None:
                starts = [
                    {"key": one.key, "value": one.shown(one.start), "unit": one.unit, "low": one.shown(one.low),
                     "high": one.shown(one.high)}
                    for one in model.sought
                ]  # fmt: skip
                text(starts)  # raises InputError before the long search
            check = partial(checks.check_estimate, comparison, remedy=partial(remedy_for, model, comparison))
            # Parameters on which only orbits depend have no influence before there are runs in time.
            first = partial(checks.check_explained, comparison) if read.orbit else check
            found = climb(model, comparison, request.ask, say, follow, first)
            report = report_of(model, comparison, found, request, say)
    except InputError as error:
        said = str(error)
        raise InputError(said if said.startswith(place.name) else f"{place.name}: {said}") from None
    report |= {"engine": base.name, "measured": place.name, "seed": request.ask.seed, "file": None, "refused": None}
    if new is None:
        return report
    # If the file cannot be written, the report of the long search is returned all the same.
    try:
        found_text = text(report["parameters"], interrupted=report["interrupted"])
        write_identified(new, found_text, old.folder, model.sought, report["parameters"])
        report["file"] = str(new)
    except (InputError, StoreError) as error:
        report["refused"] = str(error)
    return report


def prepared(base: Engine, read: MeasuredTable, place: Path, say: Progress) -> tuple[TorsionalModel, Comparison]:
    """Return model and data of a measured file after all checks that need no search; raises ``InputError``."""
    if not read.has_sets:
        if read.targets:
            raise InputError("has [targets] alone, which are met by cranktrain_lab.calibration, not fitted here")
        raise InputError("has no data; add [[orders]], [[torque]], [[orbit]], [[frequencies]], [[decay]] or [[modes]]")
    targets, data = targets_of(read), read_data(base, read, place)
    # Measured numbers of the bending crank come last, in the order in which the model computes them.
    mounts = [one for one in data.scalars if one.kind == MOUNTS]
    twist = [one for one in data.scalars if one.kind != MOUNTS]
    # Targets as measured numbers, with their tolerances as standard deviations.
    found = []
    for one in targets:
        name = f"targets.{one.name}" if one.name in data.names else one.name
        found.append(Scalar(name, TARGET, one.number, one.hz, one.tolerance, False))
    data = replace(data, scalars=(*twist, *found, *mounts))
    checks.check_data(data.strands)
    damper = base.damper is not None if read.damper is None else read.damper
    engine = with_ratios(base, read, damper, say)
    data = replace(data, orbits=read_orbits(base, read.orbit, place, data.names))
    sought = sought_parameters(engine, read.parameters, data.order_sets, read.load)
    check_orbits(base, data.orbits, sought)
    bending = Bending(base, read, data.scalars, say) if targets or mounts else None
    model = TorsionalModel(engine, data, sought, read.load, damper, read.inherit, say, bending)
    values = np.array([one.start for one in sought])
    model.check(values)
    try:
        model.answers(values)
    except SolverError as error:
        raise InputError(f"the model has no answer at the start: {error}") from None
    comparison = Comparison(model, data, sought)
    say("frequencies within the bounds")
    checks.check_frequencies(model, comparison, 1)
    return model, comparison


def with_ratios(engine: Engine, read: MeasuredTable, damper: bool, say: Progress) -> Engine:
    """Return the engine with start values of sought damping ratios: its own, the higher level's or the structure's."""
    if not any(key.startswith(RATIOS) for key in read.parameters) or engine.damping.torsional_ratios:
        return engine
    plain = engine.without_additions
    settings = Settings(crank="torsional", damper="fitted" if damper else "none")
    records = assemble(plain, settings, say=say, inherit=read.inherit).body.records
    own = engine.damping.ratio or 0.01
    ratios = np.asarray(records["inherited_damping"])[:, 1].tolist() if "inherited_damping" in records else [own, own]
    return replace(engine, damping=replace(engine.damping, torsional_ratios=tuple(ratios)))


def report_of(
    model: TorsionalModel, comparison: Comparison, climbed: Climbed, request: Request, say: Progress
) -> dict[str, Any]:
    """Return the report of an identification for JSON; raises ``InputError`` for data of another engine."""
    found = climbed.estimate
    checks.check_estimate(comparison, found)
    confidence = confidence_of(comparison, found, climbed.moves)
    profile = draws = None
    advice: list[dict[str, Any]] = []
    try:
        if request.profile and not found.interrupted:
            say("profiles")
            profile = profiles(comparison, found, confidence)
        draws = bootstrap(comparison, found, request.draws, request.ask.seed) if request.draws else None
        advice = advised(model, comparison, climbed, confidence, request.ask)
    except KeyboardInterrupt:
        found = replace(found, interrupted=True)  # keeps the estimate after possibly an hour of runs in time
    values = outer_values(comparison.sought, found.inner)
    model.check(values)
    rows = [
        parameter_row(one, k, found.inner, confidence, profile, draws, climbed.moves)
        for k, one in enumerate(comparison.sought)
    ]
    keys = [one.key for one in comparison.sought]
    around = {one.name for one in comparison.data.strands if isinstance(one, Orbit)}
    residuals = residual_rows(comparison, found, confidence)
    orders, orbits = ([row for row in residuals if ("bearing" in row) == of_orbit] for of_orbit in (False, True))
    held = held_out(comparison, found, confidence)
    levels, above = (
        [
            {
                "level": step.level,
                "answers": step.answers,
                "values": {
                    one.key: one.shown(one.value(float(u))) for one, u in zip(model.sought, step.inner, strict=True)
                },
            }
            for step in steps
        ]
        for steps in (climbed.steps, climbed.beyond)
    )
    return {
        "parameters": rows, "told_apart": told_apart(found.information, comparison.known, keys),
        "correlations": correlations(confidence, comparison.sought), "levels": levels, "above": above,
        "advice": advice, "doubts": list(doubtful_values(rows, bool(comparison.data.strands))),
        "orders": orders, "orbits": orbits, "numbers": number_rows(comparison, found), "held_out": held,
        "systematic": [
            *(f"order {row['order']:g} of {row['set']}" for row in orders if row["systematic"]),
            *(f"orbit {row['set']}" for row in orbits if row["systematic"]),
        ],
        "bias": {
            name: {
                "noise": own.noise, "relative_percent": 100.0 * own.relative,
                **({"length_deg": math.degrees(own.length)} if name in around else {"length_rpm": own.length / RPM}),
            }
            for name, own in comparison.biases.items()
        },
        "degrees_of_freedom": min(confidence.freedom, 1e6), "interrupted": found.interrupted,
        "evaluations": model.evaluations,
    }  # fmt: skip


def parameter_row(
    one: Sought, k: int, inner: Array, confidence: Confidence, profile: Sequence[tuple[float, float]] | None,
    draws: Array | None, moves: Array,
) -> dict[str, Any]:  # fmt: skip
    """Return a parameter's value and confidence intervals by covariance, profile and bootstrap, in its unit."""
    reach = confidence.reach * float(confidence.deviations[k])

    def shown(u: float) -> float:
        return one.shown(min(max(one.value(u), one.low), one.high))

    ends = (float(inner[k]) - reach, float(inner[k]) + reach)
    best = profile[k] if profile is not None else ends
    near = AT_BOUND * (one.inner(one.high) - one.inner(one.low))
    own = float(inner[k])
    at_bound = own - one.inner(one.low) < near or one.inner(one.high) - own < near
    percentiles = None if draws is None else np.percentile(draws[:, k], (2.5, 97.5)).tolist()
    relative = float(confidence.deviations[k]) * (
        1.0 if one.log else (one.high - one.low) / max(abs(one.value(own)), 1e-300)
    )
    # An angle about zero has no relative deviation.
    known = math.isfinite(relative) and (one.log or abs(own) > float(confidence.deviations[k]))
    return {
        "key": one.key, "value": one.shown(one.value(own)), "unit": one.unit,
        "low": shown(best[0]), "high": shown(best[1]),
        "deviation_percent": 100.0 * relative if known else None,
        "covariance": [shown(end) for end in ends], "profile": None if profile is None else [shown(u) for u in best],
        "bootstrap": None if percentiles is None else [shown(u) for u in percentiles],
        "next_level_percent": 100.0 * float(moves[:, k].sum()) if one.log else None,
        "bounds": [one.shown(one.low), one.shown(one.high)], "start": one.shown(one.start), "at_bound": bool(at_bound),
    }  # fmt: skip


def correlations(confidence: Confidence, sought: Sequence[Sought]) -> list[dict[str, Any]]:
    """Return pairs of parameters whose estimates have a correlation above 0.9."""
    spread = confidence.deviations
    matrix = confidence.covariance / np.outer(spread, spread)
    return [
        {"first": sought[i].key, "second": sought[k].key, "correlation": float(matrix[i, k])}
        for i in range(len(sought))
        for k in range(i + 1, len(sought))
        if abs(matrix[i, k]) > 0.9
    ]


def doubtful_values(rows: Sequence[Mapping[str, Any]], amplitudes: bool) -> Iterator[str]:
    """Yield warnings on rows of parameters; ``amplitudes``: True if orders are among the data."""
    for row in rows:
        value, unit = row["value"], "" if row["unit"] == "1" else f" {row['unit']}"
        hint = ""
        if row["key"] == LOAD and amplitudes and value > MOST_LOAD:
            hint = f"; {PEAK_TO_PEAK}"
        if row["at_bound"]:
            low, high = row["bounds"]
            side, other = ("lower", "less") if abs(value - low) < abs(value - high) else ("upper", "more")
            yield (
                f"{row['key']} lies at its {side} bound, {value:.4g}{unit}: the data want {other}, and the other "
                f"values make up for it; widen the bound{hint or ', or seek what else differs'}"
            )
        elif hint:
            yield f"{row['key']} is {value:.3g} times the full load of the engine file{hint}"
