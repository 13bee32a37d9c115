"""Height of a film between a journal and the bore's shapes, its floor, and the contact that stands on it."""

from __future__ import annotations

import math

from cranktrain.core.kernel import kernel
from cranktrain.film.contact.asperity import HIGHEST, SIGMA, contact_pressure
from cranktrain.film.elastic.grid import (
    BEND,
    CLEARANCE,
    CONTACT,
    CONTACT_SLOPE,
    FACE_OPEN,
    FACE_SLOPE,
    FILM,
    N_PHI,
    N_Z,
    OPEN,
    RADIUS,
    SLOPE,
    VISCOSITY,
)


@kernel
def pressure_unit(constants):
    """p₀ = 12 η (R/c)² (Pa s)."""
    return 12.0 * constants[VISCOSITY] * (constants[RADIUS] / constants[CLEARANCE]) ** 2


@kernel
def combined(row, shares, columns):
    """Σ row·shares over a multiple of eight columns, summed in pairs: shorter chains than one by one."""
    total = 0.0
    for r in range(0, columns, 8):
        a = row[r] * shares[r] + row[r + 1] * shares[r + 1]
        b = row[r + 2] * shares[r + 2] + row[r + 3] * shares[r + 3]
        c = row[r + 4] * shares[r + 4] + row[r + 5] * shares[r + 5]
        d = row[r + 6] * shares[r + 6] + row[r + 7] * shares[r + 7]
        total += (a + b) + (c + d)
    return total


@kernel
def node_films(film, place, shift, out):
    """Unfloored film H at all nodes and both ends into ``out``.

    ``place`` (4,) position and tilt over the clearance, ``shift`` amplitudes of the shapes over the clearance, filled
    up with zeros to the columns of ``film.shapes``.
    """
    n_phi = int(film.constants[N_PHI])
    lines = int(film.constants[N_Z]) + 2
    columns = film.shapes.shape[1]
    for i in range(n_phi):
        cos = film.trig[i, 0]
        sin = film.trig[i, 1]
        middle = 1.0 - place[0] * cos - place[1] * sin
        tilt = place[2] * cos + place[3] * sin
        for j in range(lines):
            row = film.shapes[i * lines + j]
            total = middle - tilt * film.lines[j, 0]
            total += combined(row, shift, columns)
            out[i * lines + j] = total


@kernel
def face_films(film, place, shift, out):
    """Unfloored film H at the circumferential faces into ``out``."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    columns = film.shapes.shape[1]
    first = n_phi * (n_z + 2)
    for i in range(n_phi):
        cos = film.trig[i, 2]
        sin = film.trig[i, 3]
        middle = 1.0 - place[0] * cos - place[1] * sin
        tilt = place[2] * cos + place[3] * sin
        for j in range(n_z):
            row = film.shapes[first + i * n_z + j]
            total = middle - tilt * film.lines[j + 1, 0]
            total += combined(row, shift, columns)
            out[i * n_z + j] = total


@kernel
def open_films(film, floor, nodes, faces):
    """Floored films with first and second derivative, at nodes and faces; contact pressure, over p₀, with its slope."""
    constants = film.constants
    h = nodes[FILM]
    is_open = nodes[OPEN]
    slope = nodes[SLOPE]
    bend = nodes[BEND]
    for k in range(h.shape[0]):
        above = h[k] - floor
        root = math.sqrt(above * above + floor * floor)
        inverse = 1.0 / root
        # ½(above + root), without cancellation below the floor.
        rest = 0.5 * (above + root) if above > 0.0 else 0.5 * floor * floor / (root - above)
        is_open[k] = floor + rest
        slope[k] = rest * inverse
        bend[k] = 0.5 * floor * floor * inverse * inverse * inverse
    h = faces[FACE_OPEN]
    slope = faces[FACE_SLOPE]
    for k in range(h.shape[0]):
        above = h[k] - floor
        root = math.sqrt(above * above + floor * floor)
        rest = 0.5 * (above + root) if above > 0.0 else 0.5 * floor * floor / (root - above)
        h[k] = floor + rest
        slope[k] = rest / root
    if film.contact[SIGMA] > 0.0:
        c = constants[CLEARANCE]
        unit = 1.0 / pressure_unit(constants)
        reach = HIGHEST * film.contact[SIGMA] / c
        h = nodes[FILM]
        for k in range(h.shape[0]):
            if h[k] < reach:
                p, by_gap, _ = contact_pressure(h[k] * c, film.contact, film.contact_table)
                nodes[CONTACT, k] = p * unit
                nodes[CONTACT_SLOPE, k] = by_gap * c * unit
            else:
                nodes[CONTACT, k] = 0.0
                nodes[CONTACT_SLOPE, k] = 0.0
