"""Measured total errors that ship with the package: figures of ``cranktrain tradeoff --total``, for plans to read.

``python docs/figures.py total_error`` measures and ships them. A file holds the points of one engine with the digest of
the engine that they were measured on, and of the sources that measured them. Figures of another engine are no figures
of this one; those of other sources are told as such.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import Any

from cranktrain.core.sources import source_digest
from cranktrain.engine.model import Engine
from cranktrain.studies.tradeoff.total import measure
from cranktrain.studies.tradeoff.total.point import TotalPoint, point_of
from cranktrain.studies.tradeoff.total.study import Best, TotalStudy

COMMAND = "cranktrain tradeoff --total"
FOLDER = "data"
LATER = (
    ("axial_path", "", None), ("thrust", "closed_stiffness", 0.0),
    ("frame", "", ()), ("body", "", ()), ("connection", "", ()),
)  # fmt: skip
"""Tables and keys that came after the first shipped figures, with the value of a file that does not have them."""


@dataclass(frozen=True)
class Shipped:
    """Measured figures of one engine.

    Attributes
    ----------
    points, best : of every scene, and the best model by scene
    sources : digest of the sources that measured them
    """

    points: tuple[TotalPoint, ...]
    best: dict[str, Best]
    sources: str

    @property
    def current(self) -> bool:
        """Whether the sources are still those that measured the figures."""
        return self.sources == source_digest(measure.__file__, deferred=True)

    @property
    def speeds_rpm(self) -> tuple[float, ...]:
        """Speeds that were measured, rising."""
        return tuple(sorted({point.speed_rpm for point in self.points}))


def engine_digest(engine: Engine) -> str:
    """Digest of all that an engine file says; what it may say since figures were measured counts where it does."""
    said = asdict(engine)
    for table, key, silent in LATER:
        part = said[table] if key else said
        if part[key or table] == silent:
            del part[key or table]
    return sha256(json.dumps(said, sort_keys=True, default=repr).encode()).hexdigest()[:16]


def document(study: TotalStudy) -> dict[str, Any]:
    """What ships of a study, as JSON holds it; every scene is of the same engine with no damper and the full load."""
    engine = study.scenes[0].engine
    return {
        "command": COMMAND,
        "what": "measured total errors against cost; see docs/tradeoff.md",
        "engine": engine.name,
        "engine_digest": engine_digest(engine),
        "sources_digest": source_digest(measure.__file__, deferred=True),
        "best": {scene: asdict(best) for scene, best in study.best.items()},
        "points": [point.as_dict() for point in study.points],
    }


def document_text(found: dict[str, Any]) -> str:
    """A document as text, a point a line."""
    head = json.dumps({name: value for name, value in found.items() if name != "points"}, indent=1, allow_nan=False)
    points = ",\n".join(json.dumps(point, allow_nan=False) for point in found["points"])
    return head[:-2] + ',\n "points": [\n' + points + "\n]}\n"


def read(text: str) -> tuple[str, Shipped]:
    """Engine digest and figures of a document."""
    found = json.loads(text)
    points = tuple(point_of(entry) for entry in found["points"])
    best = {scene: Best(**entry) for scene, entry in found["best"].items()}
    return found["engine_digest"], Shipped(points, best, found["sources_digest"])


def shipped(engine: Engine) -> Shipped | None:
    """Figures of an engine, None where none ship or where they were measured on another."""
    return _all().get(engine_digest(engine))


@cache
def _all() -> dict[str, Shipped]:
    folder = files("cranktrain.studies.tradeoff.total").joinpath(FOLDER)
    if not folder.is_dir():
        return {}
    return dict(read(file.read_text(encoding="utf-8")) for file in folder.iterdir() if file.name.endswith(".json"))
