"""Every shipped engine of the library through every verb, at cheap levels: each ends."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from docs.engine_library import ROWS, SHIP

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine

DATA = Path(__file__).parents[1] / "data" / "engines"
ENGINES = (*ROWS, SHIP, *(str(path) for path in sorted(DATA.glob("*.toml"))))
CHEAP = ["--crank", "beam", "--block", "ground"]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ENGINES)
def test_every_verb_ends(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    engine = load_engine(name)
    rpm = engine.speeds[1] * 30.0 / math.pi
    speed, spring = ["--speed", f"{rpm:.6g}"], ["--bearings", "linear"]
    ends = [f"{share * rpm:.6g}" for share in (0.9, 1.0, 0.05)]
    run_up = ["--from", ends[0], "--to", ends[1], "--step", ends[2]]
    commands = [
        ["modal", name, "--crank", "beam"],
        ["simulate", name, *CHEAP, *spring, *speed],
        ["runup", name, *CHEAP, *spring, *run_up],
        ["bearing-loads", name, *CHEAP, "--bearings", "impedance", *speed],
        *([["fatigue", name, *CHEAP, *spring, *speed]] if engine.crank_strength is not None else []),
        ["report", name, "--quick"],
    ]
    for command in commands:
        assert main(command) == 0, " ".join(command)
