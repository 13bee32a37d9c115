"""The verb ``vary``: many variants of an engine by a design of experiments, with percentiles and sensitivities."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cranktrain.cli.console import Interrupted, labelled_bar, say, show_rows
from cranktrain.cli.functions import Subject, verb
from cranktrain.core.errors import SolverError
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question

if TYPE_CHECKING:
    from cranktrain_lab.variants.results.variants import Variants
    from cranktrain_lab.variants.running import Means, Outcome
    from cranktrain_lab.variants.study import Study

DESCRIPTION = """\
Many variants of an engine: tolerances and choices as distributions; percentiles, sensitivities, Pareto front.

STUDY is a TOML file: an engine, the values that vary with their distributions, outputs, speeds and a design
(latin-hypercube, sobol, random, grid or sensitivity). Every finished variant is kept: the same command goes on where
it ended. The result is a folder of Parquet files, which pandas and others read as one table, with a picture beside it.

crank torsional   linear run-up of each variant over all speeds: twist, damper heat, shaft stress, orders
other cranks      runs in time at each speed; the crank's body is kept, and each run starts from the engine's own motion

5 %, 50 %, 95 %   percentiles of an output's worst value over the speeds
depends on        values by their total Sobol index (design sensitivity), else by their rank regression coefficient
"""


FILE = Subject("study", "STUDY.toml", "path of a study .toml file")


@dataclass(frozen=True, kw_only=True)
class StudyRun(Question):
    """Options for the run of a study."""

    workers: words.Workers | None = None
    scheduler: Annotated[
        str | None, Option("ADDRESS", "run on the Dask cluster of this scheduler, e.g. tcp://host:8786")
    ] = None
    anew: Annotated[bool, Option(help="replace the folder of another study, and run all variants again")] = False

    @property
    def means(self) -> Means:
        """Options in the form that the run of the study takes."""
        from cranktrain_lab.variants.running import Means

        return Means(self.workers, self.scheduler, self.anew)


@dataclass(frozen=True, kw_only=True)
class VaryFile(StudyRun):
    """Question of :func:`vary_file`."""

    output: Annotated[
        words.File | None,
        Option("FOLDER", "folder of the variants (default: STUDY_variants); its picture is FOLDER.png"),
    ] = None


@verb(VaryFile, DESCRIPTION, FILE)
def vary_file(path: str | Path, ask: VaryFile) -> VerbResult:
    """Run the variants that the folder lacks, and report all of its variants."""
    from cranktrain_lab.variants.study import load_study

    study = load_study(path)
    folder = Path(ask.output or f"{study.name}_variants")
    variants, outcome = found_variants(study, folder, ask.means)
    picture = folder.with_name(f"{folder.name}.png")
    variants.plot(path=picture)
    said = report(variants, outcome) | {"result": str(folder), "picture": str(picture)}
    return VerbResult.of(said, "vary", variants=variants)


def found_variants(study: Study, folder: Path, means: Means) -> tuple[Variants, Outcome]:
    """Run the variants of a study with a progress bar; if it ends early, the message gives the finished variants."""
    from cranktrain_lab.variants.results.variants import Variants
    from cranktrain_lab.variants.running import Outcome, run_variants

    outcome = Outcome()

    def work(tell_stage: Callable[[str], None], tell: Callable[[str, float], None]) -> Any:
        return run_variants(study, folder, means, tell_stage, tell, outcome)

    try:
        files = under_bar("vary", work)
    except KeyboardInterrupt:
        count = outcome.finished + outcome.resumed
        goes_on = "; run the same command again to continue from there" if count else ""
        raise Interrupted(f"interrupted; {folder} keeps {count} variants{goes_on}") from None
    variants = Variants(files)
    if len(variants) and len(variants.failed) == len(variants):
        raise SolverError(f"all variants failed; the first one: {next(iter(variants.failed.values()))}")
    if outcome.failed:
        most = max(outcome.reasons, key=lambda reason: outcome.reasons[reason])
        say(f"cranktrain: warning: {outcome.failed} variants failed, most often: {most}")
    return variants, outcome


def under_bar(title: str, work: Callable[[Callable[[str], None], Callable[[str, float], None]], Any]) -> Any:
    """Do work with a progress bar for its stages, texts and fractions; without a terminal a line for every 5 %."""
    with labelled_bar(title) as (tell_stage, advance):
        last = -1.0

        def tell(text: str, share: float) -> None:
            nonlocal last
            advance(share)
            if share >= last + 0.05 or share >= 1.0:
                last = share
                tell_stage(text)

        return work(tell_stage, tell)


def report(variants: Variants, outcome: Outcome) -> dict[str, Any]:
    """Report of the variants in engineering units."""
    import numpy as np

    from cranktrain_lab.variants.results.figures import shown_unit
    from cranktrain_lab.variants.results.variants import PERCENTILES

    outputs = []
    for name in variants.outputs:
        unit, factor = shown_unit(variants.output(name).unit)
        values = variants[name]
        shares = factor * np.percentile(values[np.isfinite(values)], PERCENTILES)
        outputs.append({"output": name, "unit": unit, **{f"percentile_{p:g}": v for p, v in
                                                         zip(PERCENTILES, shares.tolist(), strict=True)}})  # fmt: skip
    said: dict[str, Any] = {
        "engine": variants.about["engine"], "variants": len(variants), "failed": len(variants.failed),
        "resumed": outcome.resumed, "seconds": outcome.seconds, "workers": outcome.workers, "outputs": outputs,
        "sensitivities": variants.sensitivities(),
        "reasons": [
            {"reason": why, "variants": count} for why, count in Counter(variants.failed.values()).most_common()
        ],
    }  # fmt: skip
    if variants.about["pareto"]:
        said["pareto"] = variants.pareto().drop(columns="failed").reset_index().to_dict("records")
    return said


def show(said: VerbResult) -> None:
    """Print percentiles, failures and the Pareto front."""
    variants: Variants = said.beside["variants"]
    header = ("output", "unit", "5 %", "50 %", "95 %", "depends on")
    show_rows(f"{said['engine']}: {said['variants']} variants, {variants.about['method']}", header, variants.rows)
    if said["reasons"]:
        rows = [(str(one["variants"]), one["reason"]) for one in said["reasons"][:5]]
        show_rows(f"{said['failed']} variants failed", ("variants", "quantity"), rows)
    if "pareto" in said:
        print(f"Pareto front of {', '.join(variants.about['pareto'])}: {len(said['pareto'])} variants")
    resumed = f", {said['resumed']} of them from an earlier run" if said["resumed"] else ""
    workers = "1 worker" if said["workers"] == 1 else f"{said['workers']} workers"
    print(f"{said['seconds']:.1f} s on {workers}{resumed}. Result: {said['result']}, {said['picture']}")
