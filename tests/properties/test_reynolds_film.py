"""The general film: order, balances, history, symmetries, limits of its laws, hard states and bad input."""

from dataclasses import replace

import numpy as np
import pytest
from one_line import one_line
from some import some

from cranktrain.core.errors import InputError, SolverError
from cranktrain.film.reynolds.field import Edges, Supply, solve_film

RADIUS, WIDTH, CLEARANCE, ETA = 0.04, 0.04, 4e-5, 0.01
LENGTHS = (2 * np.pi * RADIUS, WIDTH)
MODES = ("full", "guembel", "reynolds", "mass-conserving")


def journal(n_x, n_z, ex, ey, tx=0.0, ty=0.0):
    """Film of a tilted journal; where it would touch, a floor of 2e-4 clearances."""
    phi = (2 * np.pi * np.arange(n_x) / n_x)[:, None]
    zeta = np.linspace(-1, 1, n_z)
    h = 1 - (ex + tx * zeta) * np.cos(phi) - (ey + ty * zeta) * np.sin(phi)
    return CLEARANCE * 0.5 * (h + np.sqrt(h * h + 4 * 2e-4**2))


def groove(n_x, n_z, first, pressure):
    nodes = np.zeros((n_x, n_z), dtype=bool)
    nodes[first : first + 3, n_z // 4 : n_z - n_z // 4] = True
    return [Supply("groove", nodes, pressure)]


def bearing(h, speed=8.0, **options):
    return solve_film(h, LENGTHS, speeds=(speed, 0.0), viscosity=ETA, periodic=True, **options)


def oil(film):
    return float((film.h * film.fill * film.areas).sum())


def manufactured(n, uneven):
    """Largest error of the pressure for p = (2 + cos x + sin z) sin πz on a film that varies both ways; u = squeeze."""
    x = 2 * np.pi * np.arange(n) / n
    z = np.linspace(0, 1, n + 1)
    if uneven:
        x, z = x + 0.3 * np.sin(x), z + 0.08 * np.sin(2 * np.pi * z)
    a, b = x[:, None], z[None, :]
    h = 2 + 0.8 * np.cos(a) + 0.5 * b
    h_x, h_z = -0.8 * np.sin(a) + 0 * b, 0.5 + 0 * a * b
    eta = 1 + 0.3 * np.sin(a) * b
    eta_x, eta_z = 0.3 * np.cos(a) * b, 0.3 * np.sin(a) + 0 * b
    s, c = np.sin(np.pi * b), np.cos(np.pi * b)
    f = 2 + np.cos(a) + np.sin(b)
    p = f * s
    p_x, p_xx = -np.sin(a) * s, -np.cos(a) * s
    p_z = np.cos(b) * s + f * np.pi * c
    p_zz = -np.sin(b) * s + 2 * np.pi * np.cos(b) * c - np.pi**2 * p
    poiseuille = (
        h**3 / eta * (p_xx + p_zz)
        + (3 * h**2 * h_x / eta - h**3 * eta_x / eta**2) * p_x
        + (3 * h**2 * h_z / eta - h**3 * eta_z / eta**2) * p_z
    ) / 12
    rate = poiseuille - 0.5 * 1.7 * h_x - 0.5 * 0.4 * h_z
    film = solve_film(
        h, (2 * np.pi, 1.0), speeds=(1.0, 0.7), cross_speeds=(0.1, 0.3), viscosity=eta, squeeze=rate, periodic=True,
        cavitation="full", nodes=(x, z),
    )  # fmt: skip
    return np.abs(film.pressure - p).max()


@pytest.mark.parametrize("uneven", [False, True])
def test_full_film_is_of_second_order(uneven):
    coarse, fine, finest = (manufactured(n, uneven) for n in (16, 32, 64))
    assert np.log2(coarse / fine) > 1.8
    assert np.log2(fine / finest) > 1.9


@pytest.mark.parametrize("cavitation", MODES)
def test_oil_balance(cavitation):
    squeeze = 1e-3 * np.cos(2 * np.pi * np.arange(60) / 60)[:, None] * np.ones(11)
    film = bearing(
        journal(60, 11, 0.5, -0.4, 0.05, 0.02), cavitation=cavitation, squeeze=squeeze, supplies=groove(60, 11, 30, 2e5)
    )
    balance = abs(sum(film.flows.values()) + film.stored)
    if cavitation in ("full", "mass-conserving"):
        assert film.mass_defect < 1e-10
        assert balance < 1e-10 * sum(abs(f) for f in film.flows.values())
    else:
        # Oil appears where the film ruptures and vanishes where it refills; the figure must say so.
        assert film.mass_defect > 1e-3
        assert balance > 1e-3 * sum(abs(f) for f in film.flows.values())


def test_two_edges_share_what_slides_into_a_corner():
    # A flat gap without pressure carries oil straight through, in both directions.
    film = solve_film(np.full((9, 7), 2e-5), (0.03, 0.02), speeds=(2.0, 0.0), cross_speeds=(0.0, 1.0), viscosity=ETA)
    assert film.flows["x1"] == pytest.approx(2e-5 * 1.0 * 0.02, rel=1e-9)
    assert film.flows["z1"] == pytest.approx(2e-5 * 0.5 * 0.03, rel=1e-9)
    assert -film.flows["x0"] == pytest.approx(film.flows["x1"], rel=1e-9)


def test_an_edge_without_flow_is_a_plane_of_symmetry():
    whole = bearing(journal(48, 13, 0.7, 0.0), cavitation="reynolds")
    half = solve_film(
        journal(48, 7, 0.7, 0.0), (LENGTHS[0], WIDTH / 2), speeds=(8.0, 0.0), viscosity=ETA, periodic=True,
        cavitation="reynolds", edges=Edges(z1=None),
    )  # fmt: skip
    assert half.pressure == pytest.approx(whole.pressure[:, :7], rel=1e-9, abs=1e-3)
    assert 2 * half.load == pytest.approx(whole.load, rel=1e-9)


def test_films_constant_by_cell_agree_with_a_flat_film():
    flat = solve_film(np.full((12, 9), 2e-5), LENGTHS, viscosity=ETA, squeeze=-1e-3, periodic=True)
    cells = solve_film(np.full((12, 8), 2e-5), LENGTHS, viscosity=ETA, squeeze=-1e-3, periodic=True, stepped=True)
    assert cells.pressure == pytest.approx(flat.pressure, rel=1e-12)
    assert cells.load == pytest.approx(flat.load, rel=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_travelling_fronts_conserve_oil(seed):
    rng = np.random.default_rng(seed)
    n_x, n_z, dt = 48, 9, 2e-4
    film = bearing(journal(n_x, n_z, 0.3, 0.0), supplies=groove(n_x, n_z, 10, 3e5))
    start, left, passed = oil(film), 0.0, 0.0
    angle, fronts = 0.0, set()
    for step in range(150):
        angle += rng.normal(0.1, 0.2)
        eccentricity = 0.6 + 0.35 * np.sin(0.15 * step)
        speed = 8.0 * np.cos(0.06 * step)  # reverses twice
        film = bearing(
            journal(n_x, n_z, eccentricity * np.cos(angle), eccentricity * np.sin(angle), 0.03, -0.04), speed,
            supplies=groove(n_x, n_z, 10, 3e5) if step < 100 else (), dt=dt, previous=film,
        )  # fmt: skip
        left += dt * sum(film.flows.values())
        passed += dt * sum(abs(f) for f in film.flows.values())
        fronts.add(int(film.ruptured.sum()))
        assert film.fill.min() >= 0.0
        assert film.fill.max() <= 1.0
        assert (film.pressure * (1 - film.fill) == 0.0).all()
    assert abs(oil(film) + left - start) < 1e-10 * (start + passed)
    assert len(fronts) > 20


def test_a_plug_of_oil_travels_with_half_the_speed():
    # A flat gap, no pressure: fill is carried unchanged; upwinding spreads its edges, not its mass or its mean place.
    n, length, dt = 200, 0.1, 1e-4
    h = np.full((n, 1), 1e-5)
    one = np.arange(n)[:, None] == 0
    film = solve_film(h, (length, 1.0), viscosity=ETA, periodic=True, supplies=[Supply("hole", one, 0.0)])
    fill = np.where((film.x > 0.02) & (film.x < 0.04), 0.8, 0.1)[:, None]
    film = replace(film, fill=fill)

    def place(f):
        extra = f.fill[:, 0] - 0.1
        return float((extra * f.x).sum() / extra.sum())

    first, content = place(film), oil(film)
    for _ in range(100):
        film = solve_film(
            h, (length, 1.0), speeds=(6.0, 0.0), viscosity=ETA, periodic=True, dt=dt, previous=film
        )  # fmt: skip
    assert place(film) - first == pytest.approx(3.0 * 100 * dt, rel=1e-2)
    assert oil(film) == pytest.approx(content, rel=1e-10)
    assert film.pressure.max() == 0.0


def test_reversed_speed_mirrors_the_film():
    forward = bearing(journal(64, 9, 0.5, 0.4, 0.1, 0.0), 8.0, supplies=groove(64, 9, 20, 1e5))
    h = np.roll(journal(64, 9, 0.5, 0.4, 0.1, 0.0)[::-1], 1, axis=0)
    nodes = np.roll(groove(64, 9, 20, 1e5)[0].nodes[::-1], 1, axis=0)
    backward = bearing(h, -8.0, supplies=[Supply("groove", nodes, 1e5)])
    assert np.roll(backward.pressure[::-1], 1, axis=0) == pytest.approx(forward.pressure, rel=1e-7, abs=1.0)
    assert np.roll(backward.fill[::-1], 1, axis=0) == pytest.approx(forward.fill, abs=1e-7)


def test_a_bearing_without_supply_runs_dry():
    # What leaks from the ends is never replaced: load and oil fall from step to step, to the film without pressure.
    h = journal(48, 9, 0.6, 0.0)
    film = bearing(h, supplies=groove(48, 9, 23, 2e5))
    contents, loads = [oil(film)], [film.load]
    for k in range(60):
        film = bearing(h, dt=1e-3 * 1.2**k, previous=film)
        contents.append(oil(film))
        loads.append(film.load)
    assert (np.diff(contents) <= 1e-10 * contents[0]).all()
    assert loads[-1] < 1e-3 * loads[0]
    # At last as much oil circulates in each axial place as the least gap lets through.
    steady = bearing(h)
    assert steady.load < 1e-3 * loads[0]
    # In the steady film as in the ever longer steps, no more circulates than the least gap carries.
    carried = steady.fill * 0.5 * (h + np.roll(h, -1, axis=0))
    assert carried[:, 1:-1].max() < 1.001 * h.min() * 1.01


@pytest.mark.parametrize("cavitation", ["reynolds", "mass-conserving"])
def test_the_result_does_not_depend_on_the_first_guess(cavitation):
    rng = np.random.default_rng(1)
    h = journal(48, 9, 0.6, 0.5, 0.1, 0.05)
    cold = bearing(h, cavitation=cavitation, supplies=groove(48, 9, 5, 1e5))
    for share in (0.1, 0.5, 0.9, 1.0):
        guess = replace(cold, ruptured=rng.random(h.shape) < share)
        warm = bearing(h, cavitation=cavitation, supplies=groove(48, 9, 5, 1e5), guess=guess)
        assert warm.pressure == pytest.approx(cold.pressure, rel=1e-9, abs=1e-6 * cold.p_max)
        assert warm.fill == pytest.approx(cold.fill, abs=1e-9)


def jump(rng, film, n_x=36, n_z=7):
    """Any other state at once: place, tilt to contact, speed of either sign or none, supply, step or squeeze."""
    eccentricity, angle = rng.uniform() ** 0.3 * (rng.uniform() > 0.1), rng.uniform(0, 2 * np.pi)
    tilt = 0.2 * rng.normal(size=2) * (rng.uniform() < 0.5)
    h = journal(n_x, n_z, eccentricity * np.cos(angle), eccentricity * np.sin(angle), *tilt)
    options = {"supplies": groove(n_x, n_z, int(rng.integers(0, n_x - 3)), float(rng.choice([0, 1e4, 5e5])))}
    if rng.uniform() < 0.3:
        options = {}
    if rng.uniform() < 0.7:
        options |= {"dt": 10 ** rng.uniform(-7, 0), "previous": film}
    elif rng.uniform() < 0.7:
        options |= {
            "squeeze": 10 ** rng.uniform(-4, 0) * np.cos(np.linspace(0, 6, n_x) + angle)[:, None] * np.ones(n_z)
        }
    options["guess"] = replace(film, ruptured=rng.uniform(size=h.shape) < rng.uniform())
    return bearing(h, float(rng.choice([0.0, 8.0, -8.0, 8 * rng.normal()])), **options)


@pytest.mark.parametrize(
    ("seed", "count"), [(0, 1500), *(pytest.param(k, 8000, marks=pytest.mark.slow) for k in range(1, 5))]
)
def test_random_jumps_of_state(seed, count):
    rng = np.random.default_rng(seed)
    film = bearing(journal(36, 7, 0.0, 0.0))
    for _ in some(range(count)):
        film = jump(rng, film)
        assert np.isfinite(film.pressure).all() and film.pressure.min() >= 0.0
        assert 0.0 <= film.fill.min() <= film.fill.max() <= 1.0
        assert film.mass_defect < 1e-10


def slider(n, law=None, load_factor=1.0):
    h = np.linspace(2e-5, 1e-5, n)[:, None]
    return solve_film(
        h, (0.02, 1.0), speeds=(4.0 * load_factor, 0.0), viscosity=0.05, cavitation="full", pressure_viscosity=law
    )


def test_barus_law_is_that_of_the_reduced_pressure():
    # With η = η₀ exp αp the reduced pressure (1 − exp(−αp))/α obeys the equation of constant viscosity: near its limit.
    constant = slider(201)
    alpha = 0.999 / constant.pressure.max()
    solved = slider(201, lambda p: np.exp(alpha * p))
    assert solved.pressure == pytest.approx(-np.log(1 - alpha * constant.pressure) / alpha, rel=1e-9)
    assert solved.mass_defect < 1e-10
    assert solved.flows["x1"] == pytest.approx(constant.flows["x1"], rel=1e-9)
    assert solved.viscosity == pytest.approx(0.05 * np.exp(alpha * solved.pressure), rel=1e-9)


def test_a_law_beyond_its_pole_is_refused():
    constant = slider(101)
    with pytest.raises(SolverError, match="viscosity"):
        slider(101, lambda p: np.exp(np.minimum(2.0 * p / constant.p_max, 700.0)))


def test_largest_pressure_between_nodes():
    # A film on coarse nodes that miss the maximum; its finer twin has them everywhere.
    fine = slider(6401).p_max
    coarse = slider(41)
    assert abs(coarse.p_max / fine - 1) < 0.3 * (1 - coarse.pressure.max() / fine) + 1e-3
    assert coarse.p_max >= coarse.pressure.max()


FLAT = np.full((8, 5), 1e-5)
ONE = np.zeros((8, 5), dtype=bool)
ONE[3, 2] = True


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"h": -FLAT}, r"h: -1e-05 m at \(0, 0\); the film must be positive"),
        ({"h": FLAT[0]}, "h: a field over x and z"),
        ({"h": FLAT[:2]}, "at least 3"),
        ({"lengths": (0.1, -0.1)}, "two positive lengths"),
        ({"viscosity": -0.01}, "viscosity: least value -0.01"),
        ({"viscosity": np.ones((4, 4))}, r"viscosity: shape \(4, 4\) does not fit the nodes \(8, 5\)"),
        ({"squeeze": np.nan}, "squeeze: not finite"),
        ({"squeeze": np.ones(3)}, "squeeze: shape"),
        ({"speeds": (1.0, np.inf)}, "speeds: two finite velocities"),
        ({"cavitation": "mass conserving"}, "did you mean 'mass-conserving'"),
        ({"cavitation": "gumbel"}, "did you mean 'guembel'"),
        ({"edges": Edges(x0=-1e5)}, "below the cavitation pressure"),
        ({"edges": Edges(fill=1.5)}, "between 0 and 1"),
        ({"edges": Edges(None, None, None, None), "cavitation": "full"}, "nothing holds the pressure"),
        ({"supplies": [Supply("a", ONE, 1e5), Supply("b", ONE, 2e5)]}, r"'b' \(2e\+05 Pa\) overlaps 'a' \(1e\+05 Pa\)"),
        ({"supplies": [Supply("a", ~ONE, 1e5)]}, "overlaps 'z0'|overlaps 'x0'"),
        ({"supplies": [Supply("a", ONE[:4], 1e5)]}, r"mask of shape \(8, 5\)"),
        ({"supplies": [Supply("a", ~ONE & ONE, 1e5)]}, "covers no node"),
        ({"supplies": [Supply("a", ONE, 1e5), Supply("a", ONE, 1e5)]}, "exists twice"),
        ({"nodes": (np.arange(7), np.arange(5))}, "places in x, but the film h has 8"),
        ({"nodes": (np.zeros(8), np.arange(5))}, "must increase"),
        ({"nodes": (np.linspace(0, 0.2, 8), np.linspace(0, 0.1, 5))}, "must run from 0 to 0.1"),
        ({"dt": 1e-3}, "give previous="),
        ({"dt": -1e-3}, "must be positive"),
    ],
)
def test_bad_input_is_one_clear_line(changes, message):
    data = {"h": FLAT, "lengths": (0.1, 0.1), "viscosity": ETA} | changes
    with one_line(match=message):
        solve_film(data.pop("h"), data.pop("lengths"), **data)


def test_a_step_refuses_what_it_cannot_carry_on():
    start = solve_film(FLAT, (0.1, 0.1), viscosity=ETA)
    common = {"viscosity": ETA, "dt": 1e-3, "previous": start}
    with pytest.raises(InputError, match="leave squeeze out"):
        solve_film(FLAT, (0.1, 0.1), squeeze=1.0, **common)
    with pytest.raises(InputError, match="keeps no fill"):
        solve_film(FLAT, (0.1, 0.1), cavitation="reynolds", **common)
    with pytest.raises(InputError, match="use one grid"):
        solve_film(FLAT[:, :4], (0.1, 0.1), **common)


def test_oil_that_cannot_leave_a_closing_film_is_reported():
    with pytest.raises(SolverError, match="nothing determines the pressure"):
        solve_film(FLAT, (0.1, 0.1), viscosity=ETA, squeeze=-1e-3, edges=Edges(None, None, None, None))
