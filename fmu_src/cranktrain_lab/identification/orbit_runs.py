"""Orbits of journals by runs in time, and their derivatives for the search.

Only a run in time gives the orbit of a journal in its film. A run to a steady cycle at one speed takes some tenths of a
second, so the search uses orbits z(u) linearised about the last estimate u₀,

    z(u) ≈ z(u₀) + Σ ∂z/∂u_k (u_k − u₀_k),

with derivatives by differences of steady cycles, each of which starts from the cycle of u₀. The fit of this line is a
Gauss-Newton step, which :mod:`cranktrain_lab.identification.ladder` repeats until the estimate has converged. Measured
orders are corrected by runs in time in the same way as without orbits.

The runs use films of level impedance. One run at the estimate with films by Reynolds' equation gives the change of the
estimate by better films, which is added to the covariance.

An orbit is kept as a Fourier series over the crank angle, so the encoder's zero (``zero.NAME``) and the gain of the
probes (``scale.NAME``) need no further runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.types import Array, Progress
from cranktrain.film.laws.register import LAWS, PLAIN, usual_level
from cranktrain.studies.run_up.steady import CycleStart, Job, SteadyRuns
from cranktrain_lab.identification.comparison import Answering
from cranktrain_lab.identification.data import Orbit
from cranktrain_lab.identification.model import TIME, Answers, ComplexArray, TorsionalModel
from cranktrain_lab.identification.parameters import SCALE, ZERO, inner_values, outer_values

HIGHEST = 48.0
"""Highest order of an orbit over the crank angle."""
STEP = 0.02
"""Step in u for derivatives: 2 % of a parameter, or of the range between its bounds."""
SETTLE = 1e-4
"""Upper limit of the settling error, small compared with the change of an orbit by :data:`STEP`."""

ABOVE, FOR_SIZE = "reynolds", 1e-2
"""Film level of the run that estimates the effect of better films, and settling error of this run."""


class Series(NamedTuple):
    """Fourier series of an orbit over crank angle: mean x + i y, m; amplitudes (2, o) of x, y at orders 0.5, 1, …."""

    mean: complex
    amplitudes: ComplexArray

    def at(self, angles: Array) -> ComplexArray:
        """Return the displacement x + i y (n,) at crank angles (n,) rad."""
        orders = 0.5 * np.arange(1, self.amplitudes.shape[1] + 1)
        x, y = (np.exp(1j * angles[:, None] * orders) @ self.amplitudes.T).real.T
        return np.asarray(self.mean + x + 1j * y)


@dataclass(frozen=True)
class Line:
    """Linearised orbits: coordinates (p,) of the estimate, series of the orbits, and derivatives by each coordinate."""

    inner: Array
    series: tuple[Series, ...]
    slopes: tuple[tuple[Series, ...], ...]


class OrbitModel:
    """Torsional model with additional orbits of a crank that moves in its films.

    Parameters
    ----------
    model : model that makes engines of sought values
    orders : model of all other data
    orbits : measured orbits
    crank, settle : crank level and settling error of the runs
    say : called with the stage of each run
    """

    def __init__(
        self, model: TorsionalModel, orders: Answering, orbits: Sequence[Orbit], crank: str, settle: float,
        say: Progress = lambda stage: None,
    ) -> None:  # fmt: skip
        self.orders = orders
        self._model, self._orbits, self._crank, self._say = model, tuple(orbits), crank, say
        self._settle = settle
        self._line: Line | None = None
        self.runs = 0

    def in_time(self, values: Array) -> tuple[ComplexArray, ...]:
        """Compute orders and orbits by runs in time, and linearise anew; raises ``InputError``, ``SolverError``."""
        orders = self._model.in_time(values, self._crank, self._settle, self._say) if self._model.data.strands else ()
        self._line = self._lined(values)
        return (*orders, *self._answered(values))

    def above(self, values: Array) -> tuple[ComplexArray, ...]:
        """Return orbits with films of the next finer level; raises ``InputError``, ``SolverError``."""
        series, _ = self._run(values, {}, ABOVE)
        return self._seen(values, series)

    def answers(self, values: Array) -> Answers:
        """Return computed data for sought values (p,), SI, with orbits linearised about the last estimate."""
        found = self.orders.answers(values)
        return replace(found, strands=(*found.strands, *self._answered(values)))

    def _answered(self, values: Array) -> tuple[ComplexArray, ...]:
        line = self._line
        assert line is not None, "orbits are answered after in_time"
        moved = inner_values(self._model.sought, values.tolist()) - line.inner
        found = []
        for k in range(len(self._orbits)):
            mean, amplitudes = line.series[k]
            for way, slopes in zip(moved.tolist(), line.slopes, strict=True):
                if slopes:
                    mean, amplitudes = mean + way * slopes[k].mean, amplitudes + way * slopes[k].amplitudes
            found.append(Series(mean, amplitudes))
        return self._seen(values, found)

    def _seen(self, values: Array, series: Sequence[Series]) -> tuple[ComplexArray, ...]:
        """Return orbits as measured, with encoder zero and gain of the probes applied."""
        named = dict(zip([one.key for one in self._model.sought], values.tolist(), strict=True))
        return tuple(
            one.seen(named.get(f"{SCALE}.{one.name}", 1.0) * own.at(one.speeds + named.get(f"{ZERO}.{one.name}", 0.0)))
            for one, own in zip(self._orbits, series, strict=True)
        )

    def _lined(self, values: Array) -> Line:
        """Return linearised orbits at sought values."""
        sought, inner = self._model.sought, inner_values(self._model.sought, values.tolist())
        self._say(f"orbits by the {self._crank} crank in time")
        base, starts = self._run(values, {})
        slopes: list[tuple[Series, ...]] = []
        for k, one in enumerate(sought):
            if one.key.partition(".")[0] in (ZERO, SCALE):
                slopes.append(())
                continue
            self._say(f"orbits by the {self._crank} crank in time, derivative by {one.key}")
            slopes.append(self._slopes(inner, k, base, starts))
        return Line(inner, base, tuple(slopes))

    def _slopes(
        self, inner: Array, k: int, base: tuple[Series, ...], starts: dict[float, CycleStart]
    ) -> tuple[Series, ...]:
        """Return derivatives of all orbits by one coordinate, with a step towards the farther bound."""
        one = self._model.sought[k]
        low, high = one.inner(one.low), one.inner(one.high)
        side = 1.0 if high - inner[k] >= inner[k] - low else -1.0
        point = inner.copy()
        point[k] += side * min(STEP, 0.5 * (high - low))
        values = outer_values(self._model.sought, point)
        way = one.inner(float(values[k])) - inner[k]
        try:
            there, _ = self._run(values, starts)
        except CranktrainError as error:
            raise InputError(f"parameters.'{one.key}': no orbit at {one.text(float(values[k]))}: {error}") from None
        return tuple(
            Series((b.mean - a.mean) / way, (b.amplitudes - a.amplitudes) / way)
            for a, b in zip(base, there, strict=True)
        )

    def _run(
        self, values: Array, starts: dict[float, CycleStart], bearings: str = "auto"
    ) -> tuple[tuple[Series, ...], dict[float, CycleStart]]:
        """Return the series of each orbit at sought values, and the starts of steady cycles by speed."""
        made = self._model.made_in_time(values, self._crank, bearings)
        settle = min(self._settle, SETTLE) if bearings == "auto" else max(self._settle, FOR_SIZE)
        outputs = sorted({f"{one.output}.{axis}" for one in self._orbits for axis in "xy"})
        runs = SteadyRuns(Job(made, None, settle, HIGHEST, tuple(outputs)))
        steady: dict[float, Any] = {}
        for speed in sorted({one.speed for one in self._orbits}):
            near = [starts[speed]] if speed in starts else []
            steady[speed] = runs.at(speed, near)
            self.runs += 1
        found = []
        for one in self._orbits:
            own = steady[one.speed]
            x, y = (f"{one.output}.{axis}" for axis in "xy")
            mean = complex(own.extremes[x][1], own.extremes[y][1])
            found.append(Series(mean, np.array([own.amplitudes[x], own.amplitudes[y]])))
        return tuple(found), {speed: own.start for speed, own in steady.items()}


def check_films(level: str, crank: str) -> None:
    """Raise ``InputError`` for a level of the model in which journals have no films."""
    remedy = "an orbit takes --method time --crank beam or solid, whose journals run in oil films"
    if level != TIME:
        raise InputError(f"[[orbit]]: method '{level}' has no oil films; {remedy}")
    bearings = usual_level(crank, PLAIN)
    if not LAWS[bearings].film:
        raise InputError(f"[[orbit]]: the mains of crank level '{crank}' are of level '{bearings}'; {remedy}")
