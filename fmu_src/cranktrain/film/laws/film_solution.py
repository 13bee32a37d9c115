"""Solution of elastic films at a stage, one film at a time or several side by side in lanes.

Films that were lined up are solved together at the first call for one of them; see LINE_UP in
:mod:`cranktrain.film.laws.films`. A film that fails in its lane is solved alone.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.film.elastic import workspace as lanes
from cranktrain.film.elastic.begin import choose_cut, set_lane, turn_geometry
from cranktrain.film.elastic.content import begin_content, content_rates, stage_content
from cranktrain.film.elastic.film import CONVERGED, elastic_film, solve_group
from cranktrain.film.elastic.grid import ITERATIONS
from cranktrain.film.laws.films import ELAPSED, FROZEN, GAIN, STAGE, STEP
from cranktrain.film.laws.foresight import foresee

SOLVED, EVALUATIONS, TANGENTS, PASSES, ASKED, READY, STATUS, GROUPS, GROUP_PASSES, CALLS = range(10)
"""Columns of ``ElasticMemory.calls``: solutions of the film at the present stage. Counts over the whole run: solutions,
solutions with tangents, Newton iterations. Then 1 if the film is lined up, 1 if the lanes have solved the film at its
present motion, and the status of this solution. The last two columns count, over the whole run, solutions and Newton
iterations of a group of films, in the row of the group's first film."""
IN_DOUBLES = 1.0e-6
"""Newton tolerance (clearances) at or below which films are solved in double precision, because lanes reach 2e-6."""


@kernel
def choose_precision(bore, i, tolerance):
    """Choose double precision, without lanes, for film i if ``tolerance`` of the journals is finer than lanes reach."""
    if bore.lanes.marks.shape[0] > 0:
        alone = 1.0 if tolerance <= IN_DOUBLES else 0.0
        bore.lanes.marks[i // lanes.LANES, i % lanes.LANES, lanes.ALONE] = alone


@kernel
def open_lane(bore, i):
    """Choose the angle at which the ring of film i is cut for its lane, and mark its group for a new preparation."""
    bore.scratch.marks[i, 0, lanes.PREPARED] = 0.0
    if bore.lanes.marks.shape[0] == 0:
        return
    group = i // lanes.LANES
    lane = i - group * lanes.LANES
    turn_geometry(bore.film, bore.lanes, group, lane, choose_cut(bore.film, bore.memory.start[i]))
    bore.lanes.marks[group, 0, lanes.PREPARED] = 0.0
    bore.lanes.marks[group, lane, lanes.RESIDENT] = 0.0
    bore.memory.calls[i, ASKED] = 0.0


@kernel
def start_content(bore, i):
    """Compute the oil content of the nodes of film i at the step's start."""
    own = bore.memory
    if own.content.shape[2] > 0:
        past = own.start[i], own.start_place[i], own.start_pace[i], own.start_shapes[i], own.start_rates[i]
        begin_content(bore.film, bore.scratch, past, own.content[i])


@kernel
def open_content(bore, i, numbers, row):
    """Compute the oil content of film i from the earlier stages; ``row`` is the stage's row of the integrator."""
    own = bore.memory
    if own.content.shape[2] == 0:
        return
    stage = int(numbers[STAGE]), row, numbers[STEP], numbers[GAIN], numbers[ELAPSED]
    stage_content(bore.film, own.start[i], own.content_rates, i, stage, own.content[i])
    bore.scratch.marks[i, 0, lanes.STAGED] = 0.0
    if bore.lanes.marks.shape[0] > 0:
        bore.lanes.marks[i // lanes.LANES, 0, lanes.STAGED] = 0.0


@kernel
def close_content(bore, i, numbers):
    """Store the rate of oil content of the nodes of film i at the solved stage."""
    own = bore.memory
    if own.content.shape[2] == 0:
        return
    stage = int(numbers[STAGE])
    content_rates(
        bore.film, bore.scratch, own.start[i], (own.unknowns[i], own.motions[i], own.shapes[i], own.rates[stage, i]),
        numbers[GAIN], own.content[i], own.content_rates[stage, i], own.content_ends[i],
    )  # fmt: skip


@inlined_kernel
def _time_of_voids(own, numbers):
    """Return the time (s) over which void fractions change: g of the stage; for unstaged oil, since the step began."""
    return numbers[GAIN] if own.content.shape[2] > 0 else numbers[ELAPSED]


@kernel
def line_up(bore, i):
    """Mark film i for solution in lanes, together with other films."""
    if bore.lanes.marks.shape[0] > 0 and bore.lanes.marks[i // lanes.LANES, i % lanes.LANES, lanes.ALONE] == 0.0:
        bore.memory.calls[i, ASKED] = 1.0
        bore.memory.calls[i, READY] = 0.0


@kernel
def solve_film(bore, i, numbers, closing):
    """Solve film i for its force, or if ``closing`` at the converged position of a stage. Return the status."""
    calls = bore.memory.calls
    if calls[i, ASKED] > 0.0:
        if calls[i, READY] == 0.0:
            _solve_lanes(bore, i // lanes.LANES, numbers, closing)
        calls[i, ASKED] = 0.0
        if calls[i, STATUS] == CONVERGED:
            return CONVERGED
    return solve_alone(bore, i, numbers, not closing and (numbers[FROZEN] == 0.0 or calls[i, SOLVED] == 0.0))


@kernel
def solve_alone(bore, i, numbers, tangents):
    """Solve film i at a stage, write the result to ``memory.out[i]`` and return the status."""
    own = bore.memory
    clock = _time_of_voids(own, numbers), numbers[GAIN]
    _not_resident(bore, i)
    status = elastic_film(bore.film, bore.scratch, i, clock, own, bore.viscosities[i], tangents)
    _count(own, i, tangents)
    if status != CONVERGED:
        # The next attempt, with a shorter step, starts from the last converged state.
        for k in range(own.start.shape[1]):
            own.unknowns[i, k] = own.start[i, k]
        for k in range(own.shapes.shape[1]):
            own.shapes[i, k] = own.start_shapes[i, k]
    return status


@inlined_kernel
def _not_resident(bore, i):
    """Mark film i so that its lane reads the unknowns again."""
    if bore.lanes.marks.shape[0] > 0:
        bore.lanes.marks[i // lanes.LANES, i % lanes.LANES, lanes.RESIDENT] = 0.0


@kernel
def _count(own, i, tangents):
    """Increase the counters of film i by one solution."""
    own.calls[i, SOLVED] += 1.0
    own.calls[i, EVALUATIONS] += 1.0
    own.calls[i, TANGENTS] += 1.0 if tangents else 0.0
    own.calls[i, PASSES] += own.out[i, ITERATIONS]


@kernel
def _solve_lanes(bore, group, numbers, closing):
    """Solve the lined-up films of a group; ``closing`` is True at the end of a stage."""
    own = bore.memory
    work = bore.lanes
    first = group * lanes.LANES
    count = own.calls.shape[0]
    for lane in range(lanes.LANES):
        # Lanes without a film repeat the film of the first lane.
        i = first + lane if first + lane < count else first
        if first + lane >= count or work.marks[group, lane, lanes.CUT] < 0.0:
            turn_geometry(bore.film, work, group, lane, max(int(work.marks[group, 0, lanes.CUT]), 0))
        asked = first + lane < count and own.calls[i, ASKED] > 0.0
        tangents = False
        if asked and not closing:
            if own.calls[i, SOLVED] == 0.0:
                foresee(own, i, numbers)
                _not_resident(bore, i)
            tangents = numbers[FROZEN] == 0.0 or own.calls[i, SOLVED] == 0.0
        work.wanted[lane] = 1.0 if asked else 0.0
        work.tangents[lane] = 1.0 if asked and tangents else 0.0
        set_lane(bore.film, work, lane, i, bore.viscosities[i], own)
    clock = _time_of_voids(own, numbers), numbers[GAIN], 1.0 if closing else 0.0
    passes = solve_group(bore.film, work, group, clock, own)
    own.calls[first, GROUPS] += 1.0
    own.calls[first, GROUP_PASSES] += passes
    for lane in range(min(lanes.LANES, count - first)):
        i = first + lane
        if work.asked[lane] > 0.0:
            own.calls[i, READY] = 1.0
            own.calls[i, STATUS] = work.status[lane]
            if work.status[lane] == CONVERGED:
                _count(own, i, work.tangents[lane] > 0.0)
