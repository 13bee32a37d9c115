"""Targets files: what a calibration is to meet, which values are free, and what follows from them.

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

Formulas are in SI. They also know ``bore_stiffness_x``, ``bore_stiffness_y`` and ``thrust_face_stiffness`` of the
block, see :mod:`cranktrain.studies.calibration.stand_ins`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cranktrain.core.errors import InputError, nearest, shown, within
from cranktrain.core.user_file import is_number, read_toml
from cranktrain.engine.file import engine_folder
from cranktrain.engine.levels import BLOCKS
from cranktrain.engine.model import Engine
from cranktrain.structure.crank.modal import KINDS
from cranktrain.studies.calibration import values

MOTION = "motion"
BODIES = ("cranktrain", "crankshaft", MOTION)
BASES = ("computed", "measured")
BLOCK_STAND_INS = ("bore_stiffness_x", "bore_stiffness_y", "thrust_face_stiffness")
FILM_STAND_INS = ("film_stiffness_x", "film_stiffness_y")
STAND_INS = (*BLOCK_STAND_INS, *FILM_STAND_INS)
SUFFIX = ".targets.toml"
GROUND = next(iter(BLOCKS))
LARGEST = 1e15
"""Beyond which no value of an engine lies in SI."""


@dataclass(frozen=True)
class Target:
    """A frequency to be met: Hz, relative ``tolerance``; ``number`` 0: matched by shape, 1 or 2: that torsion.

    ``of`` motion it is the first torsional frequency about the settled cycle of a run. ``order`` is that whose critical
    speed the target is given by, 0 where it is given by its frequency. ``basis`` says whether the number was measured
    or computed by its source.
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
    """A free value (SI): a key of the engine, or a name of its own; ``unit`` and ``scale`` as the file states it."""

    key: str
    low: float
    high: float
    unit: str
    scale: float
    note: str = ""

    @property
    def is_key(self) -> bool:
        """Whether it is a value of the engine file."""
        return "." in self.key


@dataclass(frozen=True)
class Derived:
    """A key of the engine that follows from others by a formula in SI."""

    key: str
    formula: str
    note: str = ""


@dataclass(frozen=True)
class Task:
    """All that a targets file says."""

    flexible: bool
    targets: tuple[Target, ...]
    parameters: tuple[Parameter, ...]
    derived: tuple[Derived, ...]

    @property
    def moves(self) -> bool:
        """Whether a target is one of a running engine."""
        return any(target.of == MOTION for target in self.targets)

    @property
    def film_springs(self) -> bool:
        """Whether anything is derived from the films' stand-in springs."""
        return any(name in entry.formula for entry in self.derived for name in FILM_STAND_INS)


def targets_path(name_or_path: str | Path) -> Path:
    """Path of a targets file, by path or by the name of a shipped engine that has one."""
    text = str(name_or_path)
    path = Path(text) if text.endswith(".toml") else engine_folder() / f"{text}{SUFFIX}"
    if not path.is_file():
        shipped = ", ".join(sorted(p.name.removesuffix(SUFFIX) for p in engine_folder().glob(f"*{SUFFIX}")))
        raise InputError(f"{text}: no such targets file; shipped ones: {shipped}")
    return path


def load_targets(name_or_path: str | Path, engine: Engine) -> Task:
    """Read and check a targets file for an engine; ``InputError``: one line with file, table and key."""
    path = targets_path(name_or_path)
    document = read_toml(path, "targets file", "give its path")
    try:
        return _task(document, engine)
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None


def _task(document: dict[str, Any], engine: Engine) -> Task:
    _known(document, ("block", "targets", "parameters", "derived"), "")
    block = document.get("block", GROUND)
    if block not in BLOCKS:
        raise InputError(f"block: level '{block}' does not exist; {nearest(str(block), BLOCKS)}")
    flexible = block != GROUND
    if flexible and (engine.block is None or engine.mounts is None):
        raise InputError(f"block: engine '{engine.name}' has no [block] with [mounts]; write block = \"{GROUND}\"")
    tables = {name: document.get(name, {}) for name in ("targets", "parameters", "derived")}
    for name, table in tables.items():
        if not isinstance(table, dict) or any(not isinstance(entry, dict) for entry in table.values()):
            raise InputError(f"{name}: must be a table [{name}] of tables")
    targets = tuple(_target(name, entry) for name, entry in tables["targets"].items())
    parameters = tuple(_parameter(key, entry, engine) for key, entry in tables["parameters"].items())
    if not targets or not parameters:
        raise InputError(f"{'parameters' if targets else 'targets'}: none is given; a calibration needs at least one")
    derived = tuple(_derived(key, entry, engine) for key, entry in tables["derived"].items())
    free = {p.key for p in parameters}
    if twice := [d.key for d in derived if d.key in free]:
        raise InputError(f"derived.{twice[0]}: is free as well; leave it out of [parameters] or of [derived]")
    names = {p.key: p.high for p in parameters if not p.is_key} | dict.fromkeys(FILM_STAND_INS, 1.0)
    names |= dict.fromkeys(BLOCK_STAND_INS, 1.0) if flexible else {}
    for entry in derived:
        values.formula_value(entry.formula, engine, names, f"derived.{entry.key}")
    return Task(flexible, targets, parameters, derived)


def _target(name: str, entry: dict[str, Any]) -> Target:
    where = f"targets.{name}"
    _known(entry, ("of", "shape", "hz", "order", "rpm", "tolerance", "source", "number", "basis"), where)
    of, shape, number = entry.get("of", BODIES[0]), entry.get("shape"), entry.get("number", 0)
    basis = entry.get("basis", BASES[0])
    for key, word, valid in (("of", of, BODIES), ("shape", shape, KINDS), ("basis", basis, BASES)):
        if word not in valid:
            raise InputError(f"{where}.{key}: '{word}' is not known; {nearest(str(word), valid)}")
    if number not in (0, 1, 2) or (number and shape != "torsional") or (of == "crankshaft" and not number):
        raise InputError(f"{where}.number: give 1 or 2 with shape torsional, always so of the free crankshaft")
    if of == MOTION and (number != 1 or shape != "torsional"):
        raise InputError(f"{where}: of motion the first torsional frequency is known; give shape torsional, number 1")
    if not isinstance(entry.get("source"), str) or not entry["source"]:
        raise InputError(f"{where}.source: say where the number comes from")
    order = 0.0
    if "order" in entry or "rpm" in entry:
        if "hz" in entry or of != MOTION:
            raise InputError(f"{where}: give order and rpm of a critical speed of motion, or hz; not both")
        order, rpm = (_number(entry, key, where) for key in ("order", "rpm"))
        within(f"{where}.order:", order, 0.5, 100.0, "per revolution")
        within(f"{where}.rpm:", rpm, 1.0, 1e5, "rev/min")
        hz = order * rpm / 60.0
    else:
        hz = _number(entry, "hz", where)
    tolerance = _number(entry, "tolerance", where)
    within(f"{where}.hz:", hz, 0.01, 1e5, "Hz")
    within(f"{where}.tolerance:", tolerance, 1e-6, 0.99, "e.g. 0.02 for 2 %")
    return Target(name, of, str(shape), hz, tolerance, entry["source"], number, order, basis)


def _parameter(key: str, entry: dict[str, Any], engine: Engine) -> Parameter:
    where = f"parameters.{key}"
    _known(entry, ("low", "high", "unit", "note"), where)
    low, high = (_number(entry, side, where) for side in ("low", "high"))
    rule = values.quantity(engine, key) if "." in key else None
    unit = entry.get("unit", "1")
    scale = values.to_si(1.0, unit, where, rule.dimension if rule else "")
    if not low < high:
        raise InputError(f"{where}: low {low:g} is not below high {high:g}")
    for side in (low, high):
        within(f"{where}:", side * scale, -LARGEST, LARGEST, "in SI")
        if rule and (wrong := rule.wrong(side * scale)):
            raise InputError(f"{where}: {wrong}")
    return Parameter(key, low * scale, high * scale, unit, scale, entry.get("note", ""))


def _derived(key: str, entry: dict[str, Any], engine: Engine) -> Derived:
    _known(entry, ("formula", "note"), f"derived.{key}")
    if not isinstance(entry.get("formula"), str):
        raise InputError(f'derived.{key}.formula: give a text, e.g. "0.5 * flywheel.polar_inertia"')
    values.quantity(engine, key)
    return Derived(key, entry["formula"], entry.get("note", ""))


def _number(entry: dict[str, Any], key: str, where: str) -> float:
    found = entry.get(key)
    if not is_number(found):
        wrong = "is missing" if found is None else f"{shown(found)} is wrong"
        raise InputError(f"{where}.{key}: {wrong}; give a finite number")
    return float(found)


def _known(table: dict[str, Any], names: tuple[str, ...], where: str) -> None:
    if unknown := [name for name in table if name not in names]:
        raise InputError(f"{where}.{unknown[0]}: is not known; {nearest(unknown[0], names)}".lstrip("."))
