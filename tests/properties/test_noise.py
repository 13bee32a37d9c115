"""Structure-borne noise of a block: panels of its surface, recovery from modes, step, result file, sound, refusals."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bodies import free_six
from box_block import box_block
from scipy.io import wavfile
from small_block import single

from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.rigid_slices import rigid_motion
from cranktrain.structure.block.mesh import block_mesh
from cranktrain.structure.block.reduction import reduction_task
from cranktrain.structure.block.shape import PATCH, block_plan
from cranktrain.structure.fem.reduction import reduced_with_shapes, surface_triangles
from cranktrain_lab.noise.panels import Facets, block_panels, facet_shapes, six_node_facets
from cranktrain_lab.noise.pictures import loudest_band, surface_map
from cranktrain_lab.noise.recording import Recorded
from cranktrain_lab.noise.result import NoiseResult, Panels, levels
from cranktrain_lab.noise.sound import RATE, save_sound
from cranktrain_lab.noise.study import for_vibration
from cranktrain_lab.noise.surface import Surface, outer_surface


@cache
def single_boundary():
    """Plan and mesh of the single's block, and all facets of its boundary."""
    plan = block_plan(single())
    mesh = block_mesh(plan)
    return plan, mesh, Facets(np.ascontiguousarray(mesh.doflocs.T), six_node_facets(surface_triangles(mesh)))


@cache
def surface_of_single():
    """Outer surface of the single's block, with the motion of its six rigid modes."""
    plan, mesh, whole = single_boundary()
    names, panel = block_panels(plan, mesh, whole)
    kept = np.flatnonzero(panel >= 0)
    motion = rigid_motion(whole.points)[:, :3].transpose(2, 0, 1)
    return plan, Surface(Facets(whole.points, whole.nodes[kept]), panel[kept], names, motion)


def test_panels_have_the_areas_of_the_plan():
    plan, surface = surface_of_single()
    b, (front, rear) = plan.block, plan.ends
    area = dict(zip(surface.names, surface.areas(), strict=True))
    assert set(area) == {
        "front", "rear", "cover", "deck", "bank left", "bank right", "skirt left", "skirt right", "mounts",
    }  # fmt: skip
    assert area["cover"] == pytest.approx(2.0 * b.crankcase_half_width * (rear - front), rel=1e-9)
    bore = 0.25 * np.pi * plan.cylinder_bore**2
    assert area["deck"] == pytest.approx(2.0 * b.bank_half_width * (rear - front) - bore, rel=1e-3)
    assert area["bank left"] == pytest.approx((b.deck_height - b.foot_height) * (rear - front), rel=1e-6)
    for pair in (("skirt left", "skirt right"), ("front", "rear")):
        assert area[pair[0]] == pytest.approx(area[pair[1]], rel=1e-6)


def test_the_outer_surface_is_closed_but_for_its_openings():
    """Over a closed surface the normal's integral vanishes: what is missing are bores, the cylinder, feet of mounts."""
    plan, surface = surface_of_single()
    b = plan.block
    total = surface.facets.area_vectors.sum(axis=(0, 1))
    bore = 0.25 * np.pi * plan.cylinder_bore**2
    foot = b.pad_size**2 * len(plan.mounts)
    assert total == pytest.approx([0.0, -(bore - foot), 0.0], abs=2e-3 * bore)


def test_products_of_rigid_motions_are_those_of_the_normals():
    """v·n of a translation along y over the cover is its area; a rotation about z has ∫ x² dA there."""
    plan, surface = surface_of_single()
    products = surface.products()
    k = surface.names.index("cover")
    area, half = surface.areas()[k], plan.block.crankcase_half_width
    assert products[k, 1, 1] == pytest.approx(area, rel=1e-9)
    assert products[k, 5, 5] == pytest.approx(area * half**2 / 3.0, rel=1e-9)
    assert products[k, 0, 0] == pytest.approx(0.0, abs=1e-12)
    turned = surface.in_modes(np.eye(6)[:, [5, 1]]).products()
    assert turned[k] == pytest.approx(products[k][np.ix_([5, 1], [5, 1])])


def test_named_surfaces_of_an_own_mesh_are_its_panels():
    plan, mesh, whole = single_boundary()
    skin = mesh.boundary_facets()
    low = whole.points[whole.nodes[:, :3], 1].max(axis=1) < -plan.block.skirt_depth - 1e-6
    named = mesh.with_boundaries({"sump": skin[low]})
    names, panel = block_panels(plan, named, whole)
    assert names == ("sump",) and np.array_equal(panel == 0, low)


def test_the_surface_of_a_reduction_moves_as_its_interfaces():
    """Mean motion of the cover's patch, and of the deck, in every mode against interfaces ``cover`` and ``head[1]``."""
    engine = single()
    engine = replace(engine, block=replace(engine.block, fixed_modes=12))
    plan = block_plan(engine)
    model, _, reduced = reduced_with_shapes(reduction_task(engine), lambda text: None)
    surface = outer_surface(plan, model, reduced)
    values, _ = facet_shapes()
    body, middle = reduced.body, surface.facets.points[surface.facets.nodes[:, :3]].mean(axis=1)
    patch = (np.abs(middle[:, [0, 2]] - [0.0, 0.5 * sum(plan.ends)]) < 0.5 * PATCH).all(axis=1)
    cover, deck = (surface.panel == surface.names.index(name) for name in ("cover", "deck"))
    for inside, interface, sign in ((cover & patch, "cover", -1.0), (deck, "head[1]", 1.0)):
        own = surface.facets.area_vectors[inside][:, :, 1]
        moved = surface.modes[:, surface.facets.nodes[inside], 1] @ values.T
        mean = (moved * own).sum(axis=(1, 2)) / own.sum()
        theirs = body.shapes[body.index(interface), 1]
        assert np.sign(own.sum()) == sign
        assert mean == pytest.approx(theirs, abs=2e-3 * np.abs(theirs).max())


def two_panels(rows=5):
    """Panels of two pieces and three modes."""
    rng = np.random.default_rng(5)
    factors = rng.standard_normal((2, 3, rows))
    points = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]])
    return Panels(
        ("a", "b"), np.array([0.2, 0.1]), np.array([[0.5, 0.4], [0.5, 0.2]]), np.array([2000.0, 900.0]),
        np.einsum("kir,kjr->kij", factors, factors), points, np.array([[0, 1, 2]], dtype=np.int32),
        rng.standard_normal((3, 3)),
    )  # fmt: skip


def motion(rpm=1500.0, count=720, seed=1, scale=1e-3):
    """Recorded motion with lines of all harmonics below 1500 Hz, and its period."""
    period, rng = 120.0 / rpm, np.random.default_rng(seed)
    lines = np.zeros((count // 2 + 1, 3), dtype=complex)
    last = int(1500.0 * period)
    lines[1 : last + 1] = scale * (rng.standard_normal((last, 3)) + 1j * rng.standard_normal((last, 3)))
    return Recorded(rpm, period, np.fft.irfft(lines * count / 2.0, count, axis=0))


def test_the_mean_square_of_lines_is_that_of_the_motion():
    """Parseval: mean over time of q̇ᵀ G q̇ over the area, at each speed; and bands add up to the total."""
    run = motion()
    result = NoiseResult(two_panels(), (run,), 2000.0, attributes={"engine": "x", "title": "X"})
    for panel, own in zip(
        result.velocity_lines(run), result.panels.products / np.array([[[0.2]], [[0.1]]]), strict=True
    ):
        assert panel.sum() == pytest.approx(np.mean(np.einsum("ti,ij,tj->t", run.velocity, own, run.velocity)))
    found = levels(result, 0, "one")
    parts = [one["sound_power_db"] for one in found["bands"] if one["sound_power_db"] is not None]
    assert 10.0 * np.log10(np.sum(10.0 ** (np.array(parts) / 10.0))) == pytest.approx(found["sound_power_db"], abs=0.01)
    assert found["sound_power_dba"] < found["sound_power_db"] + 1.5
    json.dumps(found, allow_nan=False)


def test_bands_of_long_steps_are_marked_and_those_of_wrong_steps_named():
    """Steps per period decide where the step was not checked; where it was, the difference does."""
    panels, coarse = two_panels(), motion(count=240)
    once = NoiseResult(panels, (coarse,), 1450.0, attributes={"integrator": "esdirk47"})
    marked = {one["hz"]: one["note"] for one in levels(once, 0, "one")["bands"]}
    assert [marked[hz] for hz in (63.0, 630.0, 800.0, 1250.0)] == ["", "", "step not checked", "step not checked"]
    for attributes in ({"integrator": "esdirk3"}, {}):
        other = NoiseResult(panels, (coarse,), 1450.0, attributes=attributes)
        assert {one["note"] for one in levels(other, 0, "one")["bands"]} == {"step not checked"}
    fine = motion(count=480)
    lines = fine.lines.copy()
    lines[(fine.frequency > 900.0) & (fine.frequency < 1100.0)] *= 2.0
    spectrum = np.vstack((np.zeros(3), lines, np.zeros(3)))
    finer = replace(fine, velocity=np.fft.irfft(spectrum * 240, 480, axis=0))
    twice = NoiseResult(panels, (coarse,), 1450.0, (finer,))
    notes = {one["hz"]: (one["note"], one["step_error_db"]) for one in levels(twice, 0, "one")["bands"]}
    assert notes[1000.0][0].startswith("step 5") and notes[1000.0][1] == pytest.approx(6.0, abs=0.5)
    assert notes[500.0] == ("", 0.0)


def test_a_result_is_read_as_it_was_written(tmp_path):
    runs, finer = (motion(), motion(2000.0)), (motion(count=1440), motion(2000.0, 1440))
    made = NoiseResult(two_panels(), runs, 2000.0, finer, {"engine": "x", "title": "X"})
    read = NoiseResult.load(made.save(tmp_path / "noise.h5"))
    assert read.attributes == made.attributes and read.highest == made.highest
    for k in range(2):
        for assumption in ("one", "plate"):
            assert levels(read, k, assumption) == levels(made, k, assumption)
    text = (tmp_path / "noise.h5").read_bytes()
    (tmp_path / "noise.h5").write_bytes(text[: len(text) // 2])
    with pytest.raises(StoreError, match=r"noise\.h5"):
        NoiseResult.load(tmp_path / "noise.h5")


def test_a_sound_is_the_points_velocity_over_its_full_scale(tmp_path):
    run = motion(3000.0, scale=2e-3)
    result = NoiseResult(two_panels(), (run,), 2000.0, attributes={})
    made = save_sound(tmp_path / "a.wav", result, np.array([0.09, 0.01, 0.0]))
    rate, samples = wavfile.read(tmp_path / "a.wav")
    assert rate == RATE and np.array_equal(made.place, [0.1, 0.0, 0.0])
    t = np.arange(1, 2000, 7) / RATE
    exact = run.velocity @ result.panels.normal[:, 1]
    phases = np.exp(2j * np.pi * np.outer(t, np.arange(len(exact) // 2 + 1)) / run.period)
    weights = np.fft.rfft(exact)
    weights[1:] *= 2.0
    weights[0] = 0.0
    there = (phases @ weights).real / len(exact)
    assert samples[1:2000:7] * made.full_scale / 32767 == pytest.approx(there, abs=made.full_scale / 32767)
    assert (
        np.abs(samples).max() > 32767 * 0.35
        and f"full scale {made.full_scale:g}".encode() in (tmp_path / "a.wav").read_bytes()
    )


def test_maps_show_a_band_or_an_order_of_each_speed():
    runs = motion(), motion(2000.0)
    result = NoiseResult(two_panels(), runs, 2000.0, attributes={"engine": "x", "title": "X"})
    line = surface_map(result, None, 10.0)
    for frame, run in zip(line.values, runs, strict=True):
        amplitude = run.lines[19] @ result.panels.normal
        assert frame == pytest.approx(10.0 * np.log10(0.5 * np.abs(amplitude) ** 2 / 1e-18), abs=1e-3)
    assert surface_map(result, loudest_band(result, "one"), None).values.shape == (2, 3)
    for asked, word in (((None, 500.0), "give 0.5 to"), ((5000.0, None), "give 11.2 to")):
        with pytest.raises(InputError, match=word):
            surface_map(result, *asked)


@cache
def box_run(degrees, bearings="linear"):
    """Run of the six in a block made by hand, whose cover is a panel: panels, recorded motion, cover's acceleration."""
    from cranktrain.dynamics.model.settings import Settings
    from cranktrain.structure.assembly import assemble
    from cranktrain.studies.constant_speed import Request
    from cranktrain_lab.noise import recording
    from cranktrain_lab.noise.own_panels import PanelTable, body_panels

    engine = free_six()
    box = box_block(engine)
    made = assemble(engine, Settings(crank="rigid", bearings=bearings))
    parts = made.parts._replace(block=box)
    settings = replace(made.settings, block="flexible", pistons="guided")
    made = for_vibration(replace(made, settings=settings, parts=parts), None)
    table = {"lid": PanelTable(interfaces=["cover"], areas=[3600.0], normals=[[0.0, -2.0, 0.0]], thickness=6.0)}
    panels = body_panels(box, table, engine.block.material, 0.01)
    kept = {}
    whole = recording.recorded_cycle

    def watched(*given, **named):
        kept["cycle"] = whole(*given, **named)
        return kept["cycle"]

    recording.recorded_cycle = watched
    try:
        run = recording.recorded(made, Request(speed_rpm=2000.0, block="flexible"), None, degrees, lambda text: None)
    finally:
        recording.recorded_cycle = whole
    return panels, run, kept["cycle"].outputs["cover.acceleration"]


def test_a_panel_moves_as_the_output_of_its_place():
    """Velocity of a panel around interface ``cover`` against the output ``cover.acceleration`` of the same run."""
    panels, run, acceleration = box_run(1.0)
    result = NoiseResult(panels, (run,), 5000.0)
    ours = result.velocity_lines(run)[0] * (2.0 * np.pi * run.frequency) ** 2
    count = acceleration.size
    theirs = 0.5 * np.abs(2.0 / count * np.fft.rfft(acceleration)[1 : (count + 1) // 2]) ** 2
    # Acceleration and velocity of a step differ by the integrator's error, which grows with frequency.
    low = run.frequency < 400.0
    assert ours[low] == pytest.approx(theirs[low], rel=0.01, abs=1e-4 * theirs.max())


@pytest.mark.parametrize("bearings", ["linear", pytest.param("ehd", marks=pytest.mark.slow)])
def test_levels_converge_with_the_step(bearings):
    panels, fine, _ = box_run(0.5, bearings)
    _, coarse, _ = box_run(1.0, bearings)
    result = NoiseResult(panels, (coarse,), 5000.0, (fine,), {"integrator": "esdirk47"})
    errors = result.step_errors(0, "one")
    kept = ~result.unchecked(coarse, result.bands(coarse))
    assert errors[kept].max() < 0.5


def test_panels_of_other_blocks_are_refused():
    from cranktrain_lab.noise.own_panels import PanelTable, body_panels, with_thicknesses

    engine = free_six()
    box, material = box_block(engine), engine.block.material
    with pytest.raises(InputError, match=r"no 'covr'.*cover"):
        body_panels(box, {"a": PanelTable(interfaces=["covr"], areas=[1.0], normals=[[0, 1, 0]])}, material, 0.01)
    with pytest.raises(InputError, match="no panel is named 'c'"):
        with_thicknesses(two_panels(), {"c": PanelTable(thickness=4.0)}, material)
    changed = with_thicknesses(two_panels(), {"b": PanelTable(thickness=4.0)}, material)
    assert changed.critical[0] == 2000.0 and changed.critical[1] > 2500.0
