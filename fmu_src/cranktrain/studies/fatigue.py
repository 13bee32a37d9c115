"""Fatigue of a crankshaft at constant speeds, and its assessment by IACS UR M53: the verb ``fatigue``."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from cranktrain.core.errors import InputError, nearest
from cranktrain.dynamics.simulation import Simulation, fitted_engine
from cranktrain.engine.limits import CrankStrength
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import Gas
from cranktrain.results.strength.assessment import RuleRow, judged, nominal_histories, rule_rows
from cranktrain.results.strength.critical_plane import findley_judgement
from cranktrain.results.strength.cut_loads import crank_loads, unbalanced_share
from cranktrain.results.strength.fatigue import FilletHistory, Judgement, haigh_judgement
from cranktrain.results.strength.fillet_histories import fillet_runs
from cranktrain.results.strength.iacs_m53 import ACCEPTABLE, ThrowShape, fillet_factors, throw_shape
from cranktrain.results.strength.recorded_cycle import RecordedCycle, recorded_cycle
from cranktrain.results.strength.throw_loads import single_throws, whole_crank
from cranktrain.structure.assembly import assemble
from cranktrain.structure.crank.reduction import reduced_crankshaft
from cranktrain.structure.stress.sub_model import FilletModes
from cranktrain.studies.constant_speed import Request
from cranktrain.studies.stressed_run import check_stressed

CRITERIA: dict[str, Callable[[FilletHistory, CrankStrength], Judgement]] = {
    "haigh": haigh_judgement,
    "findley": findley_judgement,
}
"""Names of the criteria for the safety of a place."""


class AtSpeed(NamedTuple):
    """Results at one speed, rev/min; ``unbalanced`` as of :func:`unbalanced_share`.

    ``nominal`` are judgements of all places by nominal stress and the rule's factors, ``fine`` of those that have
    sub-models, by name.
    """

    speed_rpm: float
    nominal: list[Judgement]
    fine: dict[str, Judgement]
    rule: list[RuleRow]
    bending: str
    unbalanced: float
    settled: str


@dataclass(frozen=True)
class FatigueReport:
    """Safety of all places of a crankshaft over the speeds that were run.

    Attributes
    ----------
    engine : the engine
    strength : of its crankshaft
    criterion : one of ``CRITERIA``
    speeds : results at each speed
    interrupted : True if an interrupt ended the runs, so that speeds are missing
    """

    engine: Engine
    strength: CrankStrength
    criterion: str
    speeds: list[AtSpeed] = field(default_factory=list)
    interrupted: bool = False

    @property
    def places(self) -> list[tuple[Judgement, float]]:
        """Least safe judgement of each place, from its sub-model if it has one, and the speed, rev/min."""
        return [
            min(
                ((at.fine.get(one.name, at.nominal[k]), at.speed_rpm) for at in self.speeds),
                key=lambda pair: pair[0].safety_factor,
            )
            for k, one in enumerate(self.speeds[0].nominal)
        ]

    @property
    def rule(self) -> list[tuple[RuleRow, float]]:
        """Least acceptability of each place by the rule, and the speed, rev/min."""
        return [
            min(((at.rule[k], at.speed_rpm) for at in self.speeds), key=lambda pair: pair[0].acceptability)
            for k in range(len(self.speeds[0].rule))
        ]

    @property
    def throws(self) -> list[ThrowShape]:
        """Dimensions of the throw at each pin, as used in the rule's formulas."""
        c = self.engine.crankshaft
        return [throw_shape(c, pin) for pin in range(1, len(c.throw_angles) + 1)]

    @property
    def outside(self) -> tuple[str, ...]:
        """Dimensions outside the range of the rule's factors, each once."""
        return tuple(dict.fromkeys(text for throw in self.throws for text in throw.outside))

    @property
    def accepted(self) -> bool | None:
        """True if the rule accepts the crankshaft at these speeds; None outside the range of its factors."""
        if self.outside:
            return None
        return all(row.acceptability >= ACCEPTABLE for row, _ in self.rule)

    def as_dict(self) -> dict[str, Any]:
        """Dictionary that ``cranktrain fatigue --json`` prints; keys end with the unit."""
        throws, fine = self.throws, self.speeds[0].fine
        return {
            "fillets": [
                {
                    "name": one.name,
                    "safety_factor": one.safety_factor,
                    "amplitude_mpa": 1e-6 * one.amplitude,
                    "mean_mpa": 1e-6 * one.mean,
                    "converged": one.converged,
                    "speed_rpm": speed,
                    "by": "sub-model" if one.name in fine else "rule's factors",
                    "safety_factor_by_rule_factors": min(at.nominal[k].safety_factor for at in self.speeds),
                }
                for k, (one, speed) in enumerate(self.places)
            ],
            "criterion": self.criterion,
            "rule": {
                "name": "IACS UR M53",
                "places": [
                    {
                        "name": row.name,
                        **{
                            f"{key}_mpa": 1e-6 * getattr(row, key)
                            for key in ("bending", "shear", "equivalent", "strength")
                        },
                        "acceptability": row.acceptability,
                        "speed_rpm": speed,
                    }
                    for row, speed in self.rule
                ],
                "required": ACCEPTABLE,
                "accepted": self.accepted,
                "throws": [{"factors": fillet_factors(throw)._asdict(), "ratios": throw.ratios} for throw in throws],
                "outside": list(self.outside),
            },
            "speeds": [
                {
                    "rpm": at.speed_rpm,
                    "bending": at.bending,
                    "unbalanced_relative": at.unbalanced,
                    "settling": at.settled,
                }
                for at in self.speeds
            ],
            "interrupted": self.interrupted,
        }


def crank_strength(engine: Engine) -> CrankStrength:
    """Strength of the engine's crankshaft; ``InputError`` if the engine file does not state it."""
    if engine.crank_strength is None:
        raise InputError(
            f"engine '{engine.name}' has no [crank_strength], which fatigue needs: add the keys tensile_strength, "
            "forming and roughness as in engine/data/diesel_i6.toml"
        )
    return engine.crank_strength


def fatigue(
    engine: Engine,
    request: Request,
    speeds_rpm: Sequence[float],
    criterion: str = "haigh",
    say: Callable[[str], None] = lambda text: None,
    progress: Callable[[float], None] = lambda share: None,
    fillets: Sequence[FilletModes] = (),
    gas: Gas | None = None,
) -> FatigueReport:
    """Run an engine at each speed until its outputs repeat, and judge every fillet and oil bore of its crankshaft.

    After an interrupt the result contains the finished speeds. Raises ``InputError`` before any work for a missing
    strength, an unknown criterion, or a run that is not possible, and ``SolverError`` for a step that fails.

    Parameters
    ----------
    engine : with its table ``[crank_strength]``
    request : levels and other choices of the runs; its speed does not count
    speeds_rpm : rev/min
    criterion : ``haigh`` or ``findley``
    fillets : places that are judged by the stress of their sub-models, see
        :func:`cranktrain.structure.stress.kept_fillets.throw_fillets`; the others by the rule's factors
    gas : measured pressures of the request, if they have been read already
    """
    strength = crank_strength(engine)
    if criterion not in CRITERIA:
        raise InputError(f"fatigue criterion '{criterion}' does not exist; {nearest(criterion, CRITERIA)}")
    if not speeds_rpm:
        raise InputError("fatigue needs a speed; give one or more in rev/min")
    runs = [replace(request, speed_rpm=speed) for speed in speeds_rpm]
    for run in runs:
        settings = run.settings(engine)
    if settings.boundary != "speed":
        raise InputError("fatigue needs cycles at a given speed; leave the load torque out")
    if fillets:
        check_stressed(request, settings)
    gas = request.gas(engine, speeds_rpm=speeds_rpm) if gas is None else gas
    for run in runs:
        run.tell_doubts(engine, gas)
    made = assemble(engine, settings, say=say, crank_mesh=request.mesh, block_mesh=request.block_mesh)
    report = FatigueReport(engine, strength, criterion)
    for k, run in enumerate(runs):

        def told(share: float, done: int = k) -> None:
            progress((done + share) / len(runs))

        def said(text: str, speed: float = run.speed_rpm) -> None:
            say(f"{speed:g} rev/min: {text}")

        simulation = Simulation(engine, made.body, made.settings, gas, made.parts)
        simulation.inputs[0] = run.speed
        try:
            cycle = recorded_cycle(simulation, fitted_engine(engine, made.settings), run.settle, told, said)
        except KeyboardInterrupt:
            if not report.speeds:
                raise
            return replace(report, interrupted=True)
        report.speeds.append(_judged(report, cycle, run.speed_rpm, fillets))
    return report


def _judged(report: FatigueReport, cycle: RecordedCycle, speed_rpm: float, fillets: Sequence[FilletModes]) -> AtSpeed:
    """Judge all places in the recorded cycle of one speed."""
    c, throws = report.engine.crankshaft, report.throws
    loads = crank_loads(cycle)
    webs, pins = single_throws(c, loads)
    rule = rule_rows(throws, report.strength, webs, pins)
    # Forces on journals locked on their axis are not known from a run, so each throw carries its own forces.
    if cycle.carried:
        webs, pins = whole_crank(c, loads)

    def judgements(histories: Iterable[FilletHistory]) -> list[Judgement]:
        known = [replace(one, converged=one.converged and cycle.settling.repeats > 0) for one in histories]
        return judged(known, report.strength, CRITERIA[report.criterion])

    fine: list[Judgement] = []
    if fillets:
        runs = fillet_runs(reduced_crankshaft(report.engine), cycle, fillets)
        fine = judgements(history for run in runs for history in run.histories(c))
    return AtSpeed(
        speed_rpm,
        judgements(nominal_histories(throws, cycle.angle, webs, pins)),
        {one.name: one for one in fine},
        rule,
        "crank" if cycle.carried else "single throws",
        unbalanced_share(cycle),
        cycle.settling.text,
    )
