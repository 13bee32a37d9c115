"""Parts of an FMU that need no other part, made in a second process while this one makes the crankshaft.

The process leaves what it makes in the cache, where the build then finds it. If there is one processor only, no process
to be had, or no cache that can be written, the build makes these parts itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress

from cranktrain.core.types import Progress
from cranktrain.engine.model import Engine
from cranktrain.store.side_by_side import processors, worker_pool
from cranktrain.structure import assembly


@contextmanager
def made_beside(
    make: Callable[[Engine], None], engine: Engine, what: str, say: Progress
) -> Iterator[Callable[[], None]]:
    """Let a process call ``make`` with the engine meanwhile; gives a function that waits for its end.

    Errors of the process are left to this one, which meets them again where it needs the part.

    Parameters
    ----------
    make : function of a module
    what : parts that it makes, in words
    say : told when this process has to wait
    """
    if processors() < 2:
        yield lambda: None
        return
    with worker_pool(1, _begin, ()) as pool:
        work: Future[None] = pool.submit(make, engine)

        def wait() -> None:
            if not work.done():
                say(f"{engine.name}: {what}, in a process beside")
            with suppress(Exception):
                work.result()

        yield wait


def make_block(engine: Engine) -> None:
    """Keep the block and its bore."""
    assembly.running_block(engine, tilting=True, bore=not engine.rollers_only)


def make_bores(engine: Engine) -> None:
    """Keep the elastic bores on ground."""
    if engine.big_end_bearing is not None and engine.rods_float:
        assembly.big_end_bore(engine)
    if not engine.rollers_only:
        assembly.elastic_bore(engine, flexible=False)


def _begin() -> None:
    """Nothing to begin with."""
