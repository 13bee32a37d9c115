"""Targets files of a calibration: targets, free values, and derived values.

    block = "flexible"                       # or "ground"

    [targets.first_torsion]
    of = "cranktrain"                        # or "crankshaft": free, with what is attached, no rods
    shape = "torsional"                      # bending, torsional or axial
    number = 1                               # torsion only: first or second; others are matched by shape, one to one
    hz = 238
    tolerance = 0.02                         # relative deviation that is still met
    source = "computed by the reference"

    [parameters]
    "flywheel.mass" = { low = 20, high = 45, unit = "kg" }
    flywheel_gyration = { low = 125, high = 170, unit = "mm", note = "a name of its own, for formulas" }

    [derived]
    "flywheel.polar_inertia" = { formula = "flywheel.mass * flywheel_gyration ** 2", note = "radius of gyration" }

Formulas are in SI. They may use ``bore_stiffness_x``, ``bore_stiffness_y`` and ``thrust_face_stiffness`` of the block,
see :func:`cranktrain_lab.calibration.calibrate.stand_ins`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, field

from cranktrain.core.errors import InputError, nearest, within
from cranktrain.core.typed_file import Fault, Table, between, quantities, record
from cranktrain.core.user_file import ending, file_exists, read_toml, user_path
from cranktrain.engine import values
from cranktrain.engine.file import engine_folder
from cranktrain.engine.levels import BLOCKS
from cranktrain.engine.model import Engine
from cranktrain.structure.crank.modal import KINDS

MOTION = "motion"
BODIES = ("cranktrain", "crankshaft", MOTION)
BASES = ("computed", "measured")
BLOCK_STAND_INS = ("bore_stiffness_x", "bore_stiffness_y", "thrust_face_stiffness")
FILM_STAND_INS = ("film_stiffness_x", "film_stiffness_y")
STAND_INS = (*BLOCK_STAND_INS, *FILM_STAND_INS)
SUFFIX = ".targets.toml"
GROUND = next(iter(BLOCKS))
LARGEST = 1e15
"""Largest magnitude of a value of an engine file in SI units."""


class TargetTable(Table, kw_only=True):
    """TOML table of a target frequency, or of the critical speed of an order."""

    of: Literal[BODIES] = BODIES[0]  # type: ignore[valid-type]
    shape: Literal[KINDS]  # type: ignore[valid-type]
    number: int = 0
    hz: Annotated[float, between(0.01, 1e5, "Hz", "frequency")] | None = None
    order: Annotated[float, between(0.5, 100.0, "per revolution")] | None = None
    rpm: Annotated[float, between(1.0, 1e5, "rev/min", "speed")] | None = None
    tolerance: Annotated[float, between(1e-6, 0.99, "e.g. 0.02 for 2 %", "1", "1")]
    source: str
    basis: Literal[BASES] = BASES[0]  # type: ignore[valid-type]


class ParameterTable(Table, kw_only=True):
    """TOML table of a free value between two bounds, in a unit."""

    measured = ("low", "high")

    low: Annotated[float, quantities()]
    high: Annotated[float, quantities()]
    unit: str = "1"
    note: str = ""


class DerivedTable(Table, kw_only=True):
    """TOML table of a value that follows from other values by a formula in SI."""

    formula: str
    note: str = ""


class TargetsTable(Table, kw_only=True):
    """Whole targets file: targets, free values and derived values of a calibration."""

    block: Annotated[str, Meta(extra_json_schema={"enum": list(BLOCKS)})] = GROUND
    targets: dict[str, TargetTable] = field(default_factory=dict)
    parameters: dict[str, ParameterTable] = field(default_factory=dict)
    derived: dict[str, DerivedTable] = field(default_factory=dict)


@dataclass(frozen=True)
class Target:
    """Target frequency, Hz, with relative ``tolerance``; ``number`` 0: matched by shape, 1 or 2: torsional mode.

    With ``of`` motion it is the first torsional frequency about the settled cycle of a run. ``order`` is the order
    whose critical speed was given, 0 if the frequency was given. ``basis`` states whether the source measured or
    computed it.
    """

    name: str
    of: str
    shape: str
    hz: float
    tolerance: float
    source: str
    number: int = 0
    order: float = 0.0
    basis: str = BASES[0]


@dataclass(frozen=True)
class Parameter:
    """Free value (SI): key of the engine, or an additional name; ``unit`` and ``scale`` of the file."""

    key: str
    low: float
    high: float
    unit: str
    scale: float
    note: str = ""

    @property
    def is_key(self) -> bool:
        """True if the parameter is a value of the engine file."""
        return "." in self.key


@dataclass(frozen=True)
class Task:
    """Contents of a targets file of a calibration; ``derived`` are values that follow from others, by key."""

    flexible: bool
    targets: tuple[Target, ...]
    parameters: tuple[Parameter, ...]
    derived: Mapping[str, DerivedTable]

    @property
    def moves(self) -> bool:
        """True if a target is a frequency of the running engine."""
        return any(target.of == MOTION for target in self.targets)

    @property
    def film_springs(self) -> bool:
        """True if a derived value depends on the springs that replace oil films."""
        return any(name in entry.formula for entry in self.derived.values() for name in FILM_STAND_INS)


def targets_path(name_or_path: str | Path) -> Path:
    """Return the path of a targets file, given by path or by the name of a shipped engine with targets."""
    text = str(name_or_path)
    path = user_path(text) if ending(text) == ".toml" else engine_folder() / f"{text}{SUFFIX}"
    if not file_exists(path):
        shipped = ", ".join(sorted(p.name.removesuffix(SUFFIX) for p in engine_folder().glob(f"*{SUFFIX}")))
        raise InputError(f"{text}: no such targets file; shipped ones: {shipped}")
    return path


def load_targets(name_or_path: str | Path, engine: Engine) -> Task:
    """Read and check a targets file for an engine; ``InputError`` is one line with file, table and key."""
    path = targets_path(name_or_path)
    document = read_toml(path, "targets file", "give its path")
    try:
        return _task(document, engine)
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None


def _task(document: dict[str, Any], engine: Engine) -> Task:
    read = record(TargetsTable, document, said=_said)
    if read.block not in BLOCKS:
        raise InputError(f"block: level '{read.block}' does not exist; {nearest(read.block, BLOCKS)}")
    flexible = read.block != GROUND
    if flexible and (engine.block is None or engine.mounts is None):
        raise InputError(f"block: engine '{engine.name}' has no [block] with [mounts]; write block = \"{GROUND}\"")
    targets = tuple(target_of(name, entry) for name, entry in read.targets.items())
    parameters = tuple(_parameter(key, entry, engine) for key, entry in read.parameters.items())
    if not targets or not parameters:
        raise InputError(f"{'parameters' if targets else 'targets'}: none is given; a calibration needs at least one")
    for key in read.derived:
        values.quantity(engine, key)
    free = {p.key for p in parameters}
    if twice := [key for key in read.derived if key in free]:
        raise InputError(f"derived.{twice[0]}: is free as well; leave it out of [parameters] or of [derived]")
    names = {p.key: p.high for p in parameters if not p.is_key} | dict.fromkeys(FILM_STAND_INS, 1.0)
    names |= dict.fromkeys(BLOCK_STAND_INS, 1.0) if flexible else {}
    for key, entry in read.derived.items():
        values.formula_value(entry.formula, engine, names, f"derived.{key}")
    return Task(flexible, targets, parameters, read.derived)


def target_of(name: str, entry: TargetTable) -> Target:
    """Return the target of a table; raises ``InputError``."""
    where, moves = f"targets.{name}", entry.of == MOTION
    torsional, number, hz = entry.shape == "torsional", entry.number, entry.hz
    if number not in (0, 1, 2) or (number and not torsional) or (entry.of == "crankshaft" and not number):
        raise InputError(f"{where}.number: give 1 or 2 with shape torsional, as targets of the free crankshaft need it")
    if moves and (number != 1 or not torsional):
        raise InputError(f"{where}: in motion only torsional mode 1 is computed; give shape torsional, number 1")
    if not entry.source:
        raise InputError(f"{where}.source: say where the number comes from")
    if entry.order is not None or entry.rpm is not None:
        if hz is not None or not moves:
            raise InputError(f"{where}: give either order and rpm of a critical speed in motion, or hz")
        if entry.order is None or entry.rpm is None:
            raise InputError(f"{where}.{'order' if entry.order is None else 'rpm'}: is missing; give a finite number")
        hz = entry.order * entry.rpm / 60.0
        within(f"{where}.hz:", hz, 0.01, 1e5, "Hz")
    if hz is None:
        raise InputError(f"{where}.hz: is missing; give a finite number")
    order = entry.order or 0.0
    return Target(name, entry.of, entry.shape, hz, entry.tolerance, entry.source, number, order, entry.basis)


def _parameter(key: str, entry: ParameterTable, engine: Engine) -> Parameter:
    where, low, high = f"parameters.{key}", entry.low, entry.high
    rule = values.quantity(engine, key) if "." in key else None
    scale = values.to_si(1.0, entry.unit, where, rule.dimension if rule else "")
    if not low < high:
        raise InputError(f"{where}: low {low:g} is not below high {high:g}")
    for side in (low, high):
        within(f"{where}:", side * scale, -LARGEST, LARGEST, "in SI")
        if rule and (wrong := rule.wrong(side * scale)):
            raise InputError(f"{where}: {wrong}")
    return Parameter(key, low * scale, high * scale, entry.unit, scale, entry.note)


def _said(fault: Fault, where: str) -> str:
    """Return the message for a fault in the file; names of targets may contain dots."""
    place = f"{fault.place}.{fault.key}".lstrip(".")
    if fault.problem == "unknown":
        return f"{place}: is not known; {nearest(fault.key, fault.owner.__struct_encode_fields__)}"
    if fault.names and isinstance(fault.value, str):
        return f"{fault.place}: '{fault.value}' is not known; {nearest(fault.value, fault.names)}"
    return f"{place}: is missing; give it" if fault.problem == "missing" else ""
