"""Runs of a scene: at its plan's levels, at the next finer levels as a check, or at every level of the ladder.

Finished runs are written at once. The result file holds all outputs of the plan's runs (under ``2000rpm/`` if the scene
has several speeds) and, under ``levels/``, the last cycle of the wanted outputs at other levels. An interrupt keeps all
finished runs.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.units import RPM
from cranktrain.dynamics.settled.judging import Settling
from cranktrain.engine.quantities import ZERO_CELSIUS
from cranktrain.results.files import output_unit
from cranktrain.results.orders.harmonics import order_spectrum
from cranktrain.store.hdf5 import write_result
from cranktrain.studies.planning.difference import LastCycle, by_family, last_cycle, relative_differences
from cranktrain.studies.planning.ladder import every_pair
from cranktrain.studies.planning.plan import Plan
from cranktrain.studies.planning.scene_model import Case, SceneModel
from cranktrain.studies.scene import Scene

Advance = Callable[[float], None] | None


@dataclass
class LevelRun:
    """Runs of one case at all speeds of a scene: last cycles, elapsed and simulated seconds, and errors."""

    case: Case
    cycles: list[LastCycle] = field(default_factory=list)
    seconds: float = 0.0
    simulated: float = 0.0
    settlings: list[Settling] = field(default_factory=list)
    status: str = "ok"


class SceneRun:
    """Runs of a scene and the file that keeps them.

    Parameters
    ----------
    plan : what to run
    model : the scene's model
    path : result file, HDF5
    """

    def __init__(self, plan: Plan, model: SceneModel, path: Path) -> None:
        self.plan, self.scene, self.model, self.path = plan, plan.scene, model, path
        self.levels: list[LevelRun] = []
        self.interrupted = False
        self._datasets: dict[str, Any] = {}

    # ------------------------------------------------------------------ runs

    def run(self, case: Case, advance: Advance = None) -> LevelRun:
        """Run a case at every speed. All outputs are stored for the plan's own case, last cycles for any other case."""
        scene, level = self.scene, LevelRun(case)
        self.levels.append(level)
        for k, speed in enumerate(scene.speeds):

            def share(done: float, k: int = k) -> None:
                if advance is not None:
                    advance((k + done) / len(scene.speeds))

            try:
                run = self.model.run(case, speed, progress=share)
            except SolverError as error:
                level.status = f"failed: {error}"
                return level
            except KeyboardInterrupt:
                self.interrupted = True
                return level
            level.cycles.append(last_cycle(run, scene.outputs))
            level.seconds += run.seconds
            level.simulated += run.seconds / run.real_time_factor
            level.settlings.append(run.settling)
            rpm = f"{speed / RPM:.6g}rpm"
            if case == self.plan.case:
                prefix = f"{rpm}/" if len(self.scene.speeds) > 1 else ""
                kept = {"time": (run.time, "s"), "angle": (run.angle, "rad")}
                kept["film_temperature_c"] = (run.film_temperatures - ZERO_CELSIUS, "degC")
                kept |= {name: (values, output_unit(name)) for name, values in run.outputs.items()}
            else:
                prefix = f"levels/{case.crank}-{case.bearings}/{rpm}/"
                kept = {
                    name: (run.outputs[name][-run.per_cycle - 1 :], output_unit(name)) for name in self.scene.outputs
                }
            self._datasets |= {prefix + name: entry for name, entry in kept.items()}
            write_result(self.path, self._datasets, self._attributes())
        return level

    def _attributes(self) -> dict[str, str | int | float]:
        """Attributes of the result file."""
        scene, case = self.scene, self.plan.case
        return {
            "scene": scene.name,
            "engine": scene.engine.name,
            "speeds_rpm": " ".join(f"{rpm:.6g}" for rpm in scene.speeds_rpm),
            **self.settling,
            "crank": case.crank,
            "bearings": case.bearings,
            "block": scene.block,
            "damper": scene.damper,
            "integrator": case.integrator,
            "step": case.step,
            "cutoff_hz": case.cutoff,
            "predicted_error": self.plan.predicted_error,
        }

    # ------------------------------------------------------------------ results of the runs

    def sort(self) -> None:
        """Put the runs of all levels in the order of the ladder."""
        pairs = every_pair(self.scene, True)
        self.levels.sort(key=lambda level: pairs.index(level.case.levels) if level.case.levels in pairs else -1)

    def outputs(self) -> dict[str, Any]:
        """Summary of each wanted output at the speed of its largest amplitude, with mean and amplitude by speed.

        Values in the unit of the output; ``amplitude`` is half the peak to peak, orders are zero to peak and reach up
        to the scene's frequency.
        """
        return output_summary(self.scene, self._own.cycles)

    @property
    def settling(self) -> dict[str, str | int | float]:
        """Largest number of cycles of the plan's runs, their periods, and the largest settling error of any output."""
        own = self._own.settlings
        return {
            "cycles": max((one.cycles for one in own), default=0),
            "repeats_every_cycles": " ".join(str(one.repeats) for one in own),
            "settling_left": max((one.worst[1] for one in own), default=math.nan),
        }

    @property
    def _own(self) -> LevelRun:
        return next(level for level in self.levels if level.case == self.plan.case)

    def rows(self) -> list[dict[str, Any]]:
        """Rows of all levels that ran, each with its difference from the finest level that ran at all speeds."""
        complete = [level for level in self.levels if len(level.cycles) == len(self.scene.speeds)]
        top = complete[-1] if len(complete) > 1 else None
        return [
            {
                "crank": level.case.crank,
                "bearings": level.case.bearings,
                "integrator": level.case.integrator,
                "step_deg": round(math.degrees(level.case.step), 9),
                "seconds": level.seconds,
                "real_time_factor": level.seconds / level.simulated if level in complete else None,
                "settling": max((one.worst[1] for one in level.settlings), default=None),
                "difference": self.difference(level, top) if level in complete and top is not None else {},
                "status": level.status if level in complete or level.status != "ok" else "interrupted",
            }
            for level in self.levels
        ]

    def difference(self, level: LevelRun, reference: LevelRun) -> dict[str, float]:
        """Largest relative difference over speeds of each output, or family of outputs."""
        scene = self.scene
        found = [
            relative_differences(one, other, speed, scene.frequency)
            for one, other, speed in zip(level.cycles, reference.cycles, scene.speeds, strict=True)
        ]
        return by_family(scene.outputs, np.max(found, axis=0))

    def verification(self) -> dict[str, Any] | None:
        """Predicted and verified error of the plan; None until the plan's case and the next finer case have run."""
        own, check = self._own, next((one for one in self.levels if one.case == self.plan.next), None)
        if check is None or len(own.cycles) != len(check.cycles) or len(own.cycles) != len(self.scene.speeds):
            return None
        differences = self.difference(own, check)
        verified = max(differences.values(), default=0.0)
        predicted = self.plan.predicted_error
        return {
            "crank": check.case.crank,
            "bearings": check.case.bearings,
            "step_deg": round(math.degrees(check.case.step), 9),
            "predicted_error": predicted,
            "verified_error": verified,
            "ratio": predicted / verified if verified > 0.0 else None,
            "difference": differences,
        }


def output_summary(scene: Scene, cycles: list[LastCycle]) -> dict[str, Any]:
    """Summary of each wanted output over the runs of a scene's first speeds."""
    summary: dict[str, Any] = {}
    if not cycles:
        return summary
    for i, name in enumerate(scene.outputs):
        values = [cycle.values[i] for cycle in cycles]
        amplitudes = [0.5 * float(np.ptp(one)) for one in values]
        k = int(np.argmax(amplitudes))
        speed = scene.speeds[k]
        orders, sizes = order_spectrum(values[k], 2.0 * math.pi * scene.frequency / speed)
        summary[name] = {
            "unit": output_unit(name),
            "speed_rpm": round(speed / RPM, 9),
            "mean": float(values[k].mean()),
            "amplitude": amplitudes[k],
            "minimum": float(values[k].min()),
            "maximum": float(values[k].max()),
            "orders": [[float(order), float(size)] for order, size in zip(orders, sizes, strict=True)],
            "by_speed": [
                [round(v / RPM, 9), float(one.mean()), size]
                for v, one, size in zip(scene.speeds, values, amplitudes, strict=False)
            ],
        }
    return summary
