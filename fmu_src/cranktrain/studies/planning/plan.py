"""A plan: levels and method for a scene, with predicted errors and time, and reasons."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.studies.planning.difference import by_family
from cranktrain.studies.planning.ladder import SOLID, Pair
from cranktrain.studies.planning.scene_model import Case
from cranktrain.studies.scene import Scene


@dataclass(frozen=True)
class Errors:
    """Relative errors of each output, (outputs,). The model error is None at the finest levels with all modes.

    The model error is that against the next levels up or, by measured total errors, against the best model.
    ``settling`` is the settling error of a run.
    """

    numerical: Array
    model: Array | None
    settling: Array

    @property
    def total(self) -> Array:
        """Total error of each output, (outputs,): root of the sum of the squared errors."""
        own = np.hypot(self.numerical, self.settling)
        return own if self.model is None else np.hypot(own, self.model)


@dataclass(frozen=True)
class Plan:
    """Levels and method for a scene, with reasons.

    Attributes
    ----------
    case : levels, cut-off, method and step
    modes : number of the crank's modes
    errors : predicted errors of each output
    real_time_factor : predicted wall seconds per simulated second
    next : the case that a check runs: next levels, all modes, half the step; None of the levels at the top
    next_real_time_factor : of the next levels at the plan's step; None if they were not run
    reasons : one line for each part
    within_accuracy, within_budget : True if the scene's limits are met
    total_error, against : error against the best model, and its name, if measured total errors chose the levels
    """

    scene: Scene
    case: Case
    modes: int
    errors: Errors
    real_time_factor: float
    next: Case
    next_real_time_factor: float | None
    reasons: tuple[str, ...]
    within_accuracy: bool
    within_budget: bool
    total_error: float | None = None
    against: str = ""

    def __repr__(self) -> str:
        case, scene = self.case, self.scene
        return (
            f"<Plan for {scene.engine.name}: crank {case.crank}, bearings {case.bearings}, {self.modes} modes\n"
            f" predicted error {self.predicted_error:.2g}, real-time factor {self.real_time_factor:.2g}\n"
            " reasons, case, errors, as_dict()>"
        )

    @property
    def predicted_error(self) -> float:
        """Largest total error over the outputs."""
        return largest(self.errors.total)

    def as_dict(self) -> dict[str, Any]:
        """Output of ``cranktrain plan --json``."""
        model, outputs = self.errors.model, self.scene.outputs
        above = None
        if model is not None and self.next_real_time_factor is not None:
            above = {
                "crank": self.next.crank,
                "bearings": self.next.bearings,
                "block": self.scene.block,
                "cutoff_hz": self.next.cutoff if self.next.crank == SOLID else None,
                "difference": by_family(outputs, model),
                "real_time_factor": self.next_real_time_factor,
            }
        return {
            "crank": self.case.crank,
            "bearings": self.case.bearings,
            "block": self.scene.block,
            "modes": self.modes,
            "cutoff_hz": self.case.cutoff if self.case.crank == SOLID else None,
            "integrator": self.case.integrator,
            "step_deg": round(math.degrees(self.case.step), 9),
            "predicted_error": self.predicted_error,
            "predicted_numerical_error": largest(self.errors.numerical),
            "predicted_settling_error": largest(self.errors.settling),
            "predicted_model_error": None if model is None else largest(model),
            "predicted_errors": by_family(outputs, self.errors.total),
            "predicted_real_time_factor": self.real_time_factor,
            "predicted_total_error": self.total_error,
            "total_error_against": self.against or None,
            "within_accuracy": self.within_accuracy,
            "within_budget": self.within_budget,
            "reasons": list(self.reasons),
            "next_level": above,
        }


def largest(errors: Array) -> float:
    """Largest error of any output; 0 if there are no outputs."""
    return float(errors.max()) if errors.size else 0.0


def pair_name(pair: Pair) -> str:
    """Text of a pair of levels, such as ``solid/table``."""
    return f"{pair[0]}/{pair[1]}"
