"""A torsional system described by a table: discs, shafts between them, gears, branches and ground.

    [[disc]]                          [[shaft]]
    name = "flywheel"                 between = ["main[7]", "flywheel"]
    inertia = 0.87      # kg m2       stiffness = 1.9e6    # N m/rad
    damping = 0.0       # N m s/rad   damping = 2.0        # N m s/rad
                                      loss_factor = 0.0
                                      ratio = 1.0

A disc's ``damping`` is absolute, a shaft's is relative. ``ratio`` is the ratio of a gear at the shaft's first end: the
shaft twists by ratio θ₁ − θ₂ and loads disc 1 by ratio times its torque. A shaft without ``stiffness`` is a rigid gear
mesh, θ₂ = ratio θ₁, and disc 2 has no coordinate of its own. ``"ground"`` in place of a disc does not move.

A shaft may have its ``stiffness`` over ``torques``, its torque over ``twists``, ``stiffness`` and ``damping`` over
``frequencies``, and ``friction``, see :mod:`cranktrain.engine.line_elements`; ``diameter``, ``bore``, ``strength`` and
``section`` are for its stress (:mod:`cranktrain.results.strength.iacs_m68`).

A text table (CSV) holds the same data, one line for a disc and the shaft from it to the next line's disc or to ``to``:

    disc,inertia,damping,to,stiffness,shaft_damping,loss_factor,ratio
    main[7],0.02,0,,1.9e6,2.0,,
    flywheel,0.87,0,,,,,

A line has a shaft if one of the shaft's columns is filled. A disc with several shafts has several lines, with its
inertia on the first. An end that is not a disc is written in the same way, without inertia. Lists are written with
slashes, as in ``2e4/3e4/6e4``. The table may be written in any dialect (:mod:`cranktrain.core.text_table`) and name its
units, as ``inertia [kg cm^2]``.

:mod:`cranktrain.structure.crank.chain` uses a chain in place of a crank. Its discs are ``pulley``, ``flywheel``, and
``pin[1]`` … or ``main[1]`` …, between which the throws lie; its shafts are linear. As a drive line behind the flywheel
(:mod:`cranktrain.loads.torsional_line`) a chain begins at ``flywheel`` and ends at ``dynamometer``, which are not discs
of the table; without a shaft to ``dynamometer`` its far end is free.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any, get_args

import numpy as np

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.reduced_body import Array
from cranktrain.core.units import known_factor
from cranktrain.core.user_file import TABLES, ending, is_number, read_toml
from cranktrain.engine import quantities as q
from cranktrain.engine.line_elements import Shaft, element_values, needed_of_shaft
from cranktrain.engine.parts import Needed
from cranktrain.engine.quantities import kinds

GROUND = "ground"
MOST_ROWS = 1000
FLYWHEEL, DYNAMOMETER = "flywheel", "dynamometer"
LINE_ENDS = (FLYWHEEL, DYNAMOMETER)
"""Ends of a drive line; they are not discs of its table."""
SHAFT_COLUMNS = {
    "to": "between",
    "stiffness": "stiffness",
    "shaft_damping": "damping",
    **{
        key: key
        for key in (
            "loss_factor",
            "ratio",
            "torques",
            "twists",
            "frequencies",
            "frequency",
            "friction",
            "slip_speed",
            "diameter",
            "bore",
            "strength",
            "section",
        )
    },
}
"""Columns of a CSV table for a shaft, and the corresponding keys."""
DISC_COLUMNS = {"disc": "name", "inertia": "inertia", "damping": "damping"}
COLUMNS = (*DISC_COLUMNS, *SHAFT_COLUMNS)
TEXTS = ("disc", "to", "section")
"""Columns of a table of discs and shafts that contain words."""
TWIST = get_args(q.Twist)[1]
LISTS = ("stiffness", "damping", "torques", "twists", "frequencies")
"""Keys of a shaft that may be lists."""


@dataclass(frozen=True)
class Disc:
    """One row of the discs: inertia in kg m², damping in N m s/rad."""

    name: str
    inertia: q.Inertia
    damping: q.TorsionalDamping = 0.0


@dataclass(frozen=True)
class Chain:
    """A table of discs and shafts."""

    discs: tuple[Disc, ...]
    shafts: tuple[Shaft, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the discs, in order."""
        return tuple(disc.name for disc in self.discs)


def is_chain(path: str | Path) -> bool:
    """True if a file is a table of discs and shafts."""
    try:
        if ending(path) in TABLES:
            from cranktrain.core.text_table import first_words

            return any(_column(word) == "disc" for word in first_words(path, "chain", ""))
        return ending(path) == ".toml" and "disc" in read_toml(path, "chain", "")
    except InputError:
        return False


def read_chain(path: str | Path, ends: tuple[str, ...] = (GROUND,)) -> Chain:
    """Table of discs and shafts from a TOML or CSV file; ``InputError`` if it cannot be read or describes no system.

    ``ends`` are names at which shafts may end in addition to discs.
    """
    what, mend = "table of discs and shafts", "give a table of [[disc]] and [[shaft]]"
    content = _table_content(path, ends) if ending(path) in TABLES else read_toml(path, what, mend)
    for key in content:
        if key not in ("disc", "shaft"):
            raise InputError(f"{path}: '{key}' is not a part of a chain; {nearest(key, ('disc', 'shaft'))}")
    for part in ("disc", "shaft"):
        if not isinstance(content.get(part, []), list):
            raise InputError(f"{path}: {part} is not a list of tables; write [[{part}]] before each row")
        if len(content.get(part, [])) > MOST_ROWS:
            raise InputError(f"{path}: {len(content[part])} rows of {part}; a chain has at most {MOST_ROWS}")
    discs = tuple(Disc(**_row(path, "disc", k, row, Disc)) for k, row in enumerate(content.get("disc", []), 1))
    shafts = tuple(Shaft(**_row(path, "shaft", k, row, Shaft)) for k, row in enumerate(content.get("shaft", []), 1))
    chain = Chain(discs, shafts)
    check_chain(str(path), chain, ends)
    return chain


def _table_content(path: str | Path, ends: tuple[str, ...]) -> dict[str, Any]:
    """Rows of a text table in the form that TOML gives, with numbers in SI by the units of their columns."""
    from cranktrain.core.text_header import named
    from cranktrain.core.text_rows import read_rows

    valid = (*DISC_COLUMNS, *SHAFT_COLUMNS)
    remedy = f"name the columns in the first line: {', '.join(valid)}"

    def check(names: Sequence[str]) -> None:
        columns = [_column(name) for name in names]
        for name, column in zip(names, columns, strict=True):
            if not column and name and get_close_matches(name.lower(), valid, n=1, cutoff=0.7):
                raise InputError(f"{path}: column '{name}' does not exist; {nearest(name.lower(), valid)}")
            if not column and name:
                warnings.warn(f"{path}: column '{name}' is none of a chain and is not read", stacklevel=6)
            if column and columns.count(column) > 1:
                raise InputError(f"{path}: column '{column}' is there {columns.count(column)} times; leave one of them")
        if "disc" not in columns:
            raise InputError(f"{path}: has no column 'disc'; {remedy}")

    table = read_rows(path, "table of discs and shafts", remedy, lambda word: bool(_column(named(word)[0])), check)
    columns = [_column(name) for name in table.names]
    stated = zip(table.names, columns, table.units, strict=True)
    scales = [_scale(f"{path}: column '{name}'", column, unit) for name, column, unit in stated]
    lines = []
    for number, cells in table.rows:
        where = f"{path}: line {number}"
        rows = zip(columns, cells, scales, strict=True)
        filled = {
            key: text if key in TEXTS else _numbers(where, key, text, table.dialect.number, scale)
            for key, text, scale in rows
            if key and text not in ("", "-", "--")
        }
        if filled:
            lines.append((where, filled))
    discs, shafts = list[dict[str, Any]](), list[dict[str, Any]]()
    for k, (where, values) in enumerate(lines):
        name = values.get("disc", "")
        disc = {DISC_COLUMNS[key]: value for key, value in values.items() if key in DISC_COLUMNS}
        if len(disc) > 1 or not (name in ends or any(row["name"] == name for row in discs)):
            discs.append(disc)
        shaft = {SHAFT_COLUMNS[key]: value for key, value in values.items() if key in SHAFT_COLUMNS}
        if not shaft:
            continue
        if "to" not in values and k + 1 == len(lines):
            raise InputError(f"{where}: the shaft of the last line has no end; name a disc in column 'to'")
        shafts.append({**shaft, "between": [name, values.get("to") or lines[k + 1][1].get("disc", "")]})
    return {"disc": discs, "shaft": shafts}


def _column(name: str) -> str:
    """Column of a table that a word names; empty if the word names no column."""
    from cranktrain.core.column_names import kind_of

    return name if name in COLUMNS else kind_of(name, COLUMNS)


def _scale(where: str, column: str, unit: str) -> float:
    """Factor of a column's unit to SI; ``InputError`` if the unit has another dimension."""
    if column in (*TEXTS, "") or not unit:
        return 1.0
    rule = key_rule(Disc, column) if column in ("inertia", "damping") else key_rule(Shaft, SHAFT_COLUMNS[column])
    found = known_factor(unit, rule.dimension)
    if found is None:
        raise InputError(
            f"{where}: unit '{unit}' does not measure its {rule.dimension}; use one of: "
            f"{', '.join(q.UNITS[rule.dimension])}"
        )
    return found.scale


def _numbers(
    where: str, key: str, text: str, number: Callable[[str], float], scale: float
) -> float | list[float]:  # fmt: skip
    """Number in a cell, or the numbers of a list with slashes, each read by ``number``."""
    listed = SHAFT_COLUMNS.get(key, "") in LISTS and "/" in text
    found = []
    for part in text.split("/") if listed else [text]:
        try:
            found.append(scale * number(part.strip()))
        except ValueError:
            raise InputError(f"{where}: {key} = '{part}' is not a number; write it with a decimal point") from None
    return found if listed else found[0]


def _row(path: str | Path, part: str, number: int, row: Any, kind: type) -> dict[str, Any]:
    """Values of one row of discs or shafts, each checked."""
    where, valid = f"{path}: {part} {number}", row_keys(kind)
    values: dict[str, Any] = {}
    if not isinstance(row, Mapping):
        raise InputError(f"{where}: {shown(row)} is not a table; write [[{part}]] before its keys")
    for key, value in row.items():
        if key not in valid:
            raise InputError(f"{where}: '{key}' does not exist; {nearest(key, valid)}")
        if key == "name":
            if not isinstance(value, str) or not value or value == GROUND:
                raise InputError(f"{where}: {shown(value)} cannot name a disc; give a text other than '{GROUND}'")
        elif key == "between":
            if not (isinstance(value, list) and len(value) == 2 and value[0] != value[1]):
                raise InputError(f'{where}: between = {shown(value)} is no pair of discs; write between = ["a", "b"]')
            value = tuple(value)
        elif kind is Shaft and key in LISTS and isinstance(value, list):
            value = tuple(_value(f"{where}: {key}[{k}]", key_rule(kind, key), one) for k, one in enumerate(value, 1))
        elif key in ("torques", "twists", "frequencies"):
            value = (_value(f"{where}: {key}", key_rule(kind, key), value),)
        else:
            value = _value(f"{where}: {key}", key_rule(kind, key), value)
            if key == "ratio" and value == 0.0:
                raise InputError(f"{where}: ratio = 0 turns nothing; give the speed of disc 2 over that of disc 1")
        values[key] = value
    needed, why = needed_of_shaft(values) if kind is Shaft else Needed(("name", "inertia"))
    if missing := [key for key in needed if key not in values]:
        keys, are, them = ("", "is", "it") if len(missing) == 1 else ("keys ", "are", "them")
        raise InputError(f"{where}: {keys}{', '.join(map(repr, missing))} {are} missing; {why or 'add'} {them}")
    if kind is Disc:
        return values
    ends = " to ".join(map(str, values["between"]))
    return element_values(f"{where} ({ends})", values)


def row_keys(kind: type) -> tuple[str, ...]:
    """Keys that a row of discs or shafts may have."""
    return tuple(SHAFT_COLUMNS.values()) if kind is Shaft else tuple(field.name for field in fields(kind))


def key_rule(kind: type, key: str) -> Any:
    """Quantity or valid names of the values under a key of a disc or shaft."""
    return TWIST if key == "twists" else kinds(kind)[key][2]


def _value(where: str, rule: Any, value: Any) -> Any:
    """Return one number or name after its check against ``rule``."""
    if not isinstance(rule, q.OneOf) and not is_number(value):
        raise InputError(f"{where} = {shown(value)} is not a number")
    if isinstance(rule, q.OneOf) and not isinstance(value, str):
        raise InputError(f"{where} = {shown(value)} is no {rule.noun}; {nearest('', rule.names)}")
    if wrong := rule.wrong(value):
        raise InputError(f"{where}: {wrong}")
    return value if isinstance(value, str) else float(value)


def check_chain(where: str, chain: Chain, ends: tuple[str, ...] = (GROUND,)) -> None:
    """Refuse duplicate discs, ends that are not discs, gears that block each other, and discs without connection."""
    start = chain.names[0] if ends == (GROUND,) and chain.discs else ends[0]
    if not chain.discs and ends == (GROUND,):
        raise InputError(f"{where}: has no disc; add [[disc]] rows")
    for name in chain.names:
        if chain.names.count(name) > 1:
            raise InputError(f"{where}: disc '{name}' is listed {chain.names.count(name)} times; name each once")
        if name in ends:
            raise InputError(f"{where}: '{name}' is an end of the drive line, which the engine has; rename it")
    for k, shaft in enumerate(chain.shafts, 1):
        for end in shaft.between:
            if end not in ends and end not in chain.names:
                raise InputError(f"{where}: shaft {k}: no disc '{end}'; {nearest(str(end), (*chain.names, *ends))}")
        held = shaft.loss_factor > 0.0 or shaft.damping > 0.0 or bool(set(ends) & set(shaft.between))
        if shaft.stiffness == 0.0 and held:
            raise InputError(
                f"{where}: shaft {k}: a rigid mesh joins two discs and has no damping; give it a stiffness"
            )
    reached, before = {start}, 0
    while len(reached) > before:
        before = len(reached)
        for shaft in chain.shafts:
            if reached & set(shaft.between):
                reached |= set(shaft.between)
    used = {end for shaft in chain.shafts for end in shaft.between}
    # A drive line without a shaft to the dynamometer has a free end, as at a propeller.
    wanted = chain.names if ends == (GROUND,) else (*chain.names, *(end for end in ends if end in used or end == start))
    lost = [name for name in wanted if name not in reached]
    if lost:
        disc = "disc " if lost[0] in chain.names else ""
        raise InputError(f"{where}: no shaft joins {disc}'{lost[0]}' to '{start}'; add one")
    coordinates(chain, where)


def gear_speeds(chain: Chain, where: str = "chain") -> dict[str, float]:
    """Speed ratios of all parts of a drive line to the flywheel; ``InputError`` if gears require two speeds at once."""
    speeds, before = {FLYWHEEL: 1.0}, 0
    while len(speeds) > before:
        before = len(speeds)
        for k, shaft in enumerate(chain.shafts, 1):
            one, two = shaft.between
            if one in speeds and two in speeds and not np.isclose(shaft.ratio * speeds[one], speeds[two], rtol=1e-9):
                raise InputError(
                    f"{where}: shaft {k}: gears turn '{two}' at {speeds[two]:g} and at {shaft.ratio * speeds[one]:g} "
                    "times the flywheel's speed, so the shafts would wind up; correct a ratio"
                )
            if one in speeds:
                speeds[two] = shaft.ratio * speeds[one]
            elif two in speeds:
                speeds[one] = speeds[two] / shaft.ratio
    return speeds


def coordinates(chain: Chain, where: str = "chain") -> Array:
    """Matrix (discs, n) of the discs' rotations in independent coordinates; rigid meshes eliminate the others."""
    # The rotation of every disc is a factor times the rotation of the leading disc of its group.
    leader, factor = list(range(len(chain.discs))), np.ones(len(chain.discs))
    for k, shaft in enumerate(chain.shafts, 1):
        if shaft.stiffness > 0.0:
            continue
        one, two = (chain.names.index(end) for end in shaft.between)
        if leader[one] == leader[two]:
            raise InputError(f"{where}: shaft {k}: rigid meshes form a ring; leave one out, or give one a stiffness")
        scale = shaft.ratio * factor[one] / factor[two]
        for disc in [disc for disc, of in enumerate(leader) if of == leader[two]]:
            factor[disc] *= scale
            leader[disc] = leader[one]
    kept = sorted(set(leader))
    return np.asarray(factor[:, None] * (np.array(leader)[:, None] == np.array(kept)[None, :]))
