"""Access to values of an engine by keys ``table.key`` or ``table.key[i]`` (from 1), and formulas with such keys.

A key of a list without index stands for all its entries. All numbers are in SI.
"""

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.units import known_factor
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import UNITS, Quantity, kinds

KEY = re.compile(r"([a-z_]+)\.([a-z0-9_]+)(?:\[(\d{1,4})\])?$")
_OPERATORS: dict[type, Callable[..., float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.USub: operator.neg,
}  # fmt: skip
_FORMULA_HINT = "numbers, keys of the engine, named parameters, + - * / ** and brackets make a formula"


def quantity(engine: Engine, key: str) -> Quantity:
    """Quantity and bounds of the number under a key; ``InputError`` for a key without a number."""
    table, name, index = _parts(engine, key)
    kind, many, rule = kinds(getattr(engine, table).__class__)[name]
    if kind is not float or not isinstance(rule, Quantity):
        raise InputError(f"{key}: is not a physical quantity; calibrate numbers with a unit or ratio")
    if index is not None and not many:
        raise InputError(f"{key}: is a single value; leave out [{index + 1}]")
    return rule


def value(engine: Engine, key: str) -> float:
    """Number of an engine under a key; for a list without index the first entry."""
    table, name, index = _parts(engine, key)
    found = getattr(getattr(engine, table), name)
    return float(found[index or 0] if isinstance(found, tuple) else found)


def holds(engine: Engine, key: str, number: float) -> bool:
    """True if the engine's value under a key equals ``number`` up to rounding."""
    table, name, index = _parts(engine, key)
    found = getattr(getattr(engine, table), name)
    entries = found if isinstance(found, tuple) and index is None else (value(engine, key),)
    return all(math.isclose(entry, number, rel_tol=1e-12) for entry in entries)


def with_value(engine: Engine, key: str, number: float) -> Engine:
    """Copy of an engine with a new number under a key."""
    table, name, index = _parts(engine, key)
    part = getattr(engine, table)
    found: Any = getattr(part, name)
    if isinstance(found, tuple):
        found = tuple(number if index in (None, i) else old for i, old in enumerate(found))
    else:
        found = number
    return replace(engine, **{table: replace(part, **{name: found})})


def to_si(number: float, unit: str, where: str, dimension: str = "") -> float:
    """Number in SI from a unit of a given dimension, or of any; ``InputError`` if the unit is unknown or unsuitable."""
    found = known_factor(unit, dimension or None) if isinstance(unit, str) else None
    if found is None:
        of = f" does not measure its {dimension}; use one of: {', '.join(UNITS[dimension])}" if dimension else ""
        raise InputError(f"{where}: unit '{unit}'{of or ' is not known'}")
    return number * found.scale


def formula_value(text: str, engine: Engine, names: Mapping[str, float], where: str) -> float:
    """Result of a formula with keys of the engine and ``names``; ``InputError`` if it has no finite value."""
    try:
        result = _evaluated(ast.parse(text, mode="eval").body, engine, names, where)
    except (SyntaxError, ZeroDivisionError, OverflowError, ValueError, TypeError, RecursionError, MemoryError) as error:
        raise InputError(f"{where}: {shown(text)} cannot be computed ({error}); {_FORMULA_HINT}") from None
    if not math.isfinite(result):
        raise InputError(f"{where}: {shown(text)} is not finite")
    return result


def _evaluated(node: ast.expr, engine: Engine, names: Mapping[str, float], where: str) -> float:
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.BinOp(left, operation, right) if type(operation) in _OPERATORS:
            pair = (_evaluated(side, engine, names, where) for side in (left, right))
            return float(_OPERATORS[type(operation)](*pair))
        case ast.UnaryOp(operation, operand) if type(operation) in _OPERATORS:
            return float(_OPERATORS[type(operation)](_evaluated(operand, engine, names, where)))
        case ast.Name(name) if name in names:
            return names[name]
        case ast.Name(name):
            raise InputError(f"{where}: unknown name '{name}'; {nearest(name, sorted(names))}")
        case ast.Attribute() | ast.Subscript():
            return value(engine, ast.unparse(node))
    raise InputError(f"{where}: '{ast.unparse(node)}' is not allowed here; {_FORMULA_HINT}")


def _parts(engine: Engine, key: str) -> tuple[str, str, int | None]:
    """Table, name and index (from 0) of a key; ``InputError`` if the engine has no such key."""
    found = KEY.match(key)
    if not found:
        raise InputError(f"{key}: is not a key of an engine file; write table.key or table.key[1]")
    table, name, index = found.groups()
    tables = [entry.name for entry in fields(engine) if getattr(engine, entry.name) is not None]
    if table not in tables or isinstance(getattr(engine, table), str):
        raise InputError(f"{key}: engine '{engine.name}' has no table [{table}]; {nearest(table, tables)}")
    part = getattr(engine, table)
    names = [entry.name for entry in fields(part)]
    if name not in names:
        raise InputError(f"{key}: [{table}] has no key '{name}'; {nearest(name, names)}")
    if index is not None and isinstance(entries := getattr(part, name), tuple) and not 1 <= int(index) <= len(entries):
        raise InputError(f"{key}: [{table}] {name} has {len(entries)} entries")
    return table, name, None if index is None else int(index) - 1
