"""Parts of an FMU that are independent of others, made in a second process while this one makes the crankshaft.

The process stores its results in the cache, where the build then finds them. With only one processor, or without
processes or a writable cache, the build makes these parts itself.
"""

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
    """Let a second process call ``make`` with the engine; yields a function that waits for its end.

    Errors of the process are ignored; this process meets them again when it needs the part.

    Parameters
    ----------
    make : function of a module
    what : name of the parts that it makes, for messages
    say : receives a message if this process has to wait
    """
    if processors() < 2:
        yield lambda: None
        return
    with worker_pool(1, _begin, ()) as pool:
        work: Future[None] = pool.submit(make, engine)

        def wait() -> None:
            if not work.done():
                say(f"{engine.name}: {what}, in a second process")
            with suppress(Exception):
                work.result()

        yield wait


def make_block(engine: Engine) -> None:
    """Compute the block and its bore, which are kept in the cache."""
    assembly.running_block(engine, tilting=True, bore=not engine.rollers_only)


def make_bores(engine: Engine) -> None:
    """Compute the elastic bores on ground, which are kept in the cache."""
    if engine.big_end_bearing is not None and engine.rods_float:
        assembly.big_end_bore(engine)
    if not engine.rollers_only:
        assembly.elastic_bore(engine, flexible=False)


def _begin() -> None:
    """Initialise the worker process; nothing is to be done."""
