"""A study of total error as the document that ships, which :mod:`cranktrain.studies.total_error.shipped` reads."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from cranktrain.studies.total_error.shipped import engine_digest, measuring_sources
from cranktrain.studies.tradeoff.total.study import TotalStudy

COMMAND = "cranktrain tradeoff --total"


def document(study: TotalStudy) -> dict[str, Any]:
    """What ships of a study, as JSON holds it; every scene is of the same engine with no damper and the full load."""
    engine = study.scenes[0].engine
    return {
        "command": COMMAND,
        "what": "measured total errors against cost; see docs/tradeoff.md",
        "engine": engine.name,
        "engine_digest": engine_digest(engine),
        "sources_digest": measuring_sources(),
        "best": {scene: asdict(best) for scene, best in study.best.items()},
        "points": [point.as_dict() for point in study.points],
    }


def document_text(found: dict[str, Any]) -> str:
    """A document as text, a point a line."""
    head = json.dumps({name: value for name, value in found.items() if name != "points"}, indent=1, allow_nan=False)
    points = ",\n".join(json.dumps(point, allow_nan=False) for point in found["points"])
    return head[:-2] + ',\n "points": [\n' + points + "\n]}\n"
