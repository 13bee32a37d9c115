"""A study of total error small enough for a test: two cheap models of the six, one of them as the best."""

import math
from dataclasses import replace

import pytest

from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.film.laws.register import CHEAP
from cranktrain_lab.tradeoff import models, settled, study
from cranktrain_lab.tradeoff.families import StudyScene


@pytest.fixture
def few(monkeypatch):
    """One scene, in which a rigid crank on springs is compared with the beam on springs, the best there is."""
    engine = load_engine("diesel_i6")
    scene = StudyScene("few 2000", engine, 2000.0 * math.pi / 30.0, Settings(crank="beam", bearings="linear"))
    rows = [("rigid", "linear", "ground"), ("beam", "linear", "ground")]
    every = [models.model(scene, *levels) for levels in rows]
    for module in (models, study):
        monkeypatch.setattr(module, "models", lambda scene, quick: every)
        monkeypatch.setattr(module, "best_model", lambda scene: every[-1])
    monkeypatch.setitem(models.STEPS_DEG, CHEAP, (6.0, 2.5))
    monkeypatch.setitem(models.FINE_DEG, CHEAP, 1.0)
    monkeypatch.setattr(settled, "TIMED_SECONDS", 0.0)
    return replace(scene)
