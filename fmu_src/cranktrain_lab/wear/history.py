"""Wear of the main bearings over time, integrated explicitly along a schedule of speeds and loads.

With the present shells (:mod:`cranktrain_lab.wear.shells`) the engine runs some cycles. The last cycle gives the mean
rate of wear ∂w/∂t (φ, ζ). The state is then advanced by Euler's method,

    w ← w + Δt ∂w/∂t,      Δt = a min(σ₀/max ∂w/∂t, 1/max |∂²w/∂t∂w|),

so no point wears by more than the fraction a of the roughness, and none beyond the depth at which its wear ends. The
first bound applies while edges touch the shell, the second when the surfaces separate. The error is of first order in
a. The worn volume is the sum of the increments, so it equals Archard's integral to rounding.

Wear has ended if no point would wear by more than ``SETTLED`` of the roughness before its contact is elastic. The rest
of the block is then skipped without cycles.

Each operating point has its own simulation, which continues from its last state, so its orbits adapt to the shells.
"""

import hashlib
import json
import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Parts, Simulation
from cranktrain.engine.levels import crank_level
from cranktrain.engine.model import Engine
from cranktrain.film.contact.wear import WearLaw
from cranktrain.store.hdf5 import WEAR, WEAR_REMEDY
from cranktrain.store.whole_file import check_place
from cranktrain.structure import assembly
from cranktrain_lab.wear.records import OVER_TIME, WearHistory, no_history
from cranktrain_lab.wear.schedule import HOUR, Block, block_at, same_until
from cranktrain_lab.wear.shells import Shells, Wear, WornFilms, new_shells

INCREMENT = 0.25
"""Default increment a: largest wear of a point in a time step, as a fraction of the roughness."""
SETTLED = 0.01
"""Remaining wear, as a fraction of the new surfaces' roughness, below which wear has ended."""
CYCLES, FIRST_CYCLES = 2, 4
"""Number of cycles of an increment (the last is evaluated), and of the first increment at an operating point."""
MOST = 5000
"""Largest number of time increments of a wear history."""


@dataclass(frozen=True)
class Choices:
    """Settings of a wear history.

    Attributes
    ----------
    law : wear law
    crank : fidelity level of a bending crank
    increment : increment a
    alike : True if all shells get the deepest profile of all, see :class:`cranktrain_lab.wear.shells.Shells`
    straight : True if new shells are straight; else they have the engine file's relief
    cycles : number of cycles of an increment
    """

    law: WearLaw = field(default_factory=WearLaw)
    crank: str = "solid"
    increment: float = INCREMENT
    alike: bool = False
    straight: bool = True
    cycles: int = CYCLES

    def __post_init__(self) -> None:
        if not 0.0 < self.increment <= 1.0:
            raise InputError(f"increment {self.increment:g} is not within 0 to 1 of the roughness; usual {INCREMENT:g}")
        if self.cycles < 1:
            raise InputError(f"cycles {self.cycles} of an increment: give one or more")


class Running:
    """Engine with worn shells at the operating points of a schedule."""

    def __init__(self, engine: Engine, choices: Choices, say: Callable[[str], None]) -> None:
        bearing = engine.plain_mains
        if not math.isfinite(bearing.hardness):
            raise InputError("run-in: Archard's wear needs the lining's hardness; give main_bearing.hardness")
        if not crank_level(choices.crank).bends:
            raise InputError(
                f"run-in: a crank at level '{choices.crank}' does not bend, so no edge touches; take solid or beam"
            )
        if choices.straight:
            engine = replace(engine, main_bearing=replace(bearing, relief_depth=0.0))
        self.engine, self.choices = engine, choices
        self.settings: Settings = assembly.checked(engine, Settings(crank=choices.crank, bearings="reynolds"))
        fitted = assembly.fitted_engine(engine, self.settings)
        self.body: ReducedBody = assembly.running_crank(fitted, choices.crank, say=say)
        self.points: dict[tuple[float, float], WornFilms] = {}

    def new_shells(self) -> Shells:
        """Return the engine's new shells."""
        return new_shells(self.engine.plain_mains, len(self.engine.plain_numbers), self.choices.alike)

    def wear(self, block: Block, shells: Shells) -> Wear:
        """Return the wear of one cycle at an operating point."""
        key, cycles = (block.speed, block.load), self.choices.cycles
        if key not in self.points:
            settings = replace(self.settings, gas_load=block.load)
            simulation = Simulation(self.engine, self.body, settings, parts=Parts())
            simulation.inputs[0] = block.speed
            simulation.initialize()
            self.points[key] = WornFilms(simulation, self.choices.law)
            cycles = max(cycles, FIRST_CYCLES)
        films = self.points[key]
        films.put(shells)
        return films.run(cycles)

    def increment(self, wear: Wear) -> float | None:
        """Return the longest time step (s) at these wear rates, or None if wear has ended."""
        sigma = self.engine.plain_mains.roughness
        rate, decrease = float(wear.rate.max()), float(wear.decrease.max())
        if rate == 0.0:
            return None
        left = np.divide(wear.rate, wear.decrease, out=np.zeros_like(wear.rate), where=wear.decrease > 0.0)
        if left.max() < SETTLED * sigma:
            return None
        return self.choices.increment * min(sigma / rate, 1.0 / decrease if decrease > 0.0 else math.inf)

    def worn(self, shells: Shells, wear: Wear, step: float) -> Shells:
        """Return the shells after a time step (s) of this wear."""
        law, bearing = self.choices.law, self.engine.plain_mains
        depths = step * wear.smoothing
        sigma = np.array([law.smoothed(bearing, float(s), float(d)) for s, d in zip(shells.sigma, depths, strict=True)])
        return replace(shells, worn=shells.worn + step * wear.rate, sigma=sigma)

    @property
    def digest(self) -> str:
        """Return a digest of all data that determine a history, except its schedule."""
        return hashlib.sha256(repr((self.engine, self.choices, self.body.digest)).encode()).hexdigest()


def wear_history(
    running: Running,
    blocks: Sequence[Block],
    hours: float | None = None,
    path: Path | None = None,
    say: Callable[[str], None] = lambda text: None,
    follow: Callable[[float], None] = lambda share: None,
) -> WearHistory:
    """Compute wear along a schedule, which repeats up to ``hours`` (None: once).

    With a ``path`` the history is written there after each increment. An existing file of the same engine, choices and
    schedule is continued.

    Raises
    ------
    InputError
        a file of another history, an empty schedule
    SolverError
        a cycle that fails; the file keeps the history before it
    """
    end = sum(block.duration for block in blocks) if hours is None else hours * HOUR
    if not blocks or not 0.0 < end < math.inf:
        raise InputError("run-in: the schedule takes no time; give --hours, or a schedule of hours and speeds")
    history = _begun(running, blocks, path)
    march = _March(running, blocks, end, history)
    for _ in range(MOST):
        row = march.advance()
        if row is None:
            break
        if path is not None:
            march.history.save(path)
        say(row)
        follow(min(march.time / end, 1.0))
    else:
        warnings.warn(
            f"run-in: {MOST} increments did not reach {end / HOUR:g} h; repeat the command to go on", stacklevel=2
        )
    return march.history


class _March:
    """Explicit time integration of a history up to a time, s."""

    def __init__(self, running: Running, blocks: Sequence[Block], end: float, history: WearHistory) -> None:
        self.running, self.blocks, self.end, self.history = running, blocks, end, history
        self.shells = replace(running.new_shells(), worn=history.worn)
        self.time, self.work = 0.0, np.zeros(len(history.bearings))
        self.wear: Wear | None = None
        self.calm: dict[Block, Array] = {}
        if history.time.size:
            self.time, self.work = float(history.time[-1]), history.contact_work[-1]
            self.shells = replace(self.shells, sigma=history.sigma[-1])

    @property
    def block(self) -> tuple[Block, float]:
        """Schedule block at the present time (at the end the last block), and the block's end time, s."""
        number, stop = block_at(self.blocks, min(self.time, self.end * (1.0 - 1e-9)))
        return self.blocks[number], stop

    def advance(self) -> str | None:
        """Add a row to the history. Return the row in words, or None at the end."""
        if self.time >= self.end * (1.0 - 1e-12) and self.history.time.size:
            return None
        block, stop = self.block
        if self.wear is None:
            self.wear = self.running.wear(block, self.shells)
            if not self.history.time.size:
                return self._record(block)
        step = self.running.increment(self.wear)
        if step is None:
            self.calm[block] = self.wear.work_rate
            self._pass_calmly(min(stop, self.end))
        else:
            self.calm.clear()
            step = min(step, stop - self.time, self.end - self.time)
            self.shells = self.running.worn(self.shells, self.wear, step)
            self.work, self.time = self.work + step * self.wear.work_rate, self.time + step
        block, _ = self.block
        self.wear = self.running.wear(block, self.shells)
        return self._record(block)

    def _pass_calmly(self, stop: float) -> None:
        """Skip time without wear: the rest of the present block, or all remaining time if no block causes wear."""
        while True:
            block, end = self.block
            if block not in self.calm or self.time >= stop:
                if self.time >= self.end or any(one not in self.calm for one in self.blocks):
                    return
                stop = self.end
                continue
            step = min(end, stop) - self.time
            self.work, self.time = self.work + step * self.calm[block], self.time + step

    def _record(self, block: Block) -> str:
        """Add a row of the present shells and cycle to the history. Return the row in words."""
        running, wear, shells = self.running, self.wear, self.shells
        assert wear is not None  # the cycle of this block has been run
        values = {
            "time": self.time, "speed": block.speed, "gas_load": block.load, "sigma": shells.sigma,
            "volume": shells.volumes(0.5 * running.engine.plain_mains.diameter), "contact_work": self.work,
            "profile": shells.profiles,
            **{name: getattr(wear, name) for name in OVER_TIME if hasattr(wear, name)},
        }  # fmt: skip
        rows: dict[str, Any] = {
            name: np.concatenate([getattr(self.history, name), np.asarray(values[name])[None]]) for name in OVER_TIME
        }
        settled = running.increment(wear) is None
        self.history = history = replace(self.history, worn=shells.worn, settled=settled, **rows)
        worst = int(history.least_gap[-1].argmin())
        return (
            f"{history.hours[-1]:.4g} h, {block.speed / RPM:.0f} rev/min: worn up to "
            f"{1e6 * history.deepest[-1].max():.2f} um, least gap {1e6 * history.least_gap[-1, worst]:.3f} um at "
            f"main[{history.bearings[worst]:.0f}]"
        )


def _begun(running: Running, blocks: Sequence[Block], path: Path | None) -> WearHistory:
    """Return the history in a file of equal engine and choices, or an empty history; ``InputError`` for other files."""
    shells, engine = running.new_shells(), running.engine
    attributes: dict[str, Any] = {
        "engine": engine.name, "crank": running.choices.crank, "digest": running.digest,
        **{f"law.{name}": value for name, value in vars(running.choices.law).items()},
        "increment": running.choices.increment, "schedule": json.dumps(blocks),
    }  # fmt: skip
    numbers = np.array([number + 1.0 for number in engine.plain_numbers])
    new = no_history(numbers, shells.zeta, shells.weight, shells.worn, attributes)
    if path is None:
        return new
    check_place(path, WEAR)
    if not path.is_file() or path.stat().st_size == 0:
        return new
    found = WearHistory.load_file(path)
    if found.attributes.get("digest") != attributes["digest"]:
        raise InputError(f"{path}: the wear of another engine, or with other choices; {WEAR_REMEDY}")
    before = [Block(*block) for block in json.loads(str(found.attributes["schedule"]))]
    if found.time.size and not same_until(before, blocks, float(found.time[-1])):
        raise InputError(
            f"{path}: its first {found.hours[-1]:.4g} h are of another schedule; give that one, or name another file"
        )
    return replace(found, attributes=attributes)
