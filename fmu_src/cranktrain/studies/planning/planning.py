"""Choice of the lowest levels, mode count, method and step for a scene, by runs of its own model.

Two errors are distinguished. The *model error* of a pair of levels is the difference of its outputs from those of the
next pair up the ladder, both at the same step; it includes the effect of dropped modes of the crank. The *numerical
error* is the difference from the same model with half the step. Both are relative differences up to the scene's highest
frequency (:mod:`cranktrain.studies.planning.difference`); the largest over outputs and speeds counts. The errors are
independent, so the root of the sum of their squares predicts the difference from a run at the next pair with half the
step.

Where measured total errors ship for the engine (:mod:`cranktrain.studies.planning.charted`) and one of their choices is
within the accuracy of the best model, the plan takes the levels of the cheapest such choice, and judges its accuracy by
that total error. Otherwise it goes up the ladder to the first pair whose model error leaves room for a numerical error,
and takes the cheapest method and step within this remainder. The settling error of a run is a third error, which is
kept small. If the next pair has no solid crank yet, the pair after it must be as close, because two coarse cranks may
agree with each other. Choices fixed by the scene are not judged, only reported.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.film.laws.register import DEAR, bearing_law
from cranktrain.studies.planning.charted import charted
from cranktrain.studies.planning.difference import longest_step
from cranktrain.studies.planning.ladder import SOLID, Pair, admits, candidates, dearest, film, next_pair
from cranktrain.studies.planning.measured import Measured
from cranktrain.studies.planning.plan import Errors, Plan, largest, pair_name
from cranktrain.studies.planning.scene_model import Case, SceneModel
from cranktrain.studies.scene import Scene, load_scene
from cranktrain.studies.total_error.point import percent

ELASTIC_METHODS = {"esdirk3": (2.0, 1.0, 0.5)}
"""Integrators with the steps (deg) that a plan tries on elastic films. Steps are short, because films close quickly."""
LONE_STEPS = (5.0, 2.5, 1.25, 0.625, 0.3125)
"""Steps (deg) for an integrator that the scene fixes."""
METHODS = {
    "esdirk4": (6.0, 4.0, 3.0, 2.5, 2.0, 1.0, 0.5, 0.25),
    "esdirk47": (6.0, 5.0, 4.0, 3.0, 2.5),
    "esdirk5": (6.0, 3.0, 1.0),
    "esdirk57": (10.0, 5.0, 2.5),
    "sdirk4": (4.0, 2.5, 1.0),
    "generalised-alpha:0.6": (1.0, 0.5),
    "tr-bdf2": (1.0,),
}
"""Integrators with their steps (deg), the longest first, that a plan tries on all other bearings."""
HOPEFUL = 3.0
"""Factor on the permitted numerical error. Films solved online are expensive, so only those steps are tried on them
whose error on the engine's lowest film level is within this multiple of the permitted error."""
USUAL_STEP = math.radians(2.5)
"""Longest step at which levels are judged, independent of their usual step."""
NUMERICAL_SHARE = 0.5
"""Largest numerical error as a fraction of the accuracy."""
MODEL_SHARE = 0.9
"""Largest model error as a fraction of the accuracy, if levels are chosen."""
CUTOFFS = (1.0, 1.5, 2.0, 3.0)
"""Cut-offs of the crank's modes that a plan tries, in units of the highest frequency."""
MODE_SHARE = 0.25
"""Largest error by dropped modes as a fraction of the accuracy."""
STRETCHED = 4.0
"""Largest time of a pair of levels at the usual step, over the budget, for the pair to be judged. Longer steps do not
save more than this factor."""
SCREENED_SPEEDS = 3
"""Number of speeds at which levels are judged. Errors of the chosen plan are then measured at all speeds."""
SETTLED_CYCLES = 5
"""Approximate number of cycles until the outputs repeat."""
LONGEST_MEASUREMENT = 60.0
"""Longest expected time, s, of measuring the plan's errors at every speed. If it is exceeded, only the screened speeds
are measured."""


def plan(scene: Scene | str | Path, model: SceneModel | None = None, compare: bool = False) -> Plan:
    """Plan of a scene, or of the scene in a file.

    Its input is measured on the scene's model, or read if it was measured before. With ``compare`` the
    next higher levels are run even if measured total errors chose the levels, although it may take minutes. Raises
    ``InputError``: an accuracy that no step reaches, levels that the engine lacks.
    """
    found = scene if isinstance(scene, Scene) else load_scene(scene)
    return _Chooser(found, Measured(model or SceneModel(found)), compare).plan()


def screened(speeds: tuple[float, ...]) -> tuple[float, ...]:
    """Speeds at which levels are judged: both ends, and evenly spaced speeds between them."""
    if len(speeds) <= SCREENED_SPEEDS:
        return speeds
    places = np.linspace(0, len(speeds) - 1, SCREENED_SPEEDS).round().astype(int)
    return tuple(sorted(speeds)[k] for k in places)


@dataclass(frozen=True)
class _Judged:
    """A pair of levels, its difference from the next finer pair (None for the finest), and true if it is small enough.

    ``charted``: differences from the best model, by output, if measured total errors are used.
    """

    pair: Pair
    model: float | None
    serves: bool
    text: str
    charted: Array | None = None


class _Chooser:
    """Chooser of levels, step and modes for one scene, from measurements of the scene's model."""

    def __init__(self, scene: Scene, measured: Measured, compare: bool = False) -> None:
        self.scene, self.measured, self.model, self.compare = scene, measured, measured.model, compare
        self.speeds = screened(scene.speeds)
        self.too_dear = ""
        self.known = charted(scene, lambda pair: admits(scene, pair))

    def plan(self) -> Plan:
        """Make the plan: choose levels first, then integrator and step, then the number of modes."""
        scene = self.scene
        judged = self._charted_pair() or self._climb()
        chosen = next((one for one in judged if one.serves), judged[-1])
        case = self._method(chosen)
        cost = self.measured.cost(case, self.speeds)
        if scene.budget is not None and cost > scene.budget:
            chosen, case = self._within_budget(judged, (chosen, case, cost))
        case, modes_text = self._modes(case)
        return self._figures(chosen, case, judged, modes_text)

    # ------------------------------------------------------------------ levels

    def _charted_pair(self) -> list[_Judged]:
        """Levels of the cheapest choice whose shipped total error is within the accuracy; empty if there is none."""
        known = self.known
        if known is None or known.chosen is None:
            return []
        one = known.chosen
        text = f"{one.label} is {percent(one.total)} in all {known.against}, the cheapest within the accuracy"
        most = MODEL_SHARE * self.scene.accuracy
        return [_Judged(one.pair, min(one.model, most), True, text, np.minimum(one.of_outputs(self.scene), most))]

    def usual(self, pair: Pair) -> Case:
        """Case of a pair of levels with the integrator and step at which levels are judged."""
        integrator = resolved(Settings(crank=pair[0], bearings=pair[1]), self.scene.engine).integrator
        return self.model.case(*pair, integrator, min(USUAL_STEP, self.longest))

    def above(self, case: Case) -> Case | None:
        """Case of the next finer pair, with all modes; for the finest pair the same case with all modes, or None."""
        pair = next_pair(self.scene, case.levels)
        if pair is None:
            full = replace(case, cutoff=self.model.all_modes)
            return full if case.crank == SOLID and full != case else None
        return self.at(case, pair)

    def at(self, case: Case, pair: Pair) -> Case:
        """Case of another pair with all modes and the same integrator and step; elastic films use their own method."""
        own = bearing_law(pair[1]).integrator
        if dearest(pair[1]) and not dearest(case.bearings):
            return Case(*pair, self.model.all_modes, own, min(case.step, USUAL_STEP))
        return Case(*pair, self.model.all_modes, case.integrator, case.step)

    @property
    def longest(self) -> float:
        """Longest step (rad) that resolves the frequency at the lowest speed."""
        return longest_step(min(self.scene.speeds), self.scene.frequency)

    def _climb(self) -> list[_Judged]:
        """Judge pairs of levels from the lowest up to the first sufficient pair, or until the time budget is used."""
        scene, found = self.scene, list[_Judged]()
        for pair in candidates(scene):
            case = self.usual(pair)
            if found and scene.budget is not None:
                cost = self.measured.cost(case, self.speeds)
                if cost > STRETCHED * scene.budget:
                    self.too_dear = f"{pair_name(pair)} takes a real-time factor of {cost:.2g}"
                    break
            found.append(self._judge(pair, case))
            if found[-1].serves:
                break
        if not found:
            raise InputError(f"{scene.path.name}: no crank level is valid up to {scene.frequency:g} Hz; lower it")
        return found

    def _judge(self, pair: Pair, case: Case) -> _Judged:
        """Difference of a pair from the next higher pair, and true if it is small enough."""
        scene, name = self.scene, pair_name(pair)
        if next_pair(scene, pair) is None:
            return _Judged(pair, None, True, f"{name} is the top of the ladder, which others are compared with")
        free = (scene.crank is None, scene.bearings is None)
        above = next_pair(scene, pair, *free)
        if above is None:
            return _Judged(pair, 0.0, True, f"{name}: fixed by the scene, so its model error is not judged")
        error = largest(self.measured.worst(case, self.at(case, above), self.speeds))
        text = f"{name} is {percent(error)} from {pair_name(above)}"
        further = next_pair(scene, above, *free)
        if above[0] != SOLID and further is not None and error <= MODEL_SHARE * scene.accuracy:
            error = max(error, largest(self.measured.worst(case, self.at(case, further), self.speeds)))
            text += f" and at most {percent(error)} from {pair_name(further)}"
        return _Judged(pair, error, error <= MODEL_SHARE * scene.accuracy, text)

    # ------------------------------------------------------------------ method, step, modes

    def _method(self, chosen: _Judged, limit: float | None = None) -> Case:
        """Case of the cheapest integrator and step with which numerical and model error are within the accuracy."""
        scene, pair = self.scene, chosen.pair
        accuracy, model = scene.accuracy, min(chosen.model or 0.0, scene.accuracy)
        # The numerical error may take what the model error leaves of the accuracy.
        room = min(NUMERICAL_SHARE * accuracy, math.sqrt(max(accuracy**2 - model**2, (0.1 * accuracy) ** 2)))
        allowed = limit or room
        if scene.integrator is not None and scene.step is not None:
            return self.model.case(*pair, scene.integrator, scene.step)
        found, tried = list[tuple[float, Case]](), self._methods(pair, allowed)
        for name, steps in tried.items():
            for step in steps:
                case = self.model.case(*pair, name, step)
                if self._numerical(case, allowed) <= allowed:
                    found.append((self.measured.cost(case, self.speeds), case))
                    break
        if not found:
            ends = (self.model.case(*pair, name, steps[-1]) for name, steps in tried.items())
            finest = min(self._numerical(case, math.inf) for case in ends)
            raise InputError(
                f"{scene.path.name}: accuracy {scene.accuracy:g} cannot be reached at {pair_name(pair)}: the least "
                f"numerical error, at the finest step, is {finest:.2g}; the nearest valid accuracy is "
                f"{_round_up(finest / NUMERICAL_SHARE)}"
            )
        return min(found, key=lambda entry: entry[0])[1]

    def _methods(self, pair: Pair, allowed: float) -> dict[str, list[float]]:
        """Integrators with their steps (rad) to try, the longest first, as the scene leaves them open.

        Films solved online are expensive, so their steps begin at the longest one that is promising on the lowest film
        level. Steps that do not resolve the frequency are shortened until they do.
        """
        scene = self.scene
        if scene.integrator is not None:
            tried = {scene.integrator: list(LONE_STEPS)}
        elif dearest(pair[1]):
            tried = {name: list(steps) for name, steps in ELASTIC_METHODS.items()}
        else:
            tried = {name: list(steps) for name, steps in METHODS.items()}
            tried.setdefault(bearing_law(pair[1]).integrator, list(LONE_STEPS))
        if scene.step is not None:
            return {name: [scene.step] for name in tried}
        short = {
            name: list(dict.fromkeys(min(math.radians(deg), self.longest) for deg in steps))
            for name, steps in tried.items()
        }
        dear = bearing_law(pair[1]).cost == DEAR and scene.integrator is None
        return self._hopeful((pair[0], film(scene)), short, HOPEFUL * allowed) if dear else short

    def _hopeful(self, pair: Pair, tried: dict[str, list[float]], most: float) -> dict[str, list[float]]:
        """Steps (rad) of each integrator, the longest first, whose numerical error on a cheap pair is at most ``most``.

        The error is measured at the first of the plan's speeds. Integrators without such a step are left out; where no
        integrator has one the finest step of each remains.
        """
        found = dict[str, list[float]]()
        for name, steps in tried.items():
            for k, step in enumerate(steps):
                if self._numerical(self.model.case(*pair, name, step), most, 1) <= most:
                    found[name] = steps[k:]
                    break
        return found or {name: steps[-1:] for name, steps in tried.items()}

    def _numerical(self, case: Case, enough: float, speeds: int | None = None) -> float:
        """Numerical error of a case, by comparison with half its step, at a plan's first ``speeds`` speeds, or at all.

        Once a speed shows more than ``enough`` the others are not measured.
        """
        error = 0.0
        for speed in self.speeds[:speeds]:
            error = max(error, largest(self.measured.worst(case, self.model.refined(case), (speed,))))
            if error > enough:
                break
        return error

    def _modes(self, case: Case) -> tuple[Case, str]:
        """Case with the smallest sufficient number of modes of the solid crank, and the reason."""
        scene, full = self.scene, self.model.own_cutoff
        if case.crank != SOLID:
            return case, f"modes: all that crank level '{case.crank}' has"
        if scene.cutoff is not None:
            return case, f"modes: up to {full:g} Hz, fixed by the scene"
        if scene.stress:
            return case, f"modes: all up to {full:g} Hz, stresses take every one"
        for share in CUTOFFS:
            cutoff = share * scene.frequency
            if cutoff >= full:
                break
            fewer = replace(case, cutoff=cutoff)
            change = largest(self.measured.worst(fewer, case, self.speeds))
            if change <= MODE_SHARE * scene.accuracy:
                dropped = self.model.assembly(case).body.n_modes - self.model.assembly(fewer).body.n_modes
                return fewer, f"modes: up to {cutoff:g} Hz; {dropped} more change the outputs by {percent(change)}"
        allowed = percent(MODE_SHARE * scene.accuracy)
        return case, f"modes: all up to {full:g} Hz; fewer change the outputs by more than {allowed}"

    # ------------------------------------------------------------------ budget and figures

    def _within_budget(self, judged: list[_Judged], wanted: tuple[_Judged, Case, float]) -> tuple[_Judged, Case]:
        """Finest pair of levels within the time budget, or else the cheapest pair."""
        budget = self.scene.budget or math.inf
        self.too_dear = self.too_dear or f"{pair_name(wanted[0].pair)} takes a real-time factor of {wanted[2]:.2g}"
        options = [wanted]
        for one in reversed(judged):
            try:
                case = self._method(one, limit=NUMERICAL_SHARE * max(self.scene.accuracy, one.model or 0.0))
            except InputError:
                continue
            options.append((one, case, self.measured.cost(case, self.speeds)))
            if options[-1][2] <= budget:
                break
        chosen, case, _ = min(options, key=lambda option: max(option[2], budget))
        return chosen, case

    def _figures(self, chosen: _Judged, case: Case, judged: list[_Judged], modes_text: str) -> Plan:
        """Plan with its errors, measured at every speed if that does not take long."""
        scene, above = self.scene, self.above(case)
        cost = self.measured.cost(case, self.speeds)
        compared = above if chosen.charted is None or self.compare else None
        above_cost = None if compared is None else self.measured.cost(compared, self.speeds)
        simulated = sum(4.0 * math.pi / v for v in scene.speeds) * (scene.cycles or SETTLED_CYCLES)
        seconds = simulated * (3.0 * cost + (above_cost or 0.0))
        speeds = scene.speeds if seconds <= LONGEST_MEASUREMENT else self.speeds
        numerical = self.measured.worst(case, self.model.refined(case), speeds)
        model = chosen.charted if compared is None else self.measured.worst(case, compared, speeds)
        errors = Errors(numerical, model, np.nan_to_num(self.measured.settling(case, speeds)))
        total, charted = largest(errors.total), chosen.charted is not None
        if charted:
            total = math.hypot(largest(replace(errors, model=None).total), chosen.model or 0.0)
        modes = self.model.assembly(case).body.n_modes
        result = Plan(
            scene, case, modes, errors, self.measured.cost(case, speeds),
            self.model.refined(above or case), above_cost, (),
            within_accuracy=total <= scene.accuracy,
            within_budget=scene.budget is None or cost <= scene.budget,
            total_error=total if charted else None,
            against=self.known.against if self.known is not None and charted else "",
        )  # fmt: skip
        return replace(result, reasons=self._reasons(result, chosen, judged, modes_text, speeds))

    def _reasons(
        self, made: Plan, chosen: _Judged, judged: list[_Judged], modes_text: str, speeds: tuple[float, ...]
    ) -> tuple[str, ...]:
        """Reasons of the plan, one line for each of its parts."""
        scene, case = self.scene, made.case
        lines = []
        for kind, level, fixed in (("crank", case.crank, scene.crank), ("bearings", case.bearings, scene.bearings)):
            if fixed is not None:
                lines.append(f"{kind} {level}: fixed by the scene")
                continue
            if chosen.charted is not None:
                lines.append(f"{kind} {level}: {chosen.text}")
                continue
            lower = [one.text for one in judged if one.pair != chosen.pair and not one.serves]
            reason = chosen.text
            if kind == "crank":
                lower = [one.text for one in judged if one.pair[0] != level and not one.serves]
                reason = "the lowest that answers the outputs" if not lower else ""
            else:
                lower = [one.text for one in judged if one.pair[0] == case.crank and one.pair[1] != level]
            lines.append(f"{kind} {level}: " + "; ".join(part for part in (*lower, reason) if part))
        moves = "the outputs need its motion" if scene.block == "flexible" else "no output needs its motion"
        lines.append(f"block {scene.block}: {moves}")
        lines += [] if self.known is None else self.known.shortfall(scene.accuracy)
        lines.append(modes_text)
        lines.append(
            f"{case.integrator} at {math.degrees(case.step):g} deg: the cheapest tried whose numerical error leaves "
            f"room for the model's; half the step changes the outputs by {percent(largest(made.errors.numerical))}"
        )
        if len(speeds) < len(scene.speeds):
            rpm = ", ".join(f"{v / RPM:.0f}" for v in speeds)
            lines.append(f"errors measured at {rpm} of {len(scene.speeds)} speeds")
        if not made.within_accuracy:
            by = " by what the scene fixes" if scene.crank is not None or scene.bearings is not None else ""
            lines.append(
                f"accuracy missed{by}: {percent(made.predicted_error)} is predicted, "
                f"{made.predicted_error / scene.accuracy:.2g} times the {percent(scene.accuracy)} of the scene"
            )
        open_ended = scene.bearings is None and scene.budget is None
        if not made.within_accuracy and open_ended and dearest(made.next.levels[1]):
            lines.append(
                f"bearings {made.next.levels[1]}: far dearer, so taken only if the scene sets a budget or names them"
            )
        if self.too_dear:
            lines.append(f"no dearer levels within the budget of {scene.budget:g}: {self.too_dear}")
        if scene.budget is not None and not made.within_budget:
            lines.append(
                f"budget missed: real-time factor {made.real_time_factor:.2g}, "
                f"{made.real_time_factor / scene.budget:.2g} times the {scene.budget:g} of the scene"
            )
        return tuple(lines)


def _round_up(value: float) -> str:
    """Text of the smallest number with one significant digit that is not below ``value``."""
    if not math.isfinite(value):
        return "not known: no step runs"
    scale = 10.0 ** math.floor(math.log10(value))
    return f"{math.ceil(value / scale) * scale:.0e}"
