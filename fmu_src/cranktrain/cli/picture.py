"""The verb ``picture``: the crankshaft in space, in a mode or as it runs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cranktrain.cli.bodies import bare_crankshaft, own_meshes
from cranktrain.cli.console import bar, number, stages
from cranktrain.cli.run_options import add_level_options, add_settle_option, option_of, request_of
from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.structure.crank.modal import KINDS

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.results.pictures.moving_surface import MovingSurface

DESCRIPTION = """\
The crankshaft in three dimensions, in a mode or as it runs: picture (PNG), animation (GIF, MP4) or page (HTML).

In a page the crankshaft can be turned. With --speed the solid crank runs until its cycles repeat, and is coloured by
its stress.
"""
FRAME_DEG = 10


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options to those that all verbs of an engine have."""
    add = parser.add_argument
    add(
        "--mode", metavar="MODE",
        help=f"number as 'modal' lists them, or first of a kind: {', '.join(KINDS)} (default torsional)",
    )  # fmt: skip
    add("--free", action="store_true", help="a mode of the free crankshaft; default the cranktrain at rest")
    add("--speed", dest="speed_rpm", type=float, metavar="RPM", help="the running crank at this speed, rev/min")
    add(
        "--angle-deg", type=number(0.0, 720.0, "deg"), default=0.0, metavar="DEG",
        help="crank angle of a still of the running crank, to 10 degrees (default 0)",
    )  # fmt: skip
    add(
        "--enlarge", type=number(0.0, 1e9, "times"), metavar="TIMES",
        help="enlargement of the motion (default: the largest is 3 %% of the length)",
    )  # fmt: skip
    add("--output", metavar="FILE", help="picture, ending in .png, .gif, .mp4 or .html (default ENGINE_WHAT.png)")
    add_level_options(parser, without="--crank")
    add_settle_option(parser)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Draw, and say where the picture is."""
    from cranktrain.results.pictures.files import check_picture, save_picture

    engine = load_engine(options.engine)
    running = options.speed_rpm is not None
    if running and (options.mode is not None or options.free):
        raise InputError("--speed draws the running crank, --mode and --free draw a mode; leave one of them out")
    what = f"{options.speed_rpm:g}rpm" if running else f"mode_{options.mode or KINDS[1]}"
    path = Path(options.output or f"{engine.name}_{what}.png")
    check_picture(path)
    surface = running_surface(engine, options) if running else _mode(engine, options)
    enlargement = surface.enlargement if options.enlarge is None else options.enlarge
    frame = round(options.angle_deg / FRAME_DEG) % len(surface.turn) if running else 0
    with bar(path.name) as advance:
        save_picture(path, surface, enlargement, frame, advance or (lambda share: None))
    if not options.json:
        print(f"{surface.title}; {surface.scale.format(enlargement)}: {path}")
    return {"picture": str(path), "title": surface.title, "enlargement": enlargement, "frames": len(surface.turn)}


def _mode(engine: Engine, options: argparse.Namespace) -> MovingSurface:
    from cranktrain.results.pictures.modes import mode_picture

    own_meshes(options)
    bare, _ = bare_crankshaft(engine, options)
    return mode_picture(engine, bare, options.mode or KINDS[1], options.free, options.mesh)


def running_surface(engine: Engine, options: argparse.Namespace) -> MovingSurface:
    """The running crankshaft that the options ask for; ``InputError``, ``SolverError``."""
    from cranktrain.results.pictures.running import running_picture
    from cranktrain.studies.stressed_run import stressed_run

    request = request_of(options, options.speed_rpm)
    settings = request.settings(engine, option_of)
    with stages(engine.name) as tell:
        made, stress = stressed_run(engine, request, settings, tell)
        title = f"{engine.title}: {request.speed_rpm:g} rev/min, films by {settings.bearings}"
        return running_picture(engine, made.body, stress, title, request.mesh)
