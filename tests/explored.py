"""The page of ``cranktrain explore`` served in this process, and how a test reads it in a browser."""

import asyncio
import io
from contextlib import asynccontextmanager
from functools import wraps
from urllib.parse import urlsplit

import numpy as np
from live_browser import LivePage

from cranktrain.engine.file import load_engine

TORSIONAL = """(() => { const s = [...within(document)].find(e => e.matches('select') &&
[...e.options].some(o => o.value === 'torsional')); s.value = 'torsional'; s.dispatchEvent(new Event('change')) })()"""
"""Chooses the torsional crank."""
FIGURES = """[...within(document)].filter(e => e.matches('.bk-Figure') && e.getBoundingClientRect().width > 0)
.map(e => Math.round(e.getBoundingClientRect().x))"""
"""Left ends of the charts."""


@asynccontextmanager
async def served(name="single_petrol", **more):
    """A server in this process, what it explores, and its address."""
    from cranktrain_lab.explore.live import LiveTorsion
    from cranktrain_lab.explore.page import Explored
    from cranktrain_lab.explore.server import serve

    explored, address = Explored(name, LiveTorsion(load_engine(name)), **more), []
    server = serve(explored, 0, address.append, wait=False)
    try:
        yield explored, address[0]
    finally:
        explored.close()
        server.stop()


@asynccontextmanager
async def visited(width=1300, height=1400, **more):
    """What is explored and its page in a browser; a visit leaves an empty console and asks nothing of a network."""
    async with served(**more) as (explored, address), LivePage(address, width, height) as page:
        yield explored, page
        assert page.console == []
        host = urlsplit(address).netloc
        kinds = [urlsplit(one) for one in page.requests]
        assert [one for one in kinds if one.scheme not in ("data", "blob") and one.netloc != host] == []


def in_a_loop(test):
    """A test that is a coroutine."""

    @wraps(test)
    def run(*arguments, **more):
        asyncio.run(test(*arguments, **more))

    return run


def drawn(png):
    """A picture's pixels, red, green and blue of 0 to 1."""
    from matplotlib.image import imread

    return imread(io.BytesIO(png))[..., :3]


def differing(first, second):
    """Fraction of pixels in which two pictures differ."""
    return float(np.mean(np.abs(drawn(first) - drawn(second)).max(axis=-1) > 0.1))
