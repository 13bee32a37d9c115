"""The virtual engine: connections of cranktrain, combustion and valve train.

The combustion extrapolates the angle by the speed and outputs the angle to which its pressures belong. The cranktrain
reconstructs the pressures by this angle (reconstruction ``own``). With any other reconstruction the master reconstructs
them over the crank angle, and the cranktrain holds its inputs. With scheme ``stages`` the cranktrain requests pressures
and valve torque at the stages of its integrator, and nothing is reconstructed.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.results.summary import vibration
from cranktrain_lab.coupling import valve_drive
from cranktrain_lab.coupling.connections import MEAN, NEWEST, START, Connection
from cranktrain_lab.coupling.fmu3_unit import open_fmu
from cranktrain_lab.coupling.fmu_unit import FmuUnit
from cranktrain_lab.coupling.master import Exchange
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, OWN, RECONSTRUCTIONS, STAGES, VALVETRAIN
from cranktrain_lab.coupling.recording_unit import MeasuredPressures, TraceUnit
from cranktrain_lab.coupling.run import Bond, Coupled, System

ANGLE, SPEED, FRAME_SPEED = "crank.angle", "crank.speed", "frame.speed"
POLYTROPIC = "polytropic"
"""Input rule of the cranktrain that reconstructs pressures by polytropic change."""
INTEGRATOR = "solver.integrator"
SHORT = math.radians(1.5) * (1.0 + 1.0e-9)
"""Largest change of crank angle per communication step, rad, that counts as a short step.

The cranktrain ends a step at every point, because its pressures change there. At short steps a method of order three
with three implicit stages has a smaller error than the exchange of pressures, and takes two thirds of the time of the
usual method, which is made for steps of 5 degrees.
"""
FOR_SHORT_STEPS, FOR_SHORT_STEPS_HELD = "esdirk3", "sdirk3"
"""Integrators for short communication steps; the second one is for inputs that are held constant over a step."""
WORK = "gas.work"
"""Output with the work of the gas since the start. Cranktrain and combustion both have it."""
DEVIATIONS, TAKEN = ("volume_deviation", "volume_deviation_rate"), "deviation_taken"
"""Outputs of the cranktrain for each cylinder's volume deviation, and output of the combustion that returns it."""
READ = {
    CRANKTRAIN: ("pulley.torsion", "pulley.axial", "shaft.torque", "torque.indicated", FRAME_SPEED, WORK),
    COMBUSTION: ("indicated.pressure_mean", "indicated.torque", "heat.released", "heat.walls", WORK),
    VALVETRAIN: valve_drive.READ,
}
"""Outputs of cranktrain and combustion that a run records in addition to connected outputs."""
PRESSURE_ANGLE = Connection((COMBUSTION, "pressure.angle"), (CRANKTRAIN, "pressure.angle"), NEWEST)
GAS = Bond("gas", given=[((COMBUSTION, "indicated.torque"), (CRANKTRAIN, SPEED))],
           taken=[((CRANKTRAIN, "torque.indicated"), (CRANKTRAIN, FRAME_SPEED))])  # fmt: skip
GAS_WORK = Bond("gas", given=[((COMBUSTION, WORK),)], taken=[((CRANKTRAIN, WORK),)], works=True)


@dataclass(frozen=True)
class Partners:
    """FMUs of the virtual engine, with or without a valve train, and start values of their parameters.

    Measured pressures may replace the combustion.
    """

    cranktrain: Path
    combustion: Path | MeasuredPressures
    values: Mapping[str, Mapping[str, Any]]
    valvetrain: Path | None = None


@dataclass(frozen=True)
class VirtualEngine(System):
    """Coupled system of the virtual engine, with start values of its units, by unit."""

    units: dict[str, FmuUnit | TraceUnit]
    values: dict[str, dict[str, Any]]

    @property
    def one_angle(self) -> str | None:
        """Path of the combustion if it uses one crank angle for all cylinders, else None."""
        combustion = self.units[COMBUSTION]
        if isinstance(combustion, TraceUnit) or any(TAKEN in link.source[1] for link in self.connections):
            return None
        taken = any(DEVIATIONS[0] in link.target[1] for link in self.connections)
        return None if taken else str(combustion.path)


def virtual_engine(
    partners: Partners, speed: float, scheme: str, reconstruction: str, step: float = math.inf
) -> VirtualEngine:
    """Return cranktrain, combustion and valve train (if any) at a constant shaft speed (rad/s).

    ``step`` is the longest communication step, s. Short steps select the cranktrain's integrator, see :data:`SHORT`.
    Parts of a step with scheme ``intermediate`` always count as short.

    Raises
    ------
    InputError
        FMUs that are not cranktrain, combustion or valve train of one number of cylinders, start values of an absent
        valve train, an unknown reconstruction
    """
    if reconstruction not in RECONSTRUCTIONS:
        raise InputError(
            f"reconstruction '{reconstruction}' does not exist; {nearest(reconstruction, RECONSTRUCTIONS)}"
        )
    if partners.valvetrain is None and VALVETRAIN in partners.values:
        raise InputError("start values are given for the valve train, which is left out; remove them")
    rule = rule_between(scheme, reconstruction)
    own, staged = rule == POLYTROPIC, rule == STAGES
    given = {name: dict(partners.values.get(name, {})) for name in (VALVETRAIN, COMBUSTION, CRANKTRAIN)}
    given[CRANKTRAIN] = {
        "speed": speed, "gas.source": "input", "input.reconstruction": rule,
    } | given[CRANKTRAIN]  # fmt: skip
    lifted = False
    combustion: FmuUnit | TraceUnit
    if isinstance(partners.combustion, MeasuredPressures):
        if given[COMBUSTION]:
            raise InputError("start values are given for a combustion, which measured pressures replace; remove them")
        combustion = TraceUnit(COMBUSTION, partners.combustion)
    else:
        lifted = partners.valvetrain is not None and valve_drive.takes_lifts(partners.combustion)
        given[COMBUSTION] = {SPEED: speed} | (valve_drive.LIFTS if lifted else {}) | given[COMBUSTION]
        combustion = open_fmu(partners.combustion, COMBUSTION, given[COMBUSTION])
    cranktrain = open_fmu(partners.cranktrain, CRANKTRAIN, given[CRANKTRAIN])
    is_open = cranktrain.has(INTEGRATOR) and not {INTEGRATOR, "solver.control"} & given[CRANKTRAIN].keys()
    if is_open and not staged and (speed * step <= SHORT or scheme == "intermediate"):
        given[CRANKTRAIN][INTEGRATOR] = FOR_SHORT_STEPS if own else FOR_SHORT_STEPS_HELD
        cranktrain.set_start(INTEGRATOR, given[CRANKTRAIN][INTEGRATOR])
    cylinders, taken = (sum(map(is_pressure, ports)) for ports in (combustion.outputs, cranktrain.inputs))
    if not cylinders or cylinders != taken:
        where = "--pressure" if isinstance(combustion, TraceUnit) else combustion.path
        raise InputError(
            f"{where}: pressures of {cylinders} cylinders, {partners.cranktrain} takes those of {taken}; "
            "take FMUs of one engine"
        )
    connections, exchange = gas_connections(cylinders, own, staged), gas_exchange(scheme, reconstruction)
    if takes_deviations(combustion.inputs) and takes_deviations(cranktrain.outputs):
        connections += volume_connections(cylinders)
    units: dict[str, FmuUnit | TraceUnit] = {COMBUSTION: combustion, CRANKTRAIN: cranktrain}
    gas = GAS_WORK if WORK in combustion.outputs and WORK in cranktrain.outputs else GAS
    bonds = [gas]
    if partners.valvetrain is not None:
        given[VALVETRAIN] = {SPEED: speed} | given[VALVETRAIN]
        valvetrain = open_fmu(partners.valvetrain, VALVETRAIN, given[VALVETRAIN])
        units = {VALVETRAIN: valvetrain, **units}
        connections += valve_drive.connections(valvetrain, cylinders, lifted, own, staged)
        bonds = [gas, valve_drive.BOND]
        if staged:
            exchange = replace(exchange, whole=(VALVETRAIN,))
    outputs = {name: [output for output in READ[name] if output in unit.outputs] for name, unit in units.items()}
    return VirtualEngine(units, connections, exchange, outputs, bonds, given)


def rule_between(scheme: str, reconstruction: str) -> str:
    """Return the cranktrain's rule for inputs between communication points; raises ``InputError`` for a conflict."""
    if scheme != STAGES:
        return POLYTROPIC if reconstruction == OWN else "hold"
    if reconstruction != OWN:
        raise InputError(
            f"scheme '{STAGES}' reconstructs nothing; leave reconstruction '{reconstruction}' out, or choose another"
        )
    return STAGES


def gas_connections(cylinders: int, own: bool, staged: bool = False) -> list[Connection]:
    """Return connections of crank motion to the combustion and of pressures back; ``own``: newest values, not means."""
    connections = valve_drive.motion_connections(COMBUSTION, staged)
    connections += [
        Connection((COMBUSTION, name), (CRANKTRAIN, name), NEWEST if own else MEAN)
        for name in (f"cylinder[{c + 1}].pressure" for c in range(cylinders))
    ]
    if own:
        connections.append(PRESSURE_ANGLE)
    return connections


def takes_deviations(names: Iterable[str]) -> bool:
    """True if volume deviations are in ``names``, the inputs of a combustion or the outputs of a cranktrain."""
    return f"cylinder[1].{DEVIATIONS[0]}" in names


def volume_connections(cylinders: int) -> list[Connection]:
    """Return connections of volume deviations to the combustion, and of the used deviations back to the cranktrain."""
    of_each = [f"cylinder[{c + 1}]." for c in range(cylinders)]
    told = [
        Connection((CRANKTRAIN, head + name), (COMBUSTION, head + name), START, judged=False)
        for head in of_each
        for name in DEVIATIONS
    ]
    return told + [
        Connection((COMBUSTION, head + TAKEN), (CRANKTRAIN, head + TAKEN), NEWEST, judged=False) for head in of_each
    ]


def gas_exchange(scheme: str, reconstruction: str) -> Exchange:
    """Return the master's exchange settings: reconstruction over the crank angle, or none."""
    if scheme == STAGES:
        return Exchange(scheme, "hold")
    own = reconstruction == OWN
    return Exchange(scheme, "hold" if own else reconstruction, None if own else (CRANKTRAIN, ANGLE))


def summary(run: Coupled, speed: float) -> dict[str, Any]:
    """Summarise the last cycle of a coupled run at constant speed (rad/s); no IMEP if the combustion has none."""
    mean_pressure = f"{COMBUSTION}.indicated.pressure_mean"
    angle, cycle = speed * run.times, 4.0 * math.pi / speed
    last = run.times >= run.times[-1] - cycle * (1.0 + 1.0e-9)
    residuals = {name: float(np.sqrt(np.mean(values[last[1:]] ** 2))) for name, values in run.residuals.items()}
    times, steps = run.times[last], np.diff(run.times[last])

    def mean(name: str) -> float:
        """Return the time mean over the last cycle, whose communication points may be unequally spaced."""
        return float(np.trapezoid(run.of(name)[last], times) / (times[-1] - times[0]))

    made = float(np.average(run.residuals[GAS.name][last[1:]][-steps.size :], weights=steps))
    given = speed * mean(f"{COMBUSTION}.indicated.torque")
    valves = {}
    if valve_drive.BOND.name in residuals:
        torque, loss = (
            float(run.of(f"{VALVETRAIN}.{name}")[-1]) for name in ("valvetrain.torque_mean", "contact.loss")
        )
        valves = {
            VALVETRAIN: {
                "torque_nm": torque, "contact_loss": loss,
                "coupling_residual_w": residuals[valve_drive.BOND.name],
            }
        }  # fmt: skip
    return {
        "pulley": {
            "torsion_deg": vibration(angle, run.of(f"{CRANKTRAIN}.pulley.torsion"), 180.0 / math.pi),
            "axial_um": vibration(angle, run.of(f"{CRANKTRAIN}.pulley.axial"), 1e6),
        },
        "imep_pa": float(run.of(mean_pressure)[-1]) if mean_pressure in run.names else None,
        "indicated_torque_nm": mean(f"{COMBUSTION}.indicated.torque"),
        "shaft_torque_nm": mean(f"{CRANKTRAIN}.shaft.torque"),
        "coupling_residual_w": residuals[GAS.name],
        "coupling_residual_mean_w": made,
        "coupling_residual_fraction": made / given if given else None,
        "real_time_factor": run.seconds / float(run.times[-1] - run.times[0]),
        "seconds": run.seconds,
        "steps": run.steps,
        "refused_steps": run.refused,
        "sweeps": run.sweeps,
        **valves,
    }


def is_pressure(name: str) -> bool:
    """True for the name of a cylinder's pressure."""
    return name.startswith("cylinder[") and name.endswith("].pressure")
