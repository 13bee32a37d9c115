"""Images of the frames of a moving surface, by pyvista if it is installed and can draw, else by matplotlib.

The camera is above the pulley and to the side; the crank axis points to the right.
"""

import math
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.results.pictures.moving_surface import MovingSurface

Image = NDArray[np.uint8]

ASIDE, ABOVE = math.radians(28.0), math.radians(22.0)
"""Angles of the camera from the crank's side towards the pulley, and upwards."""
TO_EYE = np.array([-math.cos(ASIDE) * math.cos(ABOVE), math.sin(ABOVE), -math.sin(ASIDE) * math.cos(ABOVE)])
RIGHT = np.array([-math.sin(ASIDE), 0.0, math.cos(ASIDE)])
UP = np.cross(TO_EYE, RIGHT)
COLOURS: dict[bool, Any] = {False: "turbo", True: "coolwarm"}
"""Colour scale for values of one sign (False) and of both signs (True)."""
SIZE = (1280, 720)
"""Width and height of an image, pixels; MP4 encoders require even numbers."""
GROUND, INK = "#ffffff", "#26303c"
INCH = 100
"""Pixels per inch, which sets the size of texts in an image."""
LAST_WORDS = 120.0
"""Time limit, s, of the child process that tests whether pyvista can draw."""
_TRIAL = "import pyvista; p = pyvista.Plotter(off_screen=True); p.add_mesh(pyvista.Sphere()); p.screenshot()"


def frames(
    surface: MovingSurface, enlargement: float, chosen: Sequence[int], size: tuple[int, int] = SIZE
) -> Iterator[Image]:
    """Iterate over images (height, width, 3) of the chosen frames."""
    paint = _by_pyvista if draws_with_pyvista() else _by_matplotlib
    legend = _Legend(surface, enlargement, size)
    for k, image in zip(chosen, paint(surface, enlargement, chosen, size), strict=True):
        yield legend.over(image, surface.captions[k])


@cache
def draws_with_pyvista() -> bool:
    """True if pyvista is installed and draws on this machine; tried in a child process because it may crash."""
    if find_spec("pyvista") is None:
        return False
    try:
        trial = [sys.executable, "-c", _TRIAL]
        done = subprocess.run(trial, env=_environment(), capture_output=True, timeout=LAST_WORDS, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0


def _environment() -> dict[str, str]:
    """Environment of a process, with settings for off-screen drawing on Linux without display."""
    found = dict(os.environ)
    if sys.platform == "linux" and not found.get("DISPLAY"):
        found.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    return found


def _by_pyvista(
    surface: MovingSurface, enlargement: float, chosen: Sequence[int], size: tuple[int, int]
) -> Iterator[Image]:
    os.environ.update(_environment())
    import pyvista

    low, high = surface.limits
    faces = np.column_stack((np.full(len(surface.triangles), 3), surface.triangles)).ravel()
    mesh = pyvista.PolyData(surface.places(chosen[0], enlargement), faces)
    mesh["values"] = surface.values[chosen[0]]
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(size), lighting="light kit")
    try:
        plotter.set_background(GROUND)
        plotter.add_mesh(
            mesh, scalars="values", clim=(low, high), cmap=COLOURS[low < 0.0], show_scalar_bar=False,
            smooth_shading=True, split_sharp_edges=False, specular=0.2,
        )  # fmt: skip
        window = _Window(surface, enlargement, size)
        camera = plotter.camera
        camera.focal_point = window.middle
        camera.position = window.middle + 10.0 * window.height * TO_EYE
        camera.up = UP
        camera.parallel_projection = True
        camera.parallel_scale = 0.5 * window.height
        plotter.enable_anti_aliasing("ssaa")
        for k in chosen:
            mesh.points = surface.places(k, enlargement)
            mesh["values"] = surface.values[k]
            mesh.compute_normals(cell_normals=False, split_vertices=False, consistent_normals=False, inplace=True)
            yield np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)[..., :3]
    finally:
        plotter.close()


def _by_matplotlib(
    surface: MovingSurface, enlargement: float, chosen: Sequence[int], size: tuple[int, int]
) -> Iterator[Image]:
    from matplotlib import colormaps
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    low, high = surface.limits
    window = _Window(surface, enlargement, size)
    scale = colormaps[COLOURS[low < 0.0]]
    for k in chosen:
        figure = Figure(figsize=(size[0] / INCH, size[1] / INCH), dpi=INCH, facecolor=GROUND)
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        place = (surface.places(k, enlargement) - window.middle) @ np.column_stack((RIGHT, UP, TO_EYE))
        corners = place[surface.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing = normal[:, 2] / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)
        seen = np.flatnonzero(facing > 0.0)
        seen = seen[np.argsort(corners[seen, :, 2].mean(axis=1))]
        value = surface.values[k][surface.triangles[seen]].mean(axis=1)
        colour = scale((value - low) / (high - low))
        colour[:, :3] *= (0.55 + 0.45 * facing[seen])[:, None]
        ax.add_collection(PolyCollection(corners[seen, :, :2], facecolors=colour, edgecolors=colour, linewidths=0.3))
        half = 0.5 * window.height
        ax.set(xlim=(-half * size[0] / size[1], half * size[0] / size[1]), ylim=(-half, half))
        ax.axis("off")
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba(), dtype=np.uint8)[..., :3]


class _Window:
    """Part of space shown in images: middle (3,) and height, m, large enough for every frame of the cycle."""

    def __init__(self, surface: MovingSurface, enlargement: float, size: tuple[int, int]) -> None:
        self.middle = 0.5 * (surface.points.min(axis=0) + surface.points.max(axis=0))
        self.middle[:2] = 0.0
        shown = range(0, len(surface.turn), max(1, len(surface.turn) // 24))
        flat = np.stack((RIGHT, UP), axis=1)
        reach = np.max(
            [np.abs((surface.places(k, enlargement) - self.middle) @ flat).max(axis=0) for k in shown], axis=0
        )
        # Leave a margin above and below for title and legend.
        self.height = float(max(2.0 * reach[1] / 0.74, 2.0 * reach[0] / 0.94 * size[1] / size[0]))


class _Legend:
    """Title, colour bar and enlargement on a transparent background, with the caption of each frame."""

    def __init__(self, surface: MovingSurface, enlargement: float, size: tuple[int, int]) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize
        from matplotlib.figure import Figure

        low, high = surface.limits
        figure = Figure(figsize=(size[0] / INCH, size[1] / INCH), dpi=INCH)
        figure.patch.set_alpha(0.0)
        figure.text(0.02, 0.955, surface.title, fontsize=13, color=INK, parse_math=False, va="center")
        bar = figure.colorbar(
            ScalarMappable(Normalize(low, high), COLOURS[low < 0.0]), cax=figure.add_axes((0.62, 0.075, 0.35, 0.02)),
            orientation="horizontal", extend="max" if surface.values.max() > 1.001 * high else "neither",
        )  # fmt: skip
        bar.set_label(surface.quantity, fontsize=10, color=INK)
        bar.outline.set_visible(False)
        bar.ax.tick_params(labelsize=9, length=2, colors=INK)
        scale = f"{surface.scale.format(enlargement)}; pulley end left"
        figure.text(0.02, 0.03, scale, fontsize=9, color="#5c6573")
        self._caption = figure.text(0.02, 0.075, "", fontsize=11, color=INK, parse_math=False)
        self._canvas: Any = FigureCanvasAgg(figure)
        self._drawn: tuple[str, NDArray[np.float32]] | None = None

    def over(self, image: Image, caption: str) -> Image:
        """Image with the legend and a caption drawn over it."""
        if self._drawn is None or self._drawn[0] != caption:
            self._caption.set_text(caption)
            self._canvas.draw()
            self._drawn = caption, np.asarray(self._canvas.buffer_rgba(), dtype=np.float32)
        drawn = self._drawn[1]
        cover = drawn[..., 3:] / 255.0
        return np.asarray(cover * drawn[..., :3] + (1.0 - cover) * image, dtype=np.uint8)
