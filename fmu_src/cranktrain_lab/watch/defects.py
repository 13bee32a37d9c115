"""Defects that a watch considers, as changes of an engine and its gas pressures with a severity.

A severity of 0 is the healthy engine. Severity s means

    misfire of a cylinder     its burn times 1 − s (1: compression and expansion only)
    thinner damper fluid      viscosity times 1 − s; damping of a linear damper likewise
    seizing damper ring       viscosity over 1 − s
    cracked damper springs    stiffness times 1 − s, rubber likewise
    softer shaft or coupling  stiffness of the connecting shaft, or of one shaft of the drive line, times 1 − s

Two harmless changes look similar to defects: another load (of all cylinders) and another zero of the encoder. They are
evaluated together with the defects.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Damper
from cranktrain.loads.gas_pressure import GasTrace

MISFIRE, DAMPER, SHAFT, LOAD, ZERO = "misfire", "damper", "shaft", "load", "zero"
"""Kinds of defects and harmless changes."""
MISFIRES = (0.5, 1.0)
LOSSES = (0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.97)
"""Severities at which a defect's signature is computed. Between them signatures are interpolated."""
LOADS = (0.25, 0.5, 1.0)
ANGLES = (0.01, 0.05)
"""Shifts of an encoder's zero at which the signature is computed, rad."""


class Case(NamedTuple):
    """Engine in one state (healthy or with a defect), with gas pressures and shift of the encoder's zero, rad."""

    engine: Engine
    gas: GasTrace
    zero: float = 0.0


@dataclass(frozen=True)
class Defect:
    """Defect or harmless change that a watch considers.

    Attributes
    ----------
    key : name, such as ``misfire[3]``
    words : description for reports
    kind : one of the kinds of this module
    severities : increasing severities at which the signature is computed
    of : function (case, severity) → case with this change
    """

    key: str
    words: str
    kind: str
    severities: Sequence[float]
    of: Callable[[Case, float], Case]

    @property
    def harmless(self) -> bool:
        """True for a change that is not a defect: another load or zero."""
        return self.kind in (LOAD, ZERO)


def defects_of(engine: Engine, damper: bool) -> tuple[Defect, ...]:
    """Return all defects and harmless changes that an engine can have; ``damper``: True if a damper is fitted."""
    found = [
        Defect(f"{MISFIRE}[{k + 1}]", f"misfire of cylinder {k + 1}", MISFIRE, MISFIRES, partial(_misfire, k))
        for k in range(engine.n_cylinders)
    ]
    if damper and engine.damper is not None:
        found += _of_damper(engine.damper)
    found += _of_shafts(engine)
    found += [
        Defect("load-", "less load", LOAD, LOADS, partial(_load, -1.0)),
        Defect("load+", "more load", LOAD, LOADS[:2], partial(_load, 1.0)),
        Defect("zero-", "encoder zero behind", ZERO, ANGLES, partial(_turned, -1.0)),
        Defect("zero+", "encoder zero ahead", ZERO, ANGLES, partial(_turned, 1.0)),
    ]
    return tuple(found)


def with_misfire(engine: Engine, gas: GasTrace, cylinder: int, severity: float) -> GasTrace:
    """Return pressures with a burn of ``1 − severity`` in one cylinder, counted from 0."""
    own = list(gas.own) or [gas] * engine.n_cylinders
    one = own[cylinder]
    own[cylinder] = replace(one, fired=one.fired - severity * (one.fired - one.motored))
    mean = GasTrace.mean(own, [1.0 / len(own)] * len(own), gas.source)
    return replace(mean, own=tuple(own))


def _misfire(cylinder: int, case: Case, severity: float) -> Case:
    return case._replace(gas=with_misfire(case.engine, case.gas, cylinder, severity))


def _load(sign: float, case: Case, severity: float) -> Case:
    def burnt(one: GasTrace) -> GasTrace:
        own = tuple(burnt(trace) for trace in one.own)
        return replace(one, fired=one.fired + sign * severity * (one.fired - one.motored), own=own)

    return case._replace(gas=burnt(case.gas))


def _turned(sign: float, case: Case, severity: float) -> Case:
    return case._replace(zero=case.zero + sign * severity)


def _of_damper(damper: Damper) -> list[Defect]:
    def part(key: str, words: str, change: Callable[[Damper, float], Damper]) -> Defect:
        def changed(case: Case, severity: float) -> Case:
            own = case.engine.damper
            assert own is not None
            return case._replace(engine=replace(case.engine, damper=change(own, severity)))

        return Defect(key, words, DAMPER, LOSSES, changed)

    if damper.kind == "viscous":
        return [
            part("damper.viscosity-", "damper fluid thinner", lambda d, s: replace(d, viscosity=d.viscosity * (1 - s))),
            part("damper.viscosity+", "damper ring seizing", lambda d, s: replace(d, viscosity=d.viscosity / (1 - s))),
        ]

    def less(own: Damper, severity: float, name: str, names: str) -> Damper:
        rest = 1.0 - severity
        lower = {name: rest * getattr(own, name), names: tuple(rest * one for one in getattr(own, names))}
        return replace(own, **lower)

    return [
        part(f"damper.{name}-", words, partial(less, name=name, names=names))
        for name, names, words in (
            ("stiffness", "stiffnesses", "damper springs cracked"),
            ("damping", "dampings", "damper without its damping"),
        )
        if getattr(damper, name) > 0.0 or any(getattr(damper, names))
    ]


def _of_shafts(engine: Engine) -> list[Defect]:
    line = engine.drive_line_chain
    if line is None:

        def softer(case: Case, severity: float) -> Case:
            own = case.engine.drive_line
            own = replace(own, stiffness=(1.0 - severity) * own.stiffness)
            return case._replace(engine=replace(case.engine, drive_line=own))

        return [Defect("drive_line.stiffness-", "connecting shaft softer", SHAFT, LOSSES, softer)]
    return [
        Defect(
            f"drive_line_chain.stiffnesses[{k + 1}]-", f"springs {a} to {b} cracked", SHAFT, LOSSES, partial(_softer, k)
        )
        for k, (a, b, stiffness) in enumerate(zip(line.starts, line.ends, line.stiffnesses, strict=True))
        if stiffness > 0.0 or k + 1 in line.point_shafts
    ]


def _softer(shaft: int, case: Case, severity: float) -> Case:
    """Return the case with reduced stiffness (or its curve) of a drive-line shaft, counted from 0."""
    line, rest = case.engine.drive_line_chain, 1.0 - severity
    assert line is not None
    own = tuple(rest * k if i == shaft else k for i, k in enumerate(line.stiffnesses))
    points = tuple(
        rest * k if number == shaft + 1 else k
        for number, k in zip(line.point_shafts, line.point_stiffnesses, strict=True)
    )
    changed = replace(line, stiffnesses=own, point_stiffnesses=points)
    return case._replace(engine=replace(case.engine, drive_line_chain=changed))
