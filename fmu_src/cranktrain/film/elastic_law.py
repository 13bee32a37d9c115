"""Elastic films of the main bearings in the running model: their data, their memory, and their force in the loop.

A film remembers its oil and the form of its bore. Both belong to the state: node unknowns, shapes δ and their rates at
the end of the last step. Within a step

* shapes follow the stage's own rule, δ_s = Δ + g δ̇_s with Δ = δ_n + h Σ_j a_sj δ̇_j and g = hγ, so that the squeeze of
  the elastic bore is of the integrator's order (generalised-α: backward Euler);
* voids fill and empty by backward Euler from the step's start, which keeps every fill within [0, 1].

Oil comes through a hole in the bore, or a groove all around it, at its supply pressure. The bore stands still in space:
journals come in the frame's axes and are turned there and back.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cranktrain.engine import PlainBearing
from cranktrain.film.asperity import bearing_contact_constants
from cranktrain.film.bore_compliance import BoreCompliance
from cranktrain.film.elastic_grid import (
    CLEARANCE,
    CONTACT_LOAD,
    CONTACT_SHARE,
    DAMPING,
    FILL_MEAN,
    FILM_MIN,
    FILM_MIN_ANGLE,
    FILM_MIN_ZETA,
    FORCE,
    FRICTION_TORQUE,
    N_PHI,
    N_SHAPES,
    N_Z,
    OIL,
    OUT_SIZE,
    PRESSURE_MAX,
    SIDE_FLOW,
    STIFFNESS,
    SUPPLY_FLOW,
    ElasticFilm,
    ElasticGrid,
)
from cranktrain.film.elastohydrodynamic import CONVERGED, elastic_film
from cranktrain.kernel import kernel
from cranktrain.reduced_body import Array

SHAPES = 8
"""Bore shapes that a running film carries."""
IN_LOOP = ElasticGrid(48, 7)
SMALLEST = ElasticGrid(12, 5)
"""Grid of levels that do not read it."""

# What the state keeps of a film's result, beside unknowns, shapes and rates.
KEPT_FORCE, KEPT_PRESSURE, KEPT_FILM, KEPT_ANGLE, KEPT_ZETA = 0, 4, 5, 6, 7
KEPT_SIDE_FLOW, KEPT_SUPPLY_FLOW, KEPT_FRICTION, KEPT_CONTACT, KEPT_SHARE = 8, 9, 10, 11, 12
KEPT_FILL, KEPT_OIL, KEPT = 13, 14, 15


class ElasticMemory(NamedTuple):
    """What the films of b journals read and write during a step; N nodes, k shapes."""

    start: Array  # (b, N) node unknowns at the step's start
    start_place: Array  # (b, 4) in space, m
    start_shapes: Array  # (b, k) m
    known: Array  # (b, k) Δ of the stage, m
    unknowns: Array  # (b, N) at the stage
    shapes: Array  # (b, k) at the stage, m
    rates: Array  # (stages, b, k) δ̇ of each stage, m/s
    timing: Array  # (2,) time from the step's start to the stage, and g, s
    motion: Array  # (2, 4) place and velocity in space
    out: Array  # (b, OUT_SIZE)


def elastic_arrays(bearing: PlainBearing, viscosity: float, bore: BoreCompliance, grid: ElasticGrid) -> ElasticFilm:
    """Data of one elastic film of a main bearing at ``viscosity`` (Pa s); all mains share it."""
    zetas = grid.zetas
    angles = grid.angles
    half_angle = bearing.oil_hole_diameter / bearing.diameter
    if bearing.groove == "circumferential":
        supply = np.zeros((grid.n_phi, grid.n_z))
        supply[:, grid.n_z // 2] = 1.0
    else:
        # A hole narrower than the spacing of nodes is the node nearest to it.
        reach = max(half_angle, 0.51 * 2.0 * math.pi / grid.n_phi)
        near = np.abs(np.angle(np.exp(1j * (angles - bearing.oil_hole_angle)))) <= reach
        across = np.abs(zetas[1:-1]) <= max(bearing.oil_hole_diameter / bearing.width, 1.0e-12)
        supply = np.outer(near, across).astype(float)
    shapes = bore.shapes(angles, zetas)
    return grid.film(
        bearing.diameter, bearing.width, bearing.clearance, viscosity, shapes=shapes, compliance=bore.compliance,
        load_coupling=bore.load_coupling, supply=supply, supply_pressure=bearing.supply_pressure,
        contact=bearing_contact_constants(bearing),
    )  # fmt: skip


def no_elastic_film() -> ElasticFilm:
    """An elastic film of the least size, for levels that have none."""
    return SMALLEST.film(1.0, 1.0, 1.0e-3, 1.0)


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
        z((bearings, k)), z((8, bearings, k)), z(2), z((2, 4)), z((bearings, OUT_SIZE)),
    )  # fmt: skip


@kernel
def turn_pairs(cos, sin, vector, out):
    """Turn the two plane vectors of (4,) by the angle whose cosine and sine are given."""
    for pair in range(0, 4, 2):
        x = vector[pair]
        y = vector[pair + 1]
        out[pair] = cos * x - sin * y
        out[pair + 1] = sin * x + cos * y


@kernel
def elastic_solve(film, scratch, memory, i, place, velocity, speed, cos, sin, tangents):
    """Solve film i for the journal's place and velocity in the frame's axes; CONVERGED or what went wrong."""
    turn_pairs(cos, sin, place, memory.motion[0])
    turn_pairs(cos, sin, velocity, memory.motion[1])
    status = elastic_film(
        film, memory.motion[0], memory.motion[1], speed, memory.timing[0], memory.timing[1], memory.start[i],
        memory.start_place[i], memory.start_shapes[i], memory.known[i], memory.unknowns[i], memory.shapes[i], scratch,
        memory.out[i], tangents,
    )  # fmt: skip
    if status != CONVERGED:
        # The next attempt, of a shorter step, begins with what is sure.
        for k in range(memory.start.shape[1]):
            memory.unknowns[i, k] = memory.start[i, k]
        for k in range(memory.start_shapes.shape[1]):
            memory.shapes[i, k] = memory.start_shapes[i, k]
    return status


@kernel
def elastic_force(result, status, cos, sin, out):
    """Force of a film's ``result`` and its tangents in the frame's axes, ``out[0:36]``; no number where it failed."""
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
    if status != CONVERGED:
        for k in range(4):
            out[k] = math.nan


@kernel
def kept_result(result, kept):
    """What the state keeps of a film's result, (KEPT,)."""
    for k in range(4):
        kept[KEPT_FORCE + k] = result[FORCE + k]
    kept[KEPT_PRESSURE] = result[PRESSURE_MAX]
    kept[KEPT_FILM] = result[FILM_MIN]
    kept[KEPT_ANGLE] = result[FILM_MIN_ANGLE]
    kept[KEPT_ZETA] = result[FILM_MIN_ZETA]
    kept[KEPT_SIDE_FLOW] = result[SIDE_FLOW]
    kept[KEPT_SUPPLY_FLOW] = result[SUPPLY_FLOW]
    kept[KEPT_FRICTION] = result[FRICTION_TORQUE]
    kept[KEPT_CONTACT] = result[CONTACT_LOAD]
    kept[KEPT_SHARE] = result[CONTACT_SHARE]
    kept[KEPT_FILL] = result[FILL_MEAN]
    kept[KEPT_OIL] = result[OIL]


@kernel
def closing_rate(film, place, velocity, shapes, rates, least):
    """Largest rate (1/s) at which the film shrinks, over itself or ``least`` (m), whichever is more."""
    c = film.constants[CLEARANCE]
    lines = int(film.constants[N_Z]) + 2
    n_shapes = int(film.constants[N_SHAPES])
    worst = 0.0
    for i in range(int(film.constants[N_PHI])):
        cos = film.trig[i, 0]
        sin = film.trig[i, 1]
        for line in range(lines):
            q = i * lines + line
            zeta = film.lines[line, 0]
            h = c - (place[0] + zeta * place[2]) * cos - (place[1] + zeta * place[3]) * sin
            rate = (velocity[0] + zeta * velocity[2]) * cos + (velocity[1] + zeta * velocity[3]) * sin
            for k in range(n_shapes):
                h += shapes[k] * film.shapes[q, k + 1]
                rate -= rates[k] * film.shapes[q, k + 1]
            worst = max(worst, rate / max(h, least))
    return worst
