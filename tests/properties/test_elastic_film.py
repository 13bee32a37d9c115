"""The elastic film: limits, symmetries, conservation, tangents, equilibrium, and the places where films fail."""

import numpy as np
import pytest
from elastic_bearing import (
    CLEARANCE,
    DIAMETER,
    GRID,
    SPEED,
    VISCOSITY,
    WIDTH,
    Bearing,
    bore_shapes,
    fill_up,
    follow,
    grooved,
    tangent_errors,
)
from one_line import one_line

from cranktrain.core.errors import InputError
from cranktrain.film.contact.asperity import contact_constants
from cranktrain.film.elastic import grid as at
from cranktrain.film.elastic.film import CONVERGED
from cranktrain.film.elastic.grid import ElasticGrid
from cranktrain.film.journal.film import OUT_SIZE as RIGID_SIZE
from cranktrain.film.journal.film import journal_film
from cranktrain.film.journal.grid import Motion, cold_start, journal_grid, journal_work, shell_grid

ROUGH = contact_constants(0.4e-6, 0.05, 0.01, 115e9, 0.1)


def test_a_bore_without_compliance_is_the_rigid_film():
    rigid, stiff = grooved(), grooved(count=7, softness=1e-9)
    seen = []
    follow(rigid, 120, visit=lambda n, *_: seen.append((rigid.out.copy(), rigid.unknowns.copy())))

    def compare(n, *_):
        out, unknowns = seen[n - 1]
        assert stiff.forces == pytest.approx(out[:4], rel=1e-6, abs=1e-6 * abs(out[:4]).max())
        for entry in (at.PRESSURE_MAX, at.FILM_MIN, at.SUPPLY_FLOW, at.FRICTION_TORQUE, at.OIL):
            assert stiff.out[entry] == pytest.approx(out[entry], rel=1e-6, abs=1e-12)
        assert np.maximum(stiff.unknowns, 0) == pytest.approx(np.maximum(unknowns, 0), abs=1e-6 * unknowns.max())

    follow(stiff, 120, visit=compare)


@pytest.mark.parametrize("count", [1, 7, 9])
def test_elastic_shapes_are_in_equilibrium_with_the_pressure(count):
    bearing = grooved(count=count)
    shapes = bore_shapes(GRID, count)[:, :, 1:-1]
    area = 0.5 * WIDTH * 2 * np.pi / GRID.n_phi * bearing.film.constants[3]

    def check(*_):
        weights = area * bearing.weights[:, 1:-1]
        loads = np.einsum("kij,ij,ij->k", shapes, bearing.pressure, weights)
        expected = bearing.film.compliance[:, 4:] @ loads
        assert bearing.delta == pytest.approx(expected, rel=1e-8, abs=1e-8 * abs(expected).max())

    follow(bearing, 60, visit=check)


def test_the_bore_returns_the_work_it_takes():
    """Over a closed cycle of shapes the loads' work vanishes: δ = C q with a symmetric C stores, and only stores."""
    bearing = grooved(count=7)
    path = [np.zeros(7)]
    follow(bearing, 360, visit=lambda *_: path.append(bearing.delta.copy()))
    path.append(np.zeros(7))
    path = np.array(path)
    loads = np.linalg.solve(bearing.film.compliance[:, 4:], path.T).T
    work = 0.5 * (loads[1:] + loads[:-1]) * np.diff(path, axis=0)
    assert abs(work.sum()) < 1e-9 * abs(work).sum()


@pytest.mark.parametrize(("count", "highest", "contact", "step", "speed"), [
    (0, 0.9, None, 1, SPEED), (7, 0.9, None, 0.5, SPEED), (7, 1.15, ROUGH, 0.5, SPEED), (9, 1.15, ROUGH, 1, SPEED),
    (7, 0.9, ROUGH, 20, SPEED), (7, 0.9, None, 1, 0.0), (7, 0.9, None, 1, -SPEED),
])  # fmt: skip
def test_tangents_are_derivatives_of_the_forces(count, highest, contact, step, speed):
    coupling = 1e-10 * np.random.default_rng(1).normal(size=(count, 4))
    bearing = grooved(count=count, contact=contact, load_coupling=coupling)
    worst = []

    def check(n, position, velocity, h):
        if n % 7:
            return
        worst.extend(tangent_errors(bearing, position, velocity, h, speed))

    follow(bearing, 71, highest, np.radians(step), speed, check)
    # What the last Newton step may have moved; a node that changes sides within the difference is a kink, and rare.
    assert np.median(worst) < 1e-4 and np.quantile(worst, 0.9) < 3e-3


def test_the_result_does_not_depend_on_the_warm_start():
    warm, cold = grooved(count=7, contact=ROUGH), grooved(count=7, contact=ROUGH)

    def compare(n, position, velocity, h):
        cold.start[:], cold.start_delta[:], cold.start_position[:] = warm.start, warm.start_delta, warm.start_position
        cold.forget()
        assert cold.settle(position, velocity, SPEED, h) == pytest.approx(warm.forces, rel=1e-6, abs=1e-6 * 1e4)
        assert cold.delta == pytest.approx(warm.delta, rel=1e-6, abs=1e-6 * abs(warm.delta).max())

    follow(warm, 200, 1.0, visit=compare)


@pytest.mark.parametrize("steady", [True, False])
def test_forces_converge_with_the_grid(steady):
    """Second order in smooth films; the rupture front costs some of it. Moving: all forces of a piece of orbit."""
    forces = []
    for n_phi, n_z in ((24, 5), (48, 11), (96, 23)):
        bearing, history = grooved(ElasticGrid(n_phi, n_z, groove=1 / 3), 7), []
        if steady:
            history.append(bearing.settle(CLEARANCE * np.array([0.2, -0.75, 0.03, 0.05])))
        else:
            follow(bearing, 40, 0.8, visit=lambda *_, film=bearing, kept=history: kept.append(film.forces))
        forces.append(np.array(history))
    first, second = np.linalg.norm(forces[0] - forces[2]), np.linalg.norm(forces[1] - forces[2])
    assert second < 0.03 * np.linalg.norm(forces[2])
    # Differences to the finest of three grids halved each time: their ratio is 2^p + 1, 5 at second order.
    assert first / second > 1 + 2**1.3


@pytest.mark.parametrize("axis", ["y", "z"])
def test_a_mirrored_bearing_mirrors_its_forces(axis):
    """Across the x axis the rotation turns round; shapes 0, 2, 3, 5 of the bore are even there, all but 7, 8 in z."""
    count = 7 if axis == "z" else 1
    position, velocity = CLEARANCE * np.array([0.5, -0.6, 0.05, 0.02]), CLEARANCE * np.array([100.0, 50.0, 5.0, -9.0])
    there, back = Bearing(GRID, count), Bearing(GRID, count)
    signs, turn = (np.array([1, -1, 1, -1]), -1.0) if axis == "y" else (np.array([1, 1, -1, -1]), 1.0)
    there.start_position[:], back.start_position[:] = position, signs * position
    expected = there.settle(position, velocity, SPEED, 1e-4)
    assert abs(expected).min() > 1.0
    found = signs * back.settle(signs * position, signs * velocity, turn * SPEED, 1e-4)
    assert found == pytest.approx(expected, rel=1e-6)


def test_ruptured_film_conserves_oil_to_rounding():
    """Void everywhere at the start, no supply: what is missing has left at the ends."""
    bearing = Bearing(GRID, 7)
    bearing.start[:] = -0.4
    rng = np.random.default_rng(3)
    bearing.start[rng.random(GRID.size) < 0.5] = -0.01
    position = CLEARANCE * np.array([0.3, -0.5, 0.02, 0.03])
    bearing.start_position[:] = position
    bearing.settle(position, dt=1e-12)
    before = bearing.out[at.OIL]
    later = position + CLEARANCE * np.array([0.02, -0.1, 0.0, 0.01])
    h = np.radians(2) / SPEED
    bearing.settle(later, (later - position) / h, SPEED, h)
    assert bearing.out[at.PRESSURE_MAX] > 0.0
    assert bearing.out[at.SIDE_FLOW] * h > 1e-4 * before
    assert bearing.out[at.OIL] == pytest.approx(before - h * bearing.out[at.SIDE_FLOW], rel=1e-10)


def test_oil_of_a_filling_bearing_is_what_the_groove_gave():
    """From empty to full at a fixed place: stored oil against supply less side flow, every step."""
    fills = fill_up(grooved(), CLEARANCE * np.array([0.2, -0.4, 0.0, 0.02]), 0.05, 300, 1e-12)
    assert fills[0] < 0.3 and np.diff(fills).min() > -1e-8 and fills[-1] > 0.8
    assert fills[-1] - fills[-2] < 1e-6


def test_oil_that_a_full_film_gains_or_loses_in_rupturing_shrinks_with_the_step():
    """Full nodes follow the velocities of the stage: their film changes by h ḣ, not by its difference."""

    def lost(step):
        bearing = grooved(count=7)
        balance = []
        oil = [0.0]

        def visit(n, position, velocity, h):
            if n > 1:
                balance.append(
                    bearing.out[at.OIL] - oil[0] - h * (bearing.out[at.SUPPLY_FLOW] - bearing.out[at.SIDE_FLOW])
                )
            oil[0] = bearing.out[at.OIL]

        follow(bearing, round(np.radians(240) / step), 0.85, step, visit=visit)
        return abs(np.sum(balance)) / oil[0]

    coarse, fine = lost(np.radians(2)), lost(np.radians(0.5))
    assert coarse < 0.06 and fine < 0.35 * coarse


def test_jumps_of_state_never_fail_and_fills_stay_between_nothing_and_full():
    rng = np.random.default_rng(7)
    for count, highest, tilt, contact in ((0, 0.98, 0.02, None), (7, 0.95, 0.05, ROUGH), (7, 1.3, 0.4, ROUGH)):
        bearing = grooved(count=count, contact=contact)
        for _ in range(1700):
            e, phi, t, psi = rng.uniform(0, highest), rng.uniform(0, 2 * np.pi), rng.uniform(0, tilt), rng.uniform(0, 7)
            position = CLEARANCE * np.array([e * np.cos(phi), e * np.sin(phi), t * np.cos(psi), t * np.sin(psi)])
            velocity = CLEARANCE * rng.normal(size=4) * 10 ** rng.uniform(0, 3.5)
            dt = 10 ** rng.uniform(-6, -3)
            status = bearing.solve(position, velocity, rng.choice([0, 50, 200, 500]), dt, dt * rng.uniform(0.3, 1))
            assert status == CONVERGED
            assert np.isfinite(bearing.out).all() and bearing.pressure.min() >= 0.0
            assert bearing.unknowns.min() >= -1.0 and 0.0 <= bearing.out[at.FILL_MEAN] <= 1.0
            bearing.accept(position)


def test_a_smooth_orbit_needs_no_clipping_of_the_fill():
    bearing = grooved(count=7)
    clipped = []
    follow(bearing, 720, 0.95, visit=lambda *_: clipped.append(bearing.out[at.CLIPPED]))
    assert sum(clipped) == 0


def test_without_supply_a_bearing_starves_and_a_groove_fills_it_again():
    position = CLEARANCE * np.array([0.1, -0.7, 0.0, 0.0])

    def stood(bearing):
        """Oil and force over 200 steps at a place."""
        bearing.start_position[:] = position
        rows = []
        for _ in range(200):
            bearing.settle(position, dt=np.radians(20) / SPEED)
            bearing.accept(position)
            rows.append((bearing.out[at.OIL], np.hypot(*bearing.forces[:2])))
        return np.array(rows).T

    dry, fed = Bearing(GRID, 7), grooved(count=7)
    oil, carried = stood(dry)
    assert np.diff(oil).max() < 1e-12 * oil[0]
    assert oil[-1] < 0.6 * oil[0] and carried[-1] < 0.05 * carried[0]
    fed.start[:], fed.start_delta[:] = dry.start, dry.start_delta
    assert stood(fed)[1][-1] > 0.5 * carried[0]


def test_a_bearing_at_rest_carries_nothing_and_starts():
    bearing = grooved(count=7, contact=ROUGH)
    bearing.film.constants[7] = 0.0  # no supply pressure: nothing moves, nothing presses
    position = CLEARANCE * np.array([0.3, -0.6, 0.0, 0.0])
    bearing.start_position[:] = position
    assert abs(bearing.settle(position, speed=0.0, dt=1e-3)).max() < 1e-9
    torques = []
    for n in range(1, 101):
        speed = SPEED * n / 100
        bearing.settle(position, speed=speed, dt=1e-3)
        bearing.accept(position)
        torques.append(bearing.out[at.FRICTION_TORQUE])
    assert max(torques) < 0.0 and np.hypot(*bearing.forces[:2]) > 1e3


def test_pure_squeeze_and_its_reversal_press_and_then_rupture():
    bearing = Bearing(GRID, 7)
    position = CLEARANCE * np.array([0.0, -0.6, 0.0, 0.0])
    bearing.start_position[:] = position
    pace = CLEARANCE * np.array([0.0, -200.0, 0.0, 0.0])
    h = 1e-4
    down = bearing.settle(position + h * pace, pace, 0.0, h)
    bearing.accept(position + h * pace)
    assert down[1] > 1e3 and abs(down[0]) < 1e-6 * down[1]
    for n in range(20):
        place = position + h * pace - (n + 1) * h * pace
        up = bearing.settle(place, -pace, 0.0, h)
        bearing.accept(place)
    # Pulled off the lower wall the film ruptures there; what still presses is above.
    assert up[1] < 0.0
    assert bearing.out[at.FILL_MEAN] < 1.0 and bearing.unknowns.min() < -1e-3


def test_edge_contact_carries_when_the_tilt_is_more_than_the_film():
    bearing = grooved(count=7, contact=ROUGH)
    loads = []
    for tilt in (0.0, 0.1, 0.2, 0.3, 0.4):
        position = CLEARANCE * np.array([0.0, -0.85, 0.0, -tilt])
        bearing.start_position[:] = position
        force = bearing.settle(position, dt=1e-3)
        loads.append(bearing.out[at.CONTACT_LOAD])
        assert 0.0 <= bearing.out[at.CONTACT_SHARE] < 1.0
        if tilt > 0.0:
            assert bearing.out[at.FILM_MIN_ZETA] > 0.9 and force[3] > 0.0
    assert loads[0] == 0.0 and np.diff(loads).min() >= 0.0 and loads[-1] > 100.0


@pytest.mark.parametrize("tilt", [0.24, 0.3])
def test_squeeze_in_a_relieved_shell_tends_to_that_of_the_rigid_films(tilt):
    """A rigid bore, full at the start: the films of ``reynolds`` and ``ehd`` are one, also where an edge touches."""
    relief, smooth = (6e-6, 0.5, 2.0), contact_constants(0.4e-6, 0.05, 0.01, 1.0)
    state = np.array([0.8, 0.0, tilt, 0.0, 1.0, -0.5, 0.2, 0.1])
    grid = shell_grid(journal_grid(384, 96), (relief[0] / CLEARANCE, *relief[1:]), 0.01)
    out, radius = np.zeros(RIGID_SIZE), 0.5 * DIAMETER
    journal_film(grid, (DIAMETER / WIDTH) ** 2, Motion(*state), journal_work(grid), cold_start(grid), out)
    rigid = 6.0 * VISCOSITY * radius * WIDTH * (radius / CLEARANCE) ** 2 * out[:4]
    errors = []
    for n_z in (23, 47):
        bearing = Bearing(ElasticGrid(288, n_z, 0.45), contact=smooth, profile=relief)
        force = bearing.settle(CLEARANCE * state[:4], CLEARANCE * state[4:], speed=0.0, dt=1e-6)
        errors.append([np.hypot(*(force - rigid)[k : k + 2]) / np.hypot(*rigid[k : k + 2]) for k in (0, 2)])
    assert max(errors[1]) < 0.02
    assert (np.array(errors[1]) < 0.4 * np.array(errors[0])).all()


def test_least_film_is_found_between_nodes():
    """A rigid journal: c − e at its own angle, wherever that lies between the nodes."""
    bearing = Bearing(GRID)
    for e, turn in ((0.5, 0.013), (0.9, 0.05), (0.97, 0.1), (0.8, 0.2)):
        position = CLEARANCE * np.array([e * np.cos(turn), e * np.sin(turn), 0.0, 0.0])
        bearing.settle(position, dt=1e-4)
        assert bearing.out[at.FILM_MIN] == pytest.approx(CLEARANCE * (1 - e), rel=1e-3)
        assert bearing.out[at.FILM_MIN_ANGLE] == pytest.approx(turn, abs=2e-3)


def test_supply_pressure_reaches_the_film_around_the_groove():
    bearing = grooved()
    bearing.settle([0, 0, 0, 0], speed=0.0, dt=1e-3)
    mask = bearing.film.supply.reshape(GRID.n_phi, GRID.n_z) > 0
    assert bearing.pressure[mask] == pytest.approx(4e5, rel=1e-12)
    assert bearing.out[at.PRESSURE_MAX] == pytest.approx(4e5, rel=1e-6)
    assert bearing.out[at.SUPPLY_FLOW] == pytest.approx(bearing.out[at.SIDE_FLOW], rel=1e-9)


ONE = {"shapes": bore_shapes(GRID, 1), "compliance": np.ones(1)}


@pytest.mark.parametrize(("change", "text"), [
    ({"clearance": -1e-6}, "clearance"), ({"viscosity": 0.0}, "viscosity"), ({"width": np.nan}, "width"),
    ({"supply_pressure": -1.0}, "supply pressure"), ({"compliance": np.ones(2)}, "compliance"),
    (ONE | {"shapes": np.zeros((1, 3, 3))}, "bore shapes"), (ONE | {"compliance": -np.ones(1)}, "negative eigenvalue"),
    (ONE | {"load_coupling": np.zeros((2, 4))}, "load coupling"), ({"contact": np.zeros(3)}, "contact"),
    ({"supply": np.full((GRID.n_phi, GRID.n_z), 0.5)}, "supply mask"),
])  # fmt: skip
def test_wrong_input_is_refused_in_one_line(change, text):
    sizes = {"diameter": 0.085, "width": 0.03, "clearance": 4e-5, "viscosity": 0.01}
    with one_line(text):
        GRID.film(**(sizes | change))


def test_grids_that_are_too_coarse_and_grooves_between_nodes_are_refused():
    for arguments in ((8, 7), (48, 3), (48, 7, 1.0)):
        with pytest.raises(InputError):
            ElasticGrid(*arguments)
