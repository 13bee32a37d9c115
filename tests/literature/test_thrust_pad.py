"""One pad of the thrust bearing against Reynolds' equation in two dimensions and closed forms.

Flat rectangular plates that approach: F/(η V B³ L) = 0.4217 on a square, B L³ η V (1 − 0.630 L/B) on a narrow one
(Poisson's equation on a rectangle, Timoshenko & Goodier art. 109). Wide linear slider: Hamrock, Schmid & Jacobson.
"""

import math

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import spsolve

from cranktrain.engine.file import load_engine
from cranktrain.film.laws.thrust import AMBIENT, WEDGE, pad_damping, pad_force, pad_size, thrust_parameters

BEARING = load_engine("diesel_i6").thrust
RADIUS, LENGTH, WIDTH = pad_size(BEARING)
VISCOSITY, SPEED = 0.012, 200.0
FILM = thrust_parameters(BEARING, VISCOSITY)


def solved_pad(film, closing, sliding, least_pressure=-np.inf, along=160, across=20):
    """Load (N) by central differences on an even grid; the film ruptures at ``least_pressure`` (gauge, Pa)."""
    dx, dy = LENGTH / along, WIDTH / across
    x, y = np.arange(1, along) * dx, np.arange(1, across) * dy - 0.5 * WIDTH
    faces_x = film(*np.meshgrid((np.arange(along) + 0.5) * dx, y, indexing="ij"))
    faces_y = film(*np.meshgrid(x, (np.arange(across) + 0.5) * dy - 0.5 * WIDTH, indexing="ij"))
    flow_x, flow_y = faces_x**3 * dy / dx / (12 * VISCOSITY), faces_y**3 * dx / dy / (12 * VISCOSITY)
    index = np.arange(x.size * y.size).reshape(x.size, y.size)
    first = np.concatenate((index[:-1].ravel(), index[:, :-1].ravel()))
    second = np.concatenate((index[1:].ravel(), index[:, 1:].ravel()))
    flow = np.concatenate((flow_x[1:-1].ravel(), flow_y[:, 1:-1].ravel()))
    places = np.append(first, second), np.append(second, first)
    matrix = csc_array((-np.tile(flow, 2), places), shape=(index.size, index.size))
    matrix = (matrix + diags_array((flow_x[:-1] + flow_x[1:] + flow_y[:, :-1] + flow_y[:, 1:]).ravel())).tocsc()
    source = (closing * dx + 0.5 * sliding * (faces_x[:-1] - faces_x[1:])).ravel() * dy
    full = np.ones(index.size, dtype=bool)
    for _ in range(60):
        pressure = np.where(full, 0.0, least_pressure)
        known = source - matrix @ pressure if not full.all() else source
        inside = np.flatnonzero(full)
        pressure[inside] = spsolve(matrix[inside][:, inside], known[inside])
        wanted = np.where(full, pressure > least_pressure, source - matrix @ pressure > 0.0)
        if (wanted == full).all():
            return pressure.sum() * dx * dy
        full = wanted
    raise AssertionError("the active set did not settle")


def wedge(h):
    """Film of the engine's pad, thinnest at its end."""
    return lambda x, y: h + BEARING.taper * (1 - x / LENGTH) + 0 * y


@pytest.mark.parametrize(("length", "width", "load"), [(1.0, 1.0, 0.42173), (0.02, 1.0, 1 - 0.63025 * 0.02)])
def test_flat_pad_is_squeezed_as_a_rectangular_plate(length, width, load):
    short, long = min(length, width), max(length, width)
    for size in ((length, width), (width, length)):
        assert pad_damping(np.array([1.0]), 0.0, *size)[0] == pytest.approx(load * short**3 * long, rel=2e-3)


@pytest.mark.parametrize("ratio", [0.1, 1.0, 10.0])
def test_wide_pad_is_the_linear_slider(ratio):
    # W = 6 η U L B²/δ² [ln(1 + a) − 2a/(2 + a)] is the force of squeeze at U δ/(2 B); what width adds knows no ends.
    h, length, width = 1e-5, 0.01, 0.05
    slider = 12 * width * length**3 / (ratio * h) ** 3 * (math.log1p(ratio) - 2 * ratio / (2 + ratio))
    one, two = (pad_damping(np.array([h]), ratio * h, length, w)[0] for w in (width, 2 * width))
    assert two - one == pytest.approx(slider, rel=1e-3)


@pytest.mark.parametrize("h", [5e-6, 20e-6, 100e-6])
def test_pad_is_that_of_two_dimensional_reynolds(h):
    sliding = solved_pad(wedge(h), 0.0, RADIUS * SPEED)
    closing = solved_pad(wedge(h), 1e-3, 0.0)
    assert pad_force(h, 0.0, FILM[WEDGE] * SPEED, FILM)[0] == pytest.approx(sliding, rel=1e-2)
    assert pad_force(h, 1e-3, 0.0, FILM)[0] == pytest.approx(closing, rel=1e-2)


@pytest.mark.parametrize("share", [0.1, 0.3, 1.0, 3.0, 30.0])
def test_pulled_apart_it_lets_go_within_a_fifth_of_ambient_pressure(share):
    # The bound is the law's measured deviation from rupture at zero absolute pressure, point by point on the pad.
    h, ambient = 15e-6, AMBIENT * LENGTH * WIDTH
    velocity = -share * ambient / solved_pad(wedge(h), 1.0, 0.0)
    ruptured = solved_pad(wedge(h), velocity, 0.0, -AMBIENT)
    bound = (0.02 if share <= 0.3 else 0.2) * ambient
    assert pad_force(h, velocity, 0.0, FILM)[0] == pytest.approx(ruptured, abs=bound)


@pytest.mark.parametrize("tilt", [0.1, 0.3])
@pytest.mark.parametrize("direction", [0.0, 90.0])
def test_a_tilted_pad_is_met_at_its_middle(tilt, direction):
    # The film of a tilted collar over one pad of 67°, its middle in direction 0, lowered by a share of the least film.
    # Half of that share is the measured bound of what sampling at the middle leaves out: film lost or won at the ends.
    h = 40e-6
    span = LENGTH / RADIUS

    def film(x, y):
        angle = x / LENGTH * span - 0.5 * span
        return wedge(h)(x, y) - tilt * h * (1 + y / RADIUS) * np.cos(angle - math.radians(direction))

    middle = tilt * h * math.cos(math.radians(direction))
    slope = tilt * h * math.sin(math.radians(direction)) / RADIUS
    exact = solved_pad(film, 0.0, RADIUS * SPEED)
    found = pad_force(h - middle, 0.0, FILM[WEDGE] * SPEED + 0.5 * RADIUS * SPEED * slope, FILM)[0]
    assert found == pytest.approx(exact, rel=0.5 * tilt)
