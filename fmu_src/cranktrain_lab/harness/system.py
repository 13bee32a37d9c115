"""Construction of a scenario's coupled system: FMUs, start values, connections, signals, modifiers and faults."""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.stated_units import begins_as_number, stated
from cranktrain_lab.coupling.connections import Connection, by_name
from cranktrain_lab.coupling.fmu3_unit import open_fmu
from cranktrain_lab.coupling.fmu_unit import FmuUnit
from cranktrain_lab.coupling.master import Exchange
from cranktrain_lab.coupling.modules import CRANKTRAIN
from cranktrain_lab.coupling.recording_unit import RecordingUnit
from cranktrain_lab.coupling.run import Bond, System
from cranktrain_lab.coupling.unit import Unit
from cranktrain_lab.coupling.virtual_engine import (
    POLYTROPIC,
    Partners,
    gas_exchange,
    is_pressure,
    rule_between,
    virtual_engine,
)
from cranktrain_lab.harness.assertion_entries import refuse_below_zero, refuse_unresolved
from cranktrain_lab.harness.entries import NAN, ORDER, Change, Harness, Scenario, Variable
from cranktrain_lab.harness.measures import MEASURED, between, named
from cranktrain_lab.harness.recording import MISFIT, SPEED, UNIT, compared, connected
from cranktrain_lab.harness.signals import SIGNALS, Curve, DroppedOut, Faulty, Noisy, Signals, in_turn


@dataclass(frozen=True)
class Prepared(System):
    """Coupled system of a scenario, and the channels that are compared with a measurement."""

    compared: tuple[str, ...] = ()


def prepared(harness: Harness, scenario: Scenario, fmus: Mapping[str, Path]) -> Prepared:
    """Return the coupled system of a scenario; ``fmus`` are the files of units by name.

    Raises
    ------
    InputError
        invalid variables, units of measurement or connections
    """
    starts = {name: _converted(name, path, harness, scenario) for name, path in fmus.items()}
    recorded = None if harness.recording is None else RecordingUnit(UNIT, harness.recording)
    compare: list[str] = []
    if recorded is not None:
        units, connections, exchange, outputs = _of_recording(harness, scenario, fmus, starts, recorded)
        compare = compared(recorded.recording, units[CRANKTRAIN])
        bonds: list[Bond] = []
        outputs[CRANKTRAIN] += compare
    elif harness.links is None:
        units, connections, exchange, outputs, bonds = _of_virtual_engine(harness, scenario, fmus, starts)
    else:
        units = {name: open_fmu(path, name, starts[name]) for name, path in fmus.items()}
        connections = []
        for link in harness.links or ():
            ends = [tuple(end.strip().split(".", 1)) for end in link.split("->")]
            connections.append(Connection((ends[0][0], ends[0][1]), (ends[1][0], ends[1][1])))
        if harness.by_name:
            taken = {connection.target for connection in connections}
            connections += [connection for connection in by_name(units) if connection.target not in taken]
        exchange = Exchange(scenario.way.scheme, scenario.way.reconstruction, harness.abscissa)
        outputs, bonds = {name: [] for name in units}, []
    bonds = [*bonds, *harness.bonds]
    _read(harness, scenario, units, outputs, bonds)
    alongside: dict[str, Unit] = {} if recorded is None else {UNIT: recorded}
    signals, fed = _signals(scenario, units, connections)
    connections = _modified(scenario, units, [*connections, *fed])
    faulty = {fault.unit: Faulty(units[fault.unit], fault) for fault in scenario.faults}
    return Prepared({**alongside, **units, **faulty, **signals}, connections, exchange, outputs, bonds, tuple(compare))


def check(system: Prepared, scenario: Scenario, points: float) -> None:
    """Raise ``InputError`` for a system that the co-simulation master refuses, or assertions on missing data.

    ``points``: communication points per cycle for orders, 0 without crank angle and speed.
    """
    master = system.master()
    for bond in system.bonds:
        for pair in (*bond.given, *bond.taken):
            for place in pair:
                master.find(*place)
    for fault in scenario.faults:
        if fault.kind == NAN and not any(name.startswith(f"{fault.unit}.") for name in master.names):
            raise InputError(
                f"scenario '{scenario.name}': fault of {fault.unit}: none of its outputs is read, so that NaN has no "
                "effect; name an output, or take another kind"
            )
    bonds = [bond.name for bond in system.bonds]
    for k, assertion in enumerate(scenario.assertions, 1):
        where = f"scenario '{scenario.name}': assert {k}"
        if assertion.residual and assertion.residual not in bonds:
            raise InputError(
                f"{where}: there is no power bond '{assertion.residual}'; "
                + (nearest(assertion.residual, bonds) if bonds else "add a table [power.NAME]")
            )
        unit, name = assertion.output or ("", "")
        if unit == MISFIT and name not in system.compared:
            near = nearest(name, system.compared) if system.compared else "name a channel as an output of the model"
            raise InputError(f"{where}: the measurement has no {name} to compare; {near}")
        if unit == UNIT and name not in system.units[UNIT].outputs:
            raise InputError(f"{where}: measured.{name} is no channel; {nearest(name, system.units[UNIT].outputs)}")
        if assertion.measure == ORDER:
            if not points:
                raise InputError(f"{where}: orders need angle or speed_rpm in the file")
            try:
                refuse_unresolved(assertion.order, points)
            except InputError as error:
                raise InputError(f"{where}: {error}") from None
            refuse_below_zero(ORDER, assertion.bounds, where)
        if assertion.unit:
            source = CRANKTRAIN if unit == MISFIT else unit
            port = system.units[source].outputs[name] if name else MEASURED["W"]
            between(assertion.unit, port, where)


def _converted(name: str, path: Path, harness: Harness, scenario: Scenario) -> dict[str, Any]:
    """Return start values of a unit, in the units of measurement of its variables."""
    given = {**harness.units[name].start, **scenario.start.get(name, {})}
    if not any(unit or begins_as_number(value) for value, unit in given.values()):
        return {key: value for key, (value, _) in given.items()}
    known, found = open_fmu(path, name), {}
    for key, (value, unit) in given.items():
        if begins_as_number(value) and known.is_real(key):
            try:
                value, unit = stated(value, f"20 {known.port(key).unit or 'degC'}")
            except InputError as error:
                raise InputError(f"{name}: {key}: {error}") from None
        found[key] = value
        if unit:
            factor, shift = between(named(unit, f"{name}: {key}"), known.port(key), f"{name}: {key}")
            found[key] = factor * value + shift
    return found


def _of_virtual_engine(
    harness: Harness, scenario: Scenario, fmus: Mapping[str, Path], starts: Mapping[str, Mapping[str, Any]]
) -> tuple[dict[str, FmuUnit], list[Connection], Exchange, dict[str, list[str]], list[Bond]]:
    """Return units, connections, exchange, outputs and power bonds, as ``cranktrain couple`` makes them."""
    known = [field.name for field in fields(Partners) if field.name != "values"]
    for name in fmus:
        if name not in known:
            raise InputError(f"the virtual engine has no unit '{name}'; {nearest(name, known)}, or give [connections]")
    assert harness.speed is not None
    partners = Partners(**fmus, values=starts)
    way = scenario.way
    made = virtual_engine(partners, harness.speed, way.scheme, way.reconstruction, way.steps.longest)
    units = {name: unit for name, unit in made.units.items() if isinstance(unit, FmuUnit)}
    return units, list(made.connections), made.exchange, made.outputs, list(made.bonds)


def _of_recording(
    harness: Harness, scenario: Scenario, fmus: Mapping[str, Path], starts: Mapping[str, Mapping[str, Any]],
    recorded: RecordingUnit,
) -> tuple[dict[str, FmuUnit], list[Connection], Exchange, dict[str, list[str]]]:  # fmt: skip
    """Return the cranktrain with connections to measured pressures and speed, exchange and outputs."""
    assert harness.speed is not None
    rule, recording = rule_between(scenario.way.scheme, scenario.way.reconstruction), recorded.recording
    speed = recorded.at(SPEED, 0.0) if SPEED in recorded.outputs else harness.speed
    given = {
        "speed": speed, "gas.source": "input", "input.reconstruction": rule,
    } | dict(starts.get(CRANKTRAIN, {}))  # fmt: skip
    cranktrain = open_fmu(fmus[CRANKTRAIN], CRANKTRAIN, given)
    cylinders, taken = (sum(map(is_pressure, ports)) for ports in (recorded.outputs, cranktrain.inputs))
    if cylinders != taken:
        raise InputError(
            f"measured: {recording.name} has pressures of {cylinders} cylinders, {fmus[CRANKTRAIN].name} takes those "
            f"of {taken}; take the FMU of engine and measurement"
        )
    outputs = {UNIT: list(recorded.outputs), CRANKTRAIN: ["crank.angle", "crank.speed"]}
    exchange = gas_exchange(scenario.way.scheme, scenario.way.reconstruction)
    return {CRANKTRAIN: cranktrain}, connected(cylinders, recorded, rule == POLYTROPIC), exchange, outputs


def _read(
    harness: Harness, scenario: Scenario, units: Mapping[str, Unit], outputs: dict[str, list[str]],
    bonds: Sequence[Bond],
) -> None:  # fmt: skip
    """Add to ``outputs`` the outputs that the file records or asserts, or that orders and ratios need."""
    wanted = [((unit, name), f"units.{unit}.record") for unit, entry in harness.units.items() for name in entry.record]
    # If another scenario asserts a ratio to this scenario, the same output is needed here.
    wanted += [
        (assertion.output, f"scenario '{one.name}': assert {k}")
        for one in harness.scenarios
        for k, assertion in enumerate(one.assertions, 1)
        if assertion.output is not None and scenario.name in (one.name, assertion.ratio_to)
    ]
    wanted += [
        ((fault.unit, fault.output), f"scenario '{scenario.name}': fault") for fault in scenario.faults if fault.output
    ]
    wanted += [(output, what) for output, what in ((harness.angle, "angle"), (harness.abscissa, "abscissa")) if output]
    wanted += [
        (place, f"power.{bond.name}")
        for bond in bonds
        for pair in (*bond.given, *bond.taken)
        for place in pair
        if place[1] in units[place[0]].outputs
    ]
    wanted = [(output, where) for output, where in wanted if output[0] not in (UNIT, MISFIT)]
    for (unit, name), where in wanted:
        if name not in units[unit].outputs:
            kind = "an input, which is not recorded" if name in units[unit].inputs else "not an output"
            raise InputError(f"{where}: {unit}.{name} is {kind}; {nearest(name, units[unit].outputs)}")
        there = outputs.setdefault(unit, [])
        if name not in there:
            there.append(name)


def _signals(
    scenario: Scenario, units: Mapping[str, FmuUnit], connections: Sequence[Connection]
) -> tuple[dict[str, Unit], list[Connection]]:
    """Return the unit whose outputs are a scenario's changes, with its connections; empty without changes."""
    taken = {connection.target: connection for connection in connections}
    curves: dict[Variable, Curve] = {}
    for change in scenario.changes:
        where = f"scenario '{scenario.name}': change of {'.'.join(change.target).lstrip('.')}"
        unit, name = target = _target(change, units, where)
        if name not in units[unit].inputs:
            raise InputError(f"{where}: {unit} has no such input; {nearest(name, units[unit].inputs)}")
        if target in taken:
            raise InputError(f"{where}: it is connected by {taken[target].text}; change an input that is free")
        port, start = units[unit].inputs[name], units[unit].start(name)
        factor, shift = between(change.unit, port, where)
        value = start if change.value is None else factor * change.value + shift
        if not port.low <= value <= port.high:
            raise InputError(f"{where}: {value:g} is not within {port.low:g} and {port.high:g} {port.unit}".rstrip())
        curves.setdefault(target, Curve(start)).go(change.begin, change.end, value)
    if not curves:
        return {}, []
    for (unit, name), curve in curves.items():
        units[unit].set_start(name, curve.at(0.0))
    named = {f"{unit}.{name}": curve for (unit, name), curve in curves.items()}
    ports = {f"{unit}.{name}": replace(units[unit].inputs[name], feeds=frozenset()) for unit, name in curves}
    links = [Connection((SIGNALS, f"{unit}.{name}"), (unit, name)) for unit, name in curves]
    return {SIGNALS: Signals(named, ports)}, links


def _target(change: Change, units: Mapping[str, FmuUnit], where: str) -> Variable:
    """Return unit and name of a change's input. Without a named unit, exactly one unit must have this input."""
    unit, name = change.target
    if unit:
        return unit, name
    having = [key for key, one in units.items() if name in one.inputs]
    if not having and change.other is not None:
        return _target(replace(change, target=change.other, other=None), units, where)
    if len(having) != 1:
        said = f"units {', '.join(having)} have this input" if having else "no unit has this input"
        inputs = [key for one in units.values() for key in one.inputs]
        raise InputError(f"{where}: {said}; " + ("name one with a step" if having else nearest(name, inputs)))
    return having[0], name


def _modified(scenario: Scenario, units: Mapping[str, FmuUnit], connections: Sequence[Connection]) -> list[Connection]:
    """Return connections with noise and drop-outs as modifiers."""
    wanted: dict[Variable, list[Callable[[float, float], float]]] = {}
    for what, event in [("noise", n) for n in scenario.noises] + [("dropout", d) for d in scenario.dropouts]:
        unit, name = event.target
        where = f"scenario '{scenario.name}': {what} on {unit}.{name}"
        if name not in units[unit].inputs:
            raise InputError(f"{where}: {unit} has no such input; {nearest(name, units[unit].inputs)}")
        if event.target not in [connection.target for connection in connections]:
            there = [".".join(connection.target) for connection in connections]
            raise InputError(f"{where}: nothing is connected to it; {nearest(f'{unit}.{name}', there)}")
        wanted.setdefault(event.target, [])
    for noise in scenario.noises:
        unit, name = noise.target
        where = f"scenario '{scenario.name}': noise on {unit}.{name}"
        factor, _ = between(noise.unit, units[unit].inputs[name], where, difference=True)
        seed = noise.seed, zlib.crc32(".".join(noise.target).encode())  # two inputs with one seed get different noise
        wanted[noise.target].append(Noisy(noise.begin, noise.end, factor * noise.size, seed))
    for dropout in scenario.dropouts:
        wanted[dropout.target].append(DroppedOut(dropout.begin, dropout.end, dropout.gives))
    return [
        replace(connection, modify=in_turn(wanted[connection.target])) if connection.target in wanted else connection
        for connection in connections
    ]
