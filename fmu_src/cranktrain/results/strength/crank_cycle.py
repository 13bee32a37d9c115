"""Motion of the crankshaft over a cycle that repeats, and the loads at its interfaces, in axes of the frame.

The loads are what a run shows as outputs, turned into the frame, with the moments that forces on displaced journals and
pins have about the crank's axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.cycle_run import communication_step, settled_motion
from cranktrain.dynamics.model.slots import CRANK_MODES, GRAVITY
from cranktrain.dynamics.model.state import (
    ACCELERATION,
    LEAD_ANGLE,
    LEAD_SPEED,
    POSITION,
    SHAFT_ACCELERATION,
    SHAFT_ANGLE,
    SHAFT_SPEED,
    VELOCITY,
    offset,
)
from cranktrain.dynamics.settled.judging import TOLERANCE
from cranktrain.dynamics.simulation import Simulation


@dataclass(frozen=True, eq=False)
class CrankCycle:
    """Samples of one cycle, k of them from crank angle 0 on, 720° not included (SI).

    Attributes
    ----------
    angle : (k,) crank angle, rad
    position, velocity, acceleration : (k, r) modal coordinates of the running model's crankshaft
    loads : (k, m, 6) force and moment on each interface in axes of the frame
    speed, speed_rate : (k,) of the frame
    gravity : (k, 3) in axes of the frame, m/s²
    """

    angle: Array
    position: Array
    velocity: Array
    acceleration: Array
    loads: Array
    speed: Array
    speed_rate: Array
    gravity: Array


def settled_cycle(
    simulation: Simulation, speed: float, settle: float = TOLERANCE, say: Callable[[str], None] | None = None
) -> CrankCycle:
    """Run until cycles repeat at constant ``speed`` (rad/s), then one more.

    ``InputError`` for a crank that has no stresses; ``SolverError`` where a step fails.
    """
    if simulation.settings.crank != "solid":
        raise InputError(f"crank level '{simulation.settings.crank}' has no stresses; use solid")
    tell = say or (lambda stage: None)
    simulation.inputs[0] = speed
    simulation.initialize()
    tell("cycles until they repeat")
    settled_motion(simulation, settle)
    tell("the cycle that is kept")
    step = communication_step(speed, simulation.settings.step)
    count = round(4.0 * math.pi / speed / step)
    begin = simulation.time
    samples = []
    for k in range(count):
        samples.append(_sample(simulation))
        simulation.step(begin + (k + 1) * step)
    columns = [np.array(column) for column in zip(*samples, strict=True)]
    angle = columns[0] % (4.0 * math.pi)
    order = np.argsort(angle)
    return CrankCycle(*(column[order] for column in (angle, *columns[1:])))


def _sample(simulation: Simulation) -> tuple[Array | float, ...]:
    """What a cycle keeps of the present state."""
    state, model = simulation.state, simulation.model
    n, r = model.omega2.size, int(model.layout[CRANK_MODES])
    frame = float(state[SHAFT_ANGLE] + state[LEAD_ANGLE])
    g = float(model.scalars[GRAVITY])
    q, v, a = (state[offset(block, n) : offset(block, n) + r] for block in (POSITION, VELOCITY, ACCELERATION))
    crank = simulation.outputs[simulation.output_names.index("crank.angle")]
    return (
        crank, q.copy(), v.copy(), a + model.damping[:r] * v, interface_loads(simulation, q, frame),
        state[SHAFT_SPEED] + state[LEAD_SPEED], state[SHAFT_ACCELERATION],
        np.array([-g * math.sin(frame), -g * math.cos(frame), 0.0]),
    )  # fmt: skip


def interface_loads(simulation: Simulation, q: Array, frame: float) -> Array:
    """Force and moment (m, 6) at each interface of the crankshaft from the present outputs, in axes of the frame.

    Parameters
    ----------
    q : (r,) its modal coordinates
    frame : angle of the frame, rad
    """
    engine, body = simulation.engine, simulation.body
    shown = dict(zip(simulation.output_names, simulation.outputs.tolist(), strict=True))
    loads = np.zeros((len(body.interfaces), 6))
    motion = body.shapes @ q
    cos, sin = math.cos(frame), math.sin(frame)

    def act(name: str, x: float, y: float, first: int = 0) -> Array:
        """Add a plane vector given in axes at rest; it is returned in those of the frame."""
        vector = np.array([cos * x + sin * y, cos * y - sin * x])
        loads[body.index(name), first : first + 2] += vector
        return vector

    def moved(name: str, force: Array, offset: float = 0.0) -> None:
        """Moments of a force beside the interface, on its displaced point."""
        row = body.index(name)
        u = motion[row, :2] + offset * np.array([motion[row, 4], -motion[row, 3]])
        loads[row, 5] += u[0] * force[1] - u[1] * force[0]
        loads[row, 3:5] += offset * np.array([-force[1], force[0]])

    for i in range(len(engine.crankshaft.main_widths)):
        name, output = f"main[{i + 1}]", f"bearing[{i + 1}]"
        moved(name, act(name, shown[f"{output}.force.x"], shown[f"{output}.force.y"]))
        act(name, shown[f"{output}.moment.x"], shown[f"{output}.moment.y"], 3)
        loads[body.index(name), 5] -= shown[f"{output}.friction_torque"]
    for c, pin in enumerate(engine.cylinders.pins):
        name = f"pin[{pin}]"
        force = act(name, shown[f"big_end[{c + 1}].force.x"], shown[f"big_end[{c + 1}].force.y"])
        moved(name, force, engine.rod_offsets[c])
        loads[body.index(name), 5] -= shown[f"big_end[{c + 1}].friction_torque"]
    loads[body.index("thrust"), 2] += shown["thrust.force"]
    loads[body.index("flywheel"), 5] -= shown["shaft.torque"]
    loads[body.index("pulley"), 5] += shown["damper.torque"]
    return loads
