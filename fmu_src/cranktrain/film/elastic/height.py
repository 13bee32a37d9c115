"""Film height between journal and deformed bore, mean gap of rough surfaces, and contact pressure."""

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import four
from cranktrain.core.vectors import LANES, load, unpack
from cranktrain.film.contact.asperity import HIGHEST, SIGMA, contact_pressure
from cranktrain.film.contact.gap import open_gap
from cranktrain.film.elastic import grid as at


@kernel
def pressure_unit(constants):
    """Return the pressure unit p₀ = 12 η (R/c)² (Pa s)."""
    return 12.0 * constants[at.VISCOSITY] * (constants[at.RADIUS] / constants[at.CLEARANCE]) ** 2


@kernel
def combined(table, row, shares, columns):
    """Return the dot product of a table's ``row`` with ``shares`` over ``columns`` entries, a multiple of eight."""
    total = load(table, (row, 0)) * load(shares, 0) + load(table, (row, LANES)) * load(shares, LANES)
    for r in range(2 * LANES, columns, LANES):
        total = total + load(table, (row, r)) * load(shares, r)
    a, b, c, d = unpack(total)
    return (a + b) + (c + d)


@kernel
def node_films(film, place, shift, out):
    """Compute the distance H of the surfaces at all nodes and both ends, in ``out`` (n_phi (n_z + 2),).

    ``place`` (4,) is position and tilt over the clearance, ``shift`` the shape amplitudes over the clearance, padded
    with zeros to the columns of ``film.shapes``.
    """
    n_phi = int(film.constants[at.N_PHI])
    lines = int(film.constants[at.N_Z]) + 2
    columns = film.shapes.shape[1]
    x, y, a, b = four(place, 0)
    for i in range(n_phi):
        cos = film.trig[i, at.COS]
        sin = film.trig[i, at.SIN]
        middle = 1.0 - x * cos - y * sin
        tilt = a * cos + b * sin
        for j in range(lines):
            total = middle - tilt * film.lines[j, at.ZETA] + film.lines[j, at.PROFILE]
            out[i * lines + j] = total + combined(film.shapes, i * lines + j, shift, columns)


@kernel
def face_films(film, place, shift, out):
    """Compute the distance H at circumferential faces, in ``out`` (n_phi n_z,); arguments as in :func:`node_films`."""
    n_phi = int(film.constants[at.N_PHI])
    n_z = int(film.constants[at.N_Z])
    columns = film.shapes.shape[1]
    first = n_phi * (n_z + 2)
    x, y, a, b = four(place, 0)
    for i in range(n_phi):
        cos = film.trig[i, at.FACE_COS]
        sin = film.trig[i, at.FACE_SIN]
        middle = 1.0 - x * cos - y * sin
        tilt = a * cos + b * sin
        for j in range(n_z):
            total = middle - tilt * film.lines[j + 1, at.ZETA] + film.lines[j + 1, at.PROFILE]
            out[i * n_z + j] = total + combined(film.shapes, first + i * n_z + j, shift, columns)


@kernel
def open_films(film, sigma, nodes, faces):
    """Compute mean gaps h with two derivatives at nodes and one at faces, and contact pressure over p₀ with its slope.

    ``faces[FACE_OPEN]`` holds the distance H on entry. ``sigma`` is the roughness over the clearance.
    """
    constants = film.constants
    h = nodes[at.FILM]
    is_open = nodes[at.OPEN]
    slope = nodes[at.SLOPE]
    bend = nodes[at.BEND]
    for k in range(h.shape[0]):
        is_open[k], slope[k], bend[k] = open_gap(h[k], sigma)
    h = faces[at.FACE_OPEN]
    slope = faces[at.FACE_SLOPE]
    for k in range(h.shape[0]):
        h[k], slope[k], _ = open_gap(h[k], sigma)
    if film.contact[SIGMA] > 0.0:
        c = constants[at.CLEARANCE]
        unit = 1.0 / pressure_unit(constants)
        reach = HIGHEST * film.contact[SIGMA] / c
        h = nodes[at.FILM]
        for k in range(h.shape[0]):
            if h[k] < reach:
                p, by_gap, _ = contact_pressure(h[k] * c, film.contact, film.contact_table)
                nodes[at.CONTACT, k] = p * unit
                nodes[at.CONTACT_SLOPE, k] = by_gap * c * unit
            else:
                nodes[at.CONTACT, k] = 0.0
                nodes[at.CONTACT_SLOPE, k] = 0.0
