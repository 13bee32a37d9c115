"""Elastic films of the main bearings in the running model: their data, their memory, and their force, solved online.

A film remembers its oil and the form of its bore. Both belong to the state: node unknowns, shapes δ and their rates at
the end of the last step. Within a step

* shapes follow the stage's own rule, δ_s = Δ + g δ̇_s with Δ = δ_n + h Σ_j a_sj δ̇_j and g = hγ, so that the squeeze of
  the elastic bore is of the integrator's order (generalised-α: backward Euler);
* voids fill and empty by backward Euler from the step's start, which keeps every fill within [0, 1].

Oil comes through a hole in the bore, or a groove all around it, at its supply pressure. The bore is at rest in space:
journals come in the frame's axes and are turned there and back.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cranktrain.core.kernel import kernel, law_kernel, record_reader
from cranktrain.core.lanes import four
from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import Oil, PlainBearing
from cranktrain.film.contact.asperity import bearing_contact_constants
from cranktrain.film.contact.gap import over
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.elastic.film import CONVERGED, FilmHistory, elastic_film
from cranktrain.film.elastic.grid import (
    CLEARANCE,
    DAMPING,
    FILM_MIN,
    FILM_MIN_ANGLE,
    FRICTION_TORQUE,
    N_PHI,
    N_SHAPES,
    N_Z,
    OIL,
    OIL_ROW,
    OUT_SIZE,
    PRESSURE_MAX,
    PROFILE,
    SIDE_FLOW,
    STIFFNESS,
    VISCOSITY,
    ZETA,
    ElasticFilm,
    ElasticGrid,
    ElasticWork,
)
from cranktrain.film.elastic.grid import COS as COS_NODE
from cranktrain.film.elastic.grid import FORCE as FORCE_ON_JOURNAL
from cranktrain.film.elastic.grid import SIN as SIN_NODE
from cranktrain.film.elastic.oil import OilTables, oil_tables
from cranktrain.film.laws.films import (
    CLOSE_STAGE,
    CLOSE_STEP,
    COS,
    ECCENTRICITY,
    ELAPSED,
    FLOW,
    FORCE,
    FRICTION,
    FROZEN,
    GAIN,
    GAP,
    GAP_ANGLE,
    OPEN_STAGE,
    OPEN_STEP,
    P_MAX,
    RATE,
    SIN,
    SPEED,
    STAGE,
    STEP,
)
from cranktrain.film.laws.parameters import VISCOSITY as VISCOSITIES

if TYPE_CHECKING:
    from cranktrain.film.laws.bearings import Bearings

SHAPES = 7
"""Bore shapes that a running film carries; with the load they fill one block of right-hand sides."""
IN_LOOP = ElasticGrid(48, 7, 0.45)
"""Least film of the six at 2000 rev/min within 2 % of 96 x 11 at every main that does not touch; the gathering at the
edges is chosen for that."""
SMALLEST = ElasticGrid(12, 5)
"""Grid of levels that do not read it."""

KEPT = 4 + OIL + 1 - PRESSURE_MAX
"""What the state keeps of a film's result: the force, and what follows the tangents."""


class ElasticMemory(NamedTuple):
    """What the films of b journals read and write during a step; N nodes, k shapes."""

    start: Array  # (b, N) node unknowns at the step's start
    start_place: Array  # (b, 4) in space, m
    start_shapes: Array  # (b, k) m
    known: Array  # (b, k) Δ of the stage, m
    unknowns: Array  # (b, N) at the stage
    shapes: Array  # (b, k) at the stage, m
    rates: Array  # (stages, b, k) δ̇ of each stage, m/s
    motion: Array  # (2, 4) place and velocity in space
    out: Array  # (b, OUT_SIZE)


class ElasticBore(NamedTuple):
    """Data, scratch and memory of the films."""

    film: ElasticFilm
    scratch: ElasticWork
    memory: ElasticMemory
    contact_height: Array  # (1,) m, the least gap that counts when a film closes
    viscosities: Array  # (b,) Pa s


def elastic_bore(
    bearing: PlainBearing,
    viscosities: Array,
    bore: BoreCompliance,
    grid: ElasticGrid = IN_LOOP,
    oil: Oil | None = None,
) -> ElasticBore:
    """Elastic films of as many journals as there are ``viscosities`` (b,), Pa s; ``oil`` says what pressure does."""
    tables = None if oil is None else oil_tables(oil, viscosities)
    film = elastic_arrays(bearing, float(viscosities[0]), bore, grid, tables)
    return ElasticBore(
        film, grid.work(len(bore.compliance)), elastic_memory(film, len(viscosities)),
        np.array([bearing.contact_height]), np.array(viscosities, dtype=float),
    )  # fmt: skip


def elastic_films(bearings: Bearings) -> ElasticBore:
    """Films of main bearings, of their own viscosities."""
    return elastic_bore(bearings.plain, bearings.parameters[:, VISCOSITIES], bearings.parts["bore"], oil=bearings.oil)


def film_values(bore: ElasticBore) -> int:
    """Values that one film adds to the state vector."""
    return film_size(bore.film)


def elastic_arrays(
    bearing: PlainBearing, viscosity: float, bore: BoreCompliance, grid: ElasticGrid, oil: OilTables | None = None
) -> ElasticFilm:
    """Data of one elastic film of a main bearing at ``viscosity`` (Pa s); the mains differ in that alone."""
    zetas = grid.zetas
    angles = grid.angles
    if bearing.groove == "circumferential":
        supply = np.zeros((grid.n_phi, grid.n_z))
        supply[:, grid.n_z // 2] = 1.0
    else:
        # A pocket narrower than the spacing of nodes is the nodes nearest to it.
        reach = max(0.5 * bearing.supply_arc, 0.51 * 2.0 * math.pi / grid.n_phi)
        near = np.abs(np.angle(np.exp(1j * (angles - bearing.supply_angle)))) <= reach
        across = np.abs(zetas[1:-1]) <= max(bearing.supply_width / bearing.width, 1.0e-12)
        supply = np.outer(near, across).astype(float)
    shapes = bore.shapes(angles, zetas)
    return grid.film(
        bearing.diameter, bearing.width, bearing.clearance, viscosity, shapes=shapes, compliance=bore.compliance,
        load_coupling=bore.load_coupling, supply=supply, supply_pressure=bearing.supply_pressure,
        contact=bearing_contact_constants(bearing), oil=oil, profile=over(bearing.relief),
    )  # fmt: skip


def film_size(film: ElasticFilm) -> int:
    """Values that one film adds to the state vector."""
    constants = film.constants
    return int(constants[N_PHI] * constants[N_Z]) + 2 * int(constants[N_SHAPES]) + KEPT


def elastic_memory(film: ElasticFilm, bearings: int) -> ElasticMemory:
    """Memory for as many films, full and round."""
    size = int(film.constants[N_PHI] * film.constants[N_Z])
    k = int(film.constants[N_SHAPES])
    z = np.zeros
    return ElasticMemory(
        z((bearings, size)), z((bearings, 4)), z((bearings, k)), z((bearings, k)), z((bearings, size)),
        z((bearings, k)), z((8, bearings, k)), z((2, 4)), z((bearings, OUT_SIZE)),
    )  # fmt: skip


@kernel
def turn_pairs(cos, sin, vector, out):
    """Turn the two plane vectors of (4,) by the angle whose cosine and sine are given."""
    for pair in range(0, 4, 2):
        x = vector[pair]
        y = vector[pair + 1]
        out[pair] = cos * x - sin * y
        out[pair + 1] = sin * x + cos * y


_SMALL = SMALLEST.film(1.0, 1.0, 1.0e-3, 1.0)
_read = record_reader(ElasticBore(_SMALL, SMALLEST.work(0), elastic_memory(_SMALL, 1), np.zeros(1), np.zeros(1)))


@law_kernel
def elastic_law(record, action, i, place, velocity, numbers, memory, out):
    """The law of an elastic bore; see :mod:`cranktrain.film.laws.films`.

    ``memory`` is the film's part of the state; for OPEN_STAGE the stage's row of the integrator. The status of a
    film that failed is not 0.
    """
    bore = _read(record)
    own = bore.memory
    nodes = own.start.shape[1]
    shapes = own.shapes.shape[1]
    cos = numbers[COS]
    sin = numbers[SIN]
    if action in (FORCE, CLOSE_STAGE):
        status = _solve(bore, i, place, velocity, numbers, action == FORCE and numbers[FROZEN] == 0.0)
        if action == CLOSE_STAGE:
            for k in range(shapes):
                own.rates[int(numbers[STAGE]), i, k] = (own.shapes[i, k] - own.known[i, k]) / numbers[GAIN]
            return status
        if status != CONVERGED:
            return status
        _force(own.out[i], cos, sin, out)
        out[FRICTION] = own.out[i, FRICTION_TORQUE]
        out[ECCENTRICITY] = math.sqrt(place[0] * place[0] + place[1] * place[1]) / bore.film.constants[CLEARANCE]
    elif action == OPEN_STAGE:
        for k in range(shapes):
            past = own.start_shapes[i, k]
            for s in range(int(numbers[STAGE])):
                past += numbers[STEP] * memory[s] * own.rates[s, i, k]
            own.known[i, k] = past
    elif action == OPEN_STEP:
        turn_pairs(cos, sin, place, own.start_place[i])
        for k in range(nodes):
            own.start[i, k] = memory[k]
            own.unknowns[i, k] = memory[k]
        for k in range(shapes):
            own.start_shapes[i, k] = memory[nodes + k]
            own.shapes[i, k] = memory[nodes + k]
            own.rates[0, i, k] = memory[nodes + shapes + k]
    elif action == CLOSE_STEP:
        for k in range(nodes):
            memory[k] = own.unknowns[i, k]
        for k in range(shapes):
            memory[nodes + k] = own.shapes[i, k]
            memory[nodes + shapes + k] = own.rates[int(numbers[STAGE]), i, k]
        for k in range(4):
            memory[nodes + 2 * shapes + k] = own.out[i, FORCE_ON_JOURNAL + k]
        for k in range(PRESSURE_MAX, OIL + 1):
            memory[nodes + 2 * shapes + 4 + k - PRESSURE_MAX] = own.out[i, k]
    else:
        turn_pairs(cos, sin, place, own.motion[0])
        turn_pairs(cos, sin, velocity, own.motion[1])
        if action == RATE:
            out[0] = closing_rate(
                bore.film, own.motion[0], own.motion[1], memory[nodes : nodes + shapes],
                memory[nodes + shapes : nodes + 2 * shapes], bore.contact_height[0],
            )  # fmt: skip
            return 0
        kept = memory[nodes + 2 * shapes :]
        turn_pairs(cos, -sin, kept, out)
        first = 4 - PRESSURE_MAX
        out[FRICTION] = kept[first + FRICTION_TORQUE]
        out[ECCENTRICITY] = math.sqrt(place[0] * place[0] + place[1] * place[1]) / bore.film.constants[CLEARANCE]
        out[P_MAX] = kept[first + PRESSURE_MAX]
        out[FLOW] = kept[first + SIDE_FLOW]
        out[GAP] = max(kept[first + FILM_MIN], 0.0)
        out[GAP_ANGLE] = kept[first + FILM_MIN_ANGLE]
    return 0


@kernel
def _solve(bore, i, place, velocity, numbers, tangents):
    """Solve film i at a stage into ``memory.out[i]``; its status."""
    own = bore.memory
    turn_pairs(numbers[COS], numbers[SIN], place, own.motion[0])
    turn_pairs(numbers[COS], numbers[SIN], velocity, own.motion[1])
    # All films share the rest of their data.
    bore.film.constants[VISCOSITY] = bore.viscosities[i]
    bore.film.constants[OIL_ROW] = i
    history = FilmHistory(
        own.start[i], own.start_place[i], own.start_shapes[i], own.known[i], own.unknowns[i], own.shapes[i]
    )
    clock = numbers[SPEED], numbers[ELAPSED], numbers[GAIN]
    status = elastic_film(bore.film, own.motion, clock, history, bore.scratch, own.out[i], tangents)
    if status != CONVERGED:
        # The next attempt, of a shorter step, begins with what is sure.
        for k in range(own.start.shape[1]):
            own.unknowns[i, k] = own.start[i, k]
        for k in range(own.shapes.shape[1]):
            own.shapes[i, k] = own.start_shapes[i, k]
    return status


@kernel
def _force(result, cos, sin, out):
    """Force of a film's ``result`` and its tangents in the frame's axes, ``out[0:36]``."""
    turn_pairs(cos, -sin, result, out)
    for part in range(2):
        o = STIFFNESS if part == 0 else DAMPING
        for r in range(0, 4, 2):
            for s in range(0, 4, 2):
                k = o + 4 * r + s
                xx = result[k]
                xy = result[k + 1]
                yx = result[k + 4]
                yy = result[k + 5]
                # First the columns, then the rows.
                a = xx * cos + xy * sin
                b = xy * cos - xx * sin
                c = yx * cos + yy * sin
                d = yy * cos - yx * sin
                out[k] = cos * a + sin * c
                out[k + 1] = cos * b + sin * d
                out[k + 4] = cos * c - sin * a
                out[k + 5] = cos * d - sin * b


@kernel
def closing_rate(film, place, velocity, shapes, rates, least):
    """Largest rate (1/s) at which the film shrinks, over itself or ``least`` (m), whichever is more."""
    c = film.constants[CLEARANCE]
    lines = int(film.constants[N_Z]) + 2
    n_shapes = int(film.constants[N_SHAPES])
    x, y, a, b = four(place, 0)
    vx, vy, va, vb = four(velocity, 0)
    worst = 0.0
    for i in range(int(film.constants[N_PHI])):
        cos = film.trig[i, COS_NODE]
        sin = film.trig[i, SIN_NODE]
        for line in range(lines):
            q = i * lines + line
            zeta = film.lines[line, ZETA]
            h = c * (1.0 + film.lines[line, PROFILE]) - (x + zeta * a) * cos - (y + zeta * b) * sin
            rate = (vx + zeta * va) * cos + (vy + zeta * vb) * sin
            for k in range(n_shapes):
                h += shapes[k] * film.shapes[q, k + 1]
                rate -= rates[k] * film.shapes[q, k + 1]
            worst = max(worst, rate / max(h, least))
    return worst
