"""A steady bearing with rough surfaces, oil under pressure and an elastic bore: limits, balances, another solver."""

import math
from dataclasses import replace

import numpy as np
import pytest
from bodies import free_six

import cranktrain as ct
from cranktrain.film.contact.asperity import contact_constants
from cranktrain.film.elastic.content import CONTENT
from cranktrain.film.elastic.film import CONVERGED, elastic_film
from cranktrain.film.elastic.grid import FILM_MIN, PRESSURE_MAX, ElasticGrid
from cranktrain.film.elastic.oil import oil_tables
from cranktrain.film.elastic.workspace import lane_work
from cranktrain.film.laws.ehd import elastic_memory
from cranktrain.film.reynolds.rough_gap import Roughness
from cranktrain.film.steady.bearing import Journal, SteadyBearing, bearing_grid
from cranktrain.film.steady.mixed_bearing import MixedBearing, Surroundings
from cranktrain.structure.block.saddle import bore_compliance

ENGINE = free_six()
OIL = replace(ENGINE.oil, pressure_law="roelands", pressure_viscosity=15e-9)
MAIN = replace(ENGINE.main_bearing, diameter=0.085)
BORE = bore_compliance(replace(ENGINE, main_bearing=MAIN), 7, with_motion=True)
ROUGH = Roughness(0.8e-6), contact_constants(0.8e-6, 0.05, 0.01, 58.6e9, 0.1)
JOURNAL = Journal(0.085, 0.030, 40e-6, 0.0143, 209.4)
ALL = Surroundings("mass-conserving", OIL, *ROUGH, BORE)
MACHINE = {"diameter_mm": 85, "width_mm": 30, "clearance_um": 40, "speed_rpm": 2000}


def steady(around, load=20e3, journal=JOURNAL, moment=None, grid=(96, 12)):
    return MixedBearing(around, "widest-gap", grid).state(journal, load, moment)


def test_smooth_rigid_surfaces_and_constant_oil_are_the_limits():
    """Roughness, compliance and pressure coefficient that vanish leave the plain film, each by itself and together."""
    plain = steady(Surroundings())
    tiny = replace(BORE, compliance=1e-6 * BORE.compliance, load_coupling=1e-6 * BORE.load_coupling)
    faint = Roughness(1e-9), contact_constants(1e-9, 0.05, 0.01, 58.6e9, 0.1)
    thin = replace(OIL, pressure_viscosity=1e-14)
    for around in (
        Surroundings(oil=thin), Surroundings(roughness=faint[0], contact=faint[1]),
        Surroundings("mass-conserving", thin, *faint, tiny),
    ):  # fmt: skip
        state = steady(around)
        assert state.eccentricity == pytest.approx(plain.eccentricity, rel=1e-3)
        for name in ("friction_torque", "flow", "largest_pressure", "least_film"):
            assert getattr(state, name) == pytest.approx(getattr(plain, name), rel=3e-3), name
        assert state.stiffness == pytest.approx(plain.stiffness, rel=0.02, abs=0.01 * abs(plain.stiffness).max())


def test_film_of_the_widest_gap_is_reynolds_rupture_with_moments_too():
    """Fed on the line of the widest gap, a film that conserves oil is that of Swift and Stieber: tilted as well."""
    moment = (20.0, -35.0)
    state = steady(Surroundings(), moment=moment, grid=(160, 16))
    known = SteadyBearing(bearing_grid(tilted=True)).state(JOURNAL, 20e3, moment)
    assert state.eccentricity == pytest.approx(known.eccentricity, abs=2e-3)
    assert state.tilt == pytest.approx(known.tilt, abs=2e-3)
    assert state.least_film == pytest.approx(known.least_film, rel=0.02)
    assert state.stiffness == pytest.approx(known.stiffness, rel=0.05, abs=0.03 * abs(known.stiffness).max())
    assert state.damping == pytest.approx(known.damping, rel=0.05, abs=0.03 * abs(known.damping).max())


def test_stiffness_with_everything_is_the_change_of_the_load_with_place():
    middle = steady(ALL)
    more, less = (steady(ALL, 20e3 * (1 + sign * 0.01)) for sign in (1, -1))
    moved = JOURNAL.clearance * (more.eccentricity - less.eccentricity)
    assert middle.stiffness @ moved == pytest.approx([400.0, 0.0], abs=12.0)


def test_asperities_take_over_as_the_speed_falls():
    """Stribeck: friction falls with the speed to a least value, then rises to that of the boundary, μ F R."""
    states = [
        steady(Surroundings("mass-conserving", None, *ROUGH), journal=replace(JOURNAL, speed=speed))
        for speed in (400.0, 200.0, 100.0, 50.0, 25.0, 12.0, 6.0, 1.0, 0.02)
    ]
    carried = np.array([state.contact_load for state in states])
    torque = np.array([state.friction_torque for state in states])
    assert np.all(np.diff(carried) >= 0.0) and carried[0] == 0.0 and carried[-1] > 0.9 * 20e3
    least = int(torque.argmin())
    assert 0 < least < len(states) - 1
    assert np.all(np.diff(torque[: least + 1]) < 0.0) and np.all(np.diff(torque[least:]) > 0.0)
    # Around the contact the normal turns: the sum of its pressures is a little more than its resultant.
    assert 1.0 < states[-1].contact_torque / (0.1 * carried[-1] * JOURNAL.radius) < 1.1


def test_an_elastic_bore_is_that_of_the_film_of_a_run():
    """One place towards the cap, fed along one line: another discretisation and solver, same bore, oil, asperities."""
    place = 1.05
    state = MixedBearing(ALL, "widest-gap", (96, 12)).state(JOURNAL, None, None, (place, 0.0))
    grid = ElasticGrid(96, 11)
    line = np.zeros((grid.n_phi, grid.n_z))
    line[grid.n_phi // 4] = 1
    film = grid.film(
        0.085, 0.030, 40e-6, JOURNAL.viscosity, shapes=BORE.shapes(grid.angles, grid.zetas), compliance=BORE.compliance,
        load_coupling=BORE.load_coupling, supply=line, contact=ROUGH[1], oil=oil_tables(OIL, np.array([0.0143])),
    )  # fmt: skip
    memory = elastic_memory(film, 1)._replace(content=np.zeros((1, CONTENT, 0)))
    memory.motions[0, 0, 1], memory.speeds[0] = -place * 40e-6, 209.4
    assert elastic_film(film, lane_work(film), 0, (math.inf, math.inf), memory, JOURNAL.viscosity, False) == CONVERGED
    out = memory.out[0]
    # The film of a run knows no flow factors: a per cent of the gap at six times the roughness.
    assert state.load == pytest.approx(math.hypot(*out[:2]), rel=0.03)
    assert state.largest_pressure == pytest.approx(out[PRESSURE_MAX], rel=0.03)
    assert state.least_film == pytest.approx(out[FILM_MIN], rel=0.03)


def test_oil_that_stiffens_needs_an_elastic_bore():
    """In a rigid bore the film of a high load would have to be thinner than its oil allows; one line says so."""
    stiff = replace(OIL, pressure_viscosity=20e-9)
    with pytest.raises(ct.CranktrainError, match="elastic bore or less pressure_viscosity"):
        steady(Surroundings(oil=stiff), 60e3)
    assert steady(Surroundings(oil=stiff), 20e3).least_film > steady(Surroundings(), 20e3).least_film


WARM = {"inlet_temperature_c": 80, "oil_viscosity_40": 100, "oil_viscosity_100": 11, "oil_density": 860}
THICK = {"roughness_um": 0.8, "pressure_law": "barus", "pressure_viscosity": 12}


def heat_is_balanced(state):
    rise = state["outlet_temperature_c"] - 80
    heat = 0.8 * state["friction_torque"] * 2000 * math.pi / 30
    assert rise > 2.0 and 860 * 2000 * state["flow"] * rise == pytest.approx(heat, rel=1e-3)


@pytest.mark.parametrize("cavitation", ["reynolds", "guembel", "mass-conserving"])
def test_the_place_of_a_load_carries_that_load(cavitation):
    """Rough surfaces, oil under pressure and heat balance on every path, from the load to the place and back."""
    bearing = ct.Bearing(**MACHINE, **WARM, **THICK, cavitation=cavitation, grid=(96, 12))
    state = bearing.equilibrium(15e3)
    heat_is_balanced(state)
    placed = bearing.at_eccentricity(state["eccentricity"])
    assert placed["load"] == pytest.approx(15e3, rel=2e-3)
    for name in ("attitude_deg", "min_film_um", "friction_torque", "effective_temperature_c", "contact_load"):
        assert placed[name] == pytest.approx(state[name], rel=2e-3, abs=0.02), name
    for name in ("stiffness", "damping"):
        known = np.array(state[name])
        assert np.array(placed[name]) == pytest.approx(known, rel=0.02, abs=0.01 * abs(known).max()), name


def test_heat_balance_of_an_elastic_bore():
    state = ct.Bearing(**MACHINE, **WARM, **THICK, cavitation="mass-conserving", bore=BORE, grid=(72, 10)).equilibrium(
        20e3
    )
    heat_is_balanced(state)
    assert state["contact_load"] >= 0.0 and state["bore_displacement_um"] > 5.0
