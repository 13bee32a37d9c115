"""Drive line after the flywheel: the connecting shaft, or a chain of discs, shafts, gears and branches.

Discs are rotors that rotate freely about the crank's axis. Shafts are force laws between discs, like the connecting
shaft. A disc after gears runs at g times the crank's speed; its motion ψ is its rotation minus g times the frame's.
A shaft with a gear of ratio r at its first end twists by r θ₁ − θ₂ (:mod:`cranktrain.engine.torsional_chain`).
Consistent gears have r g₁ = g₂, so the twist is r ψ₁ − ψ₂ and does not depend on the frame's angle. If the frame leads
the dynamometer of given speed by δ, the dynamometer's motion is −g δ.

A disc's absolute damping acts on its motion relative to uniform rotation at the given speed, or relative to the frame
if a torque loads the dynamometer. Loss factors are not part of the laws, because their damping depends on the common
modes of crank and line (:mod:`cranktrain.dynamics.model.hysteresis`).

A line without a shaft to the dynamometer ends freely; ``end_speed`` is then 1 and the line has no stiffness as a whole.

A line that begins on an added body, which turns at g times the crank's speed, takes this body's place for the flywheel;
all speeds of the line are then g times as large.

Source: W. Ker Wilson, *Practical Solution of Torsional Vibration Problems*, vol. 1 (1956), geared and branched systems.
"""

from typing import NamedTuple

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.engine.model import Engine
from cranktrain.engine.torsional_chain import DYNAMOMETER, FLYWHEEL, Chain, Shaft, coordinates, gear_speeds

STIFFNESS, DAMPING, LEADING, AT_FLYWHEEL, LAW = range(5)
"""Columns of a shaft's row: stiffness (N m/rad), damping (N m s/rad), twist by frame lead and by flywheel rotation."""


class TorsionalLine(NamedTuple):
    """Drive line of r rotors and s shafts and absolute dampers (SI).

    Attributes
    ----------
    names, inertia, speeds : (r,) names of the rotors (of the first disc of each), inertia, speeds over the crank's
    end_speed : speed of the dynamometer over the crank's
    twists : (s, r + 2) twist of each shaft by the rotations of flywheel, rotors and dynamometer
    laws : (s, LAW) columns of each shaft's law
    hysteresis : (s,) η k of each shaft, N m/rad
    shafts : shafts with stiffness, which are the first rows of ``twists``
    free : whether no shaft leads to the dynamometer
    last : index of the rotor with the table's last disc, on which the load acts if the line ends freely
    follow : (r,) rotations of the rotors for a slow unit rotation of the crank with the dynamometer at rest
    stiffness, damping : those of the whole line at the crank in the motion ``follow``, without loss factors
    """

    names: tuple[str, ...]
    inertia: Array
    speeds: Array
    end_speed: float
    twists: Array
    laws: Array
    hysteresis: Array
    shafts: tuple[Shaft, ...]
    free: bool
    last: int
    follow: Array
    stiffness: float
    damping: float

    @property
    def interfaces(self) -> tuple[str, ...]:
        """Names of the rotors as interfaces of the rotating body."""
        return tuple(f"line[{name}]" for name in self.names)

    @property
    def inertia_at_crank(self) -> float:
        """Inertia of the rotors reduced to the crank, for rigid rotation of the line, kg m²."""
        return float(self.inertia @ self.speeds**2)


def torsional_line(engine: Engine) -> TorsionalLine:
    """Make an engine's drive line."""
    if engine.drive_line_chain is not None:
        found = _line(engine.drive_line_chain.chain)
    else:
        line = engine.drive_line
        found = _line(Chain((), (Shaft((FLYWHEEL, DYNAMOMETER), line.stiffness, line.damping),)))
    ratio = engine.line_ratio
    if ratio == 1.0:
        return found
    laws = found.laws.copy()
    laws[:, LEADING] *= ratio
    return found._replace(
        speeds=ratio * found.speeds, end_speed=ratio * found.end_speed, follow=ratio * found.follow, laws=laws,
        stiffness=ratio**2 * found.stiffness, damping=ratio**2 * found.damping,
    )  # fmt: skip


def windup_stiffness(line: TorsionalLine) -> float:
    """Return the sum of the stiffnesses, reduced to the flywheel, of the shafts on the flywheel, N m/rad."""
    return float((line.laws[:, STIFFNESS] * line.laws[:, AT_FLYWHEEL] ** 2).sum())


def windup_shares(line: TorsionalLine) -> Array:
    """Return weights (s,) of the shafts' twists in the wind-up; wind-up times ``windup_stiffness`` is the torque."""
    stiffness = windup_stiffness(line)
    torques = line.laws[:, STIFFNESS] * line.laws[:, AT_FLYWHEEL]
    return torques / stiffness if stiffness > 0.0 else np.zeros_like(torques)


def _line(chain: Chain) -> TorsionalLine:
    turns, speeds = coordinates(chain), gear_speeds(chain)
    free = DYNAMOMETER not in speeds
    speeds.setdefault(DYNAMOMETER, 1.0)
    # Matrix from rotations of flywheel, rotors and dynamometer to rotations of flywheel, discs, dynamometer.
    whole = np.zeros((len(chain.discs) + 2, turns.shape[1] + 2))
    whole[0, 0] = whole[-1, -1] = 1.0
    whole[1:-1, 1:-1] = turns
    names = (FLYWHEEL, *chain.names, DYNAMOMETER)
    leaders = [int(np.flatnonzero(column)[0]) for column in turns.T]
    rotor_speeds = np.array([speeds[chain.names[leader]] for leader in leaders])
    inertia = turns.T**2 @ np.array([disc.inertia for disc in chain.discs])
    absolute = turns.T**2 @ np.array([disc.damping for disc in chain.discs])
    twists, laws, lost, shafts = [], [], [], []
    for shaft in chain.shafts:
        if shaft.stiffness > 0.0 or not chain.discs:
            row = shaft.ratio * whole[names.index(shaft.between[0])] - whole[names.index(shaft.between[1])]
            twists.append(row)
            shafts.append(shaft)
            laws.append([shaft.stiffness, shaft.damping, -row[-1] * speeds[DYNAMOMETER], row[0]])
            lost.append(shaft.loss_factor * shaft.stiffness)
    for k in np.flatnonzero(absolute):
        twists.append(np.eye(len(rotor_speeds) + 2)[1 + k])
        laws.append([0.0, absolute[k], rotor_speeds[k], 0.0])
        lost.append(0.0)
    rows, law = np.array(twists), np.array(laws)
    stiffness = rows.T @ (law[:, STIFFNESS, None] * rows)
    moving = stiffness[:-1, :-1]
    follow = -np.linalg.solve(moving[1:, 1:], moving[1:, 0])
    slow = rows[:, :-1] @ np.append(1.0, follow)
    effective = (float(law[:, column] @ slow**2) for column in (STIFFNESS, DAMPING))
    last = int(np.flatnonzero(turns[-1])[0]) if chain.discs else -1
    rotors = tuple(chain.names[leader] for leader in leaders)
    return TorsionalLine(
        rotors,
        inertia,
        rotor_speeds,
        speeds[DYNAMOMETER],
        rows,
        law,
        np.array(lost),
        tuple(shafts),
        free,
        last,
        follow,
        *effective,
    )
