"""Elastic films whose edge carries: grids of the levels against finer ones; films say where they do not resolve."""

import functools
import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from elastic_bearing import CLEARANCE, DIAMETER, grooved
from started import at_speed

import cranktrain as ct
from cranktrain.dynamics.simulation import Settings
from cranktrain.engine.levels import BLOCKS
from cranktrain.film.contact.asperity import contact_constants
from cranktrain.film.elastic.grid import FILM_MIN, PRESSURE_MAX, ElasticGrid
from cranktrain.film.laws.ehd import FINE
from cranktrain.film.laws.pressure_peak import (
    PEAK,
    PEAK_ANGLE,
    PEAK_DROP,
    PEAKS,
    keep_peak,
    pressure_drop,
    pressure_peaks,
)
from cranktrain.film.laws.register import bearing_law
from cranktrain.results.summary import NOT_RESOLVED, films_not_resolved, grid_errors
from cranktrain.results.tables import grid_text, resolution_text
from cranktrain.structure.assembly import assemble

SPEED, STEP, STEPS = 249.0, np.radians(2.5), 30
LINING = contact_constants(0.4e-6, 0.05, 0.01, 58.6e9, 0.1, 0.0, 300e6)
RELIEF = (6e-6, 0.5, 2.0)
EDGE_CLOSED = {0.25: (19e-6, 12e3), 0.353: (24e-6, 17e3), 0.7: (32e-6, 35e3)}
"""Width over diameter: largest tilt, m at the end, and load, N, at which the edge carries."""


@functools.cache
def pressed(n_phi, n_z, ratio, tilted=True):
    """Least film, largest pressure and its drop while a load swells and fades on a journal whose tilt is given."""
    grid = ElasticGrid(n_phi, n_z, 0.5, 0.133)
    bearing = grooved(grid, 7, softness=0.15, width=ratio * DIAMETER, contact=LINING, profile=RELIEF)
    tilt, load = EDGE_CLOSED[ratio]
    h, velocity, rows = STEP / SPEED, np.zeros(4), []
    bearing.start_position[:] = [-0.5 * CLEARANCE, -0.3 * CLEARANCE, 0.0, 0.0]
    for s in np.linspace(0.0, 1.0, STEPS + 1)[1:]:
        swell, angle = math.sin(math.pi * s) ** 2, math.radians(200.0 + 100.0 * (s - 0.5))
        way = np.array([math.cos(angle), math.sin(angle)])
        place = bearing.start_position + 0.5 * h * velocity
        place[2:] = tilt * (0.2 + 0.8 * swell) * way if tilted else 0.0
        applied = load * (0.15 + 0.85 * swell) * way
        for _ in range(60):
            velocity = (place - bearing.start_position) / h
            rest = bearing.settle(place, velocity, SPEED, h)[:2] + applied
            if np.hypot(*rest) < 1e-4 * np.hypot(*applied):
                break
            change = -np.linalg.solve((bearing.stiffness + bearing.damping / h)[:2, :2], rest)
            place[:2] += change * min(1.0, 0.1 * CLEARANCE / abs(change).max())
        else:
            raise AssertionError("the journal found no place")
        bearing.accept(place)
        rows.append([bearing.out[FILM_MIN], bearing.out[PRESSURE_MAX], pressure_drop(bearing.unknowns, n_z)])
    least, pressures, drops = np.array(rows).T
    return least.min(), pressures.max(), drops[pressures.argmax()]


@pytest.mark.parametrize("ratio", EDGE_CLOSED)
def test_lines_gathered_at_the_ends_at_a_closed_edge(ratio):
    """Least film and largest pressure within about a tenth of a grid twice as fine around and three times across."""
    (least, highest, _), (finer, peak, _) = pressed(48, 8, ratio), pressed(96, 24, ratio)
    assert least == pytest.approx(finer, rel=0.12)
    assert highest == pytest.approx(peak, rel=0.12)


@pytest.mark.slow
def test_fine_level_in_a_four(tmp_path, monkeypatch):
    """Of every main, least film within 5 % and largest pressure within 8 % of a grid three times as fine across."""
    monkeypatch.chdir(tmp_path)
    engine = ct.new_engine("four", layout="i4", bore_mm=86, stroke_mm=86)
    made = assemble(engine, Settings(bearings="ehd"))
    found = []
    for grid in (FINE, ElasticGrid(96, 24, 0.3)):
        parts = made.parts._replace(bore=replace(made.parts.bore, grid=grid))
        run = at_speed(4500.0 * math.pi / 30.0, made.engine, made.body, made.settings, None, parts)
        at = [run.output_names.index(f"bearing[{i + 1}].film_thickness_min") for i in range(5)]
        films = np.empty((720, 5))
        for k in range(720):
            run.step((k + 1) * math.radians(2.0) / run.inputs[0])
            films[k] = run.outputs[at]
        found.append((films[360:].min(axis=0), pressure_peaks(entry.films(run).entry)[:, PEAK]))
    assert found[0][0] == pytest.approx(found[1][0], rel=0.05)
    assert found[0][1] == pytest.approx(found[1][1], rel=0.08)


def test_grids_converge_at_a_closed_edge():
    fine = pressed(96, 24, 0.353)
    errors = [abs(pressed(n_phi, n_z, 0.353)[0] / fine[0] - 1.0) for n_phi, n_z in ((48, 8), (96, 16))]
    assert errors[1] < 0.03 and errors[1] < errors[0]


def test_a_film_tells_whether_its_lines_resolve_it():
    """One line alone carries a closed edge on the grid of the loop; several do on a fine grid, and without tilt."""
    assert pressed(48, 8, 0.353)[2] > NOT_RESOLVED
    assert pressed(96, 24, 0.353)[2] < NOT_RESOLVED
    assert pressed(48, 8, 0.353, tilted=False)[2] < 0.5 * NOT_RESOLVED


def test_drop_of_pressure_from_its_peak_across_the_bore():
    unknowns = np.array([-0.1, 0.2, 0.5, -0.3, 1.0, -0.2, 0.4, 0.0])
    assert pressure_drop(unknowns, 4) == pytest.approx(1.0)  # first line of the second column: beside it the end
    assert pressure_drop(unknowns[:4], 4) == pytest.approx(1.0 - 0.5 * 0.2 / 0.5)
    assert pressure_drop(np.full(8, -0.5), 4) == 0.0


def test_peaks_are_those_of_the_last_cycle():
    peaks, ridge, flat = np.zeros(PEAKS), np.array([0.0, 1.0, 0.0, 0.0]), np.ones(4)
    inside = np.array([0.9, 1.0, 1.0, 0.9])
    cycle = 4.0 * math.pi
    keep_peak(peaks, 3e8, ridge, 4, 0.5 * cycle)
    keep_peak(peaks, 2e8, flat, 4, 0.6 * cycle)
    assert peaks[[PEAK, PEAK_DROP]].tolist() == [3e8, 1.0]
    assert peaks[PEAK_ANGLE] == pytest.approx(0.5 * cycle)
    keep_peak(peaks, 1e8, flat, 4, cycle)  # the step that ends the cycle is its own
    assert peaks[PEAK] == 3e8
    keep_peak(peaks, 1e8, inside, 4, 1.25 * cycle)
    assert peaks[[PEAK, PEAK_DROP]] == pytest.approx([1e8, 0.05])
    assert peaks[PEAK_ANGLE] == pytest.approx(0.25 * cycle)


def test_summary_names_films_that_are_not_resolved():
    peaks = np.zeros((3, PEAKS))
    peaks[:, PEAK], peaks[:, PEAK_ANGLE], peaks[:, PEAK_DROP] = 1e8, math.radians(147.5), [0.1, 0.49, 0.9]
    found = films_not_resolved(peaks)
    assert [film["name"] for film in found] == ["main[3]"]
    assert found[0]["crank_angle_deg"] == pytest.approx(147.5)
    assert found[0]["pressure_drop"] == pytest.approx(0.9)
    assert "main[3] at 148 deg (90 %)" in resolution_text(found)
    assert films_not_resolved(peaks[:2]) == []


@pytest.mark.parametrize("block", BLOCKS)
@pytest.mark.parametrize("level", ["ehd", "ehd:fine"])
def test_a_run_states_the_error_of_its_grid_at_its_worst_mains(level, block):
    """The thinnest film and the largest pressure may be those of two mains; the finer level errs less."""
    errors = bearing_law(level).film_errors[block]
    films = [("main[1]", 1.4, 1e8), ("main[2]", 2.0, 3e8), ("main[3]", 0.9, 2e8)]
    found = grid_errors({"bearings": level, "block": block}, films)
    assert found["least_film"] == {"name": "main[3]", "um": 0.9, "error": errors[0]}
    assert found["largest_pressure"] == {"name": "main[2]", "pa": 3e8, "error": errors[1]}
    text = grid_text(found)
    assert f"least film of main[3], 0.90 um, is within {100 * errors[0]:.0f} %" in text
    assert f"largest pressure of main[2], 300 MPa, within {100 * errors[1]:.0f} %" in text
    assert "\n" not in text and ("block" in text) == (block == "flexible")
    fine, coarse = (bearing_law(name).film_errors[block] for name in ("ehd:fine", "ehd"))
    assert 0.0 < fine[0] < coarse[0] and 0.0 < fine[1] < coarse[1]
    assert grid_errors({"bearings": "table", "block": block}, films) == {}
    assert grid_errors({"bearings": level, "block": block}, []) == {}
