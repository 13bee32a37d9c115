"""Pictures in space: skins, motions, files. The surface of a box stands for the crankshaft's."""

import base64
import json
import re
from io import BytesIO

import numpy as np
import pytest
from browser import needs_browser, shown
from PIL import Image
from scipy.spatial import ConvexHull

from cranktrain.core.errors import InputError
from cranktrain.results.pictures import rendering
from cranktrain.results.pictures.files import check_picture, save_picture
from cranktrain.results.pictures.modes import chosen_mode
from cranktrain.results.pictures.moving_surface import SHOWN_MOTION, MovingSurface
from cranktrain.results.pictures.page import page_data
from cranktrain.results.pictures.skin import Skin, creased, outward

RNG = np.random.default_rng(7)
CORNERS = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.0, 1.0)])
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
BOX = np.array([t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))], dtype=np.int32)


def volume(points, triangles):
    a, b, c = points[triangles].transpose(1, 0, 2)
    return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0)


def sphere(n):
    """A closed sphere of n bands, whose triangles face either way."""
    polar, turn = np.meshgrid(np.linspace(0.0, np.pi, n + 1)[1:-1], np.arange(2 * n) * np.pi / n)
    rings = np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)
    points = np.vstack((np.column_stack([part.ravel() for part in rings]), [[0, 0, 1], [0, 0, -1]]))
    return points, ConvexHull(points).simplices


def box(frames=8, turning=False):
    """A box that swings along z in its upper half, and turns."""
    phase = np.arange(frames) * 2.0 * np.pi / frames
    skin = Skin.of(CORNERS, BOX, np.stack((CORNERS * 0.0, CORNERS * 0.0)).astype(np.float32))
    shapes = np.zeros((2, len(skin.points), 3), dtype=np.float32)
    shapes[0, :, 1], shapes[1, :, 2] = skin.points[:, 2], 1e-4 * skin.points[:, 0]
    return MovingSurface(
        title="Box & <others>", points=skin.points, triangles=skin.triangles, shapes=shapes,
        coordinates=np.column_stack((1e-3 * np.cos(phase), np.sin(phase))), turn=phase if turning else 0.0 * phase,
        values=np.abs(np.cos(phase))[:, None] * np.abs(skin.points[:, 2]).astype(np.float32), quantity="share / 1",
        limits=(0.0, 1.0), captions=tuple(f"{np.degrees(p):.0f}°" for p in phase), seconds=3.0,
    )  # fmt: skip


@pytest.mark.parametrize(("points", "triangles"), [(CORNERS, BOX), sphere(6)], ids=["box", "sphere"])
def test_triangles_of_any_order_come_to_face_outwards(points, triangles):
    flip = RNG.random(len(triangles)) < 0.5
    mixed = np.where(flip[:, None], triangles[:, ::-1], triangles)
    two = np.vstack((mixed, mixed + len(points)))
    found = outward(np.vstack((points, points + 5.0)), two)
    size = ConvexHull(points).volume
    assert volume(points, found[: len(triangles)]) == pytest.approx(size)
    assert volume(points, found[len(triangles) :] - len(points)) == pytest.approx(size)


def test_sharp_edges_double_their_points_and_round_ones_do_not():
    origin, split = creased(CORNERS, outward(CORNERS, BOX))
    assert len(origin) == 24  # each corner once for each of its three sides
    assert (origin[split] == outward(CORNERS, BOX)).all()
    points, triangles = sphere(24)
    assert len(creased(points, outward(points, triangles))[0]) == len(points)


def test_places_are_the_enlarged_motion_turned():
    surface = box(turning=True)
    k, times = 2, 30.0
    x, y, z = (surface.points + times * surface.displacement(k)).T
    np.testing.assert_allclose(surface.places(k, times), np.column_stack((-y, x, z)), atol=1e-12)
    largest = max(np.linalg.norm(surface.displacement(k), axis=1).max() for k in range(8))
    assert surface.enlargement * largest == pytest.approx(SHOWN_MOTION * 1.0, rel=0.05)


def test_fewer_shapes_give_the_same_motion():
    mixed = RNG.normal(size=(6, 2))
    surface = box()
    shapes = np.tensordot(mixed, surface.shapes, axes=1).astype(np.float32)
    many = MovingSurface(
        **vars(surface) | {"shapes": shapes, "coordinates": surface.coordinates @ np.linalg.pinv(mixed)}
    )
    coordinates, shapes = many.principal_motions(least=1e-4)
    assert len(shapes) == 2
    motion = np.tensordot(coordinates, shapes, axes=1)
    for k in range(8):
        np.testing.assert_allclose(motion[k], surface.displacement(k), atol=1e-8)


def test_the_page_holds_the_surface():
    surface = box()
    data = json.loads(json.dumps(page_data(surface, 10.0)))
    counts = np.stack([np.frombuffer(base64.b64decode(s), "<i2").reshape(-1, 3) for s in data["shapes"]])
    points = np.frombuffer(base64.b64decode(data["points"]), "<f4").reshape(-1, 3)
    middle = surface.points.mean(axis=0) * [0, 0, 1]
    np.testing.assert_allclose(points, surface.points - middle, atol=1e-6)
    for k in range(8):
        motion = np.tensordot(data["coordinates"][k], counts, axes=1)
        np.testing.assert_allclose(motion, surface.displacement(k), atol=0.006 * 1e-3)
        value = np.frombuffer(base64.b64decode(data["values"][k]), np.uint8) / 255.0
        np.testing.assert_allclose(value, surface.values[k], atol=0.003)


@pytest.mark.parametrize("painter", [True, False], ids=["pyvista", "matplotlib"])
def test_stills_and_animations(tmp_path, monkeypatch, painter):
    if painter and not rendering.draws_with_pyvista():
        pytest.skip("pyvista is not installed or cannot draw here")
    monkeypatch.setattr(rendering, "draws_with_pyvista", lambda: painter)
    surface, still, moving = box(frames=4), tmp_path / "box.png", tmp_path / "box.gif"
    save_picture(still, surface, 100.0, frame=1)
    image = np.asarray(Image.open(still))
    assert image.shape == (*rendering.SIZE[::-1], 3)
    assert np.mean((image < 250).any(axis=2)) > 0.05
    shares = []
    save_picture(moving, surface, 100.0, advance=shares.append)
    assert shares == [0.25, 0.5, 0.75, 1.0]
    with Image.open(moving) as animation:
        assert animation.n_frames == 4 and animation.info["loop"] == 0
        first = np.asarray(animation.convert("RGB")).astype(int)
        animation.seek(2)
        assert np.abs(np.asarray(animation.convert("RGB")).astype(int) - first).max() > 100
    save_picture(moving, surface, 100.0)  # its own kind is replaced


def test_films_for_players(tmp_path, monkeypatch):
    coder = pytest.importorskip("imageio_ffmpeg")
    monkeypatch.setattr(rendering, "draws_with_pyvista", lambda: False)
    path = tmp_path / "box.mp4"
    for _ in range(2):
        save_picture(path, box(frames=4), 100.0)
    about = next(coder.read_frames(str(path)))
    assert about["size"] == rendering.SIZE and about["duration"] == pytest.approx(6.0, rel=0.1)


@pytest.mark.parametrize(
    ("name", "words"), [("box.jpg", ".png (a still)"), ("box.gif", "exists and is no animation of cranktrain")]
)
def test_places_that_a_picture_must_not_take(tmp_path, name, words):
    (tmp_path / "box.gif").write_text("a text")
    with pytest.raises(InputError, match=re.escape(words)):
        check_picture(tmp_path / name)


def test_a_lacking_coder_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("cranktrain.results.pictures.files.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install imageio-ffmpeg, or name .*box\.gif"):
        check_picture(tmp_path / "box.mp4")


HZ = np.array([200.0, 240.0, 300.0, 640.0, 1200.0])
SHARES = np.array([[1, 0, 0], [0.2, 0.8, 0], [0.1, 0, 0.9], [0.4, 0.6, 0], [0, 1, 0]])


def test_modes_by_number_and_kind():
    found = [chosen_mode(mode, HZ, SHARES) for mode in ("bending", "torsional", "axial", "1", "4")]
    assert found == [0, 1, 2, 0, 3]
    for mode, words in (("6", "1 to 5"), ("0", "1 to 5"), ("torsion", "did you mean 'torsional'")):
        with pytest.raises(InputError, match=words):
            chosen_mode(mode, HZ, SHARES)


@needs_browser
def test_the_page_draws_in_a_browser(tmp_path):
    path = tmp_path / "box.html"
    surface = box(turning=True)
    # whichever frame the browser stops at has the colour of three quarters
    steady = MovingSurface(**{**vars(surface), "values": np.full_like(surface.values, 0.75)})
    save_picture(path, steady, 100.0)
    assert not re.search(r"https?://", path.read_text("utf-8"))
    for width in (400, 1200):
        document, console, picture = shown(path, width)
        assert console == []
        assert "Box &amp; &lt;others&gt;" in document and "× 100" in document
        image = np.asarray(Image.open(BytesIO(picture)).convert("RGB")).astype(int)
        middle = image[100:600]
        assert np.mean(np.ptp(middle, axis=2) > 60) > 0.02  # the box in its colours, on a white ground
