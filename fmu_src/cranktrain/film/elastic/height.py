"""Distance of the surfaces of journal and deformed bore, and the unit of pressure."""

from cranktrain.core.kernel import kernel
from cranktrain.core.lanes import four
from cranktrain.core.vectors import LANES, load, unpack
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
