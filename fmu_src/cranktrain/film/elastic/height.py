"""Height of a film between a journal and the bore's shapes, the mean gap of rough surfaces, and their contact."""

from __future__ import annotations

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import eight, four
from cranktrain.film.contact.asperity import HIGHEST, SIGMA, contact_pressure
from cranktrain.film.contact.gap import open_gap
from cranktrain.film.elastic.grid import (
    BEND,
    CLEARANCE,
    CONTACT,
    CONTACT_SLOPE,
    COS,
    FACE_COS,
    FACE_OPEN,
    FACE_SIN,
    FACE_SLOPE,
    FILM,
    N_PHI,
    N_Z,
    OPEN,
    PROFILE,
    RADIUS,
    SIN,
    SLOPE,
    VISCOSITY,
    ZETA,
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
        a0, a1, a2, a3, a4, a5, a6, a7 = eight(row, r)
        b0, b1, b2, b3, b4, b5, b6, b7 = eight(shares, r)
        a = a0 * b0 + a1 * b1
        b = a2 * b2 + a3 * b3
        c = a4 * b4 + a5 * b5
        d = a6 * b6 + a7 * b7
        total += (a + b) + (c + d)
    return total


@kernel
def node_films(film, place, shift, out):
    """Distance H of the surfaces at all nodes and both ends into ``out`` (n_phi (n_z + 2),).

    ``place`` (4,) position and tilt over the clearance, ``shift`` amplitudes of the shapes over the clearance, filled
    up with zeros to the columns of ``film.shapes``.
    """
    n_phi = int(film.constants[N_PHI])
    lines = int(film.constants[N_Z]) + 2
    columns = film.shapes.shape[1]
    x, y, a, b = four(place, 0)
    for i in range(n_phi):
        cos = film.trig[i, COS]
        sin = film.trig[i, SIN]
        middle = 1.0 - x * cos - y * sin
        tilt = a * cos + b * sin
        for j in range(lines):
            row = film.shapes[i * lines + j]
            total = middle - tilt * film.lines[j, ZETA] + film.lines[j, PROFILE]
            total += combined(row, shift, columns)
            out[i * lines + j] = total


@kernel
def face_films(film, place, shift, out):
    """Distance H of the surfaces at circumferential faces into ``out`` (n_phi n_z,); ``place``, ``shift`` as above."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    columns = film.shapes.shape[1]
    first = n_phi * (n_z + 2)
    x, y, a, b = four(place, 0)
    for i in range(n_phi):
        cos = film.trig[i, FACE_COS]
        sin = film.trig[i, FACE_SIN]
        middle = 1.0 - x * cos - y * sin
        tilt = a * cos + b * sin
        for j in range(n_z):
            row = film.shapes[first + i * n_z + j]
            total = middle - tilt * film.lines[j + 1, ZETA] + film.lines[j + 1, PROFILE]
            total += combined(row, shift, columns)
            out[i * n_z + j] = total


@kernel
def open_films(film, sigma, nodes, faces):
    """Mean gaps h, from ``faces[FACE_OPEN]`` there, with first and second derivative, at nodes and faces.

    Contact pressure, over p₀, with its slope. ``sigma``: roughness over the clearance.
    """
    constants = film.constants
    h = nodes[FILM]
    is_open = nodes[OPEN]
    slope = nodes[SLOPE]
    bend = nodes[BEND]
    for k in range(h.shape[0]):
        is_open[k], slope[k], bend[k] = open_gap(h[k], sigma)
    h = faces[FACE_OPEN]
    slope = faces[FACE_SLOPE]
    for k in range(h.shape[0]):
        h[k], slope[k], _ = open_gap(h[k], sigma)
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
