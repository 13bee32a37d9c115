"""Models that compute one variant: engine at a fidelity level, two masses in closed form, or function of a script.

The crank's bare body is made once, for the base engine, so changes of pulley, flywheel, damper and other attached parts
cost nothing. Values that change the body itself are varied only if the body has no finite elements, or if the study has
``reshape = true``. Damping that a torsional crank inherits is determined once, and its damping ratios hold for all
variants. The stiffness factor of a crank tuned to the solid crank in motion also holds for all variants, unless the
study has ``retune = true``.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, cast

import numpy as np

from cranktrain.core.errors import InputError, SolverError, nearest
from cranktrain.core.types import Array
from cranktrain.dynamics.model.settings import Settings, needed_parts
from cranktrain.dynamics.simulation import fitted_engine
from cranktrain.engine import values as places
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.levels import crank_level
from cranktrain.engine.model import Engine
from cranktrain.film.table.database import bearing_settings
from cranktrain.results.files import output_unit
from cranktrain.results.run_up.run_up import LARGEST, LEAST, MEAN
from cranktrain.structure.assembly import Assembly, assemble, checked
from cranktrain.structure.crank import level as crank
from cranktrain.structure.crank.reduction import input_digest, reduced_crankshaft
from cranktrain.structure.in_motion.inherited_damping import Decay, with_damping, with_stated_damping
from cranktrain.studies.run_up.steady import CycleStart, Job, SteadyRuns
from cranktrain.studies.scene import scene_outputs
from cranktrain_lab.variants.design import Design
from cranktrain_lab.variants.distributions import Distribution
from cranktrain_lab.variants.study import ENGINE, LOAD, TWO_MASS, Levels, Study, Varied
from cranktrain_lab.variants.torsional import (
    FREQUENCY,
    UNITS_OF,
    base_name,
    check_torsional_output,
    torsional_answer,
    with_load,
)
from cranktrain_lab.variants.two_mass import OUTPUTS, two_mass_answer

SHAPING = ("crankshaft", "material", "thrust", "reduction")
"""TOML tables of the engine file that determine a crank of beams or discs."""


@dataclass(frozen=True)
class Output:
    """Output of a study: SI unit, whether it has a value for each speed, and which of these values is the worst."""

    name: str
    unit: str
    over_speed: bool = False
    worst: str = "largest"


class Model(Protocol):
    """Model that computes the variants of a study."""

    outputs: tuple[Output, ...]

    def answer(self, values: Mapping[str, float]) -> dict[str, Array]:
        """Return each output at these values (SI), at the s speeds (s,) or once (1,); raises errors of the package."""


def model_of(study: Study, say: Callable[[str], None] = lambda stage: None) -> Model:
    """Return the model of a study; raises ``InputError`` for an impossible study."""
    if study.model == ENGINE:
        return EngineModel(study, say)
    if study.model == TWO_MASS:
        return TwoMassModel(study)
    return FunctionModel(study)


class TwoMassModel:
    """Model of two masses in closed form."""

    def __init__(self, study: Study) -> None:
        for output in study.outputs:
            if output not in OUTPUTS:
                raise InputError(f"outputs: two masses have no '{output}'; {nearest(output, OUTPUTS)}")
        self.outputs, self._study = tuple(Output(name, "1") for name in study.outputs), study

    def answer(self, values: Mapping[str, float]) -> dict[str, Array]:
        """Return each output of a variant at these values (SI), at the s speeds (s,) or once (1,)."""
        known = dict(values)
        for key, formula in self._study.derived:
            known[key] = places.formula_value(formula, cast("Engine", None), known, f"derived.'{key}'")
        found = two_mass_answer(known)
        return {output.name: np.array([found[output.name]]) for output in self.outputs}


class FunctionModel:
    """Model by a function of a script, from a mapping of values to a mapping of outputs."""

    def __init__(self, study: Study) -> None:
        self.outputs, self._study = tuple(Output(name, "1") for name in study.outputs), study

    def answer(self, values: Mapping[str, float]) -> dict[str, Array]:
        """Return each output of a variant at these values (SI), at the s speeds (s,) or once (1,)."""
        assert self._study.function is not None
        found = self._study.function(dict(values))
        if missing := [output.name for output in self.outputs if output.name not in found]:
            raise InputError(f"the function returns no '{missing[0]}'; it returns {', '.join(found) or 'nothing'}")
        return {output.name: np.atleast_1d(np.asarray(found[output.name], dtype=float)) for output in self.outputs}


class EngineModel:
    """Model of an engine at a fidelity level, which keeps the bare crank.

    Attributes
    ----------
    outputs : outputs of each variant
    reshaping : varied values that change the crank's body
    inherited : damping in motion that the crank inherits from the next finer crank level, or None
    """

    def __init__(self, study: Study, say: Callable[[str], None] = lambda stage: None) -> None:
        assert study.engine is not None
        engine, levels = study.engine, study.levels
        self._study, self._engine, self._speeds = study, engine, np.array(study.speeds)
        settings = Settings(
            crank=levels.crank, bearings=levels.bearings, big_ends=levels.big_ends,
            damper="fitted" if levels.damper else "none", gas_load=study.load,
        )  # fmt: skip
        self._torsional = levels.crank == "torsional"
        if self._torsional:
            for output in study.outputs:
                check_torsional_output(output, levels.damper)
        else:
            names = time_outputs(engine, study.outputs)
        self.reshaping = self._shaping_values()
        self._settings = self._checked(settings)
        # Faults of the study file have been refused before, so only the engine can fail here.
        self._base = assemble(engine, settings, say=say, inherit=levels.inherit)
        self._bare = None if self.reshaping or self._on_bearings() or levels.retune else self._bare_crank(engine)
        self._last: tuple[Any, Any] | None = None
        records = self._base.body.records
        self.inherited: Decay | None = None
        if "inherited_damping" in records:
            hz, ratio = np.asarray(records["inherited_damping"]).T
            self.inherited = Decay(hz, ratio, float(records["inherited_at"][0]))
        if self._torsional:
            self.outputs = tuple(
                Output(name, UNITS_OF[base_name(name)], base_name(name) != FREQUENCY) for name in study.outputs
            )
            # A failure of the base engine is reported before all variants fail for the same reason.
            torsional_answer(self.assembly_of(engine, study.load), self._speeds, study.outputs)
        else:
            say(f"steady motion of '{engine.name}'")
            self.outputs = tuple(
                Output(name, unit, True, "least" if split_output(name)[0] == "least" else "largest")
                for name, unit in names.items()
            )
            self._runs = TimeAnswers(self.assembly_of(engine, study.load), self._speeds, list(names), levels.settle)

    def answer(self, values: Mapping[str, float]) -> dict[str, Array]:
        """Return each output of a variant at these values (SI), at the s speeds (s,) or once (1,)."""
        engine, load = variant_engine(self._study, values)
        made = self.assembly_of(engine, load)
        if not self._torsional:
            return self._runs.answer(made)
        return torsional_answer(made, self._speeds, tuple(output.name for output in self.outputs))

    def assembly_of(self, engine: Engine, load: float, body: Any = None) -> Assembly:
        """Return the assembly of a variant, which differs in varied values or in parts attached to the crank.

        ``body`` is the variant's running crank if known, apart from damping ratios in the engine file.
        """
        fitted = fitted_engine(engine, self._base.settings)
        own = fitted if self._torsional else engine  # a run in time adds the housing of the damper by itself
        if body is None:
            body = self._running(fitted, engine)
        elif self._torsional and engine.damping.torsional_ratios:
            body = with_stated_damping(fitted, body)
        return with_load(replace(self._base, engine=own, body=body), load)

    def _running(self, fitted: Engine, engine: Engine) -> Any:
        """Return the running crank of a variant; ``fitted`` is the engine with the damper's housing."""
        level = self._study.levels.crank
        bare = self._reshaped(engine) if self._bare is None else self._bare
        body = crank.running_crank(fitted, level, bare)
        if crank_level(level).inherits and engine.damping.torsional_ratios:
            body = with_stated_damping(fitted, body)
        elif self.inherited is not None:
            body = with_damping(fitted, body, crank_level(level).inherits, self.inherited)
        return body

    def _reshaped(self, engine: Engine) -> Any:
        """Return the bare crank of a variant. The last variant's crank is reused if all its data are equal."""
        if self._on_bearings() or self._study.levels.retune:
            return self._bare_crank(engine)
        made_from = tuple(getattr(engine, table) for table in SHAPING)
        if self._last is None or self._last[0] != made_from:
            self._last = made_from, self._bare_crank(engine)
        return self._last[1]

    def _bare_crank(self, engine: Engine) -> Any:
        """Return the bare crank of an engine; a tuned crank is tuned with the parts of this engine."""
        level = self._study.levels.crank
        fitted = fitted_engine(engine, self._base.settings)
        solid = reduced_crankshaft(fitted) if crank_level(level).needs_solid(engine) else None
        return crank.bare_crank(fitted, level, solid)

    def _on_bearings(self) -> bool:
        """True if varied values change the tuned stiffness of a torsional crank, but not its finite elements."""
        own = ("main_bearing", "main_roller") if self._engine.reduction.torsional_source == "solid-on-bearings" else ()
        return self._torsional and any(one.key.partition(".")[0] in own for one in self._study.varied)

    def _shaping_values(self) -> tuple[str, ...]:
        """Return keys of the varied and derived values that change the bare crank."""
        keys = [one.key for one in self._study.varied] + [key for key, _ in self._study.derived]
        solid = crank_level(self._study.levels.crank).needs_solid(self._engine)
        found = []
        for key in keys:
            if key.partition(".")[0] not in SHAPING:
                continue
            if not solid:
                found.append(key)
                continue
            own = places.value(self._engine, key)
            other = places.with_value(self._engine, key, own * 1.001 if own else 1e-3)
            if input_digest(other) != input_digest(self._engine):
                found.append(key)
        if found and solid and not self._study.levels.reshape:
            raise InputError(
                f"vary.'{found[0]}': shapes the crankshaft's finite elements, so each variant takes a new mesh, about "
                "a minute; set reshape = true to let it, or set reduction.torsional_source to ker-wilson in the engine"
            )
        return tuple(found)

    def _checked(self, settings: Settings) -> Settings:
        """Return settings with all defaults resolved; raises ``InputError`` if variants would need remade parts."""
        settings = checked(self._engine, settings)
        wanted = needed_parts(self._engine, settings)
        if other := [name for name in ("bore", "big_end_bore") if name in wanted]:
            raise InputError(
                f"bearings '{settings.bearings}', big ends '{settings.big_ends}': variants do not make elastic bores "
                f"({other[0]}); take impedance, table or reynolds"
            )
        for part, name in (("main_bearing", "table"), ("big_end_bearing", "big_end_table")):
            own = getattr(self._engine, part)
            for one in self._study.varied:
                if name in wanted and one.key.startswith(f"{part}."):
                    number = places.value(self._engine, one.key) * 1.001
                    changed = getattr(places.with_value(self._engine, one.key, number), part)
                    if bearing_settings(changed) != bearing_settings(own):
                        raise InputError(f"vary.'{one.key}': shapes the film table; take bearings impedance")
        if self._torsional and settings.damper == "none" and any(o.startswith("damper.") for o in self._study.outputs):
            raise InputError("outputs: there is no damper; leave damper.* out")
        return settings


def torsional_model(
    engine: Engine, varied: Mapping[str, tuple[float, float, float]], speeds: Sequence[float], levels: Levels,
    load: float = 1.0, say: Callable[[str], None] = lambda stage: None,
) -> EngineModel:  # fmt: skip
    """Return the model of a torsional crank between two ``speeds``, rad/s; ``varied`` are low, high and own by key."""
    values = tuple(
        Varied(key, Distribution("uniform", (("low", low), ("high", high))), own=own)
        for key, (low, high, own) in varied.items()
    )
    outputs = (f"{FREQUENCY}[1]",)
    study = Study(engine.name, engine.title, ENGINE, values, outputs, Design(), engine, tuple(speeds), (), levels, load)
    return EngineModel(study, say)


def variant_engine(study: Study, values: Mapping[str, float]) -> tuple[Engine, float]:
    """Return the checked engine of a variant, and its load; raises ``InputError``."""
    assert study.engine is not None
    engine, names, load = study.engine, dict[str, float](), study.load
    for key, value in values.items():
        if key == LOAD:
            load = value
        elif "." in key:
            engine = places.with_value(engine, key, value)
        else:
            names[key] = value
    for key, formula in study.derived:
        engine = places.with_value(engine, key, places.formula_value(formula, engine, names, f"derived.'{key}'"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_engine(engine)
    return engine, load


def answered(model: Model, values: Mapping[str, float]) -> dict[str, Array] | str:
    """Return outputs of a variant, or the reason of failure as one line, so that one failure does not end a study."""
    try:
        found = model.answer(values)
    except (InputError, SolverError) as error:
        return str(error)
    except (ArithmeticError, np.linalg.LinAlgError, ValueError) as error:
        return f"{type(error).__name__}: {' '.join(str(error).split())}"[:300]
    for name, value in found.items():
        if not np.all(np.isfinite(value)):
            return f"{name} is not finite"
    return found


WORDS = {"least": LEAST, "mean": MEAN, "largest": LARGEST}
HIGHEST_ORDER = 24.0


def split_output(output: str) -> tuple[str, str]:
    """Split an output such as ``mean NAME`` into word and name. No word means half of the peak-to-peak value."""
    word, _, name = output.strip().partition(" ")
    return (word, name.strip()) if word in WORDS and name else ("", output.strip())


def time_outputs(engine: Engine, outputs: Sequence[str]) -> dict[str, str]:
    """Return the single outputs of a study's list, with their units; raises ``InputError`` for an unknown output."""
    found: dict[str, str] = {}
    for output in outputs:
        word, name = split_output(output)
        single, stress = scene_outputs(engine, [name])
        if stress or name.endswith(".orders"):
            raise InputError(f"outputs: '{output}' is no time series of the running model; name one, or its bearings'")
        found |= {f"{word} {one}".strip(): output_unit(one) for one in single}
    return found


class TimeAnswers:
    """Runs of variants in time, each started from the steady motion of the base engine."""

    def __init__(self, made: Assembly, speeds: Array, outputs: Sequence[str], settle: float) -> None:
        self._speeds, self._outputs, self._settle = speeds, tuple(outputs), settle
        self._starts: list[CycleStart] = []
        runs = SteadyRuns(self._job(made))
        # A second run of the base engine identifies its slowest modes, so each variant needs fewer cycles.
        for speed in speeds.tolist():
            first = runs.at(speed, [])
            self._starts.append(runs.at(speed, [first.start]).start)

    def answer(self, made: Assembly) -> dict[str, Array]:
        """Return each output of a variant at its s speeds, (s,); raises ``InputError``, ``SolverError``."""
        runs, found = SteadyRuns(self._job(made)), []
        same = runs.simulation.model.omega2.size
        for speed, start in zip(self._speeds.tolist(), self._starts, strict=True):
            near = [start] if start.motion.place.size == same else []
            found.append(runs.at(speed, near).extremes)
        return {output: np.array([_value(output, one) for one in found]) for output in self._outputs}

    def _job(self, made: Assembly) -> Job:
        return Job(made, None, self._settle, HIGHEST_ORDER, ())


def _value(output: str, extremes: dict[str, Array]) -> float:
    word, name = split_output(output)
    values = extremes[name]
    return float(values[WORDS[word]]) if word else 0.5 * float(values[LARGEST] - values[LEAST])
