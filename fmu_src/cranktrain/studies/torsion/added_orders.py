"""Bodies that an engine file adds to a torsional crank: their dynamic stiffness on the crank at each speed and order.

Small motions of crank (c) and added bodies (a) at ω = oΩ obey D q = f with D = K + iωC − ω²M of
:mod:`cranktrain.structure.in_motion.linear`. No force of a cylinder acts on the added bodies, so the crank feels

    D_cc − D_ca D_aa⁻¹ D_ac.

Connections are linear about the state at rest: films and rollers are their linear stand-ins, axial bearings are closed,
and teeth without backlash are in contact. Steady loads of connections and the weight of unbalanced bodies are left out.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.types import ComplexArray
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.model.arrays import Parts, build_model
from cranktrain.dynamics.model.records import ModelArrays
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.tangents import tangents_in_rotation
from cranktrain.dynamics.topology.tables import whole_topology
from cranktrain.engine.additions import split_end
from cranktrain.engine.connections import Coupling, GearMesh, Load, SlidingJoint
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.additions import read_added
from cranktrain.structure.in_motion.linear import Equations, SmallMotions
from cranktrain.studies.added_modes import on_springs
from cranktrain.studies.torsion.line_link import linear_engine

_HELD = 1.0e-8
"""Stiffness over Ω² of unit modal mass on each coordinate of added bodies. It keeps equations solvable where nothing
holds a motion that the crank does not excite."""


class AddedOrders:
    """Dynamic stiffness of added bodies on the modes of a torsional crank, from the rotation about the axis on.

    Raises ``InputError`` for a connection that is not linear, and for bodies whose frames do not turn uniformly.

    Attributes
    ----------
    at_rest : stiffness, damping and mass (m, m) of the modes of crank and added bodies at rest and crank angle 0; the
        crank's part is that of the connections alone
    """

    def __init__(self, engine: Engine, body: ReducedBody, settings: Settings, gas: GasTrace) -> None:
        if reason := not_linear(engine):
            raise InputError(f"{reason}, which a steady state in the frequency domain does not include; run it in time")
        model = linear_model(linear_engine(engine), body, settings, gas)
        self._crank, self._added, equations = links(model, SmallMotions(model), slots.ROTATION)
        # K and C are polynomials of the speed.
        at = max(gas.best_speed, 1.0)
        still, forwards, backwards = equations(0.0), equations(at), equations(-at)
        even = (forwards.stiffness + backwards.stiffness) / 2.0 - still.stiffness
        self._parts = np.stack([
            still.stiffness, (forwards.stiffness - backwards.stiffness) / (2.0 * at), even / at**2,
            still.damping, (forwards.damping - backwards.damping) / (2.0 * at), still.mass,
        ]).astype(np.complex128)  # fmt: skip
        crank, added, equations = links(model, SmallMotions(model, still=True), slots.ROTATION)
        kept = np.concatenate((crank, added))
        mass, damping, stiffness = (part[np.ix_(kept, kept)] for part in equations(0.0))
        self.at_rest: tuple[Array, Array, Array] = stiffness, damping, mass

    def stiffness(self, speed: float, orders: Array) -> ComplexArray:
        """Dynamic stiffness (o, n, n) at a speed (rad/s) and orders (o,)."""
        omega = speed * orders
        one = np.ones_like(omega)
        weights = np.stack((one, speed * one, speed**2 * one, 1j * omega, 1j * omega * speed, -(omega**2)), axis=-1)
        size = self._parts.shape[1]
        dynamic = (weights @ self._parts.reshape(len(self._parts), -1)).reshape(-1, size, size)
        c, a = self._crank, self._added
        held = dynamic[:, a[:, None], a] + _HELD * speed**2 * np.eye(a.size)
        answer = np.linalg.solve(held, dynamic[:, a[:, None], c])
        return np.asarray(dynamic[:, c[:, None], c] - dynamic[:, c[:, None], a] @ answer)


def linear_model(engine: Engine, body: ReducedBody, settings: Settings, gas: GasTrace) -> ModelArrays:
    """Model of an engine on rigid ground with added bodies whose connections are linear."""
    topology = whole_topology(engine, body, None, read_added(engine))
    topology = replace(topology, connections=tuple(map(on_springs, topology.connections)))
    return build_model(engine.without_additions, body, settings, gas.best_speed, gas, Parts(topology=topology))


def links(
    model: ModelArrays, motions: SmallMotions, first: int = 0
) -> tuple[NDArray[np.intp], NDArray[np.intp], Callable[[float], Equations]]:
    """Coordinates of crank, from mode ``first`` on, and added bodies, and a function of the speed (rad/s): equations.

    The crank's own matrices are left out, so its part is that of the connections.
    """
    added = range(int(model.layout[slots.TERM_ROW]), len(model.connections))
    laws, turning = tangents_in_rotation(model, rows=added).mean(), model.ports.shape[1]
    crank = np.flatnonzero((motions.mode >= first) & (motions.mode < turning))
    none = laws._replace(place=0.0 * laws.place, velocity=0.0 * laws.velocity)
    own = np.ix_(crank, crank)

    def equations(speed: float) -> Equations:
        found = motions.equations(speed, laws)
        for part, without in zip(found, motions.equations(speed, none), strict=True):
            part[own] -= without[own]
        return found

    return crank, np.flatnonzero(motions.mode >= turning), equations


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
