"""Rotation of a shaft from pulses of a wheel: angle, speed, torsional vibration, twist between two places.

Angles count from firing dead centre of cylinder 1 if its position is given, else from the wheel's tooth 0. The mean
rotation φ(t) excludes motion that recurs each cycle. Torsional vibration is δ = θ − φ at the pulses, and its orders are
lines over φ (:mod:`cranktrain_lab.measured.tracking`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain_lab.measured.channels import Channel, Measurement
from cranktrain_lab.measured.gaps import (
    beside_gaps,
    pitches,
    recognised,
    recurring_gap,
    untold,
    wheel_of,
    without_wrong,
)
from cranktrain_lab.measured.pulses import EDGES, Pulses, pulse_times, timing_error
from cranktrain_lab.measured.wheel import CYCLE, MeanRotation, Numbered, Wheel, learn_errors, number_teeth

DISAGREE = 0.005
"""Relative difference of mean speeds above which two tachos disagree."""
UNLIKELY = 15.0
"""Speed, rev/min, below which no engine runs, although it may be turned over."""
SLOWEST, FASTEST = 1.0, 50_000.0
"""Speed, rev/min, below which a shaft counts as at rest, and speed above which no engine runs."""
WRONG, FEW_WRONG = 0.04, 20
"""Fraction and number of lost and of double pulses above which a signal is not that of a wheel. Wheels with several
gaps lack many pulses, and a bouncing switch doubles many, but noise has both.
"""
NAMED = 4
"""Largest number of orders listed in a remark on pitch errors."""
KEEP, REMOVE = "keep", "remove"


@dataclass(frozen=True)
class Rotation:
    """Rotation of a shaft at one place.

    Attributes
    ----------
    name : name of the channel
    times, angle : times (s) and angles (rad) of the pulses, (k,), increasing
    wheel, numbered : wheel and its numbered pulses
    errors : (teeth,) rad, pitch errors that were subtracted
    mean : mean rotation over time
    remarks : one line each
    cycle_known : True if angle 0 is firing dead centre of cylinder 1; else it may be a revolution off, which rotates
        the phases of half orders by 180 degrees
    recurring : (n,) rad, zero to peak, parts of orders 1 to n with constant amplitude and phase over the recording, by
        pitch errors or torsion; empty if pitch errors were subtracted
    spacing : median and least number of samples per pulse; infinite for a channel of times
    two_levels : True for square pulses, whose crossings are known only to a fraction of a sample
    """

    name: str
    times: Array
    angle: Array
    wheel: Wheel
    numbered: Numbered
    errors: Array
    mean: MeanRotation
    remarks: tuple[str, ...] = field(default=())
    cycle_known: bool = False
    recurring: Array = field(default_factory=lambda: np.zeros(0))
    spacing: tuple[float, float] = (math.inf, math.inf)
    two_levels: bool = False

    @property
    def phase(self) -> Array:
        """Mean rotation at the pulses, (k,) rad."""
        return self.mean.at(self.times)

    @property
    def torsion(self) -> Array:
        """Torsional vibration at the pulses, (k,) rad."""
        return np.asarray(self.angle - self.phase)

    @property
    def speed(self) -> Array:
        """Mean speed at the pulses, (k,) rad/s."""
        return self.mean.speed(self.times)

    @property
    def speed_range(self) -> tuple[float, float]:
        """Lowest and highest mean speed, rad/s."""
        speed = np.diff(self.mean.angle) / np.diff(self.mean.times)
        return float(speed.min()), float(speed.max())

    def turned(self, by: float) -> Rotation:
        """Shift the zero of the crank angle, so that angles decrease by ``by`` rad."""
        mean = MeanRotation(self.mean.angle - by, self.mean.times)
        return replace(self, angle=self.angle - by, mean=mean)

    def with_firing(self, pressure: Channel) -> Rotation:
        """Shift by a revolution if the pressure of cylinder 1 peaks a revolution away from angle 0; ``InputError``."""
        first = math.ceil(self.angle[0] / CYCLE + 0.5)
        count = min(8, math.floor(self.angle[-1] / CYCLE - 0.5) - first + 1)
        if count < 1:
            raise InputError(
                f"{self.name}: less than 2 cycles are recorded, so the pressure cannot say which revolution fires"
            )
        swings = []
        for shift in (0.0, math.tau):
            ends = [(first + k) * CYCLE + shift + side * 0.5 * math.pi for k in range(count) for side in (-1, 1)]
            places = (np.interp(ends, self.angle, self.times) - pressure.start) / pressure.step
            parts = [
                pressure.values(max(0, int(a)), int(b) + 1)
                for a, b in zip(places[::2], places[1::2], strict=True)
                if b > 0
            ]
            swings.append(float(np.mean([np.ptp(part) for part in parts if part.size > 1] or [np.float64(0.0)])))
        low, high = min(swings), max(swings)
        if high <= 1.3 * low:
            raise InputError(
                f"{pressure.where}: swings by {swings[0]:.3g} and {swings[1]:.3g} {pressure.unit} around the two dead "
                "centres of a cycle; it does not say which one fires"
            )
        return replace(self.turned(math.tau if swings[1] > swings[0] else 0.0), cycle_known=True)

    def against(self, other: Rotation) -> Rotation:
        """Return the rotation relative to another's mean rotation, for twist between two places; raises ``InputError``.

        The angle is shifted so that both agree on average.
        """
        first, last = max(self.times[0], other.times[0]), min(self.times[-1], other.times[-1])
        own = (self.times >= first) & (self.times <= last)
        if np.count_nonzero(own) < 4 * self.wheel.pulses:
            raise InputError(f"{self.name} and {other.name} have less than 4 revolutions in common; take one recording")
        turns, others = (np.ptp(one.mean.at(np.array([first, last]))) for one in (self, other))
        if abs(turns / others - 1.0) > DISAGREE:
            raise InputError(
                f"two tachos disagree: from {first:.3g} to {last:.3g} s {self.name} turns "
                f"{turns / math.tau:.2f} times, "
                f"{other.name} {others / math.tau:.2f} times, a ratio of {turns / others:.4f}; check the pulses "
                f"a revolution"
            )
        shift = float(np.mean(self.angle[own] - other.mean.at(self.times[own])))
        return replace(self, times=self.times[own], angle=self.angle[own] - shift, mean=other.mean)

    def summary(self) -> dict[str, Any]:
        """Summarise the rotation for tables and JSON."""
        low, high = self.speed_range
        pitch = math.tau / self.wheel.teeth
        return {
            "channel": self.name,
            "teeth": self.wheel.teeth,
            "missing": self.wheel.missing,
            "gaps": self.wheel.gaps,
            "pulses": int(self.times.size),
            "samples_per_pulse": list(self.spacing) if math.isfinite(self.spacing[0]) else None,
            "timing_error_deg": math.degrees(pitch * timing_error(self.spacing[1], self.two_levels)),
            "revolutions": float((self.angle[-1] - self.angle[0]) / math.tau),
            "speed_rpm": [low / RPM, high / RPM],
            "lost_pulses": self.numbered.lost,
            "cycle_known": self.cycle_known,
            "double_pulses": self.numbered.doubled,
            "slips": [list(slip) for slip in self.numbered.slips],
            "tooth_error_percent": 100.0 * float(np.std(self.errors)) / pitch if self.errors.any() else None,
            "recurring_deg": np.degrees(self.recurring).tolist(),
            "remarks": list(self.remarks),
        }


def rotation(
    channel: Channel,
    wheel: Wheel | None,
    *,
    level: float | None = None,
    edge: str | None = None,
    learn: tuple[float, float] | bool | Array = False,
    eccentricity: str = KEEP,
    index: Channel | None = None,
    dead_centre: float = 0.0,
    clock: float | None = None,
) -> Rotation:
    """Return the rotation from a channel of pulses.

    Raises ``InputError`` for no or too few pulses, a gap that does not recur, a shaft at rest, or an index channel that
    disagrees with the pulses.

    Parameters
    ----------
    channel : sampled pulses, or increasing times of pulses
    wheel : teeth per revolution and missing teeth in the gap; None for a usual wheel from the recurring gap
    level : crossing level in the channel's unit; by default from the signal
    edge : ``rising`` or ``falling``; by default the edge whose pulses next to the gap are correct
    learn : pitch errors of the teeth. False: none. True: learned from the whole recording (this also removes whole
        orders of constant amplitude and phase). Two times (s): learned between them. Array (teeth,) rad: given
    eccentricity : ``keep`` or ``remove`` order 1 of constant amplitude and phase, as caused by an eccentric wheel
    index : channel of a once-per-revolution pulse, which marks tooth 0
    dead_centre : angle from tooth 0 to firing dead centre of cylinder 1, rad
    clock : frequency of the counter whose ticks the samples are, Hz
    """
    where = channel.where
    if eccentricity not in (KEEP, REMOVE):
        raise InputError(f"eccentricity '{eccentricity}' does not exist; valid: {KEEP}, {REMOVE}")
    found = pulse_times(channel, level, edge=edge or EDGES[0], clock=clock)
    wheel, told = _wheel(wheel, found.times, where)
    found, numbered, more = _numbered(channel, (level, edge), wheel, found, learn is False)
    remarks = [*found.remarks, *told, *_told(numbered, wheel, where), *more]
    if index is not None:
        numbered, told = _from_index(numbered, wheel, pulse_times(index, clock=clock).times, (where, index.name))
        remarks += told
    else:
        remarks += untold(wheel, where)
    numbered, told = _turning_part(numbered, wheel, where)
    remarks += told
    number = numbered.teeth % wheel.teeth
    errors = np.zeros(wheel.teeth)
    if isinstance(learn, np.ndarray):
        if learn.shape != errors.shape:
            raise InputError(f"{where}: {learn.size} pitch errors for {wheel.teeth} teeth; give one for each")
        errors = learn
    elif learn is not False:
        errors = learn_errors(numbered, wheel, None if learn is True else learn, where)
    angle = np.asarray(numbered.teeth * (math.tau / wheel.teeth), dtype=np.float64)
    if eccentricity == REMOVE:
        errors = _with_order_one(numbered, angle, errors, wheel)
    elif learn is True:
        # Teeth's pitch errors without order 1, which remains in the rotation.
        lines = np.fft.rfft(errors)
        if lines.size > 1:
            lines[1] = 0.0
        errors = np.asarray(np.fft.irfft(lines, errors.size), dtype=np.float64)
    angle = angle + errors[number] - dead_centre
    recurring, told = _doubts(numbered, angle, errors, wheel, where)
    mean = MeanRotation.of(numbered.times, angle, CYCLE)
    made = Rotation(channel.name, numbered.times, angle, wheel, numbered, errors, mean, (*remarks, *told))
    return replace(made, recurring=recurring, spacing=found.spacing, two_levels=found.two_levels)


def _wheel(wheel: Wheel | None, times: Array, where: str) -> tuple[Wheel, list[str]]:
    """Return the stated wheel corrected by its gap, or a usual wheel from the gap if none was stated; and remarks."""
    if wheel is not None:
        return recognised(wheel, times, where)
    gap = recurring_gap(times)
    turns = times.size / (gap.apart - gap.missing) if gap else 0.0
    found = wheel_of(gap, turns / float(times[-1] - times[0]) * 60.0, where)
    return found, [f"{where}: one gap a revolution is assumed ({found.name}); of several equal ones give --teeth N"]


def _numbered(
    channel: Channel, asked: tuple[float | None, str | None], wheel: Wheel, found: Pulses, leave_out: bool
) -> tuple[Pulses, Numbered, list[str]]:
    """Number the pulses by tooth, at the requested edge, or by default at the better edge. Return remarks too.

    With ``leave_out``, pulses next to gaps that deviate from the pattern of the others are removed.
    """
    where, (level, edge) = channel.where, asked
    numbered = number_teeth(found.times, wheel, where)
    wrong = beside_gaps(numbered, wheel)
    taken, other, remarks = edge or EDGES[0], EDGES[edge == EDGES[1] or edge is None], []
    sampled = math.isfinite(found.level)
    if wrong and edge is None and sampled:
        again = pulse_times(channel, level, edge=other)
        renumbered = number_teeth(again.times, wheel, where)
        better = beside_gaps(renumbered, wheel)
        if max(map(abs, better.values()), default=0.0) < 0.5 * max(map(abs, wrong.values())):
            remarks.append(
                f"{where}: {other} edges are taken, because {taken} ones beside the gap are off by "
                f"{100.0 * max(map(abs, wrong.values())):.0f} % of a pitch"
            )
            found, numbered, wrong, taken = again, renumbered, better, other
    if wrong:
        told = " and ".join(
            f"{'behind' if side == 0 else 'before'} the gap by {100.0 * off:+.0f} %" for side, off in wrong.items()
        )
        remarks.append(
            f"{where}: {taken} edges are off {told} of a pitch"
            + ("; these pulses are left out" if leave_out else "")
            + (f"; of an inductive pick-up take --edge {'falling' if taken == EDGES[0] else 'rising'}" if edge else "")
        )
        numbered = without_wrong(numbered, wheel, wrong) if leave_out else numbered
    return found, numbered, remarks


def _with_order_one(numbered: Numbered, angle: Array, errors: Array, wheel: Wheel) -> Array:
    """Return the teeth's pitch errors plus order 1 of the residual rotation over all revolutions."""
    number = numbered.teeth % wheel.teeth
    corrected = angle + errors[number]
    left = corrected - MeanRotation.of(numbered.times, corrected, CYCLE).at(numbered.times)
    waves = np.exp(1j * angle)
    basis = np.column_stack([np.ones(angle.size), waves.real, waves.imag])
    fit = np.linalg.lstsq(basis, left, rcond=None)[0]
    teeth = np.arange(wheel.teeth) * (math.tau / wheel.teeth)
    return np.asarray(errors - fit[1] * np.cos(teeth) - fit[2] * np.sin(teeth))


def _turning_part(numbered: Numbered, wheel: Wheel, where: str) -> tuple[Numbered, list[str]]:
    """Return the longest stretch between standstills; raises ``InputError`` if it is below two revolutions."""
    if not numbered.stops:
        return numbered, []
    ends = [numbered.times[0], *[time for stop in numbered.stops for time in stop], numbered.times[-1]]
    stretches = [(ends[k], ends[k + 1]) for k in range(0, len(ends), 2)]
    begin, end = max(stretches, key=lambda one: np.ptp(np.searchsorted(numbered.times, one)))
    keep = slice(int(np.searchsorted(numbered.times, begin)), int(np.searchsorted(numbered.times, end, side="right")))
    times, teeth = numbered.times[keep], numbered.teeth[keep]
    first, last = numbered.stops[0]
    said = f"{where}: the shaft stands still from {first:.4g} to {last:.4g} s"
    said += f" and {len(numbered.stops) - 1} more times" if len(numbered.stops) > 1 else ""
    if times.size < 2 * wheel.pulses:
        raise InputError(f"{said}; it never turns 2 revolutions without a stop")
    shift = int(teeth[0] // wheel.teeth) * wheel.teeth
    kept = replace(numbered, times=times, teeth=teeth - shift)
    return kept, [f"{said}; the stretch from {begin:.4g} to {end:.4g} s was taken"]


def _told(numbered: Numbered, wheel: Wheel, where: str) -> list[str]:
    """Return remarks on lost and double pulses and slips; raises ``InputError`` if there are too many for a wheel."""
    remarks = []
    if min(numbered.lost, numbered.doubled) > max(FEW_WRONG, WRONG * numbered.times.size):
        raise InputError(
            f"{where}: {numbered.lost} pulses are missing and {numbered.doubled} are double among "
            f"{numbered.times.size}; these are no pulses of a wheel of {wheel.teeth} teeth, or they are sampled too "
            "slowly (aliasing); check channel, level and teeth"
        )
    if numbered.lost:
        remarks.append(
            f"{where}: {numbered.lost} of {numbered.times.size + numbered.lost} pulses are missing and were bridged"
        )
    if numbered.doubled:
        remarks.append(f"{where}: {numbered.doubled} double pulses were removed")
    if numbered.slips:
        turn, off = numbered.slips[0]
        remarks.append(
            f"{where}: {len(numbered.slips)} revolutions do not have {wheel.pulses} pulses; revolution {turn} has "
            f"{wheel.pulses + off}; the gap was taken as right"
        )
    return remarks


def _from_index(numbered: Numbered, wheel: Wheel, marks: Array, names: tuple[str, str]) -> tuple[Numbered, list[str]]:
    """Number the teeth from the index pulse on; raises ``InputError`` if pulses and index disagree."""
    where, index = names
    inside = marks[(marks > numbered.times[0]) & (marks < numbered.times[-1])]
    if inside.size < 2:
        raise InputError(
            f"{where}: the index channel {index} has {inside.size} pulses within these pulses; give another"
        )
    places = np.interp(inside, numbered.times, numbered.teeth.astype(np.float64))
    apart = np.diff(places)
    usual = float(np.median(apart))
    if abs(usual - wheel.teeth) > 0.4:
        raise InputError(
            f"two tachos disagree: {where} counts {usual:.1f} teeth from index to index of {index}, not {wheel.teeth}; "
            "check the pulses a revolution, or sample faster: pulses that are too dense look like fewer (aliasing)"
        )
    off = np.flatnonzero(np.abs(apart - wheel.teeth) > 0.5)
    told = []
    if off.size:
        told.append(
            f"{where}: {off.size} of {apart.size} revolutions between index pulses of {index} do not have "
            f"{wheel.teeth} "
            f"teeth; the first at {inside[off[0]]:.4g} s has {apart[off[0]]:.1f}"
        )
    first = math.ceil(float(np.median(places % wheel.teeth)) - 1e-6) % wheel.teeth
    return replace(numbered, teeth=numbered.teeth - first), told


def _doubts(numbered: Numbered, angle: Array, errors: Array, wheel: Wheel, where: str) -> tuple[Array, list[str]]:
    """Return amplitudes of whole orders that recur each revolution, if no errors were subtracted, and remarks.

    ``InputError`` for an impossible speed.
    """
    speed = float(np.median(np.diff(angle) / np.diff(numbered.times)))
    if speed / RPM < SLOWEST:
        raise InputError(f"{where}: turns at {speed / RPM:.3g} rev/min, it stands still; check the pulses a revolution")
    if speed / RPM > FASTEST:
        raise InputError(
            f"{where}: turns at {speed / RPM:.4g} rev/min with {wheel.teeth} teeth, above {FASTEST:g} rev/min; "
            "check the pulses a revolution"
        )
    if speed / RPM < UNLIKELY:
        slow = [
            f"{where}: turns at {speed / RPM:.3g} rev/min, and engines run at {UNLIKELY:g} or more; check the unit of "
            "the times (ms against s) and the pulses a revolution"
        ]
        return np.zeros(0), slow
    if errors.any() or wheel.teeth < 4 or angle[-1] - angle[0] < 16 * CYCLE:
        return np.zeros(0), []
    found = learn_errors(numbered, wheel, None, where)
    # Zero-to-peak amplitudes (n,) rad of orders 1 to n of pitch errors (teeth,), n below half the teeth.
    lines = np.abs(np.fft.rfft(found)) * (2.0 / found.size)
    sizes = np.asarray(lines[1 : (found.size + 1) // 2], dtype=np.float64)
    share = float(np.std(found)) / (math.tau / wheel.teeth)
    if share < 0.002:
        return sizes, []
    largest = ", ".join(
        f"{n + 1} ({math.degrees(sizes[n]):.2g} deg)" for n in np.argsort(-sizes, kind="stable")[:NAMED].tolist()
    )
    return sizes, [
        f"{where}: the teeth's places recur each revolution with {100 * share:.2g} % of a pitch "
        f"({math.degrees(float(np.std(found))):.2g} deg); of that whole orders hold, most of all {largest}, be it of "
        f"teeth or torsion of constant size; learn the teeth from a stretch without torsion, --learn-teeth FROM,TO"
    ]


def tachos(measurement: Measurement) -> list[dict[str, Any]]:
    """List channels that look like pulses: name, pulses per second, evenness, and recurring gap (if any)."""
    listed = ((channel.name, _looks_like_pulses(channel)) for channel in measurement.channels)
    return [{"channel": name, **told} for name, told in listed if told]


def _looks_like_pulses(channel: Channel) -> dict[str, Any]:
    """Describe pulses in a channel's first million samples; empty if they are too few or too uneven."""
    part = replace(channel, size=min(channel.size, 1_000_000))
    try:
        times = pulse_times(part).times
    except InputError:
        return {}
    if times.size < 16 or (channel.step > 0.0 and times.size > part.size / 4):
        return {}
    ratio = pitches(times)
    if float(np.mean(np.abs(ratio - np.rint(ratio)) > 0.3)) > 0.02:
        return {}
    told: dict[str, Any] = {"pulses": int(times.size), "pulses_hz": float(1.0 / np.median(np.diff(times)))}
    if (gap := recurring_gap(times)) is not None:
        told |= {"teeth": gap.apart, "missing": gap.missing}
    return told
