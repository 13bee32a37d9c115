"""Variants run in time at one or several speeds, each from the steady motion of the base engine.

Outputs are those of the running model (``pulley.torsion``, ``bearing[4].force.y``; without a number all bearings). The
value is half of the peak-to-peak value over the settled cycle, or with ``largest NAME``, ``least NAME`` and ``mean
NAME`` the respective value over the cycle.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.results.files import output_unit
from cranktrain.results.run_up.run_up import LARGEST, LEAST, MEAN
from cranktrain.structure.assembly import Assembly
from cranktrain.studies.run_up.steady import CycleStart, Job, SteadyRuns
from cranktrain.studies.scene import scene_outputs

WORDS = {"least": LEAST, "mean": MEAN, "largest": LARGEST}
HIGHEST_ORDER = 24.0


def split_output(output: str) -> tuple[str, str]:
    """Split an output such as ``mean NAME`` into word and name. No word means half of the peak-to-peak value."""
    word, _, name = output.strip().partition(" ")
    return (word, name.strip()) if word in WORDS and name else ("", output.strip())


def time_outputs(engine: Engine, outputs: Sequence[str]) -> dict[str, str]:
    """Return the single outputs of a study's list, with their units; raises ``InputError`` for an unknown output."""
    found: dict[str, str] = {}
    for output in outputs:
        word, name = split_output(output)
        single, stress = scene_outputs(engine, [name])
        if stress or name.endswith(".orders"):
            raise InputError(f"outputs: '{output}' is no time series of the running model; name one, or its bearings'")
        found |= {f"{word} {one}".strip(): output_unit(one) for one in single}
    return found


class TimeAnswers:
    """Runs of variants in time, each started from the steady motion of the base engine."""

    def __init__(self, made: Assembly, speeds: Array, outputs: Sequence[str], settle: float) -> None:
        self._speeds, self._outputs, self._settle = speeds, tuple(outputs), settle
        self._starts: list[CycleStart] = []
        runs = SteadyRuns(self._job(made))
        # A second run of the base engine identifies its slowest modes, so each variant needs fewer cycles.
        for speed in speeds.tolist():
            first = runs.at(speed, [])
            self._starts.append(runs.at(speed, [first.start]).start)

    def answer(self, made: Assembly) -> dict[str, Array]:
        """Return each output of a variant at its s speeds, (s,); raises ``InputError``, ``SolverError``."""
        runs, found = SteadyRuns(self._job(made)), []
        same = runs.simulation.model.omega2.size
        for speed, start in zip(self._speeds.tolist(), self._starts, strict=True):
            near = [start] if start.motion.place.size == same else []
            found.append(runs.at(speed, near).extremes)
        return {output: np.array([_value(output, one) for one in found]) for output in self._outputs}

    def _job(self, made: Assembly) -> Job:
        return Job(made, None, self._settle, HIGHEST_ORDER, ())


def _value(output: str, extremes: dict[str, Array]) -> float:
    word, name = split_output(output)
    values = extremes[name]
    return float(values[WORDS[word]]) if word else 0.5 * float(values[LARGEST] - values[LEAST])
