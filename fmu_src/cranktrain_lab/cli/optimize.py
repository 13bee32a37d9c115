"""The verb ``optimize``: variant of an engine that minimises one output within limits on others."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cranktrain.cli.console import Interrupted, say, show_rows
from cranktrain.cli.functions import verb
from cranktrain.core.errors import InputError
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option
from cranktrain_lab.cli.vary import FILE, StudyRun, under_bar

if TYPE_CHECKING:
    from cranktrain_lab.variants.optimum import Optimum
    from cranktrain_lab.variants.running import Means
    from cranktrain_lab.variants.study import Study

DESCRIPTION = """\
The variant of an engine with the least of one output, under limits of others: a damper by twist, heat and stress.

STUDY is a file as of cranktrain vary, with [optimize]: the output that is to be least, limits of outputs, and the
number of evaluations. Each value needs low and high. Every evaluation is kept: the same command goes on where it ended.

before     outputs of the engine's own values
at a bound an optimum at the end of a range: a wider range may have a better one
"""


@dataclass(frozen=True, kw_only=True)
class OptimizeFile(StudyRun):
    """Question of :func:`optimize_file`."""

    output: Annotated[words.File | None, Option("FOLDER", "folder of the evaluations (default: STUDY_optimum)")] = None
    engine_file: Annotated[
        words.File | None, Option("FILE", "write the engine with the values found; not overwritten")
    ] = None


@verb(OptimizeFile, DESCRIPTION, FILE)
def optimize_file(path: str | Path, ask: OptimizeFile) -> VerbResult:
    """Search the optimum, and write its engine file."""
    from cranktrain_lab.variants.study import load_study

    study = load_study(path)
    target = check_engine_file(study, ask.engine_file)
    folder = Path(ask.output or f"{study.name}_optimum")
    return VerbResult.of(found_optimum(study, folder, ask.means, target), "optimize")


def check_engine_file(study: Study, path: str | Path | None) -> Path | None:
    """Path of the engine file; ``InputError`` if it exists already, or if the study has no engine."""
    if path is None:
        return None
    if study.engine is None:
        raise InputError("--engine-file: the study has no engine; leave the option out")
    if Path(path).exists():
        raise InputError(f"{path}: exists and is not overwritten; name another --engine-file")
    return Path(path)


def found_optimum(study: Study, folder: Path, means: Means, target: Path | None) -> dict[str, Any]:
    """Report of the optimum; also writes the engine file."""
    from cranktrain_lab.variants.optimum import find_optimum

    try:
        found = under_bar("optimize", lambda stage, tell: find_optimum(study, folder, means, stage, tell))
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted; run the same command again: {folder} keeps what was evaluated") from None
    said = report(study, found) | {"result": str(folder)}
    if target is not None and found.feasible:
        _write_engine(study, found, target)
        said["engine_file"] = str(target)
    return said


def report(study: Study, found: Optimum) -> dict[str, Any]:
    """Report of the optimum: values in SI, outputs in engineering units."""
    from cranktrain_lab.variants.results.figures import shown_unit
    from cranktrain_lab.variants.study import output_unit

    assert study.aim is not None
    limits = {limit.output: limit for limit in study.aim.limits}
    outputs = []
    for name, value in found.outputs.items():
        unit, factor = shown_unit(output_unit(name) or "1")
        limit = limits.get(name)
        ends = {} if limit is None else {side: factor * end for side in ("at_least", "at_most")
                                         if math.isfinite(end := getattr(limit, side))}  # fmt: skip
        met = limit is None or limit.at_least <= value <= limit.at_most
        before = {"before": factor * found.before[name]} if name in found.before else {}
        outputs.append({"output": name, "unit": unit, **before, "value": factor * value, **ends, "met": met})
    return {
        "engine": study.engine.name if study.engine else study.model, "minimized": study.aim.minimize,
        "values": [{"key": one.key, "own": one.own, "value": found.values[one.key], "unit": one.unit,
                    "low": one.distribution.ends[0], "high": one.distribution.ends[1],
                    "at_bound": one.key in found.at_bound} for one in study.varied],
        "outputs": outputs, "passed": found.feasible, "evaluations": found.evaluations, "resumed": found.resumed,
        "seconds": found.seconds,
    }  # fmt: skip


def _write_engine(study: Study, found: Optimum, target: Path) -> None:
    """Write an engine file with the optimum values, and a note on their origin."""
    from cranktrain.store.whole_file import whole_file
    from cranktrain_lab.variants.models import variant_engine

    engine, _ = variant_engine(study, found.values)
    said = ", ".join(f"{key} = {value:.6g}" for key, value in found.values.items())
    head = f"# Optimum of study '{study.name}' (cranktrain optimize), in SI: {said}\n"
    with whole_file(target) as place:
        place.write_text(head + engine.to_toml(), "utf-8")
    say(f"{target} written")


def show(said: VerbResult) -> None:
    """Print the optimum values, and outputs of the original and the optimum engine."""
    rows = [
        (one["key"], "-" if one["own"] is None else f"{one['own']:.5g}", f"{one['value']:.5g}", f"{one['low']:.5g}",
         f"{one['high']:.5g}", one["unit"], "at a bound" * one["at_bound"])
        for one in said["values"]
    ]  # fmt: skip
    show_rows(
        f"{said['engine']}: least {said['minimized']}", ("value", "own", "found", "low", "high", "unit", ""), rows
    )
    found = [
        (one["output"], f"{one['before']:.5g}" if "before" in one else "-", f"{one['value']:.5g}",
         " ".join(f"{side.replace('_', ' ')} {one[side]:g}" for side in ("at_least", "at_most") if side in one) or "-",
         one["unit"], "yes" if one["met"] else "no")
        for one in said["outputs"]
    ]  # fmt: skip
    show_rows("Outputs, by their worst over the speeds", ("output", "before", "found", "limit", "unit", "met"), found)
    if not said["passed"]:
        print("No variant meets all limits; this one is the nearest. Give wider ranges or limits.")
    resumed = f", {said['resumed']} of them from an earlier run" if said["resumed"] else ""
    print(f"{said['evaluations']} evaluations{resumed}, {said['seconds']:.1f} s. Evaluations: {said['result']}")
