"""Assembly of a model's bearings: makes a registered law's data, compiles its kernel, stores the addresses of both."""

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
from cranktrain.film.laws.films import CLOSES, CONTACT, MEMORY, SIZE, TELLS_RATE, TOGETHER, VISCOUS, Films, no_films
from cranktrain.film.laws.parabolic import film_geometry
from cranktrain.film.laws.register import AXIAL_JOINT, BIG_END, ROLLER, THRUST, Law

_MISSING = {
    "table": "a film table of L/D {ratio:.4g}; make it by film-table",
    "big_end_table": "a film table of L/D {ratio:.4g}; make it by film-table",
    "bore": "the bore's compliance; make it by structure.saddle",
    "big_end_bore": "the compliance of the rods' eyes; make it by structure.rod.eye",
}
"""Description of each part that a law may lack, with the command or function that makes it."""


@dataclass(frozen=True)
class Bearings:
    """Input from which a force law makes its data.

    Attributes
    ----------
    parameters : (b, COLUMNS) parameters of each bearing, see :mod:`cranktrain.film.laws.parameters`
    plain : the plain bearing; all bearings are equal except for their viscosity
    rollers : the roller bearings, instead of ``plain``
    parts : film table or elastic bore, by the names in the law's row of the register
    solved : (1,) counter of film evaluations outside the film table, increased by the law
    oil : dependence of viscosity and density on pressure, for laws that use it
    swings : whether motion is given in axes of a bore that swings with a rod, for laws with a memory
    """

    parameters: Array
    plain: Any = None  # PlainBearing
    rollers: Any = None  # RollerBearings
    parts: Mapping[str, Any] = field(default_factory=dict)
    solved: Array = field(default_factory=lambda: np.zeros(1))
    oil: Oil | None = None
    swings: bool = False


def bearing_parameters(bearing: PlainBearing, viscosity: float) -> Array:
    """Return the parameters of one plain bearing as the kernels read them, (COLUMNS,)."""
    c, kappa2, factor = film_geometry(bearing.diameter, bearing.width, bearing.clearance, viscosity)
    load = 0.5 * bearing.contact_pressure * bearing.width * bearing.diameter
    linear = [0.0] * 4
    if isinstance(bearing, JournalBearing):
        linear = [*bearing.ground_stiffness, bearing.damping_x, bearing.damping_y]
    row = [c, kappa2, factor, bearing.contact_height, load, *linear, 0.5 * bearing.diameter, bearing.width, viscosity]
    return np.array([*row, *bearing.relief])


def law_films(law: Law, kind: str, bearings: Bearings) -> Films:
    """Make bearings of one kind that follow a law, and compile the kernel of the law.

    Raises
    ------
    InputError
        if a part that the law needs is missing, or the table belongs to another bearing
    """
    films = no_films(len(bearings.parameters))
    enter_law(films, range(len(bearings.parameters)), law, kind, bearings)
    return films._replace(solved=bearings.solved)


def enter_law(films: Films, which: Sequence[int], law: Law, kind: str, bearings: Bearings) -> None:
    """Assign a law to the bearings ``which`` of ``films``; raises the errors of :func:`law_films`.

    The data of a roller law have one row per entry of ``which``; those of other laws have one row per film.
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
        films.traits[i, [TOGETHER, TELLS_RATE]] = form.together, bool(form.memory)
    enter(films, resolve(form.kernel), record, which)
    if kind == ROLLER:
        films.entry[list(which), 2] = range(len(which))


def thrust_bearing(thrust: ThrustBearing, viscosity: float, clearance: bool, tilt: bool) -> Films:
    """Make the thrust bearing of a model.

    ``clearance``: whether the main bearings have clearance; ``tilt``: whether their force depends on tilt. Without
    clearance this is an axial spring and damper, because a closed ring of pads would resist tilt far too much.
    """
    films = no_films(1)
    films.traits[0, [CLOSES, TELLS_RATE]] = clearance, 1.0
    form = THRUST["closed" if not clearance else "tilting" if tilt else "axial"]
    films.traits[0, VISCOUS] = form.viscous
    return enter(films, resolve(form.kernel), resolve(form.record)(thrust, viscosity))


def axial_joint_film(path: AxialPath) -> Films:
    """Make the axial joint of the drive line as :class:`Films` with one connection."""
    films = no_films(1)
    films.traits[0, MEMORY] = REMEMBERED
    return enter(films, resolve(AXIAL_JOINT.kernel), resolve(AXIAL_JOINT.record)(path))


def enter(films: Films, law: Any, record: Any, which: Sequence[int] | None = None) -> Films:
    """Compile ``law``, enter the addresses of the law and its record for films ``which`` (or all), and place memory."""
    rows = list(range(len(films.entry)) if which is None else which)
    memory, out = np.zeros(1), np.zeros(SIZE)
    address = kernel_address(law, 0, 0, 0, np.zeros(4), np.zeros(4), films.numbers, memory, out)
    films.entry[rows, :2] = address, keep_record(record, films.entry)
    films.entry[rows, 2] = rows
    films.remembered[1:] = np.cumsum(films.traits[:, MEMORY])
    return films
