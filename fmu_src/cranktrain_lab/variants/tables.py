"""TOML tables of a study file, read by ``cranktrain vary`` and ``cranktrain optimize``.

engine = "diesel_i6"                 # a shipped engine, or the path of an engine file, from the study's folder
outputs = ["twist", "damper.heat", "shaft.stress"]

[speeds]                             # of the linear run-up of a torsional crank; or speeds_rpm = [2000]
from = 800
to = 2400
points = 81

[vary]                               # numbers in SI, texts with a unit, or shares of the engine's own value
"damper.viscosity" = { low = "80 Pa s", high = "120 Pa s" }
"pulley.polar_inertia" = { distribution = "normal", deviation = "2 %" }

[derived]                            # follows from others, in SI
"pulley.diametral_inertia" = { formula = "0.6 * pulley.polar_inertia" }

[design]
method = "latin-hypercube"
n = 1000

[pareto]                             # variants that no other beats in all of these
minimize = ["twist", "damper.heat"]

[optimize]                           # of cranktrain optimize
minimize = "twist"
limits = { "damper.heat" = { at_most = "400 W" } }
"""

from typing import Annotated, Any, Literal

from msgspec import Meta, field

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.typed_file import Table, between
from cranktrain.engine.levels import CRANKS
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain_lab.variants.design import METHODS
from cranktrain_lab.variants.distributions import KINDS

MODELS = ("engine", "two-mass")
_Rpm = Annotated[float, between(SLOWEST_RPM, FASTEST_RPM, "rev/min", "speed")]
_Amount = float | str


class SpeedsTable(Table, kw_only=True, rename={"first": "from", "last": "to"}):
    """TOML table of uniformly spaced speeds, rev/min."""

    first: _Rpm
    last: _Rpm
    points: Annotated[int, between(2, 5000, "points")]

    remedy = "speeds have from, to (rev/min) and points"


class VaryTable(Table, kw_only=True):
    """TOML table of a value's distribution: numbers in SI, or texts with unit ("30 kg") or relative ("-10 %")."""

    distribution: Literal[tuple(KINDS)] = "uniform"  # type: ignore[valid-type]
    low: _Amount | None = None
    high: _Amount | None = None
    mode: _Amount | None = None
    mean: _Amount | None = None
    deviation: _Amount | None = None
    median: _Amount | None = None
    factor: float | None = None
    values: list[_Amount] | None = None
    note: str = ""


class FormulaTable(Table, kw_only=True):
    """TOML table of a value that follows from other values by a formula in SI."""

    formula: str
    note: str = ""


class DesignTable(Table, kw_only=True):
    """TOML table of the choice of variants."""

    method: Literal[METHODS] = METHODS[0]  # type: ignore[valid-type]
    n: Annotated[int, between(1, 10_000_000, "variants")] = 100
    levels: Annotated[int, between(1, 10_000, "levels of each value")] = 5
    seed: Annotated[int, between(0, 2**32 - 1, "")] = 1


class ParetoTable(Table, kw_only=True):
    """TOML table of the outputs that a Pareto front minimises."""

    minimize: list[str]

    remedy = "[pareto] has minimize, a list of outputs"


class LimitTable(Table, kw_only=True):
    """TOML table of an output's limits, as numbers in SI or texts with a unit."""

    at_most: _Amount | None = None
    at_least: _Amount | None = None

    remedy = "a limit has at_most or at_least"


class OptimizeTable(Table, kw_only=True):
    """TOML table of the output to minimise, and of limits."""

    minimize: str
    limits: dict[str, LimitTable] = field(default_factory=dict)
    evaluations: Annotated[int, between(10, 1_000_000, "evaluations")] = 2000
    seed: Annotated[int, between(0, 2**32 - 1, "")] = 1

    remedy = "[optimize] has minimize, the output that is to be least"


class StudyTable(Table, kw_only=True):
    """Whole study file, of variants or of an optimum."""

    outputs: list[str]
    model: Literal[MODELS] = "engine"  # type: ignore[valid-type]
    engine: str | None = None
    title: str | None = None
    speeds: SpeedsTable | None = None
    speeds_rpm: list[_Rpm] | None = None
    crank: Annotated[str, Meta(extra_json_schema={"enum": list(CRANKS)})] = "torsional"
    bearings: str = "auto"
    big_ends: str = "rigid"
    damper: bool = False
    load: Annotated[float, between(0.0, 2.0, "of the full-load burn", "1", "1")] = 1.0
    inherit: bool = True
    settle: Annotated[float, between(1e-8, 0.5, "of the outputs' alternating part")] = 1e-3
    reshape: bool = False
    retune: bool = False
    vary: dict[str, VaryTable] = field(default_factory=dict)
    derived: dict[str, FormulaTable] = field(default_factory=dict)
    design: DesignTable = field(default_factory=DesignTable)
    pareto: ParetoTable | None = None
    optimize: OptimizeTable | None = None

    remedy = "a study needs engine, outputs, [vary], and speeds_rpm or [speeds]"


def as_table(value: Any, where: str) -> Any:
    """Convert a distribution in Python, ``("uniform", low, high)``, to a table of a study file; ``InputError``."""
    if isinstance(value, dict):
        return value
    if not isinstance(value, tuple | list) or not value or not isinstance(value[0], str):
        raise InputError(f"{where}: {shown(value)} is no distribution; write ('uniform', low, high)")
    if value[0] not in KINDS:
        raise InputError(f"{where}: distribution '{value[0]}' does not exist; {nearest(value[0], KINDS)}")
    kind, *numbers = value
    if kind == "values":
        listed = len(numbers) == 1 and isinstance(numbers[0], list | tuple)
        return {"distribution": kind, "values": list(numbers[0] if listed else numbers)}
    names = {"normal": ("mean", "deviation", "low", "high"), "lognormal": ("median", "factor"),
             "triangular": ("low", "mode", "high"), "uniform": ("low", "high")}[kind]  # fmt: skip
    if len(numbers) > len(names):
        raise InputError(f"{where}: {shown(value)} has more than {', '.join(names)}; leave the others out")
    if len(numbers) == 1 and kind in ("normal", "lognormal"):
        names = names[1:2]  # the engine's own value is the centre
    return {"distribution": kind, **{n: v for n, v in zip(names, numbers, strict=False) if v is not None}}
