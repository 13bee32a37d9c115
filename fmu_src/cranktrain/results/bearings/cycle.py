"""Evaluation of plain bearings over the last cycle of a run: loads, films, friction, oil.

Vectors across the crank are complex, x + i y, in axes at rest with x across the engine and y upwards. For each bearing

* the specific load is |F|/(B D), and p v that times the sliding speed at the journal's surface;
* the friction power of the journal is mean(T ω) with the journal's speed ω against its bore. The other part of the
  film's heat is the work of the journal's middle against the film, −mean(F · ė). The work of tilting is left out.

Friction mean effective pressure is work per cycle over displacement: 4π P/(Ω V) of a four-stroke.

The inclination β of a rod follows from sin β = x/L with the pin's position x across its cylinder (Shigley and Uicker,
Theory of Machines and Mechanisms). The speed of a pin in its big end is the crank's speed minus β̇, without the crank's
twist. The big end of an articulated rod is its knuckle pin, which rotates with the master rod. The size of a knuckle
pin is not known, so it has no specific load. The load of a master rod's big end includes the loads of its articulated
rods.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from cranktrain.core.errors import InputError
from cranktrain.engine.articulated_rod import rod_end
from cranktrain.engine.limits import BIG_END, MAIN
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import PlainBearing
from cranktrain.results.orders.harmonics import CYCLE, Array, ComplexArray


class Sampled(Protocol):
    """Data of a run: ``time`` (n,) s in equal steps; ``angle`` (n,) rad; ``outputs``, name → (n,) SI."""

    @property
    def time(self) -> Array: ...  # noqa: D102
    @property
    def angle(self) -> Array: ...  # noqa: D102
    @property
    def outputs(self) -> Mapping[str, Array]: ...  # noqa: D102


@dataclass(frozen=True)
class Extreme:
    """Largest or least value over a cycle, SI, with the crank angle (rad in [0, 4π)) and angle in the shell (rad).

    ``place`` is an angle in the axes of the shell: axes at rest for a main bearing, axes of the rod for a big end,
    whose second axis points to the small end. It is None if not known.
    """

    value: float
    angle: float
    place: float | None = None


@dataclass(frozen=True, kw_only=True)
class BearingCycle:
    """Results of one bearing over one cycle, SI; values that the bearing's fidelity level does not compute are None.

    Attributes
    ----------
    family, number : ``MAIN`` or ``BIG_END``, and number from 1
    angle : (n,) crank angle, rad in [0, 4π)
    on_shell : (n,) load of the journal on its shell, N, in axes at rest
    on_journal : (n,) load of the shell on the journal, N, in axes that rotate with the crank and coincide with those at
        rest at crank angle 0
    on_rod : (n,) load on the shell of a big end, N, in the rod's axes, the second of which points to the small end
    orbit : (n,) position of the journal's middle in its bore over the radial clearance, axes at rest
    load, specific_load : largest load (N) and specific load (Pa); ``mean_specific_load`` is the mean over time
    pv, peak_pv : mean and largest specific load times sliding speed, Pa m/s
    film, pressure : least film thickness (m), largest film pressure (Pa)
    friction_power, squeeze_power : mean powers, W
    oil_flow : mean flow out of both ends, m³/s
    """

    family: str
    number: int
    angle: Array
    on_shell: ComplexArray
    on_journal: ComplexArray
    on_rod: ComplexArray | None
    orbit: ComplexArray | None
    load: Extreme
    specific_load: Extreme | None
    mean_specific_load: float | None
    pv: float | None
    peak_pv: float | None
    film: Extreme | None
    pressure: Extreme | None
    friction_power: float | None
    squeeze_power: float | None
    oil_flow: float | None

    @property
    def name(self) -> str:
        """Name of the bearing, such as ``main[1]`` or ``big_end[1]``."""
        return f"{self.family}[{self.number}]"


@dataclass(frozen=True)
class BearingReport:
    """Results of all plain bearings of an engine over one cycle; roller mains are included with their loads only.

    Attributes
    ----------
    engine : the engine
    speed : mean speed over the cycle, rad/s
    mains, big_ends : mains from the pulley to the flywheel, big ends by cylinder
    """

    engine: Engine
    speed: float
    mains: tuple[BearingCycle, ...]
    big_ends: tuple[BearingCycle, ...]

    @property
    def bearings(self) -> tuple[BearingCycle, ...]:
        """All bearings of the report: mains first, then big ends."""
        return self.mains + self.big_ends

    def total(self, what: str, family: str = "") -> float | None:
        """Sum of quantity ``what``, such as ``oil_flow``, over one family of bearings or all; None without films."""
        values = [getattr(bearing, what) for bearing in self.bearings if family in ("", bearing.family)]
        known = [value for value in values if value is not None]
        return math.fsum(known) if known else None

    def mean_pressure(self, power: float) -> float:
        """Mean effective pressure (Pa) that belongs to a power (W) at the run's speed and displacement."""
        return power * self.engine.cylinders.cycle / (self.speed * self.engine.displacement)

    @property
    def fmep(self) -> float | None:
        """Friction mean effective pressure, Pa, of all bearings with films; None if no bearing has a film."""
        power = self.total("friction_power")
        return None if power is None else self.mean_pressure(power)


def bearing_report(run: Sampled, engine: Engine) -> BearingReport:
    """Evaluate the bearings over the last cycle of a run.

    Raises ``InputError``: a run shorter than a cycle, or of an engine with other bearings.
    """
    last = np.flatnonzero(run.angle > run.angle[-1] - CYCLE + 1e-9)
    if last.size < 8 or run.angle[-1] - run.angle[0] < CYCLE * (1.0 - 1.0 / last.size):
        raise InputError("bearings: the run is shorter than one cycle of 720 deg; simulate longer")
    has = [
        sum(n.startswith(f"{of}[") and n.endswith("].force.x") for n in run.outputs) for of in ("bearing", "big_end")
    ]
    wanted = [len(engine.crankshaft.main_widths), engine.n_cylinders]
    if has[0] not in (0, wanted[0]) or has[1] != wanted[1]:  # 0 mains: journals locked on their axis have no load
        raise InputError(
            f"bearings: the run has {has[0]} mains and {has[1]} big ends, engine '{engine.name}' {wanted[0]} and "
            f"{wanted[1]}; give the engine of the run"
        )
    cycle = _Cycle(run, last)
    speed = CYCLE / (last.size * float(run.time[-1] - run.time[-2]))
    mains = []
    for i in range(has[0]):
        bearing, name = engine.main_bearing if i in engine.plain_numbers else None, f"bearing[{i + 1}]"
        gap, relative = cycle[f"{name}.gap.angle"], cycle[f"{name}.speed.relative"]
        velocity = cycle.vector(f"{name}.velocity")
        mains.append(_bearing(cycle, _Shell(name, MAIN, i + 1, bearing, np.zeros(gap.size), gap, relative, velocity)))
    big_ends = tuple(_big_end(cycle, c, engine) for c in range(wanted[1]))
    return BearingReport(engine, speed, tuple(mains), big_ends)


def rod_lean(engine: Engine, cylinder: int, angle: Array) -> tuple[Array, Array]:
    """Inclination (n,) of the rod of a cylinder (from 0), rad from upright in the crank's sense, and its d/dθ (n,).

    ``angle`` (n,) is the crank angle, rad.
    """
    cylinders, throw, length = engine.cylinders, engine.throws[cylinder], engine.rods[cylinder].length
    bank = cylinders.bank_angles[cylinder]
    if engine.articulations[cylinder] is not None:
        end = rod_end(engine, cylinder, angle)
        sine = (end.x - engine.offsets[cylinder]) / length
        return bank + np.arcsin(sine), end.vx / (length * np.sqrt(1.0 - sine**2))
    psi = angle + engine.crankshaft.throw_angles[cylinders.pins[cylinder] - 1] - bank
    sine = (-throw * np.sin(psi) - engine.offsets[cylinder]) / length
    return bank + np.arcsin(sine), -throw * np.cos(psi) / (length * np.sqrt(1.0 - sine**2))


class _Cycle:
    """Outputs of a run over its last cycle, by name."""

    def __init__(self, run: Sampled, last: NDArray[np.int_]) -> None:
        self._run, self.last = run, last
        self.crank = self["crank.angle"]
        self.angle = np.mod(self.crank, CYCLE)

    def __getitem__(self, name: str) -> Array:
        return self._run.outputs[name][self.last]

    def vector(self, name: str) -> ComplexArray:
        return np.asarray(self[f"{name}.x"] + 1j * self[f"{name}.y"])

    def rate(self, name: str) -> ComplexArray:
        """Rate of change of a vector output, by a spline over the cycle and some samples before it."""
        first = max(int(self.last[0]) - 8, 0)
        of = [self._run.outputs[f"{name}.{axis}"][first:] for axis in "xy"]
        slope = CubicSpline(self._run.time[first:], np.stack(of, axis=1)).derivative()(self._run.time[self.last])
        return np.asarray(slope[:, 0] + 1j * slope[:, 1])

    def extreme(self, values: Array, place: Array | None = None, least: bool = False) -> Extreme:
        k = int(values.argmin() if least else values.argmax())
        return Extreme(float(values[k]), float(self.angle[k]), None if place is None else float(place[k]))


class _Shell(NamedTuple):
    """Shell of a bearing: rotation ``turned`` (n,) of its axes, rad, and motion of the journal in it.

    ``gap`` (n,) is the angle of the least gap in axes at rest, rad; ``speed`` (n,) the relative speed of rotation,
    rad/s; ``velocity`` (n,) the velocity of the journal's middle, m/s.
    """

    name: str
    family: str
    number: int
    bearing: PlainBearing | None
    turned: Array
    gap: Array
    speed: Array
    velocity: ComplexArray


def _big_end(cycle: _Cycle, cylinder: int, engine: Engine) -> BearingCycle:
    """Results of the big end of a cylinder (from 0)."""
    name = f"big_end[{cylinder + 1}]"
    lean, slope = rod_lean(engine, cylinder, cycle.crank)
    joint, turning = engine.articulations[cylinder], np.ones(slope.size)
    if joint is not None:  # the knuckle pin is fixed to the master rod
        turning = rod_lean(engine, joint.master, cycle.crank)[1]
    bearing = engine.big_end_bearing if joint is None else None
    gap, rate = np.angle(cycle.vector(f"{name}.position")), cycle.rate(f"{name}.position")
    shell = _Shell(name, BIG_END, cylinder + 1, bearing, lean, gap, (turning - slope) * cycle["crank.speed"], rate)
    return _bearing(cycle, shell)


def _bearing(cycle: _Cycle, shell: _Shell) -> BearingCycle:
    """Results of one bearing, with a film if it has pressure and specific loads if it is a plain bearing."""
    name, bearing = shell.name, shell.bearing
    force = cycle.vector(f"{name}.force")
    in_shell = -force * np.exp(-1j * shell.turned)
    film = bearing is not None and bool(np.any(cycle[f"{name}.pressure_max"]))
    found: dict[str, Any] = dict.fromkeys(
        (
            "specific_load", "mean_specific_load", "pv", "peak_pv", "orbit", "film", "pressure", "friction_power",
            "squeeze_power", "oil_flow",
        )
    )  # fmt: skip
    if bearing is not None:
        specific = np.abs(force) / (bearing.diameter * bearing.width)
        pv = specific * np.abs(0.5 * bearing.diameter * shell.speed)
        found |= {"specific_load": cycle.extreme(specific, np.angle(in_shell))}
        found |= {"mean_specific_load": float(specific.mean()), "pv": float(pv.mean()), "peak_pv": float(pv.max())}
    if film and bearing is not None:
        place = np.angle(np.exp(1j * (shell.gap - shell.turned)))
        squeeze = -(force * shell.velocity.conj()).real
        found |= {
            "orbit": cycle.vector(f"{name}.position") / bearing.clearance,
            "film": cycle.extreme(cycle[f"{name}.film_thickness_min"], place, least=True),
            "pressure": cycle.extreme(cycle[f"{name}.pressure_max"]),
            "friction_power": float((cycle[f"{name}.friction_torque"] * shell.speed).mean()),
            "squeeze_power": float(squeeze.mean()),
            "oil_flow": float(cycle[f"{name}.oil_flow"].mean()),
        }
    return BearingCycle(
        family=shell.family,
        number=shell.number,
        angle=cycle.angle,
        on_shell=-force,
        on_journal=force * np.exp(-1j * cycle.crank),
        on_rod=in_shell if shell.family == BIG_END else None,
        load=cycle.extreme(np.abs(force), np.angle(in_shell)),
        **found,
    )
