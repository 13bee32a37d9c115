"""Elastic films of main bearings and big ends, solved online in the running model.

The state holds the oil of each film and the deformation of its bore: node unknowns, shape amplitudes δ and the rates of
both at the end of the last step. Within a step

* shapes follow the rule of the stage, δ_s = Δ + g δ̇_s with Δ = δ_n + h Σ_j a_sj δ̇_j and g = hγ, so that the squeeze of
  the elastic bore has the order of the integrator (generalised-α: backward Euler);
* the oil of ruptured nodes follows the same rule (:mod:`cranktrain.film.elastic.content`), so oil is conserved.

Oil enters at supply pressure through a hole in the bore or a groove around its circumference. The bore of a main
bearing is at rest in space; the bore of a big end turns as its rod swings. Motions of journals are transformed from the
axes of the frame to those of the bore, forces back.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cranktrain.core.kernel import inlined_kernel, kernel, law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.engine.lubricant import PRESSURE_LAWS, ROELANDS, roelands_constants
from cranktrain.engine.parts import Oil, PlainBearing
from cranktrain.film.contact.asperity import bearing_contact_constants
from cranktrain.film.contact.gap import over
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.elastic.content import CONTENT
from cranktrain.film.elastic.film import CONVERGED
from cranktrain.film.elastic.grid import BLOCK, ElasticFilm, ElasticGrid
from cranktrain.film.elastic.oil import OilTables, fill_oil_table, oil_tables
from cranktrain.film.elastic.workspace import LaneWork, lane_work
from cranktrain.film.laws.film_solution import (
    ASKED,
    CALLS,
    SOLVED,
    choose_precision,
    close_content,
    line_up,
    open_content,
    open_lane,
    solve_film,
    start_content,
)
from cranktrain.film.laws.films import (
    ANGLE,
    CLOSE_STAGE,
    CLOSE_STEP,
    COS,
    ECCENTRICITY,
    FLOW,
    FORCE,
    FRICTION,
    GAIN,
    GAP,
    GAP_ANGLE,
    LINE_UP,
    OIL,
    OPEN_STAGE,
    OPEN_STEP,
    P_MAX,
    RATE,
    RUBBING,
    SIN,
    SPEED,
    STAGE,
    STEP,
    TOLERANCE,
    TURN,
    VISCOSITY,
)
from cranktrain.film.laws.foresight import end_slopes, keep_stage
from cranktrain.film.laws.in_space import closing_rate, force_in_frame, turn_pairs
from cranktrain.film.laws.parameters import VISCOSITY as VISCOSITIES
from cranktrain.film.laws.pressure_peak import PEAKS, keep_peak

if TYPE_CHECKING:
    from cranktrain.film.laws.bearings import Bearings

SHAPES = 7
"""Number of bore shapes of a film in a run; shapes and load together fill one block of right-hand sides."""
IN_LOOP = ElasticGrid(24, 8, 0.5)
"""Grid of level ``ehd``: enough nodes for forces and motion (docs/decisions/0016-grids-of-elastic-films.md)."""
FINE = ElasticGrid(56, 8, 0.5, lands=(0.40, 0.63, 0.81))
"""Grid of level ``ehd:fine``: chosen by least films and largest pressures, ``python -m benchmarks.worst_film``."""
SMALLEST = ElasticGrid(12, 5)
"""Small grid of the dummy film that gives the array types to the compiled reader of the record."""

KEPT = 4 + one.OIL + 1 - one.PRESSURE_MAX
"""Number of values of a film's result that the state holds: the force, and the values after the tangents."""


class ElasticMemory(NamedTuple):
    """Memory of the films of b journals during a step, with N nodes and k shapes each."""

    start: Array  # (b, N) node unknowns at the step's start
    start_place: Array  # (b, 4) journal position at the step's start, axes of the bore, m
    start_pace: Array  # (b, 4) journal velocity at the step's start, axes of the bore, m/s
    start_shapes: Array  # (b, k) shape amplitudes at the step's start, m
    start_rates: Array  # (b, k) rates of the shape amplitudes at the step's start, m/s
    known: Array  # (b, k) Δ of the stage's rule δ̇ = (δ − Δ)/g, m
    unknowns: Array  # (b, N) node unknowns at the stage
    shapes: Array  # (b, k) shape amplitudes at the stage, m
    rates: Array  # (stages, b, k) δ̇ of each stage, m/s
    motions: Array  # (b, 2, 4) journal positions (m) and velocities (m/s), axes of the bore
    speeds: Array  # (b,) sum of the speeds of journal and bore, axes of the bore, rad/s
    out: Array  # (b, one.OUT_SIZE) result of each film, see film.elastic.grid
    calls: Array  # (b, CALLS) counters and status of each film, see film_solution.SOLVED
    peaks: Array  # (b, PEAKS) largest pressure of the present cycle, see pressure_peak.PEAK
    content: Array  # (b, CONTENT, N) oil content, see film.elastic.content; (b, CONTENT, 0) for compressible oil
    content_rates: Array  # (stages, b, N) ṁ of each stage over the clearance, 1/s
    content_ends: Array  # (b, N) ṁ over the clearance at the last stage, for the next step, 1/s
    solved: Array  # (stages, b, N) node unknowns at each stage; (stages, b, 0) for compressible oil
    slopes: Array  # (b, N) rates of the node unknowns at the step's start, 1/s
    times: Array  # (b, stages) time from the step's start to each solved stage, s; 0 if not solved


class ElasticBore(NamedTuple):
    """Record of the law: data, scratch and memory of the films of b journals."""

    film: ElasticFilm
    scratch: LaneWork  # workspace of films solved one by one in doubles, a group each
    memory: ElasticMemory
    contact_height: Array  # (1,) lower bound of the gap (m) in the relative rate of closing
    viscosities: Array  # (b,) Pa s
    swings: Array  # (1,) 1 if the axes of motions and forces swing with the bore, see _axes
    oil_law: Array  # (2,) pressure dependence of the viscosity: kind and slope (1/Pa), see engine.lubricant
    lanes: LaneWork  # workspace of films solved side by side in singles; without groups if each film is solved alone


def elastic_bore(
    bearing: PlainBearing,
    viscosities: Array,
    bore: BoreCompliance,
    grid: ElasticGrid = IN_LOOP,
    oil: Oil | None = None,
    swings: bool = False,
) -> ElasticBore:
    """Make one elastic film per entry of ``viscosities`` (b,), Pa s; ``oil`` gives its dependence on pressure.

    With ``swings`` motions are given in axes of the bore, which swing with a rod.
    """
    tables, law = None, np.zeros(2)
    if oil is not None:
        tables, law = oil_tables(oil, viscosities), np.array([PRESSURE_LAWS[oil.pressure_law], oil.pressure_viscosity])
    film = elastic_arrays(bearing, float(viscosities[0]), bore, grid, tables)
    count = len(viscosities)
    # Singles know no compressible oil, and have room for seven shapes.
    alone = film.constants[one.COMPRESSIBLE] > 0.0 or film.constants[one.N_SHAPES] >= BLOCK
    lanes = lane_work(film, 0 if alone else count, singles=True)
    return ElasticBore(
        film, lane_work(film, count), elastic_memory(film, count), np.array([bearing.contact_height]),
        np.array(viscosities, dtype=float), np.array([float(swings)]), law, lanes,
    )  # fmt: skip


def elastic_films(bearings: Bearings, grid: ElasticGrid = IN_LOOP) -> ElasticBore:
    """Make films of main bearings, each with its viscosity; a grid given with the bore replaces ``grid``."""
    parts, viscosities = bearings.parts, bearings.parameters[:, VISCOSITIES]
    bore = parts["bore"]
    size = bore.grid or grid
    return elastic_bore(bearings.plain, viscosities, bore, size, oil=bearings.oil)


def fine_films(bearings: Bearings) -> ElasticBore:
    """Make films of main bearings on the grid of level ``ehd:fine``."""
    return elastic_films(bearings, FINE)


def elastic_big_ends(bearings: Bearings, grid: ElasticGrid = IN_LOOP) -> ElasticBore:
    """Make films of big ends, whose force is independent of tilt; supply angles are measured in the axes of the rod."""
    bore, viscosities = bearings.parts["big_end_bore"], bearings.parameters[:, VISCOSITIES]
    size = bore.grid or grid
    return elastic_bore(bearings.plain, viscosities, bore, size, oil=bearings.oil, swings=bearings.swings)


def fine_big_ends(bearings: Bearings) -> ElasticBore:
    """Make films of big ends on the grid of level ``ehd:fine``."""
    return elastic_big_ends(bearings, FINE)


def film_values(bore: ElasticBore) -> int:
    """Return the number of values that one film adds to the state vector."""
    return bore.memory.start.shape[1] + 2 * bore.memory.shapes.shape[1] + KEPT + 2 * _staged(bore.film)


def elastic_arrays(
    bearing: PlainBearing,
    viscosity: float,
    bore: BoreCompliance,
    grid: ElasticGrid,
    oil: OilTables | None = None,
) -> ElasticFilm:
    """Return the data of one elastic film at ``viscosity`` (Pa s); the main bearings differ in viscosity only."""
    # Groove edges are grid lines, because rounding the groove to existing lines would change least films by a quarter.
    grid = replace(grid, groove=bearing.supply_width / bearing.width)
    zetas, angles = grid.zetas, grid.angles
    across = np.abs(zetas[1:-1]) <= grid.groove + 1.0e-9
    # A groove shorter than the spacing of the nodes is represented by the nodes nearest to it.
    reach = max(0.5 * bearing.supply_arc, 0.51 * 2.0 * math.pi / grid.n_phi)
    near = np.abs(np.angle(np.exp(1j * (angles - bearing.supply_angle)))) <= reach
    supply = np.outer(near | (bearing.groove == "circumferential"), across).astype(float)
    shapes = bore.shapes(angles, zetas)
    return grid.film(
        bearing.diameter, bearing.width, bearing.clearance, viscosity, shapes=shapes, compliance=bore.compliance,
        load_coupling=bore.load_coupling, supply=supply, supply_pressure=bearing.supply_pressure,
        contact=bearing_contact_constants(bearing), oil=oil, profile=over(bearing.relief),
    )  # fmt: skip


def elastic_memory(film: ElasticFilm, bearings: int) -> ElasticMemory:
    """Make the memory of ``bearings`` films, initially filled with oil and with round bores."""
    size = int(film.constants[one.N_PHI] * film.constants[one.N_Z])
    k = int(film.constants[one.N_SHAPES])
    z = np.zeros
    staged = _staged(film)
    return ElasticMemory(
        z((bearings, size)), z((bearings, 4)), z((bearings, 4)), z((bearings, k)), z((bearings, k)), z((bearings, k)),
        z((bearings, size)), z((bearings, k)), z((8, bearings, k)), z((bearings, 2, 4)), z(bearings),
        z((bearings, one.OUT_SIZE)), z((bearings, CALLS)), z((bearings, PEAKS)), z((bearings, CONTENT, staged)),
        z((8, bearings, staged)), z((bearings, staged)), z((8, bearings, staged)), z((bearings, staged)),
        z((bearings, 8)),
    )  # fmt: skip


def _staged(film: ElasticFilm) -> int:
    """Return the number of nodes whose oil follows the integrator's stages: all, or 0 if the oil is compressible."""
    return 0 if film.constants[one.COMPRESSIBLE] > 0.0 else int(film.constants[one.N_PHI] * film.constants[one.N_Z])


_SMALL = SMALLEST.film(1.0, 1.0, 1.0e-3, 1.0)
_read = record_reader(
    ElasticBore(
        _SMALL, lane_work(_SMALL, 0), elastic_memory(_SMALL, 1), np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(2),
        lane_work(_SMALL, 0, singles=True),
    )
)  # fmt: skip


@law_kernel
def elastic_law(record, action, i, place, velocity, numbers, memory, out):
    """Kernel of the film in an elastic bore; see :mod:`cranktrain.film.laws.films` for the arguments.

    ``memory`` is the film's part of the state; for OPEN_STAGE, the row of the stage in the integrator's table. The
    status is not 0 if the film failed.
    """
    bore = _read(record)
    own = bore.memory
    nodes = own.start.shape[1]
    shapes = own.shapes.shape[1]
    cos, sin, turn = _axes(bore, numbers)
    if action == FORCE:
        out[ECCENTRICITY] = math.sqrt(place[0] * place[0] + place[1] * place[1]) / bore.film.constants[one.CLEARANCE]
        if own.calls[i, ASKED] == 0.0:
            _move(bore, i, numbers, place, velocity)
            line_up(bore, i)
        status = solve_film(bore, i, numbers, False)
        if status != CONVERGED:
            return status
        force_in_frame(own.out[i], cos, sin, turn, out)
        out[FRICTION] = own.out[i, one.FRICTION_TORQUE]
    elif action == LINE_UP:
        _move(bore, i, numbers, place, velocity)
        line_up(bore, i)
    elif action == CLOSE_STAGE:
        if own.calls[i, ASKED] == 0.0:
            _move(bore, i, numbers, place, velocity)
            line_up(bore, i)
        status = solve_film(bore, i, numbers, True)
        for k in range(shapes):
            own.rates[int(numbers[STAGE]), i, k] = (own.shapes[i, k] - own.known[i, k]) / numbers[GAIN]
        close_content(bore, i, numbers)
        keep_stage(own, i, numbers)
        return status
    elif action == OPEN_STAGE:
        for k in range(shapes):
            past = own.start_shapes[i, k]
            for s in range(int(numbers[STAGE])):
                past += numbers[STEP] * memory[s] * own.rates[s, i, k]
            own.known[i, k] = past
        open_content(bore, i, numbers, memory)
        own.calls[i, SOLVED] = 0.0
    elif action == OPEN_STEP:
        _move(bore, i, numbers, place, velocity)
        for k in range(4):
            own.start_place[i, k] = own.motions[i, 0, k]
            own.start_pace[i, k] = own.motions[i, 1, k]
        for k in range(nodes):
            own.start[i, k] = memory[k]
            own.unknowns[i, k] = memory[k]
        for k in range(shapes):
            own.start_shapes[i, k] = memory[nodes + k]
            own.shapes[i, k] = memory[nodes + k]
            own.rates[0, i, k] = memory[nodes + shapes + k]
            own.start_rates[i, k] = memory[nodes + shapes + k]
        first = nodes + 2 * shapes + KEPT
        staged = own.slopes.shape[1]
        for k in range(staged):
            own.content_rates[0, i, k] = memory[first + k]
            own.slopes[i, k] = memory[first + staged + k]
        for k in range(own.times.shape[1]):
            own.times[i, k] = 0.0
        start_content(bore, i)
        open_lane(bore, i)
    elif action == CLOSE_STEP:
        n_z = int(bore.film.constants[one.N_Z])
        keep_peak(own.peaks[i], own.out[i, one.PRESSURE_MAX], own.unknowns[i], n_z, numbers[ANGLE])
        _keep_memory(own, i, int(numbers[STAGE]), memory)
    elif action == OIL:
        _take_limits(bore.film.constants, numbers[TOLERANCE])
        choose_precision(bore, i, numbers[TOLERANCE])
        return _take_oil(bore, i, numbers[VISCOSITY])
    else:
        _move(bore, i, numbers, place, velocity)
        if action == RATE:
            out[0] = closing_rate(
                bore.film, own.motions[i, 0], own.motions[i, 1], memory[nodes : nodes + shapes],
                memory[nodes + shapes : nodes + 2 * shapes], bore.contact_height[0],
            )  # fmt: skip
            return 0
        kept = memory[nodes + 2 * shapes :]
        turn_pairs(cos, -sin, kept, out)
        first = 4 - one.PRESSURE_MAX
        out[FRICTION] = kept[first + one.FRICTION_TORQUE]
        out[ECCENTRICITY] = math.sqrt(place[0] * place[0] + place[1] * place[1]) / bore.film.constants[one.CLEARANCE]
        out[P_MAX] = kept[first + one.PRESSURE_MAX]
        out[FLOW] = kept[first + one.SIDE_FLOW]
        out[GAP] = max(kept[first + one.FILM_MIN], 0.0)
        out[GAP_ANGLE] = kept[first + one.FILM_MIN_ANGLE]
    return 0


@kernel
def _take_limits(constants, tolerance):
    """Set the convergence limits of the films from the tolerance of the journals' Newton iteration, in clearances.

    The error after a Newton step is about the square of the step, and the next iteration of the journals starts from
    there. So a film is not solved much more accurately than the journals, and never more accurately than a single film
    (LIMITS). The factors are chosen: ``python -m benchmarks.elastic_cost``.
    """
    root = math.sqrt(tolerance)
    step, move, side, around = one.LIMITS
    constants[one.STEP_LIMIT] = max(step, root)
    constants[one.MOVE_LIMIT] = max(move, 3.0 * root)
    constants[one.SIDE_LIMIT] = max(side, 10.0 * tolerance)
    constants[one.AROUND_LIMIT] = max(around, 10.0 * tolerance)


@kernel
def _take_oil(bore, i, viscosity):
    """Set the viscosity of film i, Pa s. Return 0, or 1 if it is too low for the law of viscosity over pressure."""
    bore.viscosities[i] = viscosity
    constants = bore.film.constants
    if constants[one.OIL_STEP] == 0.0:
        return 0
    law = int(bore.oil_law[0])
    first = bore.oil_law[1]
    second = 0.0
    if law == ROELANDS:
        first, second = roelands_constants(viscosity, bore.oil_law[1])
        if not first > 0.0:
            return 1
    fill_oil_table(law, first, second, constants[one.COMPRESSIBLE] > 0.0, bore.film.oil[i])
    return 0


@inlined_kernel
def _keep_memory(own, i, stage, memory):
    """Copy the solution of film i at the last stage of a step to its part of the state."""
    nodes = own.start.shape[1]
    shapes = own.shapes.shape[1]
    for k in range(nodes):
        memory[k] = own.unknowns[i, k]
    for k in range(shapes):
        memory[nodes + k] = own.shapes[i, k]
        memory[nodes + shapes + k] = own.rates[stage, i, k]
    for k in range(4):
        memory[nodes + 2 * shapes + k] = own.out[i, one.FORCE + k]
    for k in range(one.PRESSURE_MAX, one.OIL + 1):
        memory[nodes + 2 * shapes + 4 + k - one.PRESSURE_MAX] = own.out[i, k]
    staged = own.slopes.shape[1]
    if staged > 0:
        end_slopes(own, i, stage)
    for k in range(staged):
        memory[nodes + 2 * shapes + KEPT + k] = own.content_ends[i, k]
        memory[nodes + 2 * shapes + KEPT + staged + k] = own.slopes[i, k]


@inlined_kernel
def _axes(bore, numbers):
    """Cosine and sine of the angle from the axes of the bore to those of the motion, and speed of the bore, rad/s."""
    if bore.swings[0] > 0.0:
        return 1.0, 0.0, 0.5 * (numbers[SPEED] - numbers[RUBBING])
    return numbers[COS], numbers[SIN], numbers[TURN]


@inlined_kernel
def _move(bore, i, numbers, place, velocity):
    """Store motion and speed of journal i in the axes of its bore, which are at rest in space or turn with a rod."""
    own = bore.memory
    cos, sin, turn = _axes(bore, numbers)
    turn_pairs(cos, sin, place, own.motions[i, 0])
    turn_pairs(cos, sin, velocity, own.motions[i, 1])
    own.speeds[i] = numbers[SPEED]
    if turn != 0.0:
        own.speeds[i] -= 2.0 * turn
        for pair in range(0, 4, 2):
            own.motions[i, 1, pair] += turn * own.motions[i, 0, pair + 1]
            own.motions[i, 1, pair + 1] -= turn * own.motions[i, 0, pair]
