"""Elastic films of big ends: the film in axes that turn with the rod, its rigid limit, its effect, what is refused."""

import math
from dataclasses import replace
from functools import cache

import entry
import numpy as np
import pytest
from one_line import one_line

import cranktrain as ct
from cranktrain.dynamics.model.settings import Settings, check_levels, resolved
from cranktrain.dynamics.simulation import Parts, Simulation, simulate
from cranktrain.film.elastic.bore_compliance import RIGID_BORE
from cranktrain.film.elastic.grid import ElasticGrid
from cranktrain.film.laws.bearings import Bearings, bearing_parameters, law_films
from cranktrain.film.laws.ehd import FINE
from cranktrain.film.laws.register import BIG_END, bearing_law
from cranktrain.fmu.flat import FlatModel, from_bytes, to_bytes
from cranktrain.fmu.running import chosen_levels
from cranktrain.results.summary import run_summary

LEVELS = Settings(crank="rigid", bearings="impedance", big_ends="ehd")


@cache
def made(name="diesel_i6"):
    return ct.assemble(ct.load_engine(name), LEVELS)


@cache
def last_cycle(name, rpm, bore="elastic", level="ehd", step_deg=0.0, grid=FINE, cycles=2):
    """Crank angle (rad) and outputs of big end 1 over the last cycle, and the run's energies."""
    parts, settings = made(name).parts, made(name).settings
    own = {"elastic": parts.big_end_bore, "rigid": RIGID_BORE}.get(bore)
    if own is None:
        own = replace(parts.big_end_bore, compliance=float(bore) * parts.big_end_bore.compliance)
    own = replace(own, grid=grid)
    if level != "ehd":
        settings = resolved(replace(LEVELS, big_ends=level), made(name).engine)
    if step_deg:
        settings = replace(settings, step=math.radians(step_deg))
    speed = rpm * math.pi / 30.0
    run = simulate(made(name).engine, made(name).body, settings, speed, cycles, parts=parts._replace(big_end_bore=own))
    last = run.angle > run.angle[-1] - 4.0 * math.pi + 1e-9
    outputs = {n.removeprefix("big_end[1]."): v[last] for n, v in run.outputs.items() if n.startswith("big_end[1].")}
    return run.angle[last] % (4.0 * math.pi), outputs, run_summary(run, "")["energy"]


class Film:
    """One film of the six's big end, asked as a stage of a step does."""

    def __init__(self):
        bearing = ct.load_engine("diesel_i6").big_end_bearing
        rows = bearing_parameters(bearing, 0.01)[None]
        parts = {"big_end_bore": made().parts.big_end_bore}
        self.law = entry.Law(law_films(bearing_law("ehd"), BIG_END, Bearings(rows, bearing, parts=parts)))
        self.clearance = bearing.clearance
        self.numbers(0.0, 0.0, 100.0)

    def numbers(self, angle, turn, speed):
        self.law.tell(cos=math.cos(angle), sin=math.sin(angle), turn=turn, speed=speed)

    def force(self, place, velocity, start):
        """Answer of a stage after a step that began at rest at ``start``, in the axes' numbers set."""
        self.law.begin(1e-5, start, np.zeros(2))
        return self.law(place, velocity)


def turned(angle, vector):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


@pytest.mark.parametrize(("angle", "turn"), [(0.0, 30.0), (0.7, -45.0), (-2.0, 60.0)])
def test_a_film_knows_motion_against_its_bore_alone(angle, turn):
    """What a bore that stands sees, one that turns sees of a journal that turns with it as much more."""
    film = Film()
    c = film.clearance
    start, place, velocity = np.array([0.3, -0.5]) * c, np.array([0.32, -0.55]) * c, np.array([3e-3, -9e-3])
    stands = film.force(place, velocity, start)
    film.numbers(angle, turn, 100.0 + 2.0 * turn)
    # In the frame's axes; those of the bore are ahead by ``angle``, and move on with ``turn``.
    moved = velocity + turn * np.array([-place[1], place[0]])
    found = film.force(turned(-angle, place), turned(-angle, moved), turned(-angle, start))
    force = stands.force[:2]
    assert np.hypot(*force) > 100.0
    assert turned(angle, found.force[:2]) == pytest.approx(force, rel=1e-5, abs=1e-5 * np.abs(force).max())
    assert found.friction == pytest.approx(stands.friction, rel=1e-5)


def test_tangents_in_turning_axes_are_those_of_differences():
    film = Film()
    c, angle, turn = film.clearance, 0.7, -45.0
    film.numbers(angle, turn, 100.0)
    start, place, velocity = np.array([0.3, -0.5]) * c, np.array([0.32, -0.55]) * c, np.array([3e-3, -9e-3])
    mean = film.force(place, velocity, start)
    for k in range(2):
        for tangent, size, which in ((mean.by_place, 1e-3 * c, 0), (mean.by_velocity, 3e-4, 1)):
            ends = []
            for sign in (1.0, -1.0):
                at_end = [place.copy(), velocity.copy()]
                at_end[which][k] += sign * size
                ends.append(film.force(*at_end, start).force[:2])
            slope = (ends[0] - ends[1]) / (2.0 * size)
            scale = np.abs(tangent[:2]).max()
            assert tangent[:2, k] == pytest.approx(slope, rel=0.02, abs=0.02 * scale)


def test_a_rigid_bore_gives_the_film_of_the_impedance_map():
    """With oil enough, at full load and low speed: another solver of the same film, of a parabola across the width."""
    _, solved, _ = last_cycle("diesel_i6", 1000, "rigid")
    _, mapped, _ = last_cycle("diesel_i6", 1000, level="impedance")
    assert solved["film_thickness_min"].min() == pytest.approx(mapped["film_thickness_min"].min(), rel=0.02)
    assert solved["pressure_max"].max() == pytest.approx(mapped["pressure_max"].max(), rel=0.06)


def test_a_stiff_eye_is_a_rigid_bore():
    _, rigid, _ = last_cycle("diesel_i6", 1000, "rigid")
    _, stiff, _ = last_cycle("diesel_i6", 1000, "1e-4")
    for name in ("film_thickness_min", "pressure_max", "eccentricity", "friction_torque"):
        # Nodes that rupture a step earlier or later move an instant by a hundredth of the largest.
        assert stiff[name] == pytest.approx(rigid[name], rel=5e-3, abs=0.012 * np.abs(rigid[name]).max())
        assert np.mean(np.abs(stiff[name] - rigid[name])) < 1e-3 * np.abs(rigid[name]).max()


def test_an_elastic_cap_spreads_the_inertia_load():
    """About the dead centre of gas exchange the cap carries: it gives way, so the peak falls and the film grows."""
    angle, rigid, _ = last_cycle("diesel_i6", 2060, "rigid")
    _, elastic, _ = last_cycle("diesel_i6", 2060)
    cap = np.abs(angle - 2.0 * math.pi) < math.radians(60.0)
    assert elastic["pressure_max"][cap].max() < 0.97 * rigid["pressure_max"][cap].max()
    assert elastic["film_thickness_min"][cap].min() > 1.03 * rigid["film_thickness_min"][cap].min()
    # The pin goes beyond the clearance, where no rigid bore would let it.
    assert elastic["eccentricity"].max() > 1.2


def test_the_energy_of_a_periodic_run_closes():
    """Of a single, whose speed varies most; with films of the impedance map 2e-6 are left after as many cycles."""
    _, _, energy = last_cycle("single_petrol", 3000, cycles=8)
    assert abs(energy["residual_j"]) < 1e-5 * energy["gas_work_j"]


@pytest.mark.slow
def test_a_run_of_all_elastic_films_keeps_both_kinds_apart():
    """Mains and big ends each in lanes of their own: big ends do what they do beside mains of another law."""
    engine = ct.load_engine("diesel_i6")
    both = ct.assemble(engine, replace(LEVELS, bearings="ehd"))
    run = simulate(both.engine, both.body, both.settings, 1000.0 * math.pi / 30.0, 2, parts=both.parts)
    last = run.angle > run.angle[-1] - 4.0 * math.pi + 1e-9
    _, alone, _ = last_cycle("diesel_i6", 1000, grid=None)
    for name, share in (("film_thickness_min", 0.02), ("pressure_max", 0.02)):
        found = run.outputs[f"big_end[1].{name}"][last]
        best = np.min if name.endswith("min") else np.max
        assert best(found) == pytest.approx(best(alone[name]), rel=share)


@pytest.mark.slow
def test_least_film_and_peak_converge_with_grid_and_step():
    """Above rated speed, at crank angles of usual steps: the peak falls by a fifth within half a degree."""
    step = made().settings.step

    def figures(**how):
        angle, found, _ = last_cycle("diesel_i6", 2600, **how)
        read = np.abs(angle / step - np.round(angle / step)) < 1e-6
        assert read.sum() == round(4.0 * math.pi / step)
        cap = read & (np.abs(angle - 2.0 * math.pi) < math.radians(80.0))
        return found["film_thickness_min"][cap].min(), found["pressure_max"][cap].max()

    usual = figures()
    assert figures(step_deg=0.5) == pytest.approx(usual, rel=0.05)
    fine = figures(grid=ElasticGrid(72, 12, 0.5))
    assert fine[0] == pytest.approx(usual[0], rel=0.03)
    assert fine[1] == pytest.approx(usual[1], rel=0.12)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "rpm"), [("v8_cross", 3000), ("two_stroke_six", 100), ("four_petrol", 5000)])
def test_other_engines_run(name, rpm):
    """Two rods on a pin, a two-stroke, a four."""
    _, found, energy = last_cycle(name, rpm, cycles=4 if name != "two_stroke_six" else 2)
    assert 0.0 < found["film_thickness_min"].min() < found["film_thickness_min"].max()
    assert 0.0 < found["pressure_max"].max() < 1e9
    assert abs(energy["residual_j"]) < 0.01 * energy["gas_work_j"]


def test_elastic_big_ends_choose_the_integrator_as_elastic_mains_do():
    engine = ct.load_engine("diesel_i6")
    of_mains, of_ends = (resolved(s, engine) for s in (Settings(bearings="ehd"), LEVELS))
    for name in ("integrator", "step", "newton_tolerance", "film_change"):
        assert getattr(of_ends, name) == getattr(of_mains, name)
    mapped = resolved(replace(LEVELS, big_ends="impedance"), engine)
    assert mapped.integrator == bearing_law("impedance").integrator


def test_what_has_no_elastic_eye_is_refused_in_one_line():
    """A run without its compliance, rods that run on others, dimensions that make none."""
    run, eight, engine = made(), ct.load_engine("v8_cross"), ct.load_engine("diesel_i6")
    hung = replace(eight, cylinders=replace(eight.cylinders, rods_on_pin="fork-and-blade", rod_offsets=()))
    with one_line("big-end level 'ehd' needs the compliance of the rods' eyes"):
        Simulation(run.engine, run.body, run.settings, None, Parts()).initialize()
    with one_line("big-end level 'ehd' has a film between each rod and its pin"):
        check_levels(resolved(LEVELS, hung), hung)
    for key, value in (("eye_width", 0.06), ("cap_wall", 0.2), ("shank_width", 0.5), ("eye_wall", 0.2)):
        with one_line(f"rod.{key}: "):
            ct.assemble(replace(engine, rod=replace(engine.rod, **{key: value})), LEVELS)


def test_an_fmu_carries_the_eye_or_says_that_it_lacks_it():
    run = made()
    model = FlatModel(run.engine, {"rigid": run.body}, big_end_bore=run.parts.big_end_bore)
    read = from_bytes(to_bytes(model))
    assert np.array_equal(read.big_end_bore.coefficients, run.parts.big_end_bore.coefficients)
    chosen = {"crank": "rigid", "bearings": "impedance", "big_ends": "ehd", "block": "ground"}
    assert chosen_levels(read, chosen, {}).parts.big_end_bore is read.big_end_bore
    with one_line("'big_ends' is 'ehd', but the FMU was built without the elastic eye"):
        chosen_levels(read._replace(big_end_bore=None), chosen, {})
