"""Bearings of a model behind one address: the data of their law from its row in the register, its kernel compiled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import keep_record, kernel_address
from cranktrain.core.named import resolve
from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import AxialPath, JournalBearing, Oil, PlainBearing, ThrustBearing
from cranktrain.film.laws.axial_joint import REMEMBERED
from cranktrain.film.laws.films import CLOSES, CONTACT, MEMORY, SIZE, TOGETHER, VISCOUS, Films, no_films
from cranktrain.film.laws.parabolic import film_geometry
from cranktrain.film.laws.register import AXIAL_JOINT, BIG_END, ROLLER, THRUST, Law

_MISSING = {
    "table": "a film table of L/D {ratio:.4g}; make it by film-table",
    "big_end_table": "a film table of L/D {ratio:.4g}; make it by film-table",
    "bore": "the bore's compliance; make it by structure.saddle",
    "big_end_bore": "the compliance of the rods' eyes; make it by structure.rod.eye",
}
"""How to come by a part that is missing."""


@dataclass(frozen=True)
class Bearings:
    """Input from which the data of a law are made.

    Attributes
    ----------
    parameters : (b, COLUMNS) of each bearing, see :mod:`cranktrain.film.laws.parameters`
    plain : the plain bearing; all bearings are equal except for their viscosity
    rollers : or the roller bearings
    parts : film table or elastic bore, by the names that the law's row gives
    solved : (1,) where the law counts films that lie outside their table
    oil : dependence of viscosity and density on pressure, for laws that use it
    """

    parameters: Array
    plain: Any = None  # PlainBearing
    rollers: Any = None  # RollerBearings
    parts: Mapping[str, Any] = field(default_factory=dict)
    solved: Array = field(default_factory=lambda: np.zeros(1))
    oil: Oil | None = None


def bearing_parameters(bearing: PlainBearing, viscosity: float) -> Array:
    """Pack one plain bearing for the kernels, (COLUMNS,)."""
    c, kappa2, factor = film_geometry(bearing.diameter, bearing.width, bearing.clearance, viscosity)
    load = 0.5 * bearing.contact_pressure * bearing.width * bearing.diameter
    linear = [0.0] * 4
    if isinstance(bearing, JournalBearing):
        linear = [*bearing.ground_stiffness, bearing.damping_x, bearing.damping_y]
    row = [c, kappa2, factor, bearing.contact_height, load, *linear, 0.5 * bearing.diameter, bearing.width, viscosity]
    return np.array([*row, *bearing.relief])


def law_films(law: Law, kind: str, bearings: Bearings) -> Films:
    """Bearings of one kind by a law; compiles its kernel.

    Raises
    ------
    InputError
        where the law lacks a part that it needs, or the table belongs to another bearing
    """
    films = no_films(len(bearings.parameters))
    enter_law(films, range(len(bearings.parameters)), law, kind, bearings)
    return films._replace(solved=bearings.solved)


def enter_law(films: Films, which: Sequence[int], law: Law, kind: str, bearings: Bearings) -> None:
    """Let the bearings ``which`` of ``films`` follow a law; errors as above.

    The data of rollers have a row for each of ``which``, those of films one for each of ``films``.
    """
    form = law.forms[kind]
    what = f"{'big-end' if kind == BIG_END else 'bearing'} level '{law.name}'"
    if not form.kernel:
        return
    if kind == ROLLER and bearings.rollers is None:
        raise InputError(f"{what} needs [main_roller] in the engine file; add it, or take a film")
    if kind != ROLLER and bearings.plain is None:
        raise InputError(f"{what} needs [main_bearing], which the engine file lacks; take level roller or linear")
    for part in form.parts:
        if bearings.parts.get(part) is None:
            ratio = bearings.plain.width / bearings.plain.diameter if bearings.plain else 0.0
            raise InputError(f"{what} needs {_MISSING.get(part, part).format(ratio=ratio)}")
    record = resolve(form.record)(bearings)
    remembered = resolve(form.memory)(record) if form.memory else 0.0
    for i in which:
        films.traits[i, [CLOSES, CONTACT, VISCOUS, MEMORY]] = form.closes, form.contact, form.viscous, remembered
        films.traits[i, TOGETHER] = form.together
    enter(films, resolve(form.kernel), record, which)
    if kind == ROLLER:
        films.entry[list(which), 2] = range(len(which))


def thrust_bearing(thrust: ThrustBearing, viscosity: float, clearance: bool, tilt: bool) -> Films:
    """The thrust bearing of a model whose main bearings have ``clearance`` and feel ``tilt``, or not.

    Without clearance it is a spring and damper along the axis: a closed ring of pads would resist tilt as no real one
    with play does.
    """
    films = no_films(1)
    films.traits[0, CLOSES] = clearance
    form = THRUST["closed" if not clearance else "tilting" if tilt else "axial"]
    films.traits[0, VISCOUS] = form.viscous
    return enter(films, resolve(form.kernel), resolve(form.record)(thrust, viscosity))


def axial_joint_film(path: AxialPath) -> Films:
    """The drive line's axial joint behind one address."""
    films = no_films(1)
    films.traits[0, MEMORY] = REMEMBERED
    return enter(films, resolve(AXIAL_JOINT.kernel), resolve(AXIAL_JOINT.record)(path))


def enter(films: Films, law: Any, record: Any, which: Sequence[int] | None = None) -> Films:
    """The films, ``which`` or all with the addresses of their law, compiled here, and of its record; memory placed."""
    rows = list(range(len(films.entry)) if which is None else which)
    memory, out = np.zeros(1), np.zeros(SIZE)
    address = kernel_address(law, 0, 0, 0, np.zeros(4), np.zeros(4), films.numbers, memory, out)
    films.entry[rows, :2] = address, keep_record(record, films.entry)
    films.entry[rows, 2] = rows
    films.remembered[1:] = np.cumsum(films.traits[:, MEMORY])
    return films
