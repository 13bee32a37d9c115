"""A torsional system from a table: discs, shafts between them, gears, branches and ground.

    [[disc]]                          [[shaft]]
    name = "flywheel"                 between = ["main[7]", "flywheel"]
    inertia = 0.87      # kg m2       stiffness = 1.9e6    # N m/rad
    damping = 0.0       # N m s/rad   damping = 2.0        # N m s/rad
                                      loss_factor = 0.0
                                      ratio = 1.0

A disc's ``damping`` is absolute, a shaft's is relative. ``ratio`` is the ratio of a gear at the shaft's first end: the
shaft twists by ratio θ₁ − θ₂ and loads disc 1 by ratio times its torque. A shaft without ``stiffness`` is a rigid gear
mesh, θ₂ = ratio θ₁, and disc 2 has no coordinate of its own. ``"ground"`` in place of a disc is at rest.

The same as CSV, one line a disc and the shaft that leaves it, to the disc of the next line or to ``to``:

    disc,inertia,damping,to,stiffness,shaft_damping,loss_factor,ratio
    main[7],0.02,0,,1.9e6,2.0,,
    flywheel,0.87,0,,,,,

A line has a shaft if one of the shaft's columns is filled. A disc with several shafts has several lines, with its
inertia on the first. An end that is not a disc is written in the same way, without inertia.

In place of a crank a chain is taken by :mod:`cranktrain.structure.crank.chain`. As drive line behind the flywheel, see
:mod:`cranktrain.loads.torsional_line`, it ends at ``flywheel`` and ``dynamometer``, which are no discs of the table.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, fields
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, nearest, shown
from cranktrain.core.reduced_body import Array
from cranktrain.core.user_file import is_number, read_text, read_toml
from cranktrain.engine import quantities as q
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
    "loss_factor": "loss_factor",
    "ratio": "ratio",
}
"""Columns of a CSV table for a shaft, and the corresponding keys."""
DISC_COLUMNS = {"disc": "name", "inertia": "inertia", "damping": "damping"}


@dataclass(frozen=True)
class Disc:
    """One row of discs: kg m², N m s/rad."""

    name: str
    inertia: q.Inertia
    damping: q.TorsionalDamping = 0.0


@dataclass(frozen=True)
class Shaft:
    """One row of shafts: N m/rad, N m s/rad; without stiffness a rigid mesh of gears."""

    between: tuple[str, str]
    stiffness: q.TorsionalStiffness = 0.0
    damping: q.TorsionalDamping = 0.0
    loss_factor: q.Hysteresis = 0.0
    ratio: q.GearRatio = 1.0


@dataclass(frozen=True)
class Chain:
    """The table."""

    discs: tuple[Disc, ...]
    shafts: tuple[Shaft, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the discs, in order."""
        return tuple(disc.name for disc in self.discs)


@dataclass(frozen=True)
class DriveLineChain:
    """Drive line of discs and shafts in place of the connecting shaft, see :mod:`cranktrain.loads.torsional_line`.

    One entry a disc, and one a shaft from ``starts`` to ``ends``: names of discs, ``flywheel`` or ``dynamometer``. A
    ``stiffnesses`` of 0 is a rigid mesh of gears. What is not given of the shafts is 0, of the gears 1.
    """

    starts: tuple[str, ...]
    ends: tuple[str, ...]
    stiffnesses: tuple[q.SupportTorsionalStiffness, ...]
    discs: tuple[str, ...] = ()
    inertias: tuple[q.Inertia, ...] = ()
    disc_dampings: tuple[q.TorsionalDamping, ...] = ()
    dampings: tuple[q.TorsionalDamping, ...] = ()
    loss_factors: tuple[q.Hysteresis, ...] = ()
    ratios: tuple[q.GearRatio, ...] = ()

    @classmethod
    def of(cls, chain: Chain) -> DriveLineChain:
        """The drive line of a table."""
        discs, shafts = chain.discs, chain.shafts
        return cls(
            tuple(shaft.between[0] for shaft in shafts), tuple(shaft.between[1] for shaft in shafts),
            tuple(shaft.stiffness for shaft in shafts),
            chain.names, tuple(disc.inertia for disc in discs), tuple(disc.damping for disc in discs),
            tuple(shaft.damping for shaft in shafts), tuple(shaft.loss_factor for shaft in shafts),
            tuple(shaft.ratio for shaft in shafts),
        )  # fmt: skip

    @property
    def chain(self) -> Chain:
        """As rows of discs and shafts."""
        d, s = len(self.discs), len(self.starts)
        discs = zip(self.discs, self.inertias, self.disc_dampings or d * (0.0,), strict=True)
        shafts = zip(
            zip(self.starts, self.ends, strict=True), self.stiffnesses, self.dampings or s * (0.0,),
            self.loss_factors or s * (0.0,), self.ratios or s * (1.0,), strict=True,
        )  # fmt: skip
        return Chain(tuple(Disc(*row) for row in discs), tuple(Shaft(*row) for row in shafts))


def is_chain(path: str | Path) -> bool:
    """Whether a file is a table of discs."""
    try:
        if Path(path).suffix == ".csv":
            return read_text(path, "chain", "").startswith("disc")
        return Path(path).suffix == ".toml" and "disc" in read_toml(path, "chain", "")
    except InputError:
        return False


def read_chain(path: str | Path, ends: tuple[str, ...] = (GROUND,)) -> Chain:
    """The table in a TOML or CSV file; ``InputError`` where it cannot be read, or describes no system.

    ``ends`` are what shafts may end at besides discs.
    """
    what, mend = "table of discs and shafts", "give a table of [[disc]] and [[shaft]]"
    if Path(path).suffix == ".csv":
        try:
            content = _csv_content(path, read_text(path, what, "give a table of discs as CSV"), ends)
        except csv.Error as error:
            raise InputError(f"{path}: not a CSV file: {error}; separate entries by commas") from None
    else:
        content = read_toml(path, what, mend)
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


def _csv_content(path: str | Path, text: str, ends: tuple[str, ...]) -> dict[str, Any]:
    """Rows of a CSV table as TOML would give them."""
    reader = csv.DictReader(StringIO(text), skipinitialspace=True, strict=True)
    columns = [name.strip() for name in reader.fieldnames or ()]
    valid = (*DISC_COLUMNS, *SHAFT_COLUMNS)
    for name in columns:
        if name not in valid:
            raise InputError(f"{path}: column '{name}' does not exist; {nearest(name, valid)}")
    if "disc" not in columns:
        raise InputError(f"{path}: has no column 'disc'; name the columns in the first line: {', '.join(valid)}")
    reader.fieldnames = columns
    lines = []
    for line in reader:
        where = f"{path}: line {reader.line_num}"
        if None in line:
            raise InputError(f"{where}: has more entries than there are columns; take commas out of names")
        if any(filled := {key: text.strip() for key, text in line.items() if text and text.strip()}):
            lines.append((where, filled))
    discs, shafts = list[dict[str, Any]](), list[dict[str, Any]]()
    for k, (where, filled) in enumerate(lines):
        name = filled.get("disc", "")
        values = {key: text if key in ("disc", "to") else _number(where, key, text) for key, text in filled.items()}
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


def _number(where: str, key: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{where}: {key} = '{text}' is not a number; write it with a decimal point") from None


def _row(path: str | Path, part: str, number: int, row: Any, kind: type) -> dict[str, Any]:
    """Values of one row, checked one by one."""
    where, valid = f"{path}: {part} {number}", tuple(field.name for field in fields(kind))
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
        else:
            if not is_number(value):
                raise InputError(f"{where}: {key} = {shown(value)} is not a number")
            if wrong := kinds(kind)[key][2].wrong(value):
                raise InputError(f"{where}: {key}: {wrong}")
            if key == "ratio" and value == 0.0:
                raise InputError(f"{where}: ratio = 0 turns nothing; give the speed of disc 2 over that of disc 1")
            value = float(value)
        values[key] = value
    for key in ("name", "inertia") if kind is Disc else ("between",):
        if key not in values:
            raise InputError(f"{where}: '{key}' is missing; add it")
    return values


def check_chain(where: str, chain: Chain, ends: tuple[str, ...] = (GROUND,)) -> None:
    """Refuse discs of one name, ends that are no discs, gears that hold each other, and discs that nothing joins."""
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
    wanted = chain.names if ends == (GROUND,) else (*chain.names, *ends)
    lost = [name for name in wanted if name not in reached]
    if lost:
        disc = "disc " if lost[0] in chain.names else ""
        raise InputError(f"{where}: no shaft joins {disc}'{lost[0]}' to '{start}'; add one")
    coordinates(chain, where)


def gear_speeds(chain: Chain, where: str = "chain") -> dict[str, float]:
    """Speeds over the flywheel's of all that a drive line joins; ``InputError`` where gears ask for two at once."""
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


def read_drive_line(path: str | Path) -> DriveLineChain:
    """The drive line in a table; ``InputError`` where it cannot be read or joins flywheel and dynamometer not."""
    chain = read_chain(path, LINE_ENDS)
    gear_speeds(chain, str(path))
    return DriveLineChain.of(chain)


def coordinates(chain: Chain, where: str = "chain") -> Array:
    """Rotations (discs, n) of the discs by the independent coordinates (rigid meshes eliminate the others)."""
    # Every disc turns by a factor times the leader of its group.
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
