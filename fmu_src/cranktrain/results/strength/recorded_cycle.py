"""Recorded motion of the crank over a periodic cycle: modal coordinates, motion of the frame, and all outputs."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.dynamics.cycle_run import Result, communication_step, run_cycles
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.settings import step_each_row
from cranktrain.dynamics.model.state import ACCELERATION, POSITION, VELOCITY, offset
from cranktrain.dynamics.settled.judging import TOLERANCE, Settling
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.topology import slots as top
from cranktrain.dynamics.topology.tables import held_on_crank
from cranktrain.engine.model import Engine

CYCLE = 4.0 * math.pi
"""Crank angle of a cycle, rad."""


@dataclass(frozen=True, eq=False)
class RecordedCycle:
    """One period of one or more cycles, n samples uniform in time without the initial one (SI).

    Attributes
    ----------
    engine, body : engine including the parts that a run fixes to its crank, and crank of the running model
    carried : true if bearings carry the crank; false if its journals are locked on their axis
    gravity : acceleration of gravity, m/s²
    angle, speed, acceleration : (n,) motion of the frame that rotates with the crank, rad, rad/s, rad/s²
    position, velocity, change : (n, modes) modal coordinates of the crank in this frame, their first and second rates
    damping : (modes,) structural damping force over modal mass and rate, 1/s
    outputs : name → (n,) values
    settling : settling of the run
    axial_force : axial force on the flywheel, N
    added : interface → (n, 6) force and moment of added connections, in axes of the frame
    """

    engine: Engine
    body: ReducedBody
    carried: bool
    gravity: float
    angle: Array
    speed: Array
    acceleration: Array
    position: Array
    velocity: Array
    change: Array
    damping: Array
    outputs: dict[str, Array]
    settling: Settling
    axial_force: float = 0.0
    added: dict[str, Array] = field(default_factory=dict)

    @property
    def crank_angle(self) -> Array:
        """Crank angle (n,) within a cycle, rad."""
        return self.outputs["crank.angle"] % CYCLE

    def motion(self, interface: str, rate: int = 0) -> Array:
        """Translation and rotation (n, 6) of an interface in the frame, or their time derivative of order ``rate``."""
        shape = self.body.shapes[self.body.index(interface)]
        return np.asarray((self.position, self.velocity, self.change)[rate] @ shape.T)

    def at(self, samples: NDArray[np.integer]) -> "RecordedCycle":
        """Cycle with some of its samples, in the order given."""
        names = ("angle", "speed", "acceleration", "position", "velocity", "change")
        return replace(
            self,
            **{name: getattr(self, name)[samples] for name in names},
            outputs={name: values[samples] for name, values in self.outputs.items()},
            added={name: values[samples] for name, values in self.added.items()},
        )

    @property
    def last_samples(self) -> NDArray[np.intp]:
        """Indices of the samples of the last cycle, from crank angle 0 on."""
        count = self.angle.size // max(self.settling.repeats, 1)
        return np.asarray(self.angle.size - count + np.argsort(self.crank_angle[-count:]))

    def last(self) -> "RecordedCycle":
        """Last cycle only, from crank angle 0 on."""
        return self.at(self.last_samples)


def recorded_cycle(
    simulation: Simulation,
    engine: Engine,
    settle: float = TOLERANCE,
    progress: Callable[[float], None] | None = None,
    say: Callable[[str], None] | None = None,
    look: Callable[[], None] | None = None,
) -> RecordedCycle:
    """Run an uninitialised simulation until its motion is periodic, and record one period.

    Raises ``InputError`` and ``SolverError`` as :func:`cranktrain.dynamics.simulation.simulate`.

    Parameters
    ----------
    simulation : simulation at the constant speed of its ``inputs``; it steps to every row from now on
    engine : engine with the parts that the run fixes to its crank, see
        :func:`cranktrain.dynamics.simulation.fitted_engine`
    settle : largest settling error of any output family
    look : called after each recorded sample, with the simulation at its state
    """
    held = held_on_crank(engine, simulation.parts.topology)
    simulation.settings = step_each_row(simulation.settings)
    simulation.initialize()
    found = whole(run_cycles(simulation, None, settle, progress, say))
    step = communication_step(float(simulation.inputs[0]), simulation.settings.step)
    count = found.per_cycle * max(found.settling.repeats, 1)
    modes, all_modes = simulation.body.n_modes, simulation.model.omega2.size
    frame, rows = np.empty((count, 3)), np.empty((count, simulation.outputs.size))
    motion = np.empty((3, count, modes))
    links = simulation.model.links.interfaces
    first_ports = links[links[:, top.OWNER] == top.OF_CRANK, top.PORT_X].astype(int)
    loads = np.empty((len(held), count, 6))
    begin = simulation.time
    for k in range(count):
        simulation.step(begin + (k + 1) * step)
        state = simulation.state
        frame[k] = simulation.work.frames[0][[at.THETA, at.OMEGA, at.OMEGA_DOT]]
        for rate, block in enumerate((POSITION, VELOCITY, ACCELERATION)):
            first = offset(block, all_modes)
            motion[rate, k] = state[first : first + modes]
        rows[k] = simulation.outputs
        for load, port in zip(loads, first_ports, strict=True):
            load[k] = simulation.work.links.answered[port : port + 6]
        if look is not None:
            look()
    return RecordedCycle(
        engine=engine,
        body=simulation.body,
        carried=simulation.model.bearings.shape[0] > 0,
        gravity=simulation.settings.gravity,
        angle=frame[:, 0],
        speed=frame[:, 1],
        acceleration=frame[:, 2],
        position=motion[0],
        velocity=motion[1],
        change=motion[2],
        damping=simulation.model.damping[:modes].copy(),
        outputs=dict(zip(simulation.output_names, rows.T.copy(), strict=True)),
        settling=found.settling,
        # Loads on discs of the drive line are left out, because these discs are not interfaces of the crank.
        added={name: load for name, load in zip(held, loads, strict=True) if name in simulation.body.interfaces},
        axial_force=float(simulation.inputs[engine.n_cylinders + at.AXIAL_INPUT]),
    )


def whole(result: Result) -> Result:
    """Return a complete run; raise ``KeyboardInterrupt`` if the run was interrupted.

    An interrupted run returns its samples up to then, for callers that keep them. Its last cycle is not periodic.
    """
    if not result.complete:
        raise KeyboardInterrupt
    return result
