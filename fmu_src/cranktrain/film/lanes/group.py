"""Solution of a group of up to eight elastic films at a stage of a step, including transfer from and to memory."""

from cranktrain.core.kernel import kernel
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic.film import CONVERGED, NOT_CONVERGED
from cranktrain.film.lanes import grid as at
from cranktrain.film.lanes.balance import take_sides
from cranktrain.film.lanes.begin import begin_solution, prepare_stage, prepare_step
from cranktrain.film.lanes.film import film_tangents, solve_films, take_last_step
from cranktrain.film.lanes.result import film_figures, film_forces

LEAST_MOBILITY = 1.0e-3
"""Mobility of oil below which a film is solved alone in double precision. Tangents of films in lanes have an error of
2e-4 at a mobility of 0.04 and are useless at 1e-7."""


@kernel
def solve_group(film, work, group, clock, memory):
    """Solve the films of a group's lanes, which ``lane_units`` and ``lane_motion`` have set up.

    On entry ``work.wanted`` is 1 for requested lanes, ``work.tangents`` for lanes with tangents. On return
    ``work.status`` holds CONVERGED or NOT_CONVERGED; nothing else is written for a film that did not converge. Returns
    the Newton iterations of the group.

    Parameters
    ----------
    clock : time over which voids change, s; g of the stage's rule, s; 1 if values for outputs are requested
    memory : unknowns at the step's start (b, N n); unknowns (b, N n) and shapes (b, k), m, in: initial guess, out:
        solution; results (b, OUT_SIZE); content of the stage (b, CONTENT, N n), or without nodes for backward Euler
        from the step's start
    """
    elapsed, gain, figures = clock
    starts, unknowns, shapes, outs, content = memory
    per_step = 1.0 / elapsed
    per_gain = 1.0 / gain
    wanted = work.wanted
    own = work.own
    if work.marks[group, 0, at.PREPARED] == 0.0:
        prepare_step(film, work, group, starts, own)
    if work.marks[group, 0, at.STAGED] == 0.0 and content.shape[2] > 0:
        prepare_stage(film, work, group, content, own)
    take_sides(film, work, group, unknowns, own)
    begin_solution(film, work, group, per_step, per_gain)
    passes = solve_films(film, work, group, per_step, per_gain)
    tangents = False
    for c in range(at.LANES):
        good = work.status[c] > 0.0 and _flows(film, work, group, c)
        work.asked[c] = wanted[c]
        if not good:
            wanted[c] = 0.0
            work.tangents[c] = 0.0
        if wanted[c] > 0.0:
            outs[int(own[c]), one.ITERATIONS] = work.status[c]
        tangents = tangents or work.tangents[c] > 0.0
        work.status[c] = float(CONVERGED if good else NOT_CONVERGED)
    if tangents:
        film_tangents(film, work, group, outs, work.tangents, own)
    take_last_step(film, work, group)
    film_forces(film, work, group, outs, wanted, own)
    if figures > 0.0:
        film_figures(film, work, group, outs, wanted, own)
    _write(film, work, group, unknowns, shapes, outs, figures > 0.0)
    return float(passes)


@kernel
def _flows(film, work, group, c):
    """True if the oil is mobile enough at all nodes; else single precision cannot resolve neighbouring pressures."""
    if film.constants[one.OIL_STEP] == 0.0:
        return True
    nodes = work.nodes[group]
    flows = True
    for q in range(nodes.shape[1] // 8):
        flows = flows and nodes[at.MOBILITY, 8 * q + c] >= LEAST_MOBILITY
    return flows


@kernel
def _write(film, work, group, unknowns, shapes, outs, whole):
    """Write the shapes of converged films and, if ``whole``, the unknowns, with void fractions limited to 1."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    nodes = work.nodes[group]
    for c in range(at.LANES):
        if work.wanted[c] == 0.0:
            continue
        i_film = int(work.own[c])
        work.marks[group, c, at.RESIDENT] = 1.0
        for k in range(shapes.shape[1]):
            shapes[i_film, k] = work.wide[8 * (at.SHIFT + k) + c] * film.constants[one.CLEARANCE]
        if not whole:
            continue
        cut = int(work.marks[group, c, at.CUT])
        clipped = 0
        for position in range(n_phi):
            i = cut + position
            if i >= n_phi:
                i -= n_phi
            for j in range(n_z):
                q = position * lines + j + 1
                u = float(nodes[at.PRESSURE, 8 * q + c])
                if nodes[at.FULL, 8 * q + c] == 0.0:
                    u = float(nodes[at.VOID, 8 * q + c])
                    if u < -1.0:
                        u = -1.0
                        clipped += 1
                unknowns[i_film, i * n_z + j] = u
        outs[i_film, one.CLIPPED] = float(clipped)
