"""Studies of variants from Python: ``ct.vary`` and ``ct.optimize``.

They take a study file as the verbs do, or an engine, a function, with distributions as tuples.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory, mkdtemp
from typing import TYPE_CHECKING, Any, Literal
from weakref import finalize

from cranktrain.cli.functions import one_line_calls, quiet
from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult

if TYPE_CHECKING:
    from cranktrain_lab.variants.results.variants import Variants
    from cranktrain_lab.variants.running import Means
    from cranktrain_lab.variants.study import Study

Of = str | Path | Engine | Callable[[Mapping[str, float]], Mapping[str, float]]
Method = Literal["latin-hypercube", "sobol", "random", "grid", "sensitivity"]


@one_line_calls
def vary(
    study: Of, vary: Mapping[str, Any] | None = None, *, outputs: Sequence[str] = (), n: int = 100,
    method: Method = "latin-hypercube", levels: int = 5, seed: int = 1,
    speeds_rpm: float | Iterable[float] | None = None,
    crank: Literal["rigid", "torsional", "beam", "solid"] = "torsional", bearings: str = "auto",
    big_ends: str = "rigid", damper: bool = False, load: float = 1.0, inherit: bool = True,
    settle: float = 1e-3, reshape: bool = False, retune: bool = False, derived: Mapping[str, str] | None = None,
    pareto: Sequence[str] = (), output: str | Path | None = None, workers: int | None = None,
    scheduler: str | None = None, anew: bool = False,
) -> Variants:  # fmt: skip
    """Many variants of an engine: tolerances and choices as distributions; percentiles, sensitivities, Pareto front.

        ct.vary("diesel_i6", {"damper.viscosity": ("uniform", "80 Pa s", "120 Pa s")}, n=200,
                outputs=["twist", "damper.heat"], speeds_rpm=range(800, 2401, 20))

    See ``cranktrain vary --help`` and ``docs/how-to/vary.md``. Raises ``InputError`` for what cannot be used,
    ``SolverError`` where all variants fail.

    Parameters
    ----------
    study : path of a study file, which then says all but the last four; or an engine (name, path or in memory); or a
        function of values to outputs, which runs in this process
    vary : distribution of each value: ("uniform", low, high), ("normal", mean, deviation), ("triangular", low, mode,
        high), ("lognormal", median, factor) or ("values", [...]); numbers in SI, texts with a unit or shares ("-10 %")
    outputs : names; all that a torsional crank has are in the module ``studies.variants.torsional``
    n, method, levels, seed : the design; ``levels`` of a grid
    speeds_rpm : rev/min
    crank, bearings, big_ends, damper, load, inherit, settle : as of ``ct.simulate``; a study that names values or
        outputs of the damper fits it
    reshape, retune : whether values may vary that take a new mesh for each variant; whether a torsional crank that is
        tuned to the solid in motion is tuned anew for each variant (three times the time)
    derived : formulas of further values in SI
    pareto : outputs of the front
    output : folder that keeps the variants; temporary if None
    workers, scheduler, anew : processes, or a Dask cluster; whether a folder of another study is replaced
    """
    given = {
        "outputs": list(outputs), "speeds_rpm": speeds_rpm, "crank": crank, "bearings": bearings,
        "big_ends": big_ends, "damper": damper, "load": load, "inherit": inherit, "settle": settle, "reshape": reshape,
        "retune": retune,
        "design": {"method": method, "n": n, "levels": levels, "seed": seed},
        **({"pareto": {"minimize": list(pareto)}} if pareto else {}),
    }  # fmt: skip
    found = _study(study, vary, derived, given, "vary")
    from cranktrain_lab.cli.vary import found_variants

    return _quietly(
        lambda: _kept(output, lambda folder: found_variants(found, folder, _means(workers, scheduler, anew))[0])
    )


@one_line_calls
def optimize(
    study: Of, vary: Mapping[str, Any] | None = None, *, minimize: str | None = None,
    limits: Mapping[str, Any] | None = None, outputs: Sequence[str] = (), evaluations: int = 2000, seed: int = 1,
    speeds_rpm: float | Iterable[float] | None = None,
    crank: Literal["rigid", "torsional", "beam", "solid"] = "torsional", bearings: str = "auto",
    big_ends: str = "rigid", damper: bool = False, load: float = 1.0, inherit: bool = True,
    settle: float = 1e-3, reshape: bool = False, retune: bool = False, derived: Mapping[str, str] | None = None,
    engine_file: str | Path | None = None, output: str | Path | None = None, workers: int | None = None,
    scheduler: str | None = None, anew: bool = False,
) -> VerbResult:  # fmt: skip
    """The variant of an engine with the least of one output, under limits of others.

        ct.optimize("diesel_i6", {"damper.viscosity": ("uniform", 50, 500)}, minimize="twist",
                    limits={"damper.heat": {"at_most": "400 W"}}, speeds_rpm=range(800, 2401, 20))

    See ``cranktrain optimize --help`` and ``docs/how-to/vary.md``. Raises ``InputError`` for what cannot be used,
    ``SolverError`` where all variants fail.

    Parameters
    ----------
    study : as of ``ct.vary``; a study file then says all but the last five
    vary : as of ``ct.vary``; each value needs low and high
    minimize : output that is to be least
    limits : of outputs: {"at_most": ..., "at_least": ...}, numbers in SI or texts with a unit
    outputs : further outputs to tell of
    evaluations, seed : of the search
    speeds_rpm, crank, bearings, big_ends, damper, load, inherit, settle, reshape, retune, derived : as of ``ct.vary``
    engine_file : engine file to write with the values found; an existing file is not overwritten
    output, workers, scheduler, anew : as of ``ct.vary``
    """
    aim = {"evaluations": evaluations, "seed": seed, "limits": dict(limits or {})}
    aim |= {} if minimize is None else {"minimize": minimize}
    named = [name for name in (minimize, *(limits or {}), *outputs) if name]
    given = {
        "outputs": list(dict.fromkeys(named)), "speeds_rpm": speeds_rpm, "crank": crank, "bearings": bearings,
        "big_ends": big_ends, "damper": damper, "load": load, "inherit": inherit, "settle": settle, "reshape": reshape,
        "retune": retune,
        "optimize": aim,
    }  # fmt: skip
    found = _study(study, vary, derived, given, "optimize")
    from cranktrain_lab.cli.optimize import check_engine_file, found_optimum

    means = _means(workers, scheduler, anew)

    def work() -> VerbResult:
        target = check_engine_file(found, None if engine_file is None else str(engine_file))
        if output is not None:
            return VerbResult.of(found_optimum(found, Path(output), means, target), "optimize")
        with TemporaryDirectory(prefix="cranktrain-optimum-") as folder:
            said = found_optimum(found, Path(folder) / "evaluations", means, target)
        del said["result"]
        return VerbResult.of(said, "optimize")

    return _quietly(work)


def _means(workers: int | None, scheduler: str | None, anew: bool) -> Means:
    """How a study is run; ``InputError`` for a number of workers that none can be."""
    from cranktrain_lab.variants.running import Means

    if workers is not None and (isinstance(workers, bool) or not isinstance(workers, int) or not 1 <= workers <= 1024):
        raise InputError(f"workers is {workers!r}; give a whole number from 1 to 1024")
    return Means(workers, scheduler, anew)


def _study(of: Any, vary: Any, derived: Any, given: dict[str, Any], name: str) -> Study:
    """Study from a file, or from the arguments of a script."""
    from cranktrain.core.typed_file import record
    from cranktrain.engine.file import load_engine
    from cranktrain_lab.variants.study import load_study, study_of
    from cranktrain_lab.variants.tables import StudyTable, as_table

    if vary is None:
        if not isinstance(of, str | Path):
            raise InputError(
                f"{name}: vary is missing; give a distribution for each value, or the path of a study file"
            )
        return load_study(of)
    if not isinstance(vary, Mapping):
        raise InputError(f"{name}: vary is of type {type(vary).__name__}; give a dictionary of values")
    table: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
    rpm = table.get("speeds_rpm")
    if rpm is not None:
        table["speeds_rpm"] = [float(one) for one in ([rpm] if isinstance(rpm, int | float) else rpm)]
    table["vary"] = {str(key): as_table(value, f"vary.'{key}'") for key, value in vary.items()}
    if derived:
        table["derived"] = {key: {"formula": formula} for key, formula in derived.items()}
    function = of if callable(of) and not isinstance(of, Engine) else None
    engine = None
    if function is None:
        engine = load_engine(of)
    return study_of(
        record(StudyTable, table, name), engine.name if engine else "function", engine=engine, function=function
    )


def _kept(output: str | Path | None, work: Callable[[Path], Variants]) -> Variants:
    """Variants in a folder that lasts, or in one that goes with them."""
    if output is not None:
        return work(Path(output))
    place = mkdtemp(prefix="cranktrain-variants-")
    try:
        found = work(Path(place) / "variants")
    except BaseException:
        rmtree(place, ignore_errors=True)
        raise
    finalize(found, rmtree, place, ignore_errors=True)
    return found


def _quietly(work: Callable[[], Any]) -> Any:
    """Work without lines of progress, its errors in keywords."""
    with quiet():
        try:
            return work()
        except CranktrainError as error:
            raise type(error)(str(error).replace("--", "")) from None
