"""Inputs and outputs of the valve train as a unit of the virtual engine.

The valve train steps first and extrapolates the crank angle by itself. Combustion and cranktrain extrapolate its lifts
and torque linearly, so these outputs must belong to the step's start. A cranktrain that holds its inputs gets the mean
torque from the master.
"""

from pathlib import Path

from cranktrain.core.errors import InputError
from cranktrain_lab.coupling.connections import MEAN, START, Connection
from cranktrain_lab.coupling.fmu_unit import FmuUnit, described
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, VALVETRAIN
from cranktrain_lab.coupling.run import Bond

ANGLE, SPEED, TORQUE = "crank.angle", "crank.speed", "valvetrain.torque"
TORQUE_STEP = "valvetrain.torque_step"
"""Output with the mean torque over a step."""
LIFTS = {"lift.source": "input"}
"""Start values of the combustion's FMU if it is coupled with a valve train."""
READ = (TORQUE, "valvetrain.torque_mean", "contact.loss", "drive.apart", "friction.power")
"""Outputs of the valve train that a run records in addition to connected outputs."""
BOND = Bond("valve_drive", given=[((VALVETRAIN, TORQUE), (VALVETRAIN, SPEED))],
            taken=[((CRANKTRAIN, TORQUE), (CRANKTRAIN, SPEED))])  # fmt: skip


def takes_lifts(combustion: Path) -> bool:
    """True if a combustion's FMU has inputs for valve lifts. An FMU without these inputs uses built-in lifts."""
    return any(v.causality == "input" and _is_lift(v.name) for v in described(combustion).modelVariables)


def motion_connections(taker: str, staged: bool) -> list[Connection]:
    """Return connections of crank angle and speed to a unit that extrapolates the angle by the speed.

    ``staged``: connect the mean speed over the step, which scheme ``stages`` knows in advance.
    """
    kinds = {ANGLE: START, SPEED: MEAN if staged else START}
    return [Connection((CRANKTRAIN, name), (taker, name), kind) for name, kind in kinds.items()]


def connections(valvetrain: FmuUnit, cylinders: int, lifted: bool, own: bool, staged: bool = False) -> list[Connection]:
    """Return connections of the valve train: angle and speed in, torque out, with ``lifted`` lifts to the combustion.

    ``InputError`` if the number of cylinders differs.
    """
    lifts = [name for name in valvetrain.outputs if _is_lift(name)]
    if len(lifts) != 2 * cylinders:
        raise InputError(
            f"{valvetrain.path}: {len(lifts)} lifts for {cylinders} cylinders, which have an intake and an "
            "exhaust lift each; take FMUs of one engine"
        )
    found = motion_connections(VALVETRAIN, staged)
    if lifted:
        found += [Connection((VALVETRAIN, name), (COMBUSTION, name), START) for name in lifts]
    given = (VALVETRAIN, TORQUE_STEP) if staged and TORQUE_STEP in valvetrain.outputs else (VALVETRAIN, TORQUE)
    return [*found, Connection(given, (CRANKTRAIN, TORQUE), START if own else MEAN)]


def _is_lift(name: str) -> bool:
    return name.endswith(("intake_lift", "exhaust_lift"))
