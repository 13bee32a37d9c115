"""Register of output families: the outputs of a run, in order, and the lowest fidelity levels that model them.

A family is a kernel ``observe(model, work, state, members, out) -> 0`` that fills ``out``, the values of its members
one after the other, from the state alone. Its caller leaves in ``work`` the frame at the state (``frames[0]``), the
cylinder pressures (``pressures[0]``), the ports (``port[STATE_U]`` and the rows after it, ``port[RELATIVE]``) and the
components of terms; :func:`cranktrain.dynamics.outputs.laws.observe_law` calls a force law there.
Adding an output is one kernel, one row and its entry in ``modelDescription/interface.toml``.

Names do not depend on levels, because the FMU's description is fixed before levels are chosen. Values that a level does
not model are 0.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.build_mark import build_mark
from cranktrain.core.errors import InputError, nearest
from cranktrain.core.kernel import kernel_addresses
from cranktrain.core.named import Named, resolve
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.topology.tables import topology_outputs
from cranktrain.dynamics.topology.values import Topology
from cranktrain.engine.model import Engine

Need = Mapping[str, Any]
"""Lowest fidelity level of each kind that models an output; ``film`` excludes roller bearings."""


class Counts(NamedTuple):
    """Number of members of output families, by kind of member."""

    bearings: int
    cylinders: int
    mounts: int
    added: tuple[str, ...] = ()  # names of the outputs of added bodies and connections


@dataclass(frozen=True)
class Family:
    """Output family: outputs that one kernel fills.

    Attributes
    ----------
    name : first part of the outputs' names; empty if names are complete
    kernel : kernel that fills the outputs, or the name of its module and function
    outputs : rest of the outputs' names, in order, with the levels that each needs
    count : the entry of :class:`Counts` with the number of members; empty: one member, without number; if the entry
       holds names, these are the outputs
    units : units of outputs whose name does not imply them, see :func:`cranktrain.results.files.output_unit`
    unjudged : outputs that do not show how settled a run is: angles that grow or wrap, counts, parts of others
    """

    name: str
    kernel: Named
    outputs: Mapping[str, Need]
    count: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    unjudged: frozenset[str] = frozenset()

    def members(self, counts: Counts) -> int:
        """Number of members of this family."""
        found = getattr(counts, self.count) if self.count else 1
        return found if isinstance(found, int) else 1

    def size(self, counts: Counts) -> int:
        """Number of outputs of all members of this family."""
        return sum(1 for _ in self.names(counts))

    def names(self, counts: Counts) -> Iterator[tuple[str, Need]]:
        """Names of the outputs of this family, in order, and the fidelity levels that each output needs."""
        found = getattr(counts, self.count) if self.count else 1
        if not isinstance(found, int):
            yield from ((name, {}) for name in found)
            return
        for i in range(found):
            prefix = f"{self.name}[{i + 1}]." if self.count else f"{self.name}." if self.name else ""
            for name, need in self.outputs.items():
                yield prefix + name, need


FAMILIES: dict[str, Family] = {}


def register_family(family: Family) -> None:
    """Add a family at the end of the register."""
    FAMILIES[family.name or "crank"] = family


def output_counts(engine: Engine, more: Topology | None = None) -> Counts:
    """Numbers of members for an engine, with ``more`` bodies and connections in addition to those of its file."""
    mounts = len(engine.mounts.x) if engine.mounts is not None else 0
    return Counts(len(engine.crankshaft.main_widths), engine.n_cylinders, mounts, topology_outputs(engine, more))


def output_needs(counts: Counts) -> dict[str, Need]:
    """Names of all outputs, in order, and levels that each output needs; ``InputError`` if a name occurs twice."""
    found: dict[str, Need] = {}
    for family in FAMILIES.values():
        for name, need in family.names(counts):
            if name in found:
                raise InputError(f"there are two outputs '{name}'; give the body or connection another name")
            found[name] = need
    return found


def judged_families(counts: Counts) -> dict[str, list[str]]:
    """Outputs by which settling is judged, by family: name without number and axis, e.g. ``bearing.force``."""
    found: dict[str, list[str]] = {}
    for family in FAMILIES.values():
        for name, _ in family.names(counts):
            own = name.partition("].")[2] if family.count else name.removeprefix(f"{family.name}.")
            if own not in family.unjudged:
                found.setdefault(output_family(name), []).append(name)
    return found


def output_family(name: str) -> str:
    """Family of an output by which settling is judged: ``bearing.force`` of ``bearing[2].force.x``.

    Connections, which have names in place of numbers, are one family too, so that one with only rounding errors does
    not keep a run from being periodic.
    """
    return re.sub(r"\[([^][]|\[[^][]*\])*\]|\.[xyz]$", "", name)


def nearest_output(name: str, valid: Iterable[str]) -> str:
    """Hint for an unknown output name: the closest valid name, or that the run has no output of this family."""
    names = list(valid)
    own = [one for one in names if output_family(one) == output_family(name)]
    family = FAMILIES.get(name.partition("[")[0])
    if not own and family is not None and family.count and name.partition("].")[2] in family.outputs:
        return f"the engine of this run has no {family.count}"
    return nearest(name, own or names)


def output_names(counts: Counts) -> tuple[str, ...]:
    """Names of all outputs, in order; the FMU's variables carry the same names."""
    return tuple(output_needs(counts))


class Outputs(NamedTuple):
    """Outputs of a run and the kernels that fill them."""

    families: NDArray[np.int64]  # (f, COLUMNS) see dynamics.run_record
    values: Array  # (outputs,) value of each output
    build: NDArray[np.void]  # (0,) see core.build_mark


def observers(counts: Counts, model: Any, work: Any, state: Array, values: Array) -> Outputs:
    """Table of the kernels that fill the ``values`` of all outputs of a model; compiles the kernels."""
    rows, first = [], 0
    kernels = [resolve(family.kernel) for family in FAMILIES.values()]
    addresses = kernel_addresses(kernels, model, work, state, 0, state)
    for family, address in zip(FAMILIES.values(), addresses, strict=True):
        members = family.members(counts)
        end = first + family.size(counts)
        rows.append([address, first, end, members, 1])
        first = end
    return Outputs(np.array(rows, dtype=np.int64), values, build_mark())


def families_of(counts: Counts) -> list[tuple[int, ...]]:
    """For each output, in order: rows of the families that must be observed."""
    return [(row,) for row, family in enumerate(FAMILIES.values()) for _ in range(family.size(counts))]


_TWISTS = {"crank": "torsional"}
_BENDS = {"crank": "beam", "bearings": "linear"}
_LOADED = {"bearings": "linear"}
_GAP = {"bearings": "impedance"}
_FILM = {"bearings": "impedance", "film": True}
_TILTS = {"crank": "beam", "bearings": "table"}
_SHAKES = {"bearings": "linear", "block": "flexible"}
_GUIDED = {"pistons": "guided"}
_FLOATS = {"big_ends": "impedance"}
_DAMPED = {"crank": "torsional", "damper": "fitted"}
_HERE = "cranktrain.dynamics.outputs"

for _family in (
    Family(
        "",
        f"{_HERE}.crank:observe_crank",
        {
            "crank.angle": {},
            "crank.angle_cycle": {},
            "crank.angle_next": {},
            "crank.speed": {},
            "crank.irregularity": {},
            "frame.speed": {},
            "pulley.torsion": _TWISTS,
            "pulley.axial": _BENDS,
            "pulley.speed": _TWISTS,
            "flywheel.torsion": {},
            "flywheel.speed": {},
            "shaft.torque": {},
        },
        units={"crank.angle_cycle": "rad", "crank.angle_next": "rad", "crank.irregularity": "1"},
        unjudged=frozenset(
            {"crank.angle", "crank.angle_cycle", "crank.angle_next", "crank.irregularity", "frame.speed"}
            | {"pulley.speed", "flywheel.speed"}  # these are rates of outputs that are judged
        ),
    ),
    Family(
        "bearing",
        f"{_HERE}.bearings:observe_bearings",
        {
            "force.x": _LOADED,
            "force.y": _LOADED,
            "eccentricity": _GAP,
            "film_thickness_min": _FILM,
            "pressure_max": _FILM,
            "friction_torque": _FILM,
            "oil_flow": _FILM,
            "tilt": _TILTS,
            "moment.x": _TILTS,
            "moment.y": _TILTS,
            "position.x": _LOADED,
            "position.y": _LOADED,
            "velocity.x": _LOADED,
            "velocity.y": _LOADED,
            "velocity.effective": _GAP,
            "speed.relative": _LOADED,
            "speed.gap": _FILM,
            "speed.effective": _FILM,
            "gap.angle": _FILM,
            "gap.side": _FILM,
            "gap.rate": _FILM,
        },
        "bearings",
        unjudged=frozenset({"gap.angle", "gap.side", "gap.rate"}),
    ),
    Family("thrust", f"{_HERE}.bearings:observe_thrust", {"force": _BENDS, "displacement": _BENDS}),
    Family(
        "axial",
        f"{_HERE}.crank:observe_axial",
        {"engine": _SHAKES, "bearing": _BENDS, "crank": _BENDS},
        units={"axial.engine": "m", "axial.bearing": "m", "axial.crank": "m"},
        unjudged=frozenset({"engine", "bearing", "crank"}),  # these are parts of an output that is judged
    ),
    Family(
        "axial_path",
        f"{_HERE}.crank:observe_axial_path",
        {"force": _BENDS, "slip": _BENDS},
        units={"axial_path.slip": "m"},
        unjudged=frozenset({"slip"}),  # a spline may creep from cycle to cycle
    ),
    Family(
        "cylinder",
        f"{_HERE}.cylinders:observe_cylinders",
        {
            "volume": {},
            "volume_rate": {},
            "volume_deviation": {},
            "volume_deviation_rate": {},
            "piston_position": {},
            "angle": {},
        },
        "cylinders",
        units={"volume_rate": "m^3/s", "volume_deviation": "m^3", "volume_deviation_rate": "m^3/s", "angle": "rad"},
        unjudged=frozenset({"volume_rate", "volume_deviation", "volume_deviation_rate", "angle"}),
    ),
    Family(
        "big_end",
        f"{_HERE}.bearings:observe_big_ends",
        {
            "force.x": {},
            "force.y": {},
            "position.x": _FLOATS,
            "position.y": _FLOATS,
            "eccentricity": _FLOATS,
            "film_thickness_min": _FLOATS,
            "pressure_max": _FLOATS,
            "friction_torque": _FLOATS,
            "oil_flow": _FLOATS,
        },
        "cylinders",
    ),
    Family(
        "piston",
        f"{_HERE}.cylinders:observe_pistons",
        {"lateral": _GUIDED, "tilt": _GUIDED, "side_force": {}, "friction": {}},
        "cylinders",
    ),
    Family(
        "mount",
        f"{_HERE}.whole_engine:observe_mounts",
        {f"{kind}.{axis}": _SHAKES for kind in ("force", "moment") for axis in "xyz"},
        "mounts",
    ),
    Family(
        "engine",
        f"{_HERE}.whole_engine:observe_block",
        {f"{kind}.{axis}": _SHAKES for kind in ("position", "rotation") for axis in "xyz"},
    ),
    Family("cover", f"{_HERE}.whole_engine:observe_cover", {"acceleration": _SHAKES}),
    Family(
        "damper",
        f"{_HERE}.whole_engine:observe_damper",
        {"torque": _DAMPED, "heat": _DAMPED, "twist": _DAMPED, "temperature": _DAMPED},
        unjudged=frozenset({"twist"}),  # a ring in its fluid may slip from cycle to cycle
    ),
    Family("added", f"{_HERE}.links:observe_links", {}, "added"),
    Family(
        "torque",
        f"{_HERE}.crank:observe_torques",
        {"indicated": {}, "friction": _FILM, "brake": {}},
        units={f"torque.{name}": "N m" for name in ("indicated", "friction", "brake")},
        unjudged=frozenset({"indicated", "friction", "brake"}),  # these are made of outputs that are judged
    ),
    Family("gas", f"{_HERE}.crank:observe_gas", {"work": {}}, units={"gas.work": "J"}, unjudged=frozenset({"work"})),
    Family(
        "solver",
        f"{_HERE}.crank:observe_solver",
        {"residual": {}, "substeps": {}, "iterations": {}, "online_films": {}, "limited": {}},
        unjudged=frozenset({"residual", "substeps", "iterations", "online_films", "limited"}),
    ),
):
    register_family(_family)
