"""A trade-off study small enough for a test: the coarse six over two cycles, a few steps, two other solvers."""

import math
from dataclasses import replace

import pytest
from benchmarks.other_solvers import entries
from bodies import COARSE

from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain_lab.tradeoff import level_points
from cranktrain_lab.tradeoff.families import StudyScene


@pytest.fixture
def small(monkeypatch):
    """One scene, with the study's choices cut down."""
    monkeypatch.setattr(level_points, "CYCLES", 2)
    monkeypatch.setattr(level_points, "QUICK_STEPS", {"esdirk4": (6.0, 3.0, 1.5), "backward-euler": (3.0,)})
    monkeypatch.setattr(entries, "EXPLICIT_DEG", {"runge-kutta-4": (0.1, 0.1)})
    monkeypatch.setattr(entries, "RADAU_DEG", (3.0, 3.0, 3.0))
    monkeypatch.setattr(entries, "FEW", {})
    monkeypatch.setattr(level_points, "REFERENCE_DEG", {"linear": 0.25})
    engine = load_engine("diesel_i6")
    engine = replace(engine, crankshaft=replace(engine.crankshaft, mesh_size=COARSE))
    return StudyScene("small six", engine, 2000.0 * math.pi / 30.0, Settings(bearings="linear"))
