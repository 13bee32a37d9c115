"""Elastohydrodynamic film solved online: mass-conserving Reynolds' equation coupled with the elastic bore.

The film is h = c + g(ζ) − (x + ζa) cos φ − (y + ζb) sin φ + Σ_k δ_k S_k(φ, ζ) with the relief g of the shell. It
depends on the motion of the journal and on a few shapes of the bore (the compliance of an elastic journal is added to
the bore's). The shapes deflect under film and contact pressure together,

    δ_k = Σ_l C_kl ∫ S_l (p + p_c) dA   (+ Σ_r g_kr ∫ (cos φ, sin φ, ζ cos φ, ζ sin φ)_r (p + p_c) dA),

and move by the rule of the integrator's stage, δ̇ = (δ − Δ)/g with Δ from the past and g = γh. Oil balances, rupture and
refilling are those of :mod:`cranktrain.film.elastic.balance`; p_c(h) is Greenwood and Tripp's.

Solution: a semi-smooth Newton method solves node unknowns and shapes together. The balance is a band matrix; the shapes
are its border. A node changes between full and ruptured when its unknown changes sign. For a fixed film this active-set
method converges from any start, because the matrix is an M-matrix. A Newton step may close the film by at most a
fraction of its thickness. The converged set is solved once more, so the result depends on the initial guess only within
the tolerances of the film (STEP_LIMIT and those after it). Tangents of the converged set follow from the implicit
function theorem and include the response of the shapes.

Films are solved eight at once in singles, or one in doubles (:mod:`cranktrain.core.side_by_side`). A converged lane
keeps the state of its last matrix while other lanes iterate, so repeated computations give the same result: a film's
result does not depend on the other lanes. Films that do not converge in singles, films of compressible oil, and films
of a tolerance that singles do not reach are solved in doubles.

The dependence of viscosity and density on pressure is that of :mod:`cranktrain.film.elastic.oil`. The axes are those of
the bore, which is at rest. Gauge pressure is zero at both ends, and supply nodes have the supply pressure.
"""

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.side_by_side import lane_count
from cranktrain.film.elastic import grid as one
from cranktrain.film.elastic import workspace as at
from cranktrain.film.elastic.balance import take_sides
from cranktrain.film.elastic.begin import begin_solution, prepare_stage, prepare_step, set_lane, turn_geometry
from cranktrain.film.elastic.gaps import oil_state
from cranktrain.film.elastic.newton import film_tangents, solve_films, take_last_step
from cranktrain.film.elastic.result import film_figures, film_forces

CONVERGED, NOT_CONVERGED = 0, 1

MOST_PASSES, MOST_ITERATIONS = np.int64(12), np.int64(30)
"""Limits of Newton iterations in singles and in doubles; a film in singles that needs more usually does not converge at
all. The np.int64 type avoids that numba compiles :func:`solve_films` for each literal."""
ROUGHEST, LOWERING, EASING, LAST = 0.3, 0.4, np.int64(20), np.int64(60)
"""Continuation if plain Newton fails: first roughness over the clearance, its factor from solution to solution, Newton
iterations of an intermediate and of the last solution."""
LEAST_MOBILITY = 1.0e-3
"""Mobility of oil below which a film is solved in doubles. Tangents of films in singles have an error of 2e-4 at a
mobility of 0.04 and are useless at 1e-7."""


@kernel
def solve_group(film, work, group, clock, own):
    """Solve the films of a group's lanes, which :func:`cranktrain.film.elastic.begin.set_lane` has set up.

    On entry ``work.wanted`` is 1 for requested lanes, ``work.tangents`` for lanes with tangents. On return
    ``work.status`` holds CONVERGED or NOT_CONVERGED; nothing else is written for a film that did not converge. Returns
    the Newton iterations of the group.

    Parameters
    ----------
    clock : time over which voids change, s; g of the stage's rule, s; 1 if values for outputs are requested
    own : memory of the films, with the arrays ``start`` (b, N n), unknowns at the step's start; ``unknowns`` (b, N n)
        and ``shapes`` (b, k), m, in: initial guess, out: solution; ``out`` (b, OUT_SIZE), the results named in
        :mod:`cranktrain.film.elastic.grid`; ``content`` (b, CONTENT, N n) of the stage, or without nodes for backward
        Euler from the step's start; and those of :func:`cranktrain.film.elastic.begin.set_lane`
    """
    elapsed, gain, figures = clock
    per_step = 1.0 / elapsed
    per_gain = 1.0 / gain
    wanted = work.wanted
    if work.marks[group, 0, at.PREPARED] == 0.0:
        prepare_step(film, work, group, own.start)
    if work.marks[group, 0, at.STAGED] == 0.0 and own.content.shape[2] > 0:
        prepare_stage(film, work, group, own.content)
    take_sides(film, work, group, own.unknowns)
    begin_solution(film, work, group, per_step, per_gain)
    most = MOST_ITERATIONS if lane_count(work.nodes) == 1 else MOST_PASSES
    passes, width = solve_films(film, work, group, film.constants[one.ROUGHNESS], (per_step, per_gain), most)
    if lane_count(work.nodes) == 1 and work.status[0] == 0.0:
        again, width = _lowered(film, work, group, (per_step, per_gain), own)
        passes += again
        if work.status[0] > 0.0:
            work.status[0] = float(passes)
    tangents = False
    for c in range(wanted.shape[0]):
        good = work.status[c] > 0.0 and (lane_count(work.nodes) == 1 or _flows(film, work, group, c))
        work.asked[c] = wanted[c]
        if not good:
            wanted[c] = 0.0
            work.tangents[c] = 0.0
        if wanted[c] > 0.0:
            own.out[int(work.own[c]), one.ITERATIONS] = work.status[c]
        tangents = tangents or work.tangents[c] > 0.0
        work.status[c] = float(CONVERGED if good else NOT_CONVERGED)
    if tangents:
        film_tangents(film, work, group, width, own.out)
    take_last_step(film, work, group)
    if lane_count(work.nodes) == 1:
        oil_state(film, work, group)
    film_forces(film, work, group, own.out)
    if figures > 0.0:
        film_figures(film, work, group, own.out)
    _write(film, work, group, own, figures > 0.0)
    return float(passes)


@kernel
def elastic_film(film, work, i, clock, own, viscosity, tangents):
    """Solve film ``i`` of the memory ``own`` in doubles, as group ``i``. Return CONVERGED or NOT_CONVERGED.

    The marks PREPARED and STAGED of the group are 0 at the first solution of a step and of a stage.

    Parameters
    ----------
    film, work : ElasticFilm and LaneWork of a film in doubles
    clock : time over which voids change, s (g of the stage, or the time from the step's start if the memory has no
        content; infinite for a steady film); g in δ̇ = (δ − Δ)/g, s, infinite for a steady bore
    own : memory of films, see :func:`solve_group`
    viscosity : Pa s
    tangents : bool
        if False, ``own.out`` keeps the tangents of the previous call
    """
    set_lane(film, work, 0, i, viscosity, own)
    turn_geometry(film, work, i, 0, 0)
    work.marks[i, 0, at.RESIDENT] = 0.0
    work.wanted[0] = 1.0
    work.tangents[0] = 1.0 if tangents else 0.0
    solve_group(film, work, i, (clock[0], clock[1], 1.0), own)
    return int(work.status[0])


@kernel
def _lowered(film, work, group, rates, own):
    """Solve a film by continuation from rougher surfaces, in at most two attempts. Return iterations and band's width.

    If surfaces overlap far, the mean gap is so small that no pressure drives out the oil, and Newton's method does not
    converge. A larger roughness gives a larger mean gap, so the bore can open first.
    """
    sigma = film.constants[one.ROUGHNESS]
    passes = 0
    width = 0
    for attempt in range(2):
        for k in range(own.known.shape[1]):
            work.shifts[at.SHIFT, k] = work.shifts[at.KNOWN, k]
        take_sides(film, work, group, own.start)
        begin_solution(film, work, group, rates[0], rates[1])
        raised = ROUGHEST
        while raised > sigma:
            passes += solve_films(film, work, group, raised, rates, EASING)[0]
            raised *= LOWERING if attempt == 0 else math.sqrt(LOWERING)
        again, width = solve_films(film, work, group, sigma, rates, LAST)
        passes += again
        if work.status[0] > 0.0:
            break
    return passes, width


@kernel
def _flows(film, work, group, c):
    """True if the oil is mobile enough at all nodes; else single precision cannot resolve neighbouring pressures."""
    if film.constants[one.OIL_STEP] == 0.0:
        return True
    nodes = work.nodes[group]
    lanes = lane_count(work.nodes)
    flows = True
    for q in range(nodes.shape[1] // lanes):
        flows = flows and nodes[at.MOBILITY, lanes * q + c] >= LEAST_MOBILITY
    return flows


@kernel
def _write(film, work, group, own, whole):
    """Write the shapes of converged films and, if ``whole``, the unknowns, with void fractions limited to 1."""
    n_phi = int(film.constants[one.N_PHI])
    n_z = int(film.constants[one.N_Z])
    lines = n_z + 2
    lanes = lane_count(work.nodes)
    nodes = work.nodes[group]
    for c in range(lanes):
        if work.wanted[c] == 0.0:
            continue
        i_film = int(work.own[c])
        work.marks[group, c, at.RESIDENT] = 1.0
        for k in range(own.shapes.shape[1]):
            own.shapes[i_film, k] = work.shifts[at.SHIFT, lanes * k + c] * film.constants[one.CLEARANCE]
        if not whole:
            continue
        cut = int(work.marks[group, c, at.CUT])
        clipped = 0
        for position in range(n_phi):
            i = (cut + position) % n_phi
            for j in range(n_z):
                q = lanes * (position * lines + j + 1) + c
                u = float(nodes[at.PRESSURE, q])
                if nodes[at.FULL, q] == 0.0:
                    u = float(nodes[at.VOID, q])
                    if u < -1.0:
                        u = -1.0
                        clipped += 1
                own.unknowns[i_film, i * n_z + j] = u
        own.out[i_film, one.CLIPPED] = float(clipped)
