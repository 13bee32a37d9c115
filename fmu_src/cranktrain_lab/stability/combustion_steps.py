"""Stability map of combustion coupled with the crank: longest communication step by burn duration and reconstruction.

One cylinder of the six at constant speed, under the reference master: the combustion module with ``PREMIXED`` of the
fuel burning over one Wiebe function of the given duration, and a crank that turns uniformly and receives the work of
the pressures after the product's reconstruction. Error is that of the work of a cycle, the RMS over ``PHASES``
positions of the communication points against the cycle.

Theory is the same work in plain NumPy: the pressure over the crank's angle from one fine run, sampled and drawn again
by the rule on paper.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.state import SHAFT_ANGLE, TIME
from cranktrain.dynamics.motion.gas import gas_volume, given_pressure
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.dynamics.time.reconstruction import JUMP, POLYTROPIC, reconstruct, take_sample
from cranktrain.modules.combustion.file import load
from cranktrain.modules.combustion.settings import CycleSettings
from cranktrain.modules.combustion.simulation import CombustionSimulation
from cranktrain.modules.register import module_files
from cranktrain_lab.coupling.master import Master
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, OWN
from cranktrain_lab.coupling.reconstruction import DEGREES
from cranktrain_lab.coupling.simulation_unit import SimulationUnit
from cranktrain_lab.coupling.virtual_engine import ANGLE, gas_connections, gas_exchange
from cranktrain_lab.stability.rotor import rotor_body, rotor_engine
from cranktrain_lab.stability.stability_map import (
    Axis,
    Boundary,
    Onset,
    Progress,
    StabilityMap,
    curve,
    deviation,
    onset,
)

SPEED = 2000.0 * RPM
WAYS = (("gauss-seidel", OWN), ("jacobi", OWN), ("gauss-seidel", "linear"), ("jacobi", "linear"), ("jacobi", "hold"))
"""Pairs of scheme and pressure reconstruction. The map's colours belong to the first pair."""
ALLOWED = 0.005
"""Error of a cycle's work beyond which a communication step counts as too long."""
PHASES = 7
"""Number of positions of the communication points; odd, so that no symmetry of the cycle hides an error."""
RUN_IN = 3
"""Number of communication steps of the run-in, until three samples are known."""
STARTS = math.radians(-360.0)
"""Crank angle relative to firing at which runs begin, rad; the valves are open there."""
PIECE = math.radians(0.1)
"""Step of crank angle for integration of work, rad."""
FINE = math.radians(0.1)
"""Step of crank angle of the run that gives the pressure for the theoretical curve, rad."""
SHORTEST, LONGEST = 0.08, 24.0
"""Range of communication steps, degrees."""
BRACKET = 1.1
"""Factor of the search range: from the first estimate divided by this factor to the estimate times this factor."""


@kernel
def work_of_step(model, work, state, inputs, angle, turn, interval, pieces):
    """Return the work, J, of the cylinders' gas over a communication step from a crank angle, with reconstruction."""
    state[SHAFT_ANGLE] = angle
    take_sample(model, state, inputs, interval)
    reconstruct(model, work, state)
    done = 0.0
    part = turn / pieces
    before = gas_volume(model, 0, angle)
    for k in range(pieces):
        after = gas_volume(model, 0, angle + (k + 1) * part)
        pressure = given_pressure(model, work, 0, angle + (k + 0.5) * part, (k + 0.5) * interval / pieces)
        done += pressure * (after - before)
        before = after
    return done


class UniformCrank:
    """Crank that rotates uniformly and records the work of one cylinder: ``works`` (steps,), J."""

    input_names: tuple[str, ...] = ("cylinder[1].pressure", "pressure.angle")
    output_names: tuple[str, ...] = (ANGLE, "crank.speed")

    def __init__(self, rule: str, start: float) -> None:
        engine = rotor_engine()
        settings = Settings(crank="rigid", bearings="linear", gas_source="input", reconstruction=rule)
        self._simulation = simulation = Simulation(engine, rotor_body(engine, 20.0), settings)
        simulation.inputs[0] = SPEED
        simulation.initialize()
        self.state, self.inputs = simulation.state, np.zeros(2)
        self._start, self.works = start, list[float]()

    def initialize(self, time: float = 0.0) -> None:
        """Initialize at a time, s."""
        self._time = time

    def step(self, t_end: float) -> None:
        """Record the work up to a time, s."""
        simulation, turn = self._simulation, SPEED * (t_end - self._time)
        taken = simulation.inputs
        taken[[simulation.input_names.index(name) for name in self.input_names]] = self.inputs
        angle, pieces = self._start + SPEED * self._time, math.ceil(turn / PIECE)
        self.works.append(
            work_of_step(simulation.model, simulation.work, self.state, taken, angle, turn, t_end - self._time, pieces)
        )
        self._time = t_end
        self.state[TIME] = t_end

    def read(self, places: Sequence[int]) -> list[float]:
        """Return crank angle (rad) and speed (rad/s) as outputs."""
        return [(self._start + SPEED * self._time, SPEED)[place] for place in places]


@cache
def burn(duration: float) -> CycleSettings:
    """Return settings of one cylinder of the six, with most of the fuel burnt over the angle ``duration``, rad."""
    settings = load(module_files()["combustion_i6"])
    return replace(settings, firing_angles=(0.0,), premixed_factor=0.0, premixed_duration=duration)


def started_combustion(duration: float, start: float) -> CombustionSimulation:
    """Return the combustion at a crank angle, rad, not yet initialized."""
    gas = CombustionSimulation(burn(duration))
    gas.inputs[[gas.input_names.index(name) for name in (ANGLE, "crank.speed")]] = start, SPEED
    return gas


def found_work(duration: float, way: tuple[str, str], count: int, phase: float) -> float:
    """Return a cycle's work, J, in ``count`` communication steps shifted by the fraction ``phase`` of a step."""
    scheme, exchange = way
    turn = 4.0 * math.pi / count
    start = STARTS + phase * turn
    crank = UniformCrank("polytropic" if exchange == OWN else "hold", start)
    units = [SimulationUnit(COMBUSTION, started_combustion(duration, start)), SimulationUnit(CRANKTRAIN, crank)]
    own = exchange == OWN
    master = Master(units, gas_connections(1, own), gas_exchange(scheme, exchange))
    master.initialize()
    h = turn / SPEED
    for k in range(count + RUN_IN):
        master.step((k + 1) * h)
    return float(sum(crank.works[-count:]))


@dataclass(frozen=True, eq=False)
class Trace:
    """Pressure (Pa) and volume (m³) of the cylinder over the crank's angle (rad), and the work of a cycle, J."""

    pressure: Callable[[Array], Array]
    volume: Callable[[Array], Array]
    work: float


@cache
def trace(duration: float) -> Trace:
    """Compute one cycle of the combustion at fine steps."""
    gas = started_combustion(duration, STARTS)
    gas.initialize()
    count = round(4.0 * math.pi / FINE)
    place = gas.output_names.index("cylinder[1].pressure")
    pressures = [gas.outputs[place]]
    for k in range(count):
        gas.inputs[gas.input_names.index(ANGLE)] = STARTS + k * FINE
        gas.step((k + 1) * FINE / SPEED)
        pressures.append(gas.outputs[place])
    pressures[-1] = pressures[0]
    spline = CubicSpline(STARTS + FINE * np.arange(count + 1), pressures, bc_type="periodic", extrapolate="periodic")
    settings = burn(duration)
    area, r, rod = 0.25 * math.pi * settings.bore**2, 0.5 * settings.stroke, settings.rod_length

    def volume(angle: Array) -> Array:
        reach = r * np.cos(angle) + np.sqrt(rod**2 - (r * np.sin(angle) + settings.pin_offset) ** 2)
        top = math.sqrt((rod + r) ** 2 - settings.pin_offset**2)
        bottom = math.sqrt((rod - r) ** 2 - settings.pin_offset**2)
        return np.asarray(area * (top - reach + (top - bottom) / (settings.compression_ratio - 1.0)))

    angles = STARTS + 4.0 * math.pi * np.linspace(0.0, 1.0, 200_001)
    middle = 0.5 * (angles[1:] + angles[:-1])
    return Trace(spline, volume, float(spline(middle) @ np.diff(volume(angles))))


def drawn_work(duration: float, way: tuple[str, str], count: int, phase: float) -> float:
    """Return the theoretical work of a cycle, J, by reconstruction of samples of the trace."""
    scheme, exchange = way
    known, turn = trace(duration), 4.0 * math.pi / count
    begins: Array = STARTS + (phase + np.arange(float(count))) * turn
    pieces = math.ceil(turn / PIECE)
    edges: Array = begins[:, None] + turn * np.linspace(0.0, 1.0, pieces + 1)
    middle, swept = 0.5 * (edges[:, 1:] + edges[:, :-1]), np.diff(known.volume(edges), axis=1)
    newest: Array = begins + (turn if scheme == "gauss-seidel" else 0.0)
    samples = [known.pressure(newest - s * turn) for s in range(3)]
    if exchange == OWN:
        # Pressures (steps, pieces) by the parabola of p Vⁿ through the last samples, held after a jump.
        g = [p * known.volume(newest - s * turn) ** POLYTROPIC for s, p in enumerate(samples)]
        smooth = [np.abs(a - b) <= JUMP * np.maximum(a, b) for a, b in ((g[0], g[1]), (g[1], g[2]))]
        rate = (g[0] - g[1]) / turn
        bend = np.where(smooth[1], (rate - (g[1] - g[2]) / turn) / (2.0 * turn), 0.0)
        x = middle - newest[:, None]
        drawn = g[0][:, None] + x * (rate[:, None] + (x + turn) * bend[:, None])
        pressures = np.where(smooth[0][:, None], drawn / known.volume(middle) ** POLYTROPIC, samples[0][:, None])
    elif scheme == "gauss-seidel":
        pressures = 0.5 * (samples[0] + samples[1])[:, None] if DEGREES[exchange] else samples[0][:, None]
    else:
        pressures = (samples[0] + 0.5 * DEGREES[exchange] * (samples[0] - samples[1]))[:, None]
    return float(np.sum(np.maximum(pressures, 0.0) * swept))


Work = Callable[[float, tuple[str, str], int, float], float]


def error(work: Work, duration: float, way: tuple[str, str], step_deg: float) -> float:
    """Return the relative RMS error of the work over the phases, at the nearest step that divides a cycle."""
    count, exact = round(720.0 / step_deg), trace(duration).work
    off = [work(duration, way, count, k / PHASES) / exact - 1.0 for k in range(PHASES)]
    return float(np.sqrt(np.mean(np.square(off))))


def longest_steps(work: Work, durations: Array, way: tuple[str, str], about: list[Onset] | None = None) -> list[Onset]:
    """Return communication steps, degrees, above which the error exceeds the allowed error, by burn duration."""
    found = []
    for k, duration in enumerate(durations):
        places = np.geomspace(SHORTEST, LONGEST, 25)
        if about is not None and about[k].found:
            places = np.array([about[k] / BRACKET, about[k] * BRACKET])

        def fails(step: float, duration: float = duration) -> bool:
            return error(work, duration, way, step) > ALLOWED

        found.append(onset(fails, places, 5.0e-3, SHORTEST))
    return found


def compute(quick: bool, progress: Progress) -> StabilityMap:
    """Compute the map of burn duration over communication step."""
    degrees = np.geomspace(3.0, 60.0, 9 if quick else 17)
    steps = np.geomspace(SHORTEST, 12.0, 19 if quick else 41)
    every, ways = (4, WAYS[:2]) if quick else (2, WAYS)
    durations = np.radians(degrees)
    theory, found, worst = [], [], 0.0
    for k, way in enumerate(ways):
        name = ", ".join(way)
        progress(f"longest step: {name}", k / (len(ways) + 1.0))
        # The boundary is irregular, because communication points move across the burn. Both searches have equal bounds.
        rough = longest_steps(drawn_work, durations, way)
        exact = longest_steps(drawn_work, durations, way, rough)
        coupled = longest_steps(found_work, durations[::every], way, rough[::every])
        worst = max(worst, deviation(np.array(coupled), np.array(exact[::every])))
        theory.append(curve(name, exact, degrees, "the trace of one fine run, sampled and drawn by the rule"))
        found.append(curve(name, coupled, degrees[::every], "combustion and crank under the reference master"))
    progress(f"ground: {', '.join(WAYS[0])}", len(ways) / (len(ways) + 1.0))
    errors = np.array([[error(drawn_work, duration, WAYS[0], step) for step in steps] for duration in durations])
    return StabilityMap(
        name="combustion_steps",
        title="Combustion beside the crank: duration of the burn over communication step, 2000 rev/min",
        rows=Axis("crank angle of the burn", "deg", degrees, log=True),
        columns=Axis("communication step", "deg", steps, log=True),
        stable=errors <= ALLOWED,
        measure=np.log10(np.clip(errors, 1.0e-7, 1.0)),
        measure_label=f"log10 of the work's error ({', '.join(WAYS[0])})",
        theory=tuple(theory),
        numerical=tuple(found),
        max_deviation=worst,
        explanation=_explanation(theory, float(degrees[0])),
        failure=f"work off by more than {100.0 * ALLOWED:g} % ({', '.join(WAYS[0])})",
    )


def _explanation(curves: Sequence[Boundary], steepest: float) -> str:
    """Return the explanation of the map, with its numbers."""
    least = min(float(boundary.points[:, 0].min()) for boundary in curves[:2])
    return (
        "Nothing grows here: pressures hardly depend on how the crank moves. What a long step costs is accuracy: "
        "pressures between communication points are drawn, and a burn within a step or two is not seen by what is "
        "drawn.\n"
        "Held pressures (Jacobi, hold) come half a step late on average whatever the burn: compression and expansion "
        "alone make the work wrong, in proportion to the step.\n"
        "What to do: let the partner tell the angle of its pressures and the cranktrain draw them (own). Up to "
        f"{least:.1f} deg the work is then within {100.0 * ALLOWED:g} % down to burns of {steepest:g} deg, by either "
        "scheme; where the burn is known to be slow, longer steps serve."
    )
