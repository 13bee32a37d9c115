"""The ladder of levels: what each answers and refuses, and that every rung is the same crank."""

import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from one_line import one_line
from refusals import refused_files
from some import some
from threadpoolctl import threadpool_limits

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import rigid_coordinates
from cranktrain.engine.file import load_engine
from cranktrain.engine.levels import CRANKS, Levels
from cranktrain.film.laws.register import PLAIN, bearing_levels
from cranktrain.structure import assembly
from cranktrain.structure.crank.level import bare_crank, crank_body
from cranktrain.structure.crank.modal import free_modes, torsional_frequencies
from cranktrain.structure.crank.reduction import complete_crankshaft, reduced_crankshaft
from cranktrain.structure.crank.sections import crank_pieces, interface_places
from cranktrain.structure.crank.torsional import sections
from cranktrain.studies.output_levels import lowest_levels, plain_name, refuse_beyond, variables
from cranktrain.studies.torsion.level_frequencies import level_frequencies

INTERFACE = Path(__file__).parents[2] / "modelDescription" / "interface.toml"


SIX = load_engine("diesel_i6")
CUT = SIX.reduction.running_cutoff_hz
BEYOND = [
    *refused_files()["levels"]["beyond"],
    ("rigid", "linear", 2.0 * CRANKS["rigid"].highest_frequency(SIX), "crank level 'torsional'"),
    ("torsional", "linear", 1.01 * CRANKS["torsional"].highest_frequency(SIX), "crank level 'beam'"),
    ("solid", "linear", 1.01 * CUT, f"at most {CUT:g} Hz"),
]


@pytest.mark.parametrize(("crank", "bearings", "asked", "can"), BEYOND)
def test_what_a_level_does_not_answer_is_refused_with_the_one_that_does(crank, bearings, asked, can):
    """An output, or a frequency."""
    wanted = ([asked],) if isinstance(asked, str) else ([], asked)
    with one_line(can):
        refuse_beyond(Levels(crank, bearings), *wanted, engine=SIX)


def test_the_lowest_levels_answer_and_none_below_does():
    plain = bearing_levels(PLAIN)
    for output, lowest in some(variables().items()):
        chosen = lowest_levels([output])
        refuse_beyond(chosen, [output])
        assert chosen.crank == lowest.crank
        for below in list(CRANKS)[: list(CRANKS).index(lowest.crank)]:
            with pytest.raises(InputError):
                refuse_beyond(replace(chosen, crank=below), [output])
        for below in plain[: plain.index(lowest.bearings)]:
            with pytest.raises(InputError):
                refuse_beyond(replace(chosen, bearings=below), [output])


def test_levels_of_several_outputs_are_the_highest_of_each_kind():
    chosen = lowest_levels(["pulley.axial", "bearing[1].film_thickness_min", "damper.heat"])
    assert (chosen.crank, chosen.bearings, chosen.damper) == ("beam", "impedance", "fitted")
    assert lowest_levels(["bearing[1].tilt"], rollers=True).bearings == "roller"
    assert lowest_levels(["bending_frequencies"]).bearings == "linear"
    refuse_beyond(Levels("solid", "linear"), [], CUT, engine=SIX)
    with pytest.raises(InputError, match="no oil film"):
        lowest_levels(["bearing[1].oil_flow"], rollers=True)


@cache
def crank(name, level):
    """Complete crankshaft of an engine at a level."""
    engine = load_engine(name)
    solid = reduced_crankshaft(engine) if level in ("solid", "torsional") else None
    return engine, complete_crankshaft(engine, bare_crank(engine, level, solid))


ENGINES = ["diesel_i6", "diesel_v8"]


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("level", ["rigid", "beam"])
def test_rigid_modes_of_every_level_are_exact(name, level):
    _, body = crank(name, level)
    coordinates = rigid_coordinates(body)
    for row, position in zip(body.shapes, body.positions, strict=True):
        moved = coordinates[:3] + np.cross(coordinates[3:].T, position).T
        np.testing.assert_allclose(row[:3, :6], moved, atol=1e-10)
        np.testing.assert_allclose(row[3:, :6], coordinates[3:], atol=1e-10)
    mass = np.zeros((6, 6))
    mass[:3, :3] = body.mass * np.eye(3)
    x, y, z = body.centre
    mass[3:, :3] = body.mass * np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    mass[:3, 3:] = mass[3:, :3].T
    mass[3:, 3:] = body.inertia
    np.testing.assert_allclose(coordinates.T @ mass @ coordinates, np.eye(6), atol=1e-9)
    # Rotation about the axis is neutral at every speed.
    assert np.abs((body.stress_stiffness - body.centrifugal)[5]).max() < 1e-8


@pytest.mark.parametrize("name", ENGINES)
def test_rotation_invariants_of_the_beam_are_those_of_the_rigid_crank(name):
    """Rigid rows of G, C, K_sigma, f_c and f_e belong to mass and inertia alone, which both have from dimensions."""
    engine = load_engine(name)
    stiff, bent = bare_crank(engine, "rigid"), bare_crank(engine, "beam")
    for part in ("gyroscopic", "centrifugal", "stress_stiffness"):
        own = getattr(stiff, part)
        np.testing.assert_allclose(getattr(bent, part)[:6, :6], own, atol=2e-3 * np.abs(own).max())
    for part in ("centrifugal_load", "euler_load"):
        np.testing.assert_allclose(getattr(bent, part)[:6], getattr(stiff, part), atol=2e-3)


@pytest.mark.parametrize("name", ENGINES)
def test_torsion_of_the_beam_does_not_feel_the_speed(name):
    """Spin softening and stress stiffening cancel in the first torsional mode of the free crankshaft."""
    engine, body = crank(name, "beam")
    hz, shares, _ = free_modes(engine, body)
    mode = 6 + int(np.argmin(np.abs(hz - torsional_frequencies(hz, shares)[0])))
    # d(ω²)/d(Ω²) of the mode: 0.03 moves 250 Hz by 0.04 % at 2400 rev/min; with −C alone it would be nearly −1.
    assert abs((body.stress_stiffness - body.centrifugal)[mode, mode]) < 0.03
    assert body.centrifugal[mode, mode] > 0.5


@pytest.mark.parametrize("name", ENGINES)
def test_sections_hold_the_mass_and_inertia_between_their_borders(name):
    """Against thin discs: each belongs to the nearest interface, about which its inertia counts."""
    engine = load_engine(name)
    found = sections(engine)
    places = interface_places(engine.crankshaft, engine.thrust.main)
    z = np.array([list(places.values())[int(row)][2] for row in found["section_interface"]])
    expected = np.zeros((3, z.size))
    for piece in crank_pieces(engine):
        thin = piece.length / 4000
        at = piece.span[0] + thin * (np.arange(4000) + 0.5)
        nearest = np.argmin(np.abs(at[:, None] - z), axis=1)
        mass, polar = piece.moments[0, 0] * thin, (piece.moments[1, 1] + piece.moments[2, 2]) * thin
        for row, values in enumerate((mass + 0.0 * at, polar + 0.0 * at, 0.5 * polar + mass * (at - z[nearest]) ** 2)):
            expected[row] += np.bincount(nearest, weights=values, minlength=z.size)
    keys = ("section_mass", "section_polar", "section_diametral")
    np.testing.assert_allclose([found[key] for key in keys], expected, rtol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("level", ["rigid", "torsional", "beam"])
def test_every_level_is_the_same_crank(name, level):
    """Mass within 0.1 %, inertia within 0.2 %, centre within 0.5 mm, interfaces within 0.5 mm of the solid's."""
    _, body = crank(name, level)
    _, solid = crank(name, "solid")
    assert body.interfaces == solid.interfaces
    np.testing.assert_allclose(body.positions, solid.positions, atol=5e-4)
    assert body.mass == pytest.approx(solid.mass, rel=1e-3)
    np.testing.assert_allclose(np.diag(body.inertia), np.diag(solid.inertia), rtol=2e-3)
    np.testing.assert_allclose(body.centre, solid.centre, atol=5e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", ENGINES)
def test_beam_is_near_the_solid_without_fitting(name):
    """Issue: 3 % in the first torsional, 8 % in the first three bending frequencies of the free crankshaft."""
    engine = load_engine(name)
    report = level_frequencies(engine, "beam", reduced_crankshaft(engine))
    free = report["crankshaft_free"]
    assert abs(free["first_torsional"]["deviation_percent"]) < 3.0
    bending = [row for row in free["modes"] if row["shape"] == "bending"][:3]
    assert len(bending) == 3 and max(abs(row["deviation_percent"]) for row in bending) < 8.0
    assert abs(report["cranktrain"]["first_torsional"]["deviation_percent"]) < 3.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ENGINES)
def test_bare_beam_is_near_the_bare_solid(name):
    """The same without flywheel and pulley, mode by mode in their order: nothing hides behind heavy parts."""
    engine = load_engine(name)
    beam, solid = bare_crank(engine, "beam"), reduced_crankshaft(engine)
    np.testing.assert_allclose(beam.frequencies_hz[6:9], solid.frequencies_hz[6:9], rtol=0.08)


def test_running_bodies_are_cut_and_answer_statically():
    """Torsional: a force on a pin along its circle twists the cut body as it does the whole one."""
    reduction = replace(SIX.reduction, torsional_source="carter", running_cutoff_hz=800.0)
    engine = replace(SIX, reduction=reduction)
    whole = complete_crankshaft(engine, bare_crank(engine, "torsional"))
    cut = crank_body(engine, "torsional")

    def twist(body):
        pin, pulley = body.shapes[body.index("pin[3]"), :2, 6:], body.shapes[body.index("pulley"), 5, 6:]
        return pin @ (pulley / body.omega[6:] ** 2)

    np.testing.assert_allclose(twist(cut), twist(whole), rtol=1e-6)
    assert np.count_nonzero(cut.omega[6:] <= 2.0 * np.pi * 800.0) < whole.n_modes - 6


def test_only_what_is_made_of_the_solid_asks_for_it_and_every_output_of_the_interface_has_its_levels():
    listed = tomllib.loads(INTERFACE.read_text())["variable"]
    outputs = {plain_name(entry["name"]) for entry in listed if entry["causality"] == "output"}
    assert outputs == set(variables())
    formula = replace(SIX, reduction=replace(SIX.reduction, torsional_source="carter"))
    assert [row.needs_solid(SIX) for row in CRANKS.values()] == [False, True, False, True]
    assert not CRANKS["torsional"].needs_solid(formula)


@pytest.mark.parametrize("level", ["torsional", "beam"])
@pytest.mark.parametrize("name", ["single_petrol", "diesel_i6"])
def test_a_crank_is_the_same_on_any_number_of_threads(name, level, monkeypatch):
    """By its digest, to the bit: a run-up is gone on with on another machine, and beside other processes."""
    monkeypatch.setattr(assembly, "_once", lambda key, make: make())
    digests = set()
    for threads in (1, 2):
        with threadpool_limits(limits=threads, user_api="blas"):
            digests.add(assembly.running_crank(load_engine(name), level).digest)
    assert len(digests) == 1
