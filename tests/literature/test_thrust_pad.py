"""One pad of the thrust bearing against Reynolds' equation in two dimensions and closed forms.

Flat rectangular plates that approach: F/(η V B³ L) = 0.4217 on a square, B L³ η V (1 − 0.630 L/B) on a narrow one
(Poisson's equation on a rectangle, Timoshenko & Goodier art. 109). Wide linear slider: Hamrock, Schmid & Jacobson.
"""

import math

import numpy as np
import pytest

from cranktrain.engine.file import load_engine
from cranktrain.film.laws.thrust import AMBIENT, WEDGE, pad_damping, pad_force, pad_size, thrust_parameters
from cranktrain.film.reynolds.field import Edges, solve_film

BEARING = load_engine("diesel_i6").thrust
RADIUS, LENGTH, WIDTH = pad_size(BEARING)
VISCOSITY, SPEED = 0.012, 200.0
FILM = thrust_parameters(BEARING, VISCOSITY)


def solved_pad(film, closing, sliding, ambient=None):
    """Load (N) of the general film on an even grid; it ruptures at zero pressure where an ambient one is given, Pa."""
    x, y = np.meshgrid(np.linspace(0.0, LENGTH, 161), np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, 21), indexing="ij")
    rupture, edge = ("full", 0.0) if ambient is None else ("reynolds", ambient)
    solved = solve_film(
        film(x, y), (LENGTH, WIDTH), speeds=(sliding, 0.0), squeeze=-closing, viscosity=VISCOSITY,
        edges=Edges(edge, edge, edge, edge), cavitation=rupture,
    )  # fmt: skip
    return ((solved.pressure - edge) * solved.areas).sum()


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
    ruptured = solved_pad(wedge(h), velocity, 0.0, AMBIENT)
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
