"""Measurement of a harness file, compared with the running model: pressures, speed and channels over crank angle.

    [measured]
    file = "bench.csv"                       # any measurement file; one channel is the crank angle
    channels = { "pulley.torsion" = "TORS" } # names of this model and channels of the file, where they differ

The measurement is the unit ``measured`` in place of the combustion. It has ``cylinder[1].pressure`` and so on, or one
``pressure`` that all cylinders have at their own firing angle. ``speed`` drives the dynamometer if there is one. Every
other channel with the name of an output of the cranktrain has a *misfit*, which is model minus measurement at equal
crank angle, without their means over a cycle. Misfits are outputs of the unit ``misfit``.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.core.user_file import beside
from cranktrain.engine.model import Engine
from cranktrain_lab.coupling.connections import MEAN, Connection
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN
from cranktrain_lab.coupling.recording_unit import Recording, RecordingUnit, without_zero
from cranktrain_lab.coupling.run import Coupled
from cranktrain_lab.coupling.unit import Port, Unit
from cranktrain_lab.coupling.virtual_engine import gas_connections
from cranktrain_lab.harness.measures import MEASURED as UNITS
from cranktrain_lab.harness.measures import between, named
from cranktrain_lab.harness.tables import RecordingTable
from cranktrain_lab.measured.channels import Channel, Measurement
from cranktrain_lab.measured.reading import read_measured

UNIT, MISFIT = "measured", "misfit"
"""Names of the units with the measurement and with the misfits."""
ANGLE, SPEED, PRESSURE = "crank.angle", "speed", "pressure"
TURN = 2.0 * math.pi
CYCLE = 4.0 * math.pi
FEWEST = 72
"""Smallest number of samples per cycle."""
WIDEST = 20
"""Limit of the ratio of uniformly spaced samples to samples of the file; a larger ratio means a gap of angles."""
LARGEST = {PRESSURE: 1e9, SPEED: 30000.0 * RPM, "": 1e12}
"""Largest valid pressure (Pa), speed (rad/s) and value of other channels (SI)."""
SI = {ANGLE: "rad", SPEED: "rad/s", PRESSURE: "Pa"}


def read_recording(path: Path, table: RecordingTable, engine: Engine) -> Recording:
    """Return the recording of a harness file at ``path``; raises ``InputError``."""
    place = beside(path, table.file)
    found = read_measured(place)
    names = {channel.name: channel.name for channel in found.channels} | dict(table.channels)
    for name, channel in table.channels.items():
        try:
            found[channel]
        except InputError as error:
            raise InputError(f"measured.channels.'{name}': {error}") from None
    if ANGLE not in names:
        raise InputError(
            f"measured: {place.name} has no channel '{ANGLE}'; name it, channels = {{ \"{ANGLE}\" = "
            f'"{found.channels[0].name}" }}'
        )
    angle = _unwrapped(_in_si(found[names[ANGLE]], ANGLE), place.name) - math.radians(table.zero_deg)
    cycles, grid = _grid(angle, place.name)
    wanted = _wanted(found, names, engine, place.name)
    values, ports = {}, {}
    for name, channel in wanted.items():
        own = found[channel]
        kind = PRESSURE if name.endswith(PRESSURE) else name
        samples = own.values() if kind not in SI else _in_si(own, kind)
        if samples.size != angle.size or not np.all(np.isfinite(samples)):
            raise InputError(
                f"measured: channel '{channel}' of {place.name} has {samples.size} samples, {angle.size} angles, or "
                "values that are not numbers; export it again with one value an angle"
            )
        values[name] = np.interp(grid, angle, samples)
        ports[name] = Port() if kind in SI else UNITS.get(own.unit, Port(own.unit))
    if PRESSURE in values:
        values, ports = _for_all(values, ports, engine, cycles)
    _check(values, place.name)
    return Recording(place.name, cycles, float(grid[0]), values, ports)


def _wanted(found: Measurement, names: Mapping[str, str], engine: Engine, file: str) -> dict[str, str]:
    """Return model names and channels of the file to read; raises ``InputError`` if pressures are missing."""
    cylinders = [f"cylinder[{c + 1}].pressure" for c in range(engine.n_cylinders)]
    there = [name for name in cylinders if name in names]
    if PRESSURE not in names and len(there) < len(cylinders):
        missing = next(name for name in cylinders if name not in names)
        near = nearest(missing, [channel.name for channel in found.channels])
        raise InputError(
            f"measured: {file} has pressures of {len(there)} of the {len(cylinders)} cylinders of '{engine.name}' and "
            f"no '{missing}'; {near}; name the channels of all, or one '{PRESSURE}' for all cylinders"
        )
    more = [name for name in names if name.startswith("cylinder[") and name not in cylinders]
    if more:
        raise InputError(f"measured: {file} has '{more[0]}', engine '{engine.name}' {len(cylinders)} cylinders")
    pressures = there if len(there) == len(cylinders) else [PRESSURE]
    others = [name for name in names if name not in (ANGLE, PRESSURE, *cylinders)]
    return {name: names[name] for name in (*pressures, *others)}


def _in_si(channel: Channel, kind: str) -> Array:
    """Return samples in SI; raises ``InputError`` for a channel without unit or of another dimension."""
    where = f"measured: channel '{channel.name}' of {channel.source}"
    if not channel.unit:
        raise InputError(f"{where} has no unit; write it behind its name, as in '{channel.name} [{SI[kind]}]'")
    factor, shift = between(named(channel.unit, where), UNITS[SI[kind]], where)
    return np.asarray(factor * channel.values() + shift)


def _unwrapped(angle: Array, file: str) -> Array:
    """Return the angle without jumps at the start of each revolution or cycle; raises ``InputError``."""
    steps = np.diff(angle)
    back = np.flatnonzero(steps < 0.0)
    if back.size:
        period = CYCLE if -float(steps[back].min()) > 1.5 * TURN else TURN
        angle = angle + period * np.concatenate(([0.0], np.cumsum(steps < 0.0)))
    wrong = np.flatnonzero(~(np.diff(angle) > 0.0))
    if wrong.size:
        raise InputError(
            f"measured: the crank angle of {file} does not rise from sample {int(wrong[0]) + 1} on; sort its lines"
        )
    return np.asarray(angle)


def _grid(angle: Array, file: str) -> tuple[int, Array]:
    """Return the number of whole cycles, and uniform angles (n,) over them; raises ``InputError``."""
    step = float(np.median(np.diff(angle)))
    cycles = int((float(angle[-1] - angle[0]) + 1.001 * step) / CYCLE)
    if cycles < 1:
        raise InputError(
            f"measured: {file} covers {math.degrees(float(angle[-1] - angle[0])):.0f} deg of crank angle, less than "
            "the 720 of a cycle"
        )
    count = round(CYCLE / step)
    if count < FEWEST:
        raise InputError(f"measured: {file} has {count} samples a cycle; {FEWEST} or more are needed")
    if cycles * count > WIDEST * angle.size:
        raise InputError(
            f"measured: the crank angle of {file} has a gap of {math.degrees(float(np.diff(angle).max())):.4g} deg; "
            "correct it, or cut the file there"
        )
    return cycles, angle[0] + CYCLE * np.arange(cycles * count) / count


def _for_all(
    values: Mapping[str, Array], ports: Mapping[str, Port], engine: Engine, cycles: int
) -> tuple[dict[str, Array], dict[str, Port]]:
    """Return pressures of all cylinders, as the first cylinder's pressure shifted by each firing angle."""
    one = values[PRESSURE]
    period, place = CYCLE * cycles, CYCLE * cycles * np.arange(one.size) / one.size
    first = engine.firing_angles[0]
    rest = {name: own for name, own in values.items() if name != PRESSURE}
    shifted = {
        f"cylinder[{c + 1}].pressure": np.interp((place - phase + first) % period, place, one, period=period)
        for c, phase in enumerate(engine.firing_angles)
    }
    return shifted | rest, dict.fromkeys(shifted, Port()) | {k: v for k, v in ports.items() if k != PRESSURE}


def _check(values: Mapping[str, Array], file: str) -> None:
    """Raise ``InputError`` for impossible pressures, speeds or amplitudes."""
    for name, own in values.items():
        most = LARGEST.get(PRESSURE if name.endswith(PRESSURE) else name, LARGEST[""])
        if not np.abs(own).max() <= most:
            raise InputError(
                f"measured: {name} of {file} goes to {np.abs(own).max():.3g} (SI), more than {most:.3g}; correct it"
            )
        if name.endswith(PRESSURE) and not own.min() > 0.0:
            raise InputError(
                f"measured: {name} of {file} falls to {own.min() / 1e5:.3g} bar; pressures are absolute, see "
                "'cranktrain measured --pegging'"
            )
        if name == SPEED and not own.min() > 0.0:
            raise InputError(f"measured: speed of {file} falls to {own.min() / RPM:.4g} rev/min")


def connected(cylinders: int, unit: RecordingUnit, own: bool) -> list[Connection]:
    """Return connections of a recording in place of the combustion, and of the recorded speed to the dynamometer."""

    def there(end: tuple[str, str]) -> tuple[str, str]:
        return (UNIT, end[1]) if end[0] == COMBUSTION else end

    found = [
        replace(one, source=there(one.source), target=there(one.target)) for one in gas_connections(cylinders, own)
    ]
    if SPEED in unit.outputs:
        found.append(Connection((UNIT, SPEED), (CRANKTRAIN, SPEED), MEAN))
    return found


def compared(recording: Recording, cranktrain: Unit) -> list[str]:
    """Return channels that are outputs of the cranktrain; ``InputError`` for an incompatible unit of measurement."""
    names = [name for name in recording.values if name in cranktrain.outputs]
    for name in names:
        port = recording.ports[name]
        if not port.unit:
            raise InputError(f"measured: channel {name} of {recording.name} has no unit; write it behind its name")
        between(port.unit, cranktrain.outputs[name], f"measured: channel {name} of {recording.name}")
    return names


def with_misfits(run: Coupled, names: Sequence[str], ports: Mapping[str, Port]) -> Coupled:
    """Return a run with its misfits added as outputs ``misfit.NAME``, in the unit of the model."""
    if not names:
        return run
    angle, columns, units = run.of(f"{CRANKTRAIN}.{ANGLE}"), [], []
    for name in names:
        port, own = ports[f"{CRANKTRAIN}.{name}"], ports[f"{UNIT}.{name}"]
        factor, shift = between(own.unit, port, name)
        away = run.of(f"{CRANKTRAIN}.{name}") - factor * run.of(f"{UNIT}.{name}") - shift
        columns.append(without_zero(angle, away))
        units.append(port.unit)
    added = tuple(f"{MISFIT}.{name}" for name in names)
    values = np.column_stack((run.values, *columns))
    return run._replace(names=(*run.names, *added), units=(*run.units, *units), values=values)
