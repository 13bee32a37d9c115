"""The engine and the speed of the benchmarks of films."""

from __future__ import annotations

import math

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.structure.crank.reduction import running_body

SPEED = 2000.0 * math.pi / 30.0


def engine_and_body() -> tuple[Engine, ReducedBody]:
    """The in-line six and its crankshaft as the FMU carries it, from the cache where it is there."""
    engine = load_engine("diesel_i6")
    return engine, running_body(engine)
