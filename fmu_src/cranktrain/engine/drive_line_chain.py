"""Drive line of discs and shafts behind the flywheel, as an engine stores it: one list per column."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.engine import quantities as q
from cranktrain.engine.additions import ConnectionTable
from cranktrain.engine.connections import Coupling
from cranktrain.engine.line_elements import torque_curve
from cranktrain.engine.torsional_chain import (
    FLYWHEEL,
    LINE_ENDS,
    Chain,
    Disc,
    Shaft,
    coordinates,
    gear_speeds,
    read_chain,
)

FURTHER = {
    "frequency": "frequencies",
    "friction": "frictions",
    "slip_speed": "slip_speeds",
    "diameter": "diameters",
    "bore": "bores",
    "strength": "strengths",
    "section": "sections",
}
"""Fields of a shaft that are optional columns of a drive line, with the columns' names."""
POINTS = ("torques", "frequencies", "stiffnesses", "dampings")


def _further_columns(shafts: tuple[Shaft, ...]) -> dict[str, tuple[Any, ...]]:
    """Optional columns of a drive line: all data of shafts except stiffness, damping, loss factor and ratio."""
    found: dict[str, tuple[Any, ...]] = {}
    counts = [len(shaft.stiffnesses) for shaft in shafts]
    if any(counts):
        found["point_shafts"] = tuple(k for k, count in enumerate(counts, 1) for _ in range(count))
        for key in POINTS:
            columns = [getattr(shaft, key) or (0.0,) * n for shaft, n in zip(shafts, counts, strict=True)]
            if any(getattr(shaft, key) for shaft in shafts):
                found[f"point_{key}"] = tuple(value for column in columns for value in column)
    for key, name in FURTHER.items():
        column = tuple(getattr(shaft, key) for shaft in shafts)
        if any(value != getattr(Shaft(("", "")), key) for value in column):
            found[name] = column
    return found


@dataclass(frozen=True)
class DriveLineChain:
    """Drive line of discs and shafts in place of the connecting shaft, see :mod:`cranktrain.loads.torsional_line`.

    There is one entry per disc, and one per shaft from ``starts`` to ``ends``, which are names of discs, ``flywheel``
    or ``dynamometer``. A stiffness of 0 is a rigid gear mesh. Values of shafts that are not given are 0, ratios 1.

    ``point_shafts`` are the numbers (from 1) of shafts whose stiffness depends on torque, or stiffness and damping on
    frequency. There is one entry per point, with ``point_stiffnesses`` and either ``point_torques`` or
    ``point_frequencies`` and ``point_dampings``. The other columns are those of :class:`Shaft`.
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
    point_shafts: tuple[q.ShaftNumber, ...] = ()
    point_torques: tuple[q.Torque, ...] = ()
    point_frequencies: tuple[q.Frequency, ...] = ()
    point_stiffnesses: tuple[q.TorsionalStiffness, ...] = ()
    point_dampings: tuple[q.TorsionalDamping, ...] = ()
    frequencies: tuple[q.Frequency, ...] = ()
    frictions: tuple[q.FrictionTorque, ...] = ()
    slip_speeds: tuple[q.SlipSpeed, ...] = ()
    diameters: tuple[q.AddedLength, ...] = ()
    bores: tuple[q.AddedLength, ...] = ()
    strengths: tuple[q.ShaftStrength, ...] = ()
    sections: tuple[q.ShaftSection, ...] = ()

    @classmethod
    def of(cls, chain: Chain) -> "DriveLineChain":
        """Drive line from a table of discs and shafts."""
        discs, shafts = chain.discs, chain.shafts
        return cls(
            tuple(shaft.between[0] for shaft in shafts), tuple(shaft.between[1] for shaft in shafts),
            tuple(shaft.stiffness for shaft in shafts),
            chain.names, tuple(disc.inertia for disc in discs), tuple(disc.damping for disc in discs),
            tuple(shaft.damping for shaft in shafts), tuple(shaft.loss_factor for shaft in shafts),
            tuple(shaft.ratio for shaft in shafts), **_further_columns(shafts),
        )  # fmt: skip

    @property
    def chain(self) -> Chain:
        """The drive line as rows of discs and shafts."""
        d, s = len(self.discs), len(self.starts)
        discs = zip(self.discs, self.inertias, self.disc_dampings or d * (0.0,), strict=True)
        shafts = zip(
            zip(self.starts, self.ends, strict=True), self.stiffnesses, self.dampings or s * (0.0,),
            self.loss_factors or s * (0.0,), self.ratios or s * (1.0,), strict=True,
        )  # fmt: skip
        further = [self._further(k) for k in range(s)]
        return Chain(
            tuple(Disc(*row) for row in discs),
            tuple(Shaft(*row, **more) for row, more in zip(shafts, further, strict=True)),
        )

    def _further(self, shaft: int) -> dict[str, Any]:
        """Fields of shaft number ``shaft`` (from 0) that a linear shaft does not have."""
        points = [k for k, number in enumerate(self.point_shafts) if number == shaft + 1]
        columns = {
            "torques": self.point_torques, "frequencies": self.point_frequencies,
            "stiffnesses": self.point_stiffnesses, "dampings": self.point_dampings,
        }  # fmt: skip
        found = {key: tuple(column[k] for k in points) for key, column in columns.items() if column and points}
        # A column that only other shafts need is zero for this shaft.
        idle = ("torques",) if any(found.get("frequencies", ())) else ("frequencies", "dampings")
        found = {key: values for key, values in found.items() if key not in idle}
        own = {key: column[shaft] for key, name in FURTHER.items() if (column := getattr(self, name))}
        return found | own


def line_connections(line: DriveLineChain, start: str) -> tuple[ConnectionTable, ...]:
    """Couplings for the nonlinear part of shafts in the time domain: torque beyond the linear stiffness, and friction.

    ``start`` is the end on which the line begins. ``InputError`` if such a shaft is not between the flywheel and discs
    at crank speed.
    """
    chain, found = line.chain, []
    speeds, names = gear_speeds(chain), chain.names
    leaders = {names[int(np.flatnonzero(column)[0])] for column in coordinates(chain).T}
    for number, shaft in enumerate(chain.shafts, 1):
        if not shaft.bends_the_line:
            continue
        for end in shaft.between:
            if end != FLYWHEEL and not (end in leaders and speeds[end] == 1.0 and shaft.ratio == 1.0):
                raise InputError(
                    f"drive line: shaft {number} has stiffness over torque or friction, and its end '{end}' is no disc "
                    "that turns as the crank does; in time place it between flywheel and such discs, before gears and "
                    "the dynamometer, or take --method"
                )
        twists = torques = ()
        if shaft.torques:
            at, curve = torque_curve(shaft)
            twists, torques = tuple(at.tolist()), tuple((curve - shaft.stiffness * at).tolist())
        own = Coupling(twists=twists, torques=torques, friction=shaft.friction, slip_speed=shaft.slip_speed)
        ends = tuple(start if end == FLYWHEEL else f"crank.line[{end}]" for end in shaft.between)
        found.append(ConnectionTable(f"line[{number}]", "coupling", ends, coupling=own))
    return tuple(found)


def read_drive_line(path: str | Path) -> DriveLineChain:
    """Drive line from a table file; ``InputError`` if the file cannot be read or does not begin at a flywheel."""
    chain = read_chain(path, LINE_ENDS)
    gear_speeds(chain, str(path))
    return DriveLineChain.of(chain)
