"""Measured total errors and costs by ``cranktrain tradeoff --total``, shipped with the package for use by plans.

``python docs/figures.py total_error`` measures and ships them. A file holds the points of one engine with the digest of
the engine that they were measured on, and of the sources of the model. Figures of another engine are not used; figures
of other sources are marked as such.
"""

import json
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from importlib.resources import files

from cranktrain.core.sources import ROOT, source_digest
from cranktrain.engine.model import Engine
from cranktrain.engine.written import document_of
from cranktrain.studies.total_error.point import Best, TotalPoint, point_of

FOLDER = "data"
MODEL = ROOT / "structure" / "assembly.py"
"""Source file that makes all bodies and parts of a run; with its imports it covers the sources of the whole model."""


@dataclass(frozen=True)
class Shipped:
    """Measured total errors and costs of one engine, as shipped.

    Attributes
    ----------
    points, best : of every scene, and the best model by scene
    sources : digest of the sources of the model that was measured
    """

    points: tuple[TotalPoint, ...]
    best: dict[str, Best]
    sources: str

    @property
    def current(self) -> bool:
        """True if the sources of the model are unchanged since the errors were measured."""
        return self.sources == model_sources()

    @property
    def speeds_rpm(self) -> tuple[float, ...]:
        """Speeds, rev/min, at which errors were measured, in increasing order."""
        return tuple(sorted({point.speed_rpm for point in self.points}))


def model_sources() -> str:
    """Digest of the present sources of bodies and running model."""
    return source_digest(MODEL, deferred=True)


def engine_digest(engine: Engine) -> str:
    """Digest of all values of an engine file that are not the defaults of their keys."""
    return sha256(json.dumps(document_of(engine), sort_keys=True).encode()).hexdigest()[:16]


def read(text: str) -> tuple[str, Shipped]:
    """Digest of an engine file, and the measured errors of this engine, from the JSON ``text`` of a shipped file."""
    found = json.loads(text)
    points = tuple(point_of(entry) for entry in found["points"])
    best = {scene: Best(**entry) for scene, entry in found["best"].items()}
    return found["engine_digest"], Shipped(points, best, found["sources_digest"])


def shipped(engine: Engine) -> Shipped | None:
    """Shipped errors and costs of an engine; None if none were measured on exactly this engine file."""
    return _all().get(engine_digest(engine))


@cache
def _all() -> dict[str, Shipped]:
    folder = files("cranktrain.studies.total_error").joinpath(FOLDER)
    if not folder.is_dir():
        return {}
    return dict(read(file.read_text(encoding="utf-8")) for file in folder.iterdir() if file.name.endswith(".json"))
