"""Formulas of the slow modes of a running engine: the drive line, and six rigid motions of the block on its mounts.

All other modes decay within a cycle or two. With the rotations β of the crank and of the drive line's inertias relative
to the driven shaft, the lead δ of the crank's frame and w = δ̇, the equations of the drive line are

    J β̈ = −C β̇ − K β,   δ̇ = w,   ẇ = κ ((β₁ − δ)/τ_c − w)

with J of crank with rods and of discs and bodies, K and C of shafts and connections (:mod:`..model.wound_line`) and κ,
τ_c of :mod:`cranktrain.loads.drive_line`. The gas follows the crank, so it is no spring. Friction and tables make K and
C vary along a cycle, so its matrix M is the product of those of its intervals. The block and all it carries move as a
rigid body,

    M η̈ = −(C + Ω J_c R) η̇ − K η

with K, C of the mounts, M of block, crank, rods and pistons, and the gyroscopic torque of the crank's inertia J_c
between its two tilts, R. A motion is split into slow modes and a rest by momentum; the rest has no such momentum.
"""

import functools
import math

import numpy as np

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.records import ModelArrays, dimensions
from cranktrain.dynamics.model.wound_line import Line
from cranktrain.dynamics.settled.collar import NOTHING_LEFT, RATE, Collar, Learned
from cranktrain.dynamics.settled.motion import Motion
from cranktrain.dynamics.start.mean_motion import carried
from cranktrain.dynamics.topology import slots as top
from cranktrain.dynamics.topology.frames import frames_at
from cranktrain.loads.drive_line import RECENTRING_REVOLUTIONS

PLAIN = 0.3
"""Least ratio of the collar's motion to the free mode's motion at which data of the collar can be learned."""
SERIES, HALVINGS = 14, 8
"""Number of terms of the exponential's series, and number of halvings of its argument below a norm of 1."""
ALONG = 2
"""Index of the block's rigid mode along the crank's axis."""


def body_shares(model: ModelArrays, row: Array) -> Array:
    """Modal motion (3, n) of an added body tied to the crank: rotation about z, displacement along x and along y.

    It is zero for a body with modes in common with the crank, whose motion includes it.
    """
    tied = row[top.TIED] * (row[top.MODE] >= model.ports.shape[1])
    own = slice(row[top.OWN_MODE], row[top.OWN_MODE] + row[top.MODES])
    turned = row[top.SENSE] * model.bodies.euler_load[own]
    return np.asarray(tied * np.vstack((turned, model.bodies.translation[:2, own])))


def frame_change(frame: Array) -> Array:
    """Derivative, by crank angle, of a frame's angular rate and of its origin's motion, in the frame's axes (3,)."""
    turn, x, y = frame[[top.TURN, top.OWN_X1, top.OWN_Y1]]
    return np.array([frame[top.TURN2], frame[top.OWN_X2] + turn * y, frame[top.OWN_Y2] - turn * x])


class DriveLine:
    """Crank and drive line, y = (β, β̇, δ, w) with the rotations β (m,) of the crank and of all inertias behind it.

    The coordinates y follow ẏ = ``matrix`` y, as those of :class:`BlockOnMounts` do.
    """

    def __init__(self, model: ModelArrays, speed: float, motions: Array | None = None) -> None:
        """See :meth:`.Line.of` for ``motions``, by default one of zero."""
        line = Line.of(model, np.zeros((1, 2, model.omega2.size)) if motions is None else motions)
        t = model.ports.shape[1]
        self._count = m = len(line.turns)
        self._turn = np.zeros((model.omega2.size, m))
        self._turn[:t] = line.turns.T
        # Motion of the frames of added bodies by the crank's rotation itself, at crank angle 0, where cycles end.
        self._moves = np.zeros(model.omega2.size)
        moved = frames_at(model.links.frames, 0.0)
        for row in model.bodies.rows[top.OTHERS :]:
            size, first = row[top.MODES], row[top.MODE]
            frame, shares = moved[row[top.FRAME_OF]], body_shares(model, row)
            self._turn[first : first + size, 0] += frame[[top.TURN, top.OWN_X1, top.OWN_Y1]] @ shares
            self._moves[first : first + size] += speed * (frame_change(frame) @ shares)
        self._weight = self._turn.copy()
        for rod, pin in zip(model.cylinders, model.pins, strict=True):
            swept = (rod[at.M_BIG] + 0.5 * rod[at.M_OSC]) * float(pin @ pin)
            self._weight[:t, 0] += swept * model.ports[int(rod[at.PIN_TURN])]
        self.inertia, self._stiffness = self._weight.T @ self._turn, line.stiffness[0]
        inverse = speed / (2.0 * math.pi * RECENTRING_REVOLUTIONS)
        kappa = 4.0 * inverse
        self._matrices = np.zeros((len(line.stiffness), 2 * m + 2, 2 * m + 2))
        self._matrices[:, :m, m:-2] = np.eye(m)
        self._matrices[:, m:-2, :m] = -np.linalg.solve(self.inertia, line.stiffness)
        self._matrices[:, m:-2, m:-2] = -np.linalg.solve(self.inertia, line.damping)
        self._matrices[:, -2, -1] = 1.0
        self._matrices[:, -1, [0, -2, -1]] = kappa * inverse, -kappa * inverse, -kappa
        self.matrix, self._known = self._matrices[-1], dict[float, Array]()

    @property
    def bends(self) -> bool:
        """Whether springs and friction of added connections act in the drive line."""
        return len(self._matrices) > 1

    def over(self, time: float) -> Array:
        """Matrix M of y after ``time``, s, in which the intervals of the motion follow one another."""
        if time not in self._known:
            parts = [exponential(matrix * (time / len(self._matrices))) for matrix in self._matrices]
            self._known[time] = functools.reduce(lambda m, part: part @ m, parts)
        return self._known[time]

    def split(self, motion: Motion) -> Array:
        """Coordinates y of a motion; β and β̇ follow from angular momentum."""
        turn, rate = (np.linalg.solve(self.inertia, self._weight.T @ values) for values in motion[:2])
        return np.concatenate((turn + motion.lead, rate + motion.lead_rate, [motion.lead, motion.lead_rate]))

    def lift(self, y: Array) -> Motion:
        """Motion in which crank and all bodies of the drive line turn, as rigid bodies, with coordinates y."""
        m, change = self._count, self.matrix @ y
        place, velocity, acceleration = (
            self._turn @ part for part in (y[:m] - y[-2], y[m:-2] - y[-1], change[m:-2] - change[-1])
        )
        velocity += (y[0] - y[-2]) * self._moves
        return Motion(place, velocity, acceleration, float(y[-2]), float(y[-1]))

    def coordinates(self, y: Array) -> Array:
        """Rotations and their rates, scaled by their energy; the frame's lead is scaled like the crank's rotation."""
        m = self._count
        return np.concatenate(
            (
                _root(self._stiffness) @ y[:m], [math.sqrt(self._stiffness[0, 0]) * y[-2]],
                _root(self.inertia) @ y[m:-2], [math.sqrt(self.inertia[0, 0]) * y[-1]],
            )
        )  # fmt: skip


class BlockOnMounts:
    """The block with all bodies that it carries, y = (η, η̇) of the block's six rigid modes."""

    def __init__(self, model: ModelArrays, speed: float) -> None:
        n, t = model.omega2.size, model.ports.shape[1]
        self._turning, self._speed = t, speed
        self._gyroscopic, self._bodies, self._frames = (
            model.gyroscopic.T,
            model.bodies,
            frames_at(model.links.frames, 0.0),
        )
        units = np.eye(model.block_ports.shape[1])[:6]
        self._carried = np.column_stack([carried(model, unit) for unit in units])
        self._turned_back = self._moves_back(model)
        # Rods and pistons have no modes, except for the lateral motion of guided pistons.
        weight = self._carried.copy()
        for rod in model.cylinders:
            rows, pin, across = np.zeros((2, n)), int(rod[at.PIN_PORT]), rod[at.PISTON_PORT] < 0.0
            rows[:, :t] = model.ports[pin : pin + 2]
            cos, sin = math.cos(rod[at.BANK]), math.sin(rod[at.BANK])
            sideways, along = np.array([[cos, sin], [-sin, cos]]) @ rows
            masses = rod[at.M_BIG] + (rod[at.M_OSC] if across else 0.0), rod[at.M_BIG] + rod[at.M_OSC]
            for mass, row in zip(masses, (sideways, along), strict=True):
                weight += mass * np.outer(row, row @ self._carried)
        self.mass = weight.T @ self._carried
        self._split = np.linalg.solve(self.mass, weight.T)
        self.stiffness = model.block.stiffness[:6, :6]
        tilt_x, tilt_y = model.block.motion[3:5, :6]
        spin = speed * float(model.euler_load @ model.euler_load)
        damping = model.block.damping[:6, :6] + spin * (np.outer(tilt_x, tilt_y) - np.outer(tilt_y, tilt_x))
        self.matrix = np.zeros((12, 12))
        self.matrix[:6, 6:] = np.eye(6)
        self.matrix[6:, :6] = -np.linalg.solve(self.mass, self.stiffness)
        self.matrix[6:, 6:] = -np.linalg.solve(self.mass, damping)

    def _moves_back(self, model: ModelArrays) -> Array:
        """Velocity (n, 6) of added bodies because the crank does not rotate with the block, in addition to _swept."""
        found, turn = np.zeros_like(self._carried), model.block.motion[at.ROTATION, :6]
        for row in self._bodies.rows[top.OTHERS :]:
            n, first = row[top.MODES], row[top.MODE]
            shares, moved = body_shares(model, row), self._frames[row[top.FRAME_OF]]
            # The origin of a moving frame of an added body rotates with the block about the crank's axis.
            around = np.array([0.0, -moved[top.OWN_Y1], moved[top.OWN_X1]])
            found[first : first + n] += self._speed * np.outer((around - frame_change(moved)) @ shares, turn)
            back = np.zeros(found.shape[0])
            back[first : first + n] = moved[[top.TURN, top.OWN_X1, top.OWN_Y1]] @ shares
            found -= np.outer(self._swept(back), turn)
        return found

    def _swept(self, place: Array) -> Array:
        """Velocity in space of a constant displacement ``place`` in the rotating frame, at the time of equal axes."""
        out = np.zeros_like(place)
        out[: self._turning] = self._speed * (self._gyroscopic @ place[: self._turning])
        for row in self._bodies.rows[top.OTHERS :]:
            own, n, first = row[top.OWN_MODE], row[top.MODES], row[top.MODE]
            # A body rotated about the origin of its frame keeps its position in the frame.
            shifted, turn = place[first : first + n].copy(), self._bodies.turn[own : own + n]
            shifted[at.ROTATION] -= turn @ shifted / turn[at.ROTATION]
            turned = self._bodies.gyroscopic[own : own + n, :n].T @ shifted
            rate = row[top.SENSE] * self._frames[row[top.FRAME_OF], top.TURN]
            out[first : first + n] += rate * self._speed * turned
        return out

    def over(self, time: float) -> Array:
        """Matrix M of y after ``time``, s."""
        return exponential(self.matrix * time)

    def split(self, motion: Motion) -> Array:
        """Coordinates y of a motion, η and η̇, from the momentum of all bodies that the block carries."""
        return np.concatenate((self._split @ motion.place, self._split @ (motion.velocity + self._swept(motion.place))))

    def lift(self, y: Array) -> Motion:
        """Motion of the block with crank, rods and pistons, for coordinates y; the crank does not rotate."""
        change = self.matrix @ y
        place = self._carried @ y[:6]
        velocity = self._carried @ y[6:] - self._swept(place) + self._turned_back @ y[:6]
        acceleration = self._carried @ change[6:] - 2.0 * self._swept(velocity) - self._swept(self._swept(place))
        return Motion(place, velocity, acceleration, 0.0, 0.0)

    def coordinates(self, y: Array) -> Array:
        """Coordinates y of the block's motion, scaled by kinetic and elastic energy."""
        return np.concatenate((_root(self.stiffness) @ y[:6], _root(self.mass) @ y[6:]))


class SlowModes:
    """All slow modes of a model at a speed (rad/s); there are none if the speed is free under a load torque.

    Attributes
    ----------
    free : the mode that settles last of all others; None if it is not known
    collar : the crank's motion along its axis, corrected only as far as it has been learned
    """

    def __init__(self, model: ModelArrays, speed: float, learned: Learned | None = None) -> None:
        self.free = None if learned is None else learned.free
        self.collar = Collar(model, NOTHING_LEFT if learned is None else learned.collar)
        self._period = 4.0 * math.pi / speed
        self._model, self._speed = model, speed
        # If the engine creeps along the axis, the corrections of creep include all other modes (:mod:`creep`).
        self._creeps = dimensions(model).joint >= 0 and model.block_ports.shape[0] > 0
        driven = model.scalars[at.DRIVEN] > 0.0
        self.drive_line = DriveLine(model, speed) if driven and model.scalars[at.SHAFT_K] > 0.0 else None
        self.block = BlockOnMounts(model, speed) if driven and model.block_ports.shape[0] > 0 else None

    @property
    def _parts(self) -> list[DriveLine | BlockOnMounts]:
        return [part for part in (self.drive_line, self.block) if part is not None]

    def follow(self, motions: Array) -> None:
        """Take connections of the drive line as in successive ``motions`` of the last cycle, see :meth:`.Line.of`."""
        if self.drive_line is not None:
            self.drive_line = DriveLine(self._model, self._speed, motions)

    def correction(self, change: Motion, cycles: int = 1) -> Motion:
        """Correction to add after ``cycles`` cycles that changed the state by ``change``: lift M (I − M)⁻¹ y."""
        total = change.minus(change)
        for part in self._parts:
            m = part.over(cycles * self._period)
            total = total.plus(part.lift(m @ np.linalg.solve(np.eye(len(m)) - m, part.split(change))))
        if self.free is None or self._creeps:
            return total
        total = total.plus(self.collar.correction(self._fast(change), cycles))
        return total.plus(self.free.correction(self.rest(change), cycles * self._period))

    @property
    def joint_correction(self) -> bool:
        """Whether Anderson's method adds to the correction: of all modes if these are learned, or of the drive line."""
        return self.collar.stable if self.free is not None else self.drive_line is not None and self.drive_line.bends

    @property
    def learned(self) -> Learned | None:
        """Data learned while a run settles, apart from the slow modes; None if the free mode is not known."""
        return None if self.free is None else Learned(self.free, self.collar.over_cycle)

    def learn(self, before: Motion, after: Motion, first: bool) -> None:
        """Update the free mode or the collar from a change of a cycle's start and the change one cycle later.

        The ``first`` change contains all modes, of which mainly the free one is left after the cycle. Later changes,
        without the free mode, show the collar.
        """
        if self.free is None:
            return
        if first:
            self.free = self.free.learned(self.rest(before), self.rest(after), self._period)
        elif self.free.speed_of(self.rest(before)) * PLAIN < np.linalg.norm(self.collar.split(self._fast(before))):
            self.collar.learn(self._fast(before), self._fast(after))

    def of_line(self, motion: Motion) -> Motion:
        """Part of a motion in the drive line."""
        part = self.drive_line
        return motion.minus(motion) if part is None else part.lift(part.split(motion))

    def rest(self, motion: Motion) -> Motion:
        """Motion minus its parts in the slow modes and the collar."""
        fast = self._fast(motion)
        return fast.minus(self.collar.lift(self.collar.split(fast)))

    def _fast(self, motion: Motion) -> Motion:
        """Motion minus its part in the slow modes."""
        for part in self._parts:
            motion = motion.minus(part.lift(part.split(motion)))
        return motion

    def left(self, change: Motion, cycles: int = 1) -> Motion:
        """Estimated error of the start of cycles: (I − M)⁻¹ y for slow modes, ``change`` for all other motion."""
        return change.plus(self.correction(change, cycles))

    def coordinates(self, motion: Motion) -> tuple[Array, Array]:
        """Coordinates of a motion of crank with pistons, and of the block; squared lengths are twice the energies, J.

        The slow modes come first, then all modes of the rest. Springs count as if no mode were slower than ``RATE``,
        because the collar's position has no energy but matters for axial motion.
        """
        rest, slow = motion, []
        for part in (self.drive_line, self.block):
            y = None if part is None else part.split(motion)
            slow.append(np.zeros(0) if part is None or y is None else part.coordinates(y))
            if part is not None and y is not None:
                rest = rest.minus(part.lift(y))
        energy = np.array([rest.velocity, np.sqrt(np.maximum(self._model.omega2, RATE**2)) * rest.place])
        t = self._model.ports.shape[1]
        block = slice(t, t + self._model.block_ports.shape[1])
        return (
            np.concatenate((slow[0], np.delete(energy, block, axis=1).ravel())),
            np.concatenate((slow[1], energy[:, block].ravel())),
        )


def _root(matrix: Array) -> Array:
    """R with Rᵀ R = matrix, for a symmetric matrix without negative eigenvalues (except by rounding)."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def exponential(a: Array) -> Array:
    """exp(a) of a small square matrix, by Taylor's series of a/2ˢ and s squarings."""
    times = max(0, math.ceil(math.log2(max(float(np.abs(a).sum(axis=1).max()), 1.0)))) + HALVINGS
    term = np.eye(len(a))
    total = term.copy()
    for k in range(1, SERIES):
        term = term @ a / (k * 2.0**times)
        total += term
    for _ in range(times):
        total = total @ total
    return np.asarray(total)
