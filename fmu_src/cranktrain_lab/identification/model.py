"""Computed orders, frequencies, decays and shapes for sought values, as counterparts of measured data.

There are three levels. ``linear`` is the run-up of :mod:`cranktrain_lab.variants.torsional`, all speeds and orders at
once. ``harmonic-balance`` uses the rods' exact torques and the damper's law. ``time`` runs a crank of any level to its
steady cycle at each speed. The levels above the first are evaluated only a few times, see
:mod:`cranktrain_lab.identification.ladder`.

Modes are those of the cranktrain with mean rods, free to turn, without its drive line, as in
:mod:`cranktrain.structure.crank.modal`.
"""

import math
import warnings
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import eigh

from cranktrain.core.errors import InputError, SolverError
from cranktrain.core.types import Array, ComplexArray, Progress
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.arrays import structural_damping
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.model import Engine
from cranktrain.results.run_up.run_up import FLYWHEEL, TORSION
from cranktrain.structure.assembly import Assembly, assemble
from cranktrain.structure.crank.modal import cranktrain_matrices
from cranktrain.studies.run_up.steady import CycleStart, Job, SteadyRuns
from cranktrain.studies.torsion.damped_modes import damped_modes, with_ring
from cranktrain.studies.torsion.damper_link import DamperLink
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, HIGHEST_ORDER, SolvedOrders, frequency_run_up
from cranktrain.studies.torsion.shaft_orders import ShaftOrders
from cranktrain_lab.identification.bending import Bending
from cranktrain_lab.identification.data import FREQUENCY, RATIO, Data, Scalar, Shape, Strand
from cranktrain_lab.identification.parameters import CRANK, LOAD, SCALE, ZERO, Sought, engine_with
from cranktrain_lab.identification.tables import LEVELS, TWIST
from cranktrain_lab.variants.models import torsional_model
from cranktrain_lab.variants.study import Levels
from cranktrain_lab.variants.torsional import against_frame, structure_of, variant_orders

LINEAR, BALANCE, TIME = LEVELS
_TWISTS = slice(5, None)
"""Coordinates of a torsional crank in a model's matrices: rotation about the axis, and elastic modes."""
_KEPT = 6
"""Number of computed cranks kept for reuse. Derivatives by values of damper or load use the same crank."""
_FEWEST_ORDERS = 12.0
"""Order up to which the linear level computes at least. Higher orders hardly twist the damper or affect lower ones."""
_ROUNDS = 6
"""Largest number of iterations of a natural frequency with a damper whose stiffness depends on the frequency."""


@dataclass(frozen=True)
class Answers:
    """Computed counterparts of the data: complex orders, frequencies and damping ratios, shapes."""

    strands: tuple[ComplexArray, ...]
    scalars: Array
    shapes: tuple[Array, ...]


class TorsionalModel:
    """Model of a torsional crank as a function of the sought values.

    Parameters
    ----------
    engine : engine with the values that are not sought; added bodies and connections are left out
    data, sought : measured data, and sought parameters
    load : fraction of the full-load burn if the load is not sought
    damper : True if the damper is fitted
    inherit : True if the crank takes the damping of the level above
    say : called with each stage of making the crank
    bending : model of the bending crank for targets and mount frequencies

    Raises
    ------
    InputError
        a parameter that shapes the finite elements of the crank, an engine without linear run-up
    """

    def __init__(
        self, engine: Engine, data: Data, sought: Sequence[Sought], load: float, damper: bool, inherit: bool,
        say: Progress = lambda stage: None, bending: Bending | None = None,
    ) -> None:  # fmt: skip
        self._bending = bending
        self.engine, self.data, self.sought, self._load = engine.without_additions, data, tuple(sought), load
        self.damper, self._inherit = damper, inherit
        self._place(data)
        speeds = self.speeds
        varied = {one.key: (one.low, one.high, one.start) for one in sought if one.in_file}
        ends = tuple(speeds[[0, -1]].tolist()) if speeds.size > 1 else self.engine.speeds
        try:
            levels = Levels(damper=damper, inherit=inherit)
            self._variants = torsional_model(self.engine, varied, ends, levels, load, say)
        except InputError as error:
            raise InputError(str(error).replace("vary.'", "parameters.'")) from None
        self.evaluations = 0
        self._bodies: list[tuple[Any, Any]] = []
        self._structures: list[tuple[Any, ShaftOrders]] = []

    def _place(self, data: Data) -> None:
        """Set all speeds of the data, and the highest order of the linear level."""
        self.speeds: Array = np.unique(np.concatenate([np.zeros(0), *(one.speeds for one in data.strands)]))
        self._rows = [np.searchsorted(self.speeds, one.speeds) for one in data.strands]
        self._highest = max([_FEWEST_ORDERS, *(one.order for one in data.strands)])

    def beside(self, data: Data) -> "TorsionalModel":
        """Return a copy of the model for other data, without the bending crank."""
        other = copy(self)
        other.data, other._bending = data, None
        if other._highest < max([0.0, *(one.order for one in data.strands)]):
            other._structures = []
        other._place(data)
        return other

    def seeking(self, sought: Sequence[Sought]) -> "TorsionalModel":
        """Return a copy of the model for other parameters. Parameters of the engine file must be among the model's."""
        other = copy(self)
        other.sought = tuple(sought)
        return other

    def check(self, values: Array) -> Engine:
        """Return the checked engine of sought values (p,), SI; raises ``InputError`` for inconsistent values."""
        engine = self.engine_of(values)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            check_engine(engine)
        return engine

    def engine_of(self, values: Array) -> Engine:
        """Return the engine with sought values (p,), SI, without checks. Each value must be within its valid range."""
        return engine_with(self.engine, self.sought, values.tolist())

    def assembly(self, values: Array) -> Assembly:
        """Return the torsional crank of sought values; raises ``InputError``."""
        named, engine = self._named(values), self.engine_of(values)
        damper, ratios = engine.damper, engine.damping.torsional_ratios
        # Only the housing of the damper affects the crank; damping ratios are applied later.
        key = (
            replace(engine, damper=None, damping=replace(engine.damping, torsional_ratios=ratios[:0])), len(ratios),
            None if damper is None else (damper.housing_inertia, damper.mass),
        )  # fmt: skip
        body = next((kept for made_from, kept in self._bodies if made_from == key), None)
        made = self._variants.assembly_of(engine, named.get(LOAD, self._load), body)
        if body is None:
            self._bodies = [(key, made.body), *self._bodies[: _KEPT - 1]]
        return made if CRANK not in named else replace(made, body=_stiffer(made.body, named[CRANK]))

    def _structure(self, made: Assembly) -> ShaftOrders:
        """Return an assembly's linear structure, made from the structure for another load, viscosity or damping."""
        engine, damper, body = made.engine, made.engine.damper, made.body
        key = (
            replace(engine, damper=None, damping=replace(engine.damping, torsional_ratios=())),
            None if damper is None else damper.ring_inertia, body.shapes.shape,
        )  # fmt: skip
        found = next((kept for made_from, kept in self._structures if made_from == key), None)
        if found is None:
            found = structure_of(made, self._highest)
            self._structures = [(key, found), *self._structures[: _KEPT - 1]]
        squares, damping = body.omega[_TWISTS] ** 2, structural_damping(engine, body)[_TWISTS]
        return found.with_crank(squares, damping).at_load(made.settings.gas_load)

    def answers(self, values: Array) -> Answers:
        """Return computed data of the linear level for sought values (p,), SI; ``InputError``, ``SolverError``."""
        self.evaluations += 1
        if not self.data.of_pieces:
            return Answers((), np.zeros(0), ())
        made, named = self.assembly(values), self._named(values)
        strands = tuple(
            self._measured(one, self._orders(one, solved)[rows], named)
            for solved in ([variant_orders(made, self.speeds, self._structure(made))] if self.data.strands else [])
            for one, rows in zip(self.data.strands, self._rows, strict=True)
        )
        return Answers(strands, self._scalars(made, values), tuple(shape_of(made, one) for one in self.data.shapes))

    def balanced(self, values: Array) -> tuple[ComplexArray, ...]:
        """Return orders of each strand by harmonic balance; raises ``InputError``, ``SolverError``."""
        made, named = self.assembly(values), self._named(values)
        orders = sorted({one.order for one in self.data.strands})
        found = frequency_run_up(made.engine, made.body, made.settings, self.speeds, orders, HARMONIC_BALANCE)
        return tuple(
            self._measured(one, _of_run_up(one, found.amplitudes, orders)[rows], named)
            for one, rows in zip(self.data.strands, self._rows, strict=True)
        )

    def in_time(
        self, values: Array, crank: str, settle: float, tell: Progress = lambda stage: None,
        cycles: dict[float, CycleStart] | None = None,
    ) -> tuple[ComplexArray, ...]:  # fmt: skip
        """Return orders of each strand by runs of a crank of any level to its steady cycle at each speed.

        ``cycles`` by speed, from a run-up with other values, are the initial states; they are replaced by new ones.
        """
        named, made = self._named(values), self.made_in_time(values, crank)
        wanted = {one.output for one in self.data.strands}
        outputs = sorted(wanted - {TWIST} | ({TORSION, FLYWHEEL} if TWIST in wanted else set()))
        runs = SteadyRuns(Job(made, None, settle, HIGHEST_ORDER, tuple(outputs)))
        found: dict[str, list[ComplexArray]] = {name: [] for name in outputs}
        starts: list[CycleStart] = []
        cycles = {} if cycles is None else cycles
        for speed in self.speeds.tolist():
            tell(f"{crank} crank in time at {speed / RPM:.0f} rev/min")
            steady = runs.at(speed, [cycles[speed]] if speed in cycles else starts[-2:][::-1])
            starts.append(steady.start)
            cycles[speed] = steady.start
            for name in outputs:
                found[name].append(steady.amplitudes[name])
        whole = {name: np.array(rows) for name, rows in found.items()}
        orders = [0.5 * k for k in range(1, round(2.0 * HIGHEST_ORDER) + 1)]
        return tuple(
            self._measured(one, _of_run_up(one, whole, orders)[rows], named)
            for one, rows in zip(self.data.strands, self._rows, strict=True)
        )

    def made_in_time(self, values: Array, crank: str, bearings: str = "auto") -> Assembly:
        """Return the assembly of a crank of any level with sought values (p,), SI, for runs in time; ``InputError``."""
        named, engine = self._named(values), self.check(values)
        damper, load = "fitted" if self.damper else "none", named.get(LOAD, self._load)
        settings = Settings(crank=crank, bearings=bearings, damper=damper, gas_load=load)
        made = assemble(engine, settings, inherit=self._inherit)
        return made if CRANK not in named else replace(made, body=_stiffer(made.body, named[CRANK]))

    def _named(self, values: Array) -> dict[str, float]:
        """Return sought values that do not belong to the engine file, by key."""
        return {one.key: float(v) for one, v in zip(self.sought, values, strict=True) if not one.in_file}

    def _measured(self, one: Strand, values: ComplexArray, named: dict[str, float]) -> ComplexArray:
        """Return a computed order as its data set measures it, with the encoder's zero and the scale factor applied."""
        turn, factor = named.get(f"{ZERO}.{one.name}", 0.0), named.get(f"{SCALE}.{one.name}", 1.0)
        return np.asarray(factor * np.exp(1j * one.order * turn) * values)

    def _orders(self, one: Strand, solved: SolvedOrders) -> ComplexArray:
        """Return one order of an output at all s speeds, (s,), from solved orders."""
        structure, at = solved.structure, round(2.0 * one.order)
        _, pulley, _, flywheel = structure.ends_rows()
        if one.output == TWIST:
            return np.asarray((solved.motion @ (pulley - flywheel))[:, at])
        if one.output in (TORSION, FLYWHEEL):
            return against_frame(solved, self.speeds, pulley if one.output == TORSION else flywheel)[:, at]
        twists = solved.motion @ structure.shaft_rows().T
        torques = structure.shaft_torques(self.speeds, twists, structure.friction(self.speeds))
        names = [f"shaft[{name}].torque" for name in structure.shafts]
        return np.asarray(torques[:, at, names.index(one.output)])

    def numbers(self, values: Array) -> Array:
        """Return the frequency (Hz) or damping ratio for each measured number; ``InputError``, ``SolverError``."""
        return self._scalars(self.assembly(values), values)

    def _scalars(self, made: Assembly, values: Array) -> Array:
        """Return the frequency (Hz) or damping ratio for each measured number, bending crank last."""
        found = []
        for one in self.data.scalars:
            if one.kind in (FREQUENCY, RATIO):
                found.append(mode_of(made, one)[0 if one.kind == FREQUENCY else 1])
        bent = [] if self._bending is None else self._bending.frequencies(self.engine_of(values)).tolist()
        return np.array([*found, *bent])


def _of_run_up(one: Strand, amplitudes: Any, orders: Sequence[float]) -> ComplexArray:
    """Return one order of an output at all speeds, (s,), from a run-up's amplitudes (s, o)."""
    at = list(orders).index(one.order)
    if one.output == TWIST:
        return np.asarray(amplitudes[TORSION][:, at] - amplitudes[FLYWHEEL][:, at])
    return np.asarray(amplitudes[one.output][:, at])


def _stiffer(body: Any, factor: float) -> Any:
    """Return a crank that is stiffer by a factor, with unchanged masses and damping ratios."""
    root = math.sqrt(factor)
    return replace(body, omega=body.omega * root, damping=body.damping * root)


def mode_of(made: Assembly, one: Scalar) -> tuple[float, float]:
    """Return frequency (Hz) and damping ratio of a torsional mode; raises ``SolverError`` if there are fewer modes."""
    stiffness, damping, mass = _matrices(made)
    found = damped_modes(stiffness, damping, mass)
    if one.damper:
        found = _with_ring(made, one, (stiffness, damping, mass))
    if found.hz.size < one.number:
        raise SolverError(f"'{one.name}': the model has {found.hz.size} torsional modes, no number {one.number}")
    k = one.number - 1
    return float(np.abs(found.values[k]) / (2.0 * math.pi)), float(found.damping_ratios[k])


def _matrices(made: Assembly) -> tuple[Array, Array, Array]:
    """Return K, C, M (n, n) of the cranktrain's torsion, without the damper's ring."""
    stiffness, mass = (matrix[_TWISTS, _TWISTS] for matrix in cranktrain_matrices(made.engine, made.body))
    return stiffness, np.diag(structural_damping(made.engine, made.body)[_TWISTS]), mass


def _with_ring(made: Assembly, one: Scalar, matrices: tuple[Array, Array, Array]) -> Any:
    """Return modes with the damper's ring. The damper's stiffness is iterated to match the mode's frequency."""
    if made.settings.damper != "fitted" or made.engine.damper is None:
        raise InputError(f"'{one.name}': asks for a mode with the damper, which is not fitted; set damper = true")
    stiffness, damping, mass = matrices
    hub, speed = made.body.shapes[made.body.index("pulley"), 5, _TWISTS], one.speed or made.engine.speeds[1]
    hz, found = 2.0 * math.pi * one.value if one.kind == FREQUENCY else 0.0, None
    hz = hz or float(2.0 * math.pi * damped_modes(stiffness, damping, mass).hz[0])
    for _ in range(_ROUNDS):
        law = DamperLink(made.engine, made.settings, np.array([speed]), np.array([[0.0, hz]])).stiffness[0, 1]
        k, c, m = with_ring(stiffness, mass, hub, made.engine.damper.ring_inertia, law.real, law.imag / hz)
        found = damped_modes(k, c + np.pad(damping, (0, 1)), m)
        if found.hz.size < one.number:
            break
        before, hz = hz, float(np.abs(found.values[one.number - 1]))
        if abs(hz - before) < 1e-9 * hz:
            break
    return found


def shape_of(made: Assembly, one: Shape) -> Array:
    """Return a torsional mode's shape at the measured positions, of unit length and with the measured sign."""
    stiffness, _, mass = _matrices(made)
    squares, shapes = eigh(stiffness, mass)
    elastic = np.flatnonzero(squares > 1e-6 * squares[-1])
    if elastic.size < one.number:
        raise SolverError(f"'{one.name}': the model has {elastic.size} torsional modes, no number {one.number}")
    rows = made.body.shapes[[made.body.index(place) for place in one.places], 5, _TWISTS]
    found = rows @ shapes[:, elastic[one.number - 1]]
    found = found / np.linalg.norm(found)
    return np.asarray(found * (1.0 if found @ one.values >= 0.0 else -1.0))
