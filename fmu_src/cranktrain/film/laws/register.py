"""Register of bearing laws, ordered from the lowest to the highest fidelity level; one row per law.

Command line, FMU interface, plan and studies read their lists of bearing levels here. No code compares the name of a
law: every property of a law that a run needs is in its row. A new law needs one file with its kernel
(:mod:`cranktrain.film.laws.films` describes the arguments of a kernel) and one row.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.named import Named

PLAIN, ROLLER, BIG_END = "plain", "roller", "big_end"
"""Kinds of bearing that a law may serve: plain and roller main bearings, and the rods' big ends."""
MAINS = (PLAIN, ROLLER)
OIL_LAWS = ("pressure_law", "compressibility")
"""Keys of the engine file's [oil] for the dependence of the oil on pressure."""
CHEAP, MODERATE, DEAR, DEAREST = "cheap", "moderate", "dear", "dearest"
"""Classes of computing cost: about 1, 3, 30 and 100 times a run with level ``linear``."""


@dataclass(frozen=True)
class Form:
    """Form of a law for one kind of bearing.

    Attributes
    ----------
    kernel : the law's kernel, or its module and name; empty if there is no bearing
    record : makes the kernel's data, ``record(bearings) -> named tuple``, see :mod:`cranktrain.film.laws.bearings`
    parts : fields of ``Parts`` that the law needs
    tilt : whether the force depends on the journal's tilt
    closes : whether the least gap limits the step
    contact : whether its force has a kink at the contact height, which adaptive steps look for
    memory : function ``memory(record)`` that returns how many values one film keeps in the state; empty if none
    viscous : whether the record holds oil data in addition to the bearings' parameters, set by action OIL
    together : whether the law solves films side by side, after action LINE_UP
    """

    kernel: Named = ""
    record: Named = ""
    parts: tuple[str, ...] = ()
    tilt: bool = False
    closes: bool = True
    contact: bool = False
    memory: Named = ""
    viscous: bool = False
    together: bool = False


@dataclass(frozen=True)
class Law:
    """One bearing law: a fidelity level of main bearings, big ends or both.

    Attributes
    ----------
    name : of the level
    title : one line for users
    forms : by kind of bearing
    film : whether the law has an oil film: gap, pressure, friction, flow
    oil : pressure laws of the oil that the films use, as keys of the engine file's [oil]
    clearance : whether journals have clearance; without it, the thrust bearing has none either
    any_clearance : whether bearings stay valid if their clearance changes after they were made
    square_collar : whether the collar of the thrust bearing stays square to its axis; otherwise its tilt is included
    usual_for : kinds of bearing, or crank levels, for which it is the default level
    cost : class of cost
    block : default block level of its runs, if engine and crank allow it
    film_errors : by block level, largest relative errors by the film's grid of the least film and of the largest
        pressure of any main bearing of the engines that were measured; empty if not measured
    integrator, step_deg, film_change, tolerance : default integrator of its runs, internal step in degrees of crank
        angle, fraction of its thickness by which a film may close over a step, and Newton tolerance of the ports in
        clearances
    """

    name: str
    title: str
    forms: dict[str, Form]
    film: bool = False
    oil: tuple[str, ...] = ()
    clearance: bool = True
    any_clearance: bool = False
    square_collar: bool = False
    usual_for: tuple[str, ...] = ()
    cost: str = CHEAP
    block: str = "ground"
    film_errors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    integrator: str = "esdirk47"
    step_deg: float = 5.0
    film_change: float = 1.0
    tolerance: float = 1.0e-5

    @property
    def carries(self) -> bool:
        """True if the level has bearings; otherwise journals are locked on their axis, or pins in their rods."""
        return any(form.kernel for form in self.forms.values())

    @property
    def tilt(self) -> bool:
        """True if the force on every kind of main journal depends on the journal's tilt."""
        mains = [self.forms[kind] for kind in MAINS if kind in self.forms]
        return bool(mains) and all(form.tilt for form in mains)


LAWS: dict[str, Law] = {}


def register_law(law: Law, before: str | None = None) -> None:
    """Add a law as the highest level, or just below the level ``before``."""
    rest = [LAWS.pop(name) for name in list(LAWS)[list(LAWS).index(before) :]] if before is not None else []
    LAWS.update({row.name: row for row in (law, *rest)})


def bearing_levels(*kinds: str) -> tuple[str, ...]:
    """Return the levels that serve any of the given ``kinds`` of bearing, from the lowest to the highest."""
    return tuple(name for name, law in LAWS.items() if any(kind in law.forms for kind in kinds))


def usual_level(*kinds: str) -> str:
    """Return the default level of the first of the given ``kinds`` (of bearing or crank levels) that has a default."""
    return next(name for kind in kinds for name, law in LAWS.items() if kind in law.usual_for)


def bearing_law(name: str, what: str = "bearing level") -> Law:
    """Return the register's row of a level; ``InputError`` if the level does not exist."""
    if name not in LAWS:
        kinds = (BIG_END,) if what == "big-end level" else MAINS
        raise InputError(f"{what} '{name}' does not exist; {nearest(name, bearing_levels(*kinds))}")
    return LAWS[name]


_HERE = "cranktrain.film.laws"
THRUST = {
    name: Form(f"{_HERE}.thrust:{name}_thrust", f"{_HERE}.thrust:{pads}_pads", viscous=name != "closed")
    for name, pads in (("closed", "closed"), ("axial", "thrust"), ("tilting", "thrust"))
}
"""Forms of the thrust bearing: closed (no clearance), films with a collar square to its axis, films with tilt."""
AXIAL_JOINT = Form(f"{_HERE}.axial_joint:axial_joint_law", f"{_HERE}.axial_joint:axial_joint")
"""Form of the axial joint between flywheel and connecting shaft."""


def forms() -> list[Form]:
    """Return every form of bearing law with a kernel that a machine-code library exports."""
    found = [*(form for law in LAWS.values() for form in law.forms.values()), *THRUST.values(), AXIAL_JOINT]
    return [form for form in found if form.kernel]


def _elastic(name: str, title: str, grid: str, film_errors: Mapping[str, tuple[float, float]]) -> Law:
    """Make a level of elastic films; these levels differ only in their grid (``elastic`` or ``fine``) and its errors.

    The errors come from ``python -m benchmarks.worst_film --levels``.
    """
    mains = Form(
        f"{_HERE}.ehd:elastic_law",
        f"{_HERE}.ehd:{grid}_films",
        ("bore",),
        tilt=True,
        memory=f"{_HERE}.ehd:film_values",
        viscous=True,
        together=True,
    )
    big_ends = replace(mains, record=f"{_HERE}.ehd:{grid}_big_ends", parts=("big_end_bore",), tilt=False)
    return Law(
        name,
        title,
        {PLAIN: mains, BIG_END: big_ends},
        film=True,
        oil=OIL_LAWS,
        cost=DEAREST,
        film_errors=film_errors,
        integrator="esdirk3",
        step_deg=2.0,
        # At ten times this tolerance a run costs a third less per cycle but needs four times as many cycles to settle.
        tolerance=1.0e-3,
    )


for _law in (
    Law(
        "held",
        "no bearings: journals locked on their axis",
        {PLAIN: Form(), ROLLER: Form()},
        clearance=False,
        any_clearance=True,
        usual_for=("torsional",),
        step_deg=6.0,
    ),
    Law(
        "rigid",
        "no film: pins locked in their rods",
        {BIG_END: Form()},
        clearance=False,
        any_clearance=True,
        usual_for=(BIG_END,),
    ),
    Law(
        "linear",
        "springs and dampers",
        {
            PLAIN: Form(f"{_HERE}.linear:linear_law", f"{_HERE}.linear:linear_bearings", closes=False),
            ROLLER: Form(f"{_HERE}.roller:roller_law", f"{_HERE}.roller:linear_seats", tilt=True),
        },
        clearance=False,
        any_clearance=True,
        tolerance=1.0e-6,
    ),
    Law(
        "impedance",
        "oil film read from an impedance map",
        {
            kind: Form(f"{_HERE}.impedance:impedance_law", f"{_HERE}.impedance:impedance_films", contact=True)
            for kind in (PLAIN, BIG_END)
        },
        film=True,
        any_clearance=True,
        # Tilt of the collar adds two unknowns without better axial motion: docs/decisions/0012-thrust-film.md.
        square_collar=True,
        usual_for=(PLAIN,),
    ),
    Law(
        "table",
        "oil film that feels tilt, read from a film table, with asperities",
        {
            PLAIN: Form(f"{_HERE}.rigid_bore:table_law", f"{_HERE}.rigid_bore:table_films", ("table",), tilt=True),
            BIG_END: Form(f"{_HERE}.rigid_bore:aligned_law", f"{_HERE}.rigid_bore:aligned_films", ("big_end_table",)),
        },
        film=True,
        cost=MODERATE,
    ),
    Law(
        "reynolds",
        "oil film that feels tilt, Reynolds' equation solved online, with asperities",
        {PLAIN: Form(f"{_HERE}.rigid_bore:reynolds_law", f"{_HERE}.rigid_bore:reynolds_films", tilt=True)},
        film=True,
        cost=DEAR,
    ),
    _elastic(
        "ehd",
        "oil film in an elastic bore, solved online, with cavitation and asperities",
        "elastic",
        {"ground": (0.32, 0.21), "flexible": (0.35, 0.29)},
    ),
    _elastic(
        "ehd:fine",
        "the same on a finer grid: least films and pressure peaks",
        "fine",
        {"ground": (0.07, 0.09), "flexible": (0.21, 0.17)},
    ),
    Law(
        "roller",
        "cylindrical rollers",
        {ROLLER: Form(f"{_HERE}.roller:roller_law", f"{_HERE}.roller:roller_seats", tilt=True)},
        any_clearance=True,
        usual_for=(ROLLER,),
        block="flexible",
        step_deg=3.0,
        tolerance=1.0e-6,
    ),
):
    register_law(_law)
