"""The verb ``picture``: the crankshaft in space, in a mode or as it runs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cranktrain.cli.bodies import bare_crankshaft, own_mesh
from cranktrain.cli.console import bar, stages
from cranktrain.cli.functions import verb
from cranktrain.cli.run_options import option_of, request_of
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.engine.file import load_engine
from cranktrain.results.views.found import VerbResult
from cranktrain.structure.crank.modal import KINDS
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.pictures.moving_surface import MovingSurface

DESCRIPTION = """\
The crankshaft in three dimensions, in a mode or as it runs: picture (PNG), animation (GIF, MP4) or page (HTML).

In a page the crankshaft can be turned. With --speed the solid crank runs until its cycles repeat, and is coloured by
its stress.
"""
FRAME_DEG = 10


@dataclass(frozen=True, kw_only=True)
class Picture(words.Settled, words.Levels, words.PistonLevel, words.Load, words.Meshes):
    """Question of :func:`picture`."""

    mode: Annotated[
        str | None,
        Option("MODE", f"number as 'modal' lists them, or first of a kind: {', '.join(KINDS)} (default torsional)"),
    ] = None
    free: Annotated[bool, Option(help="a mode of the free crankshaft; default the cranktrain at rest")] = False
    speed_rpm: Annotated[float | None, Option("RPM", "the running crank at this speed, rev/min", "--speed")] = None
    angle_deg: Annotated[
        float,
        between(0.0, 720.0, "deg"),
        Option("DEG", "crank angle of a still of the running crank, to 10 degrees (default 0)"),
    ] = 0.0
    enlarge: Annotated[
        float | None,
        between(0.0, 1e9, "times"),
        Option("TIMES", "enlargement of the motion (default: the largest is 3 % of the length)"),
    ] = None
    output: Annotated[
        words.File | None, Option("FILE", "picture, ending in .png, .gif, .mp4 or .html (default ENGINE_WHAT.png)")
    ] = None


@verb(Picture, DESCRIPTION)
def picture(named: str | Path | Engine, ask: Picture) -> VerbResult:
    """Draw the picture. Return its path."""
    from cranktrain.results.pictures.files import check_picture, save_picture

    engine = load_engine(named)
    running = ask.speed_rpm is not None
    if running and (ask.mode is not None or ask.free):
        raise InputError("--speed draws the running crank, --mode and --free draw a mode; leave one of them out")
    what = f"{ask.speed_rpm:g}rpm" if running else f"mode_{ask.mode or KINDS[1]}"
    path = Path(ask.output or f"{engine.name}_{what}.png")
    check_picture(path)
    if running:
        surface = running_surface(engine, ask)
    else:
        from cranktrain.results.pictures.modes import mode_picture

        mesh = own_mesh(ask.mesh, ask.mesh_unit)
        surface = mode_picture(engine, bare_crankshaft(engine, mesh)[0], ask.mode or KINDS[1], ask.free, mesh)
    enlargement = surface.enlargement if ask.enlarge is None else ask.enlarge
    frame = round(ask.angle_deg / FRAME_DEG) % len(surface.turn) if running else 0
    with bar(path.name) as advance:
        save_picture(path, surface, enlargement, frame, advance or (lambda share: None))
    found = {"picture": str(path), "title": surface.title, "enlargement": enlargement, "frames": len(surface.turn)}
    return VerbResult.of(found, "picture", scale=surface.scale.format(enlargement))


def show(found: VerbResult) -> None:
    """Print the path of the picture."""
    print(f"{found['title']}; {found.beside['scale']}: {found['picture']}")


def running_surface(engine: Engine, ask: Picture) -> MovingSurface:
    """Surface of the running crankshaft over a cycle; ``InputError``, ``SolverError``."""
    from cranktrain.results.pictures.running import running_picture
    from cranktrain.studies.stressed_run import stressed_run

    request = request_of(ask, ask.speed_rpm or 0.0)
    settings = request.settings(engine, option_of)
    with stages(engine.name) as tell:
        made, stress = stressed_run(engine, request, settings, tell)
        title = f"{engine.title}: {request.speed_rpm:g} rev/min, films by {settings.bearings}"
        return running_picture(engine, made.body, stress, title, request.mesh)
