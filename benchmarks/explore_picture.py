"""Picture of the page of ``cranktrain explore``: ``python -m benchmarks.explore_picture docs/explore.png``.

A heavier damper ring on the six is turned by the mouse in headless Chromium; the engine before stays dashed. Needs the
extra ``explore`` and Chromium. The same command prints, as JSON, what answers took in 40 turns of the knob.

``python -m benchmarks.explore_picture --look docs/explore_inside.png`` looks inside the six instead: solid crank,
elastic films, 1500 rev/min. It prints the memory that the page's arrays take and what a frame takes.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import resource
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from cranktrain.engine.file import load_engine
from cranktrain_lab.explore.knobs import Chosen
from cranktrain_lab.explore.live import LiveTorsion

TURNS = 40
LOOK_RPM, LOOK_ANGLE = 1500.0, 15
HANDLES = """[...within(document)].filter(e => e.matches('.noUi-handle')).map(e => {
  const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2] })"""


def turns(live: LiveTorsion) -> dict[str, object]:
    """Wall and processor time of answers while the second knob turns."""
    knob, spent = live.knobs[1], []
    for k in range(TURNS):
        began = time.perf_counter(), time.thread_time()
        found = live.answer(Chosen({knob.key: knob.own * (1.0 + 0.01 * k)}), moving=True)
        spent.append((time.perf_counter() - began[0], time.thread_time() - began[1], found.speeds.size))
    wall, cpu, speeds = (sorted(column) for column in zip(*spent, strict=True))
    middle, worst = TURNS // 2, round(0.95 * TURNS)
    return {
        "engine": live.engine.name, "knob": knob.key, "wall_ms": 1e3 * wall[middle], "wall_95_ms": 1e3 * wall[worst],
        "processor_ms": 1e3 * cpu[middle], "fewest_speeds": speeds[0], "most_speeds": speeds[-1],
    }  # fmt: skip


async def picture(live: LiveTorsion, path: Path, width: int, height: int) -> None:
    """Turn the second knob, and keep the window as PNG."""
    from live_browser import LivePage

    from cranktrain_lab.explore.balance import Balance
    from cranktrain_lab.explore.page import Explored
    from cranktrain_lab.explore.server import serve

    explored = Explored(live.engine.name, live, balance=Balance(live))
    address: list[str] = []
    server = serve(explored, 0, address.append, wait=False)
    try:
        async with LivePage(address[0], width, height) as page:
            await page.until("[...within(document)].filter(e => e.matches('canvas')).length >= 3")
            x, y = (await page.until(HANDLES))[1]
            await page.mouse("mousePressed", x, y)
            for k in range(1, 9):
                await page.mouse("mouseMoved", x + 6 * k, y)
            await page.mouse("mouseReleased", x + 48, y)
            await page.until("said().includes('->')")
            end = time.monotonic() + 90.0
            while explored.balance is not None and explored.balance.busy and time.monotonic() < end:
                await asyncio.sleep(0.5)
            await asyncio.sleep(2.0)
            path.write_bytes(await page.picture())
    finally:
        explored.close()
        server.stop()


def recorded(name: str) -> Any:
    """A cycle of an engine's solid crank on elastic films, and what it took, as JSON."""
    from cranktrain_lab.explore.inside.recording import LookInside

    began = time.perf_counter(), time.process_time()
    look = LookInside(load_engine(name), "solid", "ehd", "ehd", 1.0, LOOK_RPM * math.pi / 30.0)
    cycle = look.record(lambda stage: None, lambda stage, share: None)[0]
    surface = cycle.surface
    assert surface is not None
    films = sum(one.film.pressure.nbytes for one in cycle.bearings if one.film is not None)
    said = {
        "engine": name, "seconds": time.perf_counter() - began[0], "processor_seconds": time.process_time() - began[1],
        "points": len(surface.points), "triangles": len(surface.triangles), "shapes": len(surface.shapes),
        "stresses_mb": [1e-6 * one.nbytes for one in surface.stresses.values()], "films_mb": 1e-6 * films,
        "surface_mb": 1e-6 * (surface.points.nbytes + surface.triangles.nbytes + surface.shapes.nbytes),
        "largest_process_mb": 1e-3 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
    }  # fmt: skip
    print(json.dumps(said | {"frame_ms": frame_ms(cycle)}, indent=2))
    return cycle


def frame_ms(cycle: Any) -> float:
    """Median time in which the server gives all charts the data of another frame, ms."""
    from cranktrain_lab.explore.inside.view import InsideView

    view, spent = InsideView(cycle), []
    for angle in range(5, 5 * TURNS, 5):
        began = time.perf_counter()
        view.player.value = angle
        spent.append(time.perf_counter() - began)
    return 1e3 * sorted(spent)[len(spent) // 2]


async def look_picture(live: LiveTorsion, cycle: Any, path: Path, width: int, height: int) -> None:
    """Move the crank angle, and keep the window as PNG."""
    from live_browser import LivePage

    from cranktrain_lab.explore.page import Explored
    from cranktrain_lab.explore.server import serve

    explored, address = Explored(live.engine.name, live, inside=cycle), list[str]()
    server = serve(explored, 0, address.append, wait=False)
    try:
        async with LivePage(address[0], width, height) as page:
            await page.until("said().includes('0°: greatest')")
            await page.run(
                "(() => { const e = [...within(document)].find(e => e.matches('input[type=range]')); "
                f"e.value = {LOOK_ANGLE}; "
                "for (const one of ['input', 'change']) e.dispatchEvent(new Event(one)) })()"
            )
            await page.until(f"said().includes('{LOOK_ANGLE}°: greatest')")
            await asyncio.sleep(3.0)
            path.write_bytes(await page.picture())
    finally:
        explored.close()
        server.stop()


def main() -> None:
    """Times, then the picture where one is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", nargs="?", type=Path)
    parser.add_argument("--engines", default="diesel_i6")
    parser.add_argument("--width", type=int, default=1300)
    parser.add_argument("--look", type=Path, help="picture of the inside of the first engine, and nothing else")
    options = parser.parse_args()
    if options.look is not None:
        first = options.engines.split(",")[0]
        cycle = recorded(first)
        asyncio.run(look_picture(LiveTorsion(load_engine(first)), cycle, options.look, options.width, 1000))
        return
    lives = [LiveTorsion(load_engine(name)) for name in options.engines.split(",")]
    print(json.dumps([turns(live) for live in lives], indent=2))
    if options.picture is not None:
        asyncio.run(picture(lives[0], options.picture, options.width, 1000))


if __name__ == "__main__":
    main()
