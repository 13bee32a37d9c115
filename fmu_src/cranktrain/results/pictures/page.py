"""Interactive HTML page of a moving surface with WebGL, without network requests or libraries."""

import base64
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cranktrain.results.page_head import filled_page, script_data
from cranktrain.results.pictures.moving_surface import MovingSurface
from cranktrain.results.pictures.rendering import COLOURS, RIGHT, TO_EYE, UP


def page(surface: MovingSurface, enlargement: float) -> str:
    """HTML text of the page with the surface's data: displacements in 16 bits, colours in 8."""
    title, data = surface.title, script_data(page_data(surface, enlargement))
    return filled_page(__package__, "page.html", "picture", title, title, SURFACE=surface_script(), DATA=data)


def surface_script() -> str:
    """JavaScript of class ``SurfaceView``, which draws a surface that the user can rotate."""
    return files(__package__).joinpath("surface.js").read_text(encoding="utf-8")


def page_data(surface: MovingSurface, enlargement: float) -> dict[str, Any]:
    """Data for the page's script; arrays are little-endian bytes in base 64."""
    from matplotlib import colormaps

    low, high = surface.limits
    coordinates, shapes = surface.principal_motions()
    sizes = np.abs(shapes).max(axis=(1, 2))
    counts = np.round(32767.0 * shapes / sizes[:, None, None]).astype("<i2")
    middle = 0.5 * (surface.points.min(axis=0) + surface.points.max(axis=0))
    middle[:2] = 0.0
    scale = colormaps[COLOURS[low < 0.0]](np.linspace(0.0, 1.0, 256))
    # Values that are equal in all frames are stored once.
    values = surface.values[:1] if (surface.values == surface.values[0]).all() else surface.values
    share = np.clip((values - low) / (high - low), 0.0, 1.0)
    return {
        "points": _text((surface.points - middle).astype("<f4")),
        "triangles": _text(surface.triangles.astype("<u4")),
        "shapes": [_text(one) for one in counts],
        # Coordinates: for each frame and each shape, metres per count of the shape's 16-bit integers.
        "coordinates": (coordinates * sizes / 32767.0).tolist(),
        "turn": surface.turn.tolist(),
        "values": [_text(np.round(255.0 * frame).astype(np.uint8)) for frame in share],
        "colours": np.round(255.0 * scale[:, :3]).astype(int).tolist(),
        "range": [low, high],
        "quantity": surface.quantity,
        "captions": list(surface.captions),
        "seconds": surface.seconds,
        "enlargement": enlargement,
        "scale": surface.scale.partition("{")[0],
        "radius": float(np.linalg.norm(surface.points - middle, axis=1).max()),
        "axes": [RIGHT.tolist(), UP.tolist(), TO_EYE.tolist()],
    }


def _text(array: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
