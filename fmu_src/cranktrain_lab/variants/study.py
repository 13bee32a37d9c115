"""Checked study of variants: varied values with distributions, requested outputs, and model.

Values are named as in an engine file, ``table.key`` or ``table.key[2]``. ``load`` is the fraction of the full-load
burn. A name without a dot is an additional value for formulas of ``[derived]``.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.stated_units import begins_as_number, in_unit, stated
from cranktrain.core.typed_file import record
from cranktrain.core.units import RPM, UNITS, unit_factor
from cranktrain.core.user_file import beside, ending, is_number, read_toml, user_path
from cranktrain.engine import values
from cranktrain.engine.file import check_title, load_engine
from cranktrain.engine.levels import crank_level
from cranktrain.engine.model import Engine
from cranktrain_lab.variants import distributions, two_mass
from cranktrain_lab.variants.design import Design
from cranktrain_lab.variants.distributions import CENTRES, KINDS, Distribution
from cranktrain_lab.variants.tables import LimitTable, OptimizeTable, StudyTable, VaryTable

LOAD = "load"
"""Name of the varied fraction of the full-load burn, which is not in engine files."""
ENGINE, TWO_MASS, FUNCTION = "engine", "two-mass", "function"
Answer = Callable[[Mapping[str, float]], Mapping[str, float]]


@dataclass(frozen=True)
class Varied:
    """Varied value: key, distribution in SI, SI unit, and the engine's own value (or None)."""

    key: str
    distribution: Distribution
    unit: str = "1"
    own: float | None = None


@dataclass(frozen=True)
class Limit:
    """Lower and upper limit of an output in SI; infinite on a side without limit."""

    output: str
    at_least: float = -math.inf
    at_most: float = math.inf


@dataclass(frozen=True)
class Aim:
    """Aim of an optimisation: output to minimise, limits of other outputs, and settings of the search."""

    minimize: str
    limits: tuple[Limit, ...] = ()
    evaluations: int = 2000
    seed: int = 1


@dataclass(frozen=True)
class Levels:
    """Fidelity levels of a study, as in ``cranktrain simulate``."""

    crank: str = "torsional"
    bearings: str = "auto"
    big_ends: str = "rigid"
    damper: bool = False
    inherit: bool = True
    settle: float = 1e-3
    reshape: bool = False
    retune: bool = False


@dataclass(frozen=True)
class Study:
    """Study that has been checked, except for checks by its model.

    Attributes
    ----------
    name, title : name of the file, and title for reports
    model : ``engine``, ``two-mass`` or ``function``
    speeds : speeds, rad/s
    derived : keys and their formulas
    load : fraction of the full-load burn if it is not varied
    pareto : outputs of the Pareto front
    function : function of model ``function``
    """

    name: str
    title: str
    model: str
    varied: tuple[Varied, ...]
    outputs: tuple[str, ...]
    design: Design
    engine: Engine | None = None
    speeds: tuple[float, ...] = ()
    derived: tuple[tuple[str, str], ...] = ()
    levels: Levels = field(default_factory=Levels)
    load: float = 1.0
    pareto: tuple[str, ...] = ()
    aim: Aim | None = None
    function: Answer | None = None

    @property
    def distributions(self) -> list[Distribution]:
        """Distributions in the order of ``varied``."""
        return [one.distribution for one in self.varied]


def load_study(path: str | Path) -> Study:
    """Read and check a study file; ``InputError`` is one line with file and key."""
    path = user_path(path)
    document = read_toml(path, "study file", "give the path of a study.toml")
    try:
        return study_of(record(StudyTable, document), path.stem, path)
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(path.name) else f"{path.name}: {text}") from None


def study_of(
    read: StudyTable, name: str, path: Path | None = None, engine: Engine | None = None, function: Answer | None = None
) -> Study:
    """Return the study of a table; an ``engine`` or ``function`` from a script replaces the table's model."""
    title = name if read.title is None else read.title
    check_title(title, "title")
    model = FUNCTION if function is not None else read.model
    if engine is None and model == ENGINE:
        if read.engine is None:
            raise InputError("key 'engine' is missing; name a shipped engine, or give the path of an engine file")
        named = path is not None and ending(read.engine) == ".toml"
        engine = load_engine(beside(path, read.engine) if named and path else read.engine)
    if model != ENGINE:
        engine = None
    if not read.outputs:
        raise InputError("outputs: is empty; name at least one")
    varied = tuple(_varied(key, table, engine, model) for key, table in read.vary.items())
    design = Design(read.design.method, read.design.n, read.design.levels, read.design.seed)
    design.check([one.distribution for one in varied])
    _check_derived(read, engine, model)
    outputs = tuple(dict.fromkeys(read.outputs))
    front = () if read.pareto is None else tuple(read.pareto.minimize)
    if read.pareto is not None and len(front) < 2:
        raise InputError("pareto.minimize: a front needs two outputs or more")
    for key in front:
        _among(key, outputs, "pareto.minimize")
    return Study(
        name=name, title=title, model=model, varied=varied, outputs=outputs, design=design, engine=engine,
        speeds=_speeds(read, model), derived=tuple((key, table.formula) for key, table in read.derived.items()),
        levels=_levels(read, engine),
        load=read.load, pareto=front, aim=None if read.optimize is None else _aim(read.optimize, outputs),
        function=function,
    )  # fmt: skip


def _levels(read: StudyTable, engine: Engine | None) -> Levels:
    """Return the fidelity levels; a study that names the damper fits it; ``InputError`` for an unknown crank level."""
    crank_level(read.crank)
    named = any("damper." in name for name in (*read.vary, *read.derived, *read.outputs))
    damper = read.damper or (named and engine is not None and engine.damper is not None)
    return Levels(
        read.crank, read.bearings, read.big_ends, damper, read.inherit, read.settle, read.reshape, read.retune
    )  # fmt: skip


def output_unit(output: str) -> str:
    """Return the SI unit of an output, for reading limits; empty if any unit is accepted."""
    from cranktrain_lab.variants.torsional import UNITS_OF, base_name

    return UNITS_OF.get(base_name(output), "")


def _aim(read: OptimizeTable, outputs: tuple[str, ...]) -> Aim:
    """Return the output to minimise, the limits in SI, and settings of the search."""
    _among(read.minimize, outputs, "optimize.minimize")
    limits = []
    for output, table in read.limits.items():
        _among(output, outputs, "optimize.limits")
        limits.append(_limit(output, table))
    return Aim(read.minimize, tuple(limits), read.evaluations, read.seed)


def _limit(output: str, table: LimitTable) -> Limit:
    where = f"optimize.limits.'{output}'"
    if table.at_most is None and table.at_least is None:
        raise InputError(f"{where}: has neither at_most nor at_least; give one")
    ends = [
        far if given is None else _number(given, output_unit(output), "", None, f"{where}.{side}")
        for side, given, far in (("at_least", table.at_least, -math.inf), ("at_most", table.at_most, math.inf))
    ]
    if ends[0] > ends[1]:
        raise InputError(f"{where}: at_least {table.at_least} is above at_most {table.at_most}; exchange them")
    return Limit(output, *ends)


def _among(output: str, outputs: tuple[str, ...], where: str) -> None:
    if output not in outputs:
        raise InputError(f"{where}: '{output}' is not among the study's outputs; {nearest(output, outputs)}")


def _speeds(read: StudyTable, model: str) -> tuple[float, ...]:
    """Return increasing speeds, rad/s."""
    if model != ENGINE:
        if read.speeds or read.speeds_rpm:
            raise InputError(f"model '{model}' has no speeds; leave out speeds and speeds_rpm")
        return ()
    if (read.speeds is None) == (read.speeds_rpm is None):
        both = "speeds_rpm and [speeds] exclude each other" if read.speeds else "no speeds"
        raise InputError(f"{both}; give one of them, e.g. speeds_rpm = [2000]")
    if read.speeds is not None:
        first, last, points = read.speeds.first, read.speeds.last, read.speeds.points
        if not first < last:
            raise InputError(f"speeds: from {first:g} must be less than to, {last:g} rev/min")
        return tuple((first + (last - first) * k / (points - 1)) * RPM for k in range(points))
    if not read.speeds_rpm:
        raise InputError("speeds_rpm: no speed in it; give at least one, rev/min")
    return tuple(rpm * RPM for rpm in sorted(set(read.speeds_rpm)))


def _varied(key: str, table: VaryTable, engine: Engine | None, model: str) -> Varied:
    """Return a varied value with its distribution in SI."""
    where, dimension, unit, own = f"vary.'{key}'", "", "", None
    rule = None
    if model == TWO_MASS:
        if key not in two_mass.VALUES and "." in key:
            raise InputError(f"{where}: model '{model}' has no such value; {nearest(key, two_mass.VALUES)}")
        dimension, unit, own = "1", "1", two_mass.VALUES.get(key)
    elif model == ENGINE and key == LOAD:
        dimension, unit, own = "1", "1", 1.0
    elif model == ENGINE and "." in key:
        assert engine is not None
        try:
            rule, own = values.quantity(engine, key), values.value(engine, key)
        except InputError as error:
            raise InputError(str(error).replace("calibrate numbers", "vary numbers")) from None
        dimension, unit = rule.dimension, next(iter(UNITS[rule.dimension]))
    kind = table.distribution
    needs, may = KINDS[kind]
    given = {n: v for n in ("low", "high", "mode", "mean", "deviation", "median", "factor", "values")
             if (v := getattr(table, n)) is not None}  # fmt: skip
    for name in given:
        if name not in (*needs, *may):
            raise InputError(f"{where}: distribution '{kind}' has no {name}; it has {', '.join((*needs, *may))}")
    for name in needs:
        if name not in given:
            raise InputError(f"{where}: distribution '{kind}' needs {name}; it has {', '.join((*needs, *may))}")
    numbers = {name: _number(value, unit, dimension, own, f"{where}.{name}", name == "deviation")
               for name, value in given.items() if name not in ("values", "factor")}  # fmt: skip
    if "factor" in given:
        numbers["factor"] = float(given["factor"])
    if (centre := CENTRES.get(kind)) and centre not in numbers:
        if own is None:
            raise InputError(f"{where}: distribution '{kind}' needs {centre}; '{key}' has no value of its own")
        numbers[centre] = own
    several = tuple(_number(one, unit, dimension, own, f"{where}.values") for one in given.get("values", ()))
    found = distributions.checked(kind, numbers, several, where)
    for end in found.ends:
        if rule is not None and math.isfinite(end) and (wrong := rule.wrong(end)):
            raise InputError(f"{where}: {wrong}")
    return Varied(key, found, unit or "1", own)


def _number(
    value: Any, unit: str, dimension: str, own: float | None, where: str, difference: bool = False
) -> float:  # fmt: skip
    """Return a number in SI from a number, a text with unit, or ``"-10 %"``, ``"90 %"`` of the engine's value."""
    if is_number(value):
        return float(value)
    if not begins_as_number(value):
        raise InputError(f"{where}: {shown(value)} is no number; write 0.2, '30 kg' or '-10 %'")
    try:
        found = stated(value, f"20 {unit or 'kg'}")
        if found.unit == "%":
            if own is None:
                raise InputError(f"{shown(value)} is a share, and there is no value of which; give a number")
            change = 1.0 if value.strip()[0] in "+-" and not difference else 0.0
            return own * (change + 0.01 * found.number)
        if not unit:
            factor = unit_factor(found.unit)
            return found.number * factor.scale + (0.0 if difference else factor.zero)
        return in_unit(found, unit, dimension or None, difference)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _check_derived(read: StudyTable, engine: Engine | None, model: str) -> None:
    """Raise ``InputError`` for unknown keys of ``[derived]``, and for unused values."""
    if model == FUNCTION and read.derived:
        raise InputError("derived: a function has its own formulas; leave [derived] out")
    for key in read.derived:
        if key in read.vary:
            raise InputError(f"derived.'{key}': is varied too; leave one of them out")
        if engine is not None:
            values.quantity(engine, key)
        elif key not in two_mass.VALUES:
            raise InputError(f"derived.'{key}': does not exist; {nearest(key, two_mass.VALUES)}")
    formulas = " ".join(table.formula for table in read.derived.values())
    known = {ENGINE: (LOAD,), TWO_MASS: tuple(two_mass.VALUES)}.get(model)
    for key in read.vary:
        if known is not None and "." not in key and key not in known and key not in formulas:
            raise InputError(f"vary.'{key}': nothing uses it; name table.key of an engine file, or a formula of it")
