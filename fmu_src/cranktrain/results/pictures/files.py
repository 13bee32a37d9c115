"""Files of three-dimensional pictures by their ending: still (PNG), animation (GIF, MP4), interactive page (HTML)."""

from collections.abc import Callable, Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.results.figures import PICTURE
from cranktrain.results.pictures.moving_surface import MovingSurface
from cranktrain.results.pictures.page import page
from cranktrain.results.pictures.rendering import SIZE, Image, frames
from cranktrain.store.whole_file import Kind, check_place, marked, whole_file

MARK = "Cranktrain"
Advance = Callable[[float], None]


class Request(NamedTuple):
    """Content of a picture file: moving surface, enlargement of its motion, and frame shown by a still picture."""

    surface: MovingSurface
    enlargement: float
    frame: int
    """Index of the frame that a still picture (PNG) shows."""


class Writer(NamedTuple):
    """Writer of picture files with one file ending."""

    what: str
    kind: Kind
    write: Callable[[Path, Request, Advance], None]
    needs: str = ""
    """Python module that must be installed for this writer; empty if none is needed."""


def save_picture(
    path: Path, surface: MovingSurface, enlargement: float, frame: int = 0, advance: Advance = lambda share: None
) -> Path:
    """Write a picture of the kind given by its file extension, completely or not at all; returns the path.

    Raises ``InputError`` as :func:`check_picture`.

    Parameters
    ----------
    enlargement : enlargement of the displacement
    frame : index of the frame that a still shows
    advance : called with the completed fraction
    """
    writer = check_picture(path)
    with whole_file(path, writer.kind) as temporary:
        writer.write(temporary, Request(surface, enlargement, frame), advance)
    return path


def check_picture(path: Path) -> Writer:
    """Writer for a picture path; ``InputError``: unknown ending, missing encoder, or file that must not be replaced."""
    writer = WRITERS.get(path.suffix.lower())
    if writer is None:
        endings = ", ".join(f"{ending} ({row.what})" for ending, row in WRITERS.items())
        raise InputError(f"{path}: unknown kind of picture; end the name with {endings}")
    if writer.needs and find_spec(writer.needs) is None:
        name = writer.needs.replace("_", "-")
        raise InputError(f"{path}: {writer.what} needs {name}; pip install {name}, or name {path.with_suffix('.gif')}")
    check_place(path, writer.kind)
    return writer


def _still(path: Path, wanted: Request, advance: Advance) -> None:
    from PIL import Image as Pillow
    from PIL.PngImagePlugin import PngInfo

    note = PngInfo()
    note.add_text("Software", MARK)
    image = next(iter(frames(wanted.surface, wanted.enlargement, [wanted.frame])))
    Pillow.fromarray(image).save(path, format="PNG", pnginfo=note)
    advance(1.0)


def _gif(path: Path, wanted: Request, advance: Advance) -> None:
    from PIL import Image as Pillow

    # One palette for all frames prevents flicker of the colour scale.
    images = [Pillow.fromarray(image) for image in _all_frames(wanted, advance)]
    palette = images[len(images) // 3].quantize(256, dither=Pillow.Dither.NONE)
    indexed = [image.quantize(palette=palette, dither=Pillow.Dither.NONE) for image in images]
    indexed[0].save(
        path, format="GIF", save_all=True, append_images=indexed[1:], loop=0, comment=MARK.encode(),
        duration=max(20, round(1000.0 * wanted.surface.seconds / len(images))),
    )  # fmt: skip


def _mp4(path: Path, wanted: Request, advance: Advance) -> None:
    import imageio_ffmpeg

    rate = len(wanted.surface.turn) / wanted.surface.seconds
    repeats = max(1, round(6.0 / wanted.surface.seconds))  # players do not loop by themselves
    coder: Any = imageio_ffmpeg.write_frames(
        str(path), SIZE, fps=rate, quality=7, macro_block_size=2,
        output_params=["-metadata", f"comment={MARK}", "-movflags", "+faststart", "-f", "mp4"],
    )  # fmt: skip
    coder.send(None)
    try:
        images = list(_all_frames(wanted, advance))
        for image in images * repeats:
            coder.send(np.ascontiguousarray(image))
    finally:
        coder.close()


def _html(path: Path, wanted: Request, advance: Advance) -> None:
    path.write_text(page(wanted.surface, wanted.enlargement), encoding="utf-8")
    advance(1.0)


def _all_frames(wanted: Request, advance: Advance) -> Iterable[Image]:
    count = len(wanted.surface.turn)
    for k, image in enumerate(frames(wanted.surface, wanted.enlargement, range(count))):
        advance((k + 1) / count)
        yield image


def _holds_mark(path: Path) -> bool:
    return MARK.encode() in path.read_bytes()


WRITERS = {
    ".png": Writer("a still", PICTURE, _still),
    ".gif": Writer("an animation", marked("animation of cranktrain", MARK), _gif),
    ".mp4": Writer("an animation", Kind("animation of cranktrain", _holds_mark), _mp4, "imageio_ffmpeg"),
    ".html": Writer("a page to turn about", marked("page of cranktrain", 'content="cranktrain picture"'), _html),
}
"""Writers of picture files by file ending."""
