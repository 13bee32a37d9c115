"""Linear model of a crank with the bodies that its engine file adds, and their dynamic stiffness at speeds and orders.

Small motions of crank (c) and added bodies (a) at ω = oΩ obey D q = f with D = K + iωC − ω²M of
:mod:`cranktrain.dynamics.linear`. No force of a cylinder acts on the added bodies, so the crank feels

    D_cc − D_ca D_aa⁻¹ D_ac.

Connections are linear about where their mean loads place them at rest: films and rollers are their linear stand-ins,
axial bearings are closed, and teeth without backlash bear on the flank that a mean torque presses. The moments of mean
forces and the weight of unbalanced bodies are left out.
"""

from dataclasses import replace

import numpy as np

from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.types import ComplexArray
from cranktrain.dynamics.linear import Equations, SmallMotions
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.model.arrays import Parts, build_model
from cranktrain.dynamics.model.records import ModelArrays
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.tangents import Tangents
from cranktrain.dynamics.topology.tables import whole_topology
from cranktrain.engine.additions import split_end
from cranktrain.engine.connections import Coupling, GearMesh, Load, SlidingJoint
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.additions import read_added
from cranktrain.studies.added_modes import on_springs
from cranktrain.studies.torsion.line_link import linear_engine

_HELD = 1.0e-8
"""Stiffness over Ω² of unit modal mass on each coordinate of added bodies. It keeps equations solvable where nothing
holds a motion that the crank does not excite."""


class OrderMatrices:
    """Matrices of a crank and of added bodies as polynomials of the speed, from the rotation about the axis on.

    Parameters
    ----------
    model, laws : linear model and the mean tangents of its connections
    speed : any speed that scales the terms of the polynomials, rad/s

    Attributes
    ----------
    of_crank : (6, n, n) factors of 1, Ω, Ω², iω, iωΩ and −ω² in the crank's dynamic stiffness
    at_rest : equations of all modes at rest and crank angle 0, the crank's first
    """

    def __init__(self, model: ModelArrays, laws: Tangents, speed: float) -> None:
        motions, turning = SmallMotions(model), model.ports.shape[1]
        self._crank = np.flatnonzero((motions.mode >= slots.ROTATION) & (motions.mode < turning))
        self._added = np.flatnonzero(motions.mode >= turning)
        still = motions.equations(0.0, laws)
        zero = np.zeros_like(still.mass)
        self._parts = np.stack((still.stiffness, zero, zero, still.damping, zero, still.mass))
        if self._added.size:  # a crank that only twists has no terms with the speed
            forwards, backwards = (motions.equations(at, laws) for at in (speed, -speed))
            self._parts[1] = (forwards.stiffness - backwards.stiffness) / (2.0 * speed)
            self._parts[2] = ((forwards.stiffness + backwards.stiffness) / 2.0 - still.stiffness) / speed**2
            self._parts[4] = (forwards.damping - backwards.damping) / (2.0 * speed)
            still = SmallMotions(model, still=True).equations(0.0, laws)
        self.at_rest = Equations(*(part[slots.ROTATION :, slots.ROTATION :] for part in still))
        self.of_crank = self._parts[:, self._crank[:, None], self._crank]

    def weights(self, speed: Array, omega: Array) -> ComplexArray:
        """Factors (…, 6) of the matrices at speeds and angular frequencies (…), rad/s."""
        speed = np.broadcast_to(speed, omega.shape)
        return np.stack((omega**0, speed, speed**2, 1j * omega, 1j * omega * speed, -(omega**2)), axis=-1)

    def felt(self, speed: float, orders: Array) -> ComplexArray | float:
        """D_ca D_aa⁻¹ D_ac (o, n, n) at a speed (rad/s) and orders (o,); 0 without added bodies."""
        if not self._added.size:
            return 0.0
        c, a, n = self._crank, self._added, self._parts.shape[1]
        weights = self.weights(np.array(speed), speed * orders)
        dynamic = (weights @ self._parts.reshape(6, -1)).reshape(-1, n, n)
        held = dynamic[:, a[:, None], a] + _HELD * speed**2 * np.eye(a.size)
        return np.asarray(dynamic[:, c[:, None], a] @ np.linalg.solve(held, dynamic[:, a[:, None], c]))


def linear_model(engine: Engine, body: ReducedBody, settings: Settings, gas: GasTrace) -> ModelArrays:
    """Model of an engine on rigid ground whose connections and drive line are linear; also those of added bodies."""
    engine = linear_engine(engine)
    topology = whole_topology(engine, body, None, read_added(engine))
    topology = replace(topology, connections=tuple(map(on_springs, topology.connections)))
    return build_model(engine.without_additions, body, settings, gas.best_speed, gas, Parts(topology=topology))


def not_linear(engine: Engine) -> str:
    """Reason why bodies that an engine's file adds have no linear form about uniform rotation; empty if they have."""
    if not engine.line_on_crank:
        return f"the drive line begins at '{engine.drive_line.start}', not on the crank whose modes these are"
    for frame in engine.additions.frame:
        if frame.motion != "turning":
            return f"frame '{frame.name}' moves as a {frame.motion}, so orders of its bodies' motion are coupled"
    for table in engine.additions.connection:
        data, reason = table.data, ""
        if isinstance(data, GearMesh) and data.backlash > 0.0:
            reason = "teeth with backlash come apart"
        elif isinstance(data, Coupling) and (data.twists or data.friction > 0.0):
            reason = "its torque over the twist is not linear"
        elif isinstance(data, Load) and data.order != 0.0:
            reason = "its load has an order of its own"
        elif isinstance(data, SlidingJoint) and data.joint == "spline":
            reason = "its spline sticks and slips"
        elif table.law in ("damper", "gas", "liner", "slider_crank", "own"):
            reason = f"law '{table.law}' is not linear in the motion, or depends on the frequency"
        elif table.law in ("rigid_gear", "planetary") and "crank" in {split_end(end)[0] for end in table.ends}:
            reason = "rigid teeth on the crank give it common modes with bodies"
        if reason:
            return f"connection '{table.name}': {reason}"
    return ""
