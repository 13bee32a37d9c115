"""Register of integrators: one row for each method, and one for each family of methods that share a step.

Command line, FMU interface and studies read their lists of integrators here. A method of a known family is one row with
its coefficients; a family is a file with its kernels and one row more.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from zlib import crc32

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.named import Named
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.state import ACCELERATION, AUXILIARY, HISTORY, POSITION, VELOCITY
from cranktrain.dynamics.time import tableaux
from cranktrain.dynamics.time.table import EXPLICIT_FIRST, FAMILY, FIRST_STAGE, HEAD, NODE, STAGES, WIDTH


@dataclass(frozen=True)
class Family:
    """Family of methods that share their kernels.

    Attributes
    ----------
    name : of the family
    step : kernel ``step(model, work, state, slot, h) -> status``, or the name of its module and function. It advances
       the modal motion in ``state`` by h with the factors in ``slot``, see :mod:`cranktrain.dynamics.time.step`; on
       failure the caller restores the state
    difference : kernel ``difference(model, work, h) -> 0`` that fills ``work.modal[DIFFERENCE]`` and
       ``work.port[U_DIFFERENCE]`` with the step minus its embedded solution; empty if no method has one
    carried : blocks of the state that a step reads, each with its power of 1/s
    """

    name: str
    step: Named
    difference: Named = ""
    carried: tuple[tuple[int, int], ...] = ((POSITION, 0), (VELOCITY, 1))


@dataclass(frozen=True)
class Parameter:
    """Parameter that may follow a method's name after a colon; its bounds are allowed values."""

    name: str
    default: float
    least: float
    most: float


@dataclass(frozen=True)
class Integrator:
    """Integration method, one row of the register.

    Attributes
    ----------
    name : of the method
    title : one line for users
    family : name of its family
    order : of its solution
    coefficients : function that makes its table (rows, WIDTH), see :mod:`cranktrain.dynamics.time.table`; called with
       the parameter's value if there is a parameter
    embedded : order of the second solution, whose difference estimates the error of a step; 0: none. For methods of
       Newmark's form this solution has constant acceleration (Zienkiewicz & Xie 1991)
    parameter : parameter that may follow the name, or None
    """

    name: str
    title: str
    family: str
    order: int
    coefficients: Callable[..., Array]
    embedded: int = 0
    parameter: Parameter | None = None


LARGEST_FOR_FILMS = 1.25
"""Largest stage coefficient of a method that is allowed for elastic films, where oil in a closing void follows stages.

Chosen from ``python -m benchmarks.film_methods``: up to 1.21 (sdirk3) methods agree; esdirk57 (1.49) fails, and largest
pressures of esdirk5 (2.5) and sdirk4 (7.8) do not converge.
"""

FAMILIES: dict[str, Family] = {}
INTEGRATORS: dict[str, Integrator] = {}


def register_family(row: Family) -> None:
    """Add a family of integration methods to the register."""
    FAMILIES[row.name] = row


def register_integrator(row: Integrator) -> None:
    """Add a method, whose family is registered already, to the register."""
    INTEGRATORS[row.name] = row


def integrator(name: str) -> Integrator:
    """Row of the method ``name``, which may include its parameter; ``InputError`` for an unknown method."""
    base, _, parameter = name.partition(":")
    row = INTEGRATORS.get(base)
    if row is None or (parameter and row.parameter is None):
        raise InputError(f"integrator '{name}' does not exist; {nearest(base, INTEGRATORS)}")
    return row


def integrator_table(name: str) -> Array:
    """Table of a method by name; ``generalised-alpha:0.8`` sets ρ∞, ``hht:-0.2`` α. ``InputError`` if unknown."""
    row, given = integrator(name), name.partition(":")[2]
    table = row.coefficients() if row.parameter is None else row.coefficients(_value(row, row.parameter, given))
    table[HEAD, FAMILY] = list(FAMILIES).index(row.family)
    return table


def _value(row: Integrator, parameter: Parameter, given: str) -> float:
    """Value of a parameter from the text ``given``, or the parameter's default if the text is empty."""
    if not given:
        return parameter.default
    try:
        value = float(given)
    except ValueError:
        raise InputError(
            f"integrator '{row.name}:{given}': {parameter.name} must be a number, e.g. {row.name}:{parameter.default:g}"
        ) from None
    if not parameter.least - 1e-12 <= value <= parameter.most:
        raise InputError(
            f"{row.name} needs {parameter.least:.4g} <= {parameter.name} <= {parameter.most:g}, got {value:g}; "
            f"{parameter.default:g} is a good start"
        )
    return value


def family(table: Array) -> Family:
    """Family of the integration method that a table of coefficients describes."""
    return list(FAMILIES.values())[int(table[HEAD, FAMILY])]


def carried(table: Array) -> tuple[tuple[int, int], ...]:
    """Blocks of the state that a method carries from step to step, each with the power of 1/s in its unit."""
    blocks = family(table).carried
    return (*blocks, (ACCELERATION, 2)) if table[HEAD, EXPLICIT_FIRST] else blocks


@cache
def amplification(name: str) -> float:
    """Largest factor by which the error of a stage enters the step: the table's largest coefficient, at least 1."""
    return largest_coefficient(integrator_table(name))


def settles_films(name: str) -> bool:
    """True if largest pressures of elastic films converge as a method's step shrinks, judged by its coefficients."""
    return amplification(name) <= LARGEST_FOR_FILMS


def largest_coefficient(table: Array) -> float:
    """Largest coefficient of a method's stages, at least 1."""
    return max(1.0, float(np.abs(table[FIRST_STAGE : FIRST_STAGE + int(table[HEAD, STAGES]), :NODE]).max()))


def method_arrays(given: str = "") -> tuple[Array, Array]:
    """Arrays ``methods`` (without the last column) and ``tables`` of a model's basis for all integrators.

    The integrator ``given`` may state its parameter behind its name.
    """
    methods, tables = _method_arrays(given, tuple(INTEGRATORS))
    return methods.copy(), tables.copy()


@cache
def _method_arrays(given: str, names: tuple[str, ...]) -> tuple[Array, Array]:
    chosen = integrator(given).name if given else ""
    full = [given if name == chosen else name for name in names]
    coefficients = [integrator_table(name) for name in full]
    tables = np.zeros((len(full), max(map(len, coefficients)), WIDTH))
    methods = np.zeros((len(full), at.LOSES_PEAKS))
    for row, table, own, name in zip(methods, tables, coefficients, full, strict=True):
        table[: len(own)] = own
        row[at.EMBEDDED], row[at.METHOD_ORDER] = integrator(name).embedded, max(2, integrator(name).order)
        row[at.AMPLIFICATION], row[at.MARK] = largest_coefficient(own), float(crc32(own.tobytes()))
    return methods, tables


def _rows() -> tuple[Integrator, ...]:
    kutta, form = "runge-kutta", "newmark"
    rho, alpha = Parameter("rho", 0.6, 0.0, 1.0), Parameter("alpha", -0.1, -1.0 / 3.0, 0.0)
    t = tableaux
    return (
        Integrator("backward-euler", "implicit Euler", kutta, 1, t.backward_euler),
        Integrator("trapezoidal", "trapezoidal rule", form, 2, t.trapezoidal),
        Integrator("hht", "Hilber, Hughes and Taylor, or hht:ALPHA", form, 2, t.hht, 1, alpha),
        Integrator(
            "generalised-alpha", "spectral radius 0.6, or generalised-alpha:RHO", form, 2, t.generalised_alpha, 1, rho
        ),
        Integrator("bdf2", "two-step backward differences", "bdf2", 2, t.bdf2),
        Integrator("tr-bdf2", "TR-BDF2, first stage explicit", kutta, 2, t.tr_bdf2),
        Integrator("sdirk2", "L-stable, two stages", kutta, 2, t.sdirk2),
        Integrator("sdirk3", "L-stable, three stages", kutta, 3, t.sdirk3),
        Integrator("sdirk4", "L-stable, five stages, with error estimate", kutta, 4, t.sdirk4, 3),
        Integrator("esdirk3", "L-stable, first stage explicit, with error estimate", kutta, 3, t.esdirk3, 2),
        Integrator("esdirk4", "L-stable, first stage explicit, with error estimate", kutta, 4, t.esdirk4, 3),
        Integrator("esdirk5", "L-stable, first stage explicit, with error estimate", kutta, 5, t.esdirk5, 4),
        Integrator(
            "esdirk47", "order 4, seven stages, the first explicit, with error estimate", kutta, 4, t.esdirk47, 3
        ),
        Integrator(
            "esdirk57", "order 5, seven stages, the first explicit, with error estimate", kutta, 5, t.esdirk57, 4
        ),
    )


_HERE = "cranktrain.dynamics.time"
_MOTION = ((POSITION, 0), (VELOCITY, 1))

for _family in (
    Family("runge-kutta", f"{_HERE}.runge_kutta:runge_kutta_step", f"{_HERE}.runge_kutta:runge_kutta_difference"),
    Family(
        "newmark", f"{_HERE}.newmark:newmark_step", f"{_HERE}.newmark:newmark_difference",
        (*_MOTION, (ACCELERATION, 2), (AUXILIARY, 2)),
    ),
    Family("bdf2", f"{_HERE}.bdf2:bdf2_step", "", (*_MOTION, (AUXILIARY, 0), (HISTORY, 1))),
):  # fmt: skip
    register_family(_family)
for _integrator in _rows():
    register_integrator(_integrator)
