"""Three-dimensional view of the crankshaft, as a page component that draws frames by WebGL.

The surface is sent once. A frame contains the coordinates of its shapes, its rotation and the value of each point, some
tens of kilobytes.
"""

from importlib.resources import files
from typing import Any

import numpy as np
import panel as pn
import param

from cranktrain.results.pictures.page import surface_script
from cranktrain.results.pictures.rendering import COLOURS, RIGHT, TO_EYE, UP
from cranktrain_lab.explore.charts import HEIGHT
from cranktrain_lab.explore.inside.crank_surface import PRINCIPAL, STRESSES, CrankSurface
from cranktrain_lab.explore.inside.cycle import FRAME_DEG

MPA = 1.0e-6


class CrankView(pn.custom.JSComponent):
    """Page component of a coloured surface at one crank angle; lengths in m, values in MPa."""

    points = param.Parameter()
    triangles = param.Parameter()
    shapes = param.Parameter()
    radius = param.Number(1.0)
    axes = param.List()
    colours = param.List()
    low, high = param.Number(0.0), param.Number(1.0)
    quantity, title, caption = param.String(), param.String(), param.String()
    frame = param.Integer(0)
    weights = param.Parameter()
    turn = param.Number(0.0)
    values = param.Parameter()

    _esm = surface_script() + files(__package__).joinpath("crank_view.js").read_text(encoding="utf-8")


class CrankChart:
    """View of a crank's surface with choice of stress, enlargement and frame."""

    def __init__(self, surface: CrankSurface, title: str) -> None:
        self._surface, self._title = surface, title
        self._stress, self._enlargement, self._frame = next(iter(STRESSES)), surface.enlargement, 0
        middle = 0.5 * (surface.points.min(axis=0) + surface.points.max(axis=0))
        middle[:2] = 0.0
        places = (surface.points - middle).astype(np.float32)
        self.view = CrankView(
            points=places.ravel(), triangles=surface.triangles.astype(np.uint32).ravel(),
            shapes=surface.shapes.astype(np.float32).ravel(), radius=float(np.linalg.norm(places, axis=1).max()),
            axes=[RIGHT.tolist(), UP.tolist(), TO_EYE.tolist()], sizing_mode="stretch_width", height=HEIGHT,
            min_width=300, **self._scale(), **self._now(),
        )  # fmt: skip

    def choose(self, stress: str) -> None:
        """Choose the displayed stress."""
        self._stress = stress
        self.view.param.update(**self._scale(), **self._now())

    def enlarge(self, enlargement: float) -> None:
        """Set the enlargement of the deformation."""
        self._enlargement = enlargement
        self.view.param.update(**self._now())

    def show(self, frame: int) -> None:
        """Show a frame."""
        self._frame = frame
        self.view.param.update(**self._now())

    def _scale(self) -> dict[str, Any]:
        from matplotlib import colormaps

        low, high = self._surface.limits(self._stress)
        colours = colormaps[COLOURS[self._stress == PRINCIPAL]](np.linspace(0.0, 1.0, 256))
        return {
            "low": MPA * low, "high": max(MPA * high, 1.0e-9), "quantity": f"{STRESSES[self._stress]}, MPa",
            "colours": np.round(255.0 * colours[:, :3]).astype(int).tolist(),
            "title": f"{self._title}: {STRESSES[self._stress]}",
        }  # fmt: skip

    def _now(self) -> dict[str, Any]:
        own, frame = self._surface, self._frame
        value, place = own.extreme(self._stress, frame)
        at = ", ".join(f"{1e3 * one:.0f}" for one in place)
        return {
            "frame": frame,
            "weights": (self._enlargement * own.coordinates[frame]).tolist(),
            "turn": float(own.turn[frame]),
            "values": MPA * own.stresses[self._stress][frame],
            "caption": f"{frame * FRAME_DEG}°: greatest {MPA * value:.1f} MPa at x, y, z = {at} mm; deformation × "
            f"{float(f'{self._enlargement:.2g}'):g}",
        }  # fmt: skip
