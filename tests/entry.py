"""The running model as tests ask it: by names of bodies and connections, never by places in its arrays.

Everything that tests know of how the running model is packed is in this file: where the packing changes, this file
changes and no test does. All is SI. ``run`` is an initialised :class:`~cranktrain.dynamics.simulation.Simulation`;
``model`` is its model, or one that ``build_model`` made.

Bodies: ``crank``, ``rod[c]`` (a floating big end), ``block``, ``piston[c]`` (a guided one), and added bodies by their
names. Connections: ``main[i]``, ``pin[c]`` (rod or film on a crank pin), ``rod[c]`` (rod on a floating big end),
``thrust``, ``axial_joint``, ``damper``, and added connections by their names. Numbers in brackets count from 1.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import RECORDS, keep_record
from cranktrain.dynamics.model import pack as model_pack
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.arrays import basis
from cranktrain.dynamics.model.records import dimensions
from cranktrain.dynamics.model.state import AUXILIARY, HISTORY, film_offset, offset, state_size
from cranktrain.dynamics.model.workspace import make_work
from cranktrain.dynamics.motion import linear_algebra as linear_algebra
from cranktrain.dynamics.motion.bodies import factor_stage
from cranktrain.dynamics.motion.equations import port_forces
from cranktrain.dynamics.motion.gas import gas_volume as gas_volume
from cranktrain.dynamics.motion.gas import given_pressure as given_pressure
from cranktrain.dynamics.motion.law_motion import place_journal
from cranktrain.dynamics.motion.relative import reactions, relative_compliance, relative_motion, relative_step
from cranktrain.dynamics.start import mean_motion
from cranktrain.dynamics.start.mean_motion import ORDERS as ORDERS  # half orders of torque by which a block rocks
from cranktrain.dynamics.start.mean_motion import carried as carried
from cranktrain.dynamics.start.mean_motion import rigid_start as rigid_start
from cranktrain.dynamics.tangents import tangents_in_rotation
from cranktrain.dynamics.time.integrators import INTEGRATORS, integrator_table
from cranktrain.dynamics.topology import slots as top
from cranktrain.dynamics.topology.arrays import lay_topology
from cranktrain.dynamics.topology.belt import strands as strands
from cranktrain.dynamics.topology.frames import fill_coefficients, frames_at
from cranktrain.dynamics.topology.laws import CONNECTION_LAWS as CONNECTION_LAWS
from cranktrain.dynamics.topology.laws import pieces_of
from cranktrain.dynamics.topology.records import Base
from cranktrain.dynamics.topology.relations import groups
from cranktrain.dynamics.topology.tables import whole_topology
from cranktrain.dynamics.topology.terms import Direction, terms_of
from cranktrain.film.laws import films as of_law
from cranktrain.film.laws.films import MASS, film_call
from cranktrain.film.laws.rigid_bore import rigid_bore
from cranktrain.loads.damper import DAMPING, STIFFNESS
from cranktrain.structure.in_motion.topology_modes import CrankAtRest as CrankAtRest

PLACE, VELOCITY, ACCELERATION = range(3)
"""Rows of what :func:`motion` gives."""
AMBIENT = at.AMBIENT  # Pa
POWERS = at.POWERS  # number of powers that are recorded
C_Q, C_V = 1e-9, 3e-5
"""Of a stage u = Q + C_Q ü, u̇ = V + C_V ü, s² and s: those of a short step."""

# Force laws alone -----------------------------------------------------------------------------------------------------


class Answer(NamedTuple):
    """What a law answers; NaN where it writes nothing."""

    force: np.ndarray  # (4,) on its components, N or N m
    by_place: np.ndarray  # (4, 4) tangents
    by_velocity: np.ndarray  # (4, 4)
    eccentricity: float
    friction: float  # torque on the journal, N m
    pressure: float  # largest, Pa
    flow: float  # to the sides, m³/s
    gap: float  # least, m; negative if it is that of a rigid circle
    gap_angle: float  # rad


class Law:
    """A force law of up to four components: film ``k`` of some :class:`~cranktrain.film.laws.films.Films`.

    ``place`` and ``velocity`` (4,) are those of the last call, ``memory`` is what the law keeps in a state.
    """

    def __init__(self, films, k=0, alive=None):
        self._films, self._k, self._alive = films, k, alive
        self.place, self.velocity = films.place[k], films.velocity[k]
        self.memory = np.zeros(int(films.traits[k, of_law.MEMORY]))

    def __call__(self, place=None, velocity=None, action="FORCE", **told):
        """Answer at a motion, else at the last one; ``told`` as in :meth:`tell`."""
        self._move(place, velocity)
        self.tell(**told)
        out = np.full(of_law.SIZE, np.nan)
        self._act(action, self.memory if action == "OBSERVE" and self.memory.size else out, out)
        tangents = [out[k : k + 16].reshape(4, 4) for k in (of_law.BY_PLACE, of_law.BY_VELOCITY)]
        slots = of_law.ECCENTRICITY, of_law.FRICTION, of_law.P_MAX, of_law.FLOW, of_law.GAP, of_law.GAP_ANGLE
        return Answer(out[:4], *tangents, *out[list(slots)].tolist())

    def tell(self, **numbers):
        """Set what laws are told beside their motion: speed, cos, sin, angle, turn, viscosity, and so on."""
        for name, value in numbers.items():
            self._films.numbers[getattr(of_law, name.upper())] = value

    def tell_all(self, random):
        """Set all that laws are told by a random generator."""
        self._films.numbers[:] = random.normal(size=of_law.NUMBERS)

    def begin(self, step, place=None, velocity=None):
        """Begin a step (s) of backward Euler at a motion; the law is then called at motions of its end."""
        self._move(place, velocity)
        self.tell(step=step, gain=step, elapsed=step, stage=0.0)
        self._act("OPEN_STEP", self.memory, self.memory)
        self._act("OPEN_STAGE", np.zeros(8), self.memory)

    def end(self):
        """End the step at the last motion."""
        self._act("CLOSE_STAGE", self.memory, self.memory)
        self._act("CLOSE_STEP", self.memory, self.memory)

    def _move(self, place, velocity):
        for own, given in ((self.place, place), (self.velocity, velocity)):
            if given is not None:
                own[: len(given)] = given

    def _act(self, action, memory, out):
        assert film_call(self._films, getattr(of_law, action), self._k, memory, out) == 0


def laws_of(topology):
    """Laws of a topology's connections by the register, a list; and numbers of their components."""
    made = lay_topology(topology, Base(None, None, 0, 0, 0))
    return [Law(made.laws, k, made) for k in range(len(made.rows))], made.rows[:, at.COUPLED].tolist()


# Bodies ---------------------------------------------------------------------------------------------------------------


def modes(run, name):
    """Slice of a body's modal coordinates among all of a run or model; added bodies are known to a run alone."""
    model, number = getattr(run, "model", run), int(name[name.find("[") + 1 : -1]) - 1 if "[" in name else 0
    turning, standing, crank = model.ports.shape[1], model.block_ports.shape[1], dimensions(model).crank_modes
    if name == "crank":
        return slice(0, crank)
    if name == "block":
        return slice(turning, turning + standing)
    names = [] if run is model else [body.name for group in groups(topology(run)) for body in group.bodies]
    if name in names:
        first, count = model.bodies.rows[top.OTHERS + names.index(name), [top.MODE, top.MODES]]
    elif name.startswith("rod["):
        assert model.cylinders[number, at.END_PORT] >= 0.0
        first, count = crank + 2 * number, 2
    else:
        ports = model.cylinders[:, at.PISTON_PORT]
        assert name.startswith("piston[") and ports[number] >= 0.0
        first, count = turning + standing + int(ports[number] - ports[ports >= 0.0].min()), 2
    return slice(first, first + count)


def topology(run):
    """Bodies and connections of engine file and parts of a run, or of what ``assemble`` made."""
    return whole_topology(run.engine, run.body, run.parts.block, run.parts.bodies, run.parts.topology)


def mode_count(model):
    """Number of modal coordinates of all bodies."""
    return model.omega2.size


def motion(run, state=None, blocks=3):
    """Modal place, velocity, acceleration (3, n) of all bodies: a view of ``state``, else of a copy of the run's.

    With more ``blocks``: the integrator's own acceleration (place before), and the velocity before, (4 or 5, n).
    """
    n, state = getattr(run, "model", run).omega2.size, run.state if state is None else state
    return state[offset(0, n) : offset(blocks, n)].reshape(blocks, n)


def frame(run):
    """Angle (rad), speed and acceleration of the crank's frame."""
    return run.work.frames[0, [at.THETA, at.OMEGA, at.OMEGA_DOT]]


def translation(run):
    """Modal forces (3, n) of unit accelerations of all bodies along the engine's axes."""
    return run.model.gravity


def guided(model):
    """Cylinders (from 1) whose pistons are guided bodies."""
    return [c + 1 for c, row in enumerate(model.cylinders) if row[at.PISTON_PORT] >= 0.0]


def dynamometer(model):
    """Rotation (n,) of a free dynamometer in its frame by modal coordinates of all bodies."""
    return np.append(model.rotor, np.zeros(model.omega2.size - model.rotor.size))


def own_frequencies(model):
    """Frequencies (n,) of all bodies' modes, each body alone and free, rad/s."""
    return np.sqrt(model.omega2)


def own_damping(model):
    """Damping (n,) of all modes by themselves, 1/s."""
    return model.damping


def take_turning_stiffness(monkeypatch, function):
    """Make models with another stiffness by rotation, a ``function`` of a reduced body."""
    monkeypatch.setattr(model_pack, "turning_stiffness", function)


def matrices(model, speed=0.0, damper=False):
    """Damping and stiffness (n, n) of all bodies at a speed of the frame, with drive line and mounts, for unit mass.

    Without what force laws do, but for the linear ``damper``; centrifugal terms are those of bodies in the frame.
    """
    t, n = model.ports.shape[1], model.omega2.size
    c, k = np.diag(model.damping), np.diag(model.omega2)
    c[:t, :t] += 2.0 * speed * model.gyroscopic.T + model.shafts.T @ (model.shaft_laws[:, 1, None] * model.shafts)
    k[:t, :t] += speed**2 * model.spin.T + model.shafts.T @ (model.shaft_laws[:, 0, None] * model.shafts)
    if damper:
        twist = model.ports[dimensions(model).twist]
        c[:t, :t] += model.damper[DAMPING] * np.outer(twist, twist)
        k[:t, :t] += model.damper[STIFFNESS] * np.outer(twist, twist)
    still = slice(t, t + model.block_ports.shape[1])
    c[still, still] += model.block.damping.T
    k[still, still] += model.block.stiffness.T
    assert n == len(k)
    return c, k


# Connections of a run -------------------------------------------------------------------------------------------------


def rows(model):
    """Rows of the engine's own connections by name."""
    size = dimensions(model)
    found = {f"main[{i + 1}]": i for i in range(size.bearings)}
    for name, slot in (("pin", at.PIN_ROW), ("rod", at.END_ROW)):
        found |= {f"{name}[{c + 1}]": int(row[slot]) for c, row in enumerate(model.cylinders)}
    found |= {"thrust": size.thrust, "axial_joint": size.joint, "damper": size.damper}
    return {name: row for name, row in found.items() if row >= 0}


def pieces(run):
    """Pieces of the added connections: of each its connection's name."""
    whole = topology(run)
    return [one.name for one in whole.connections for _ in pieces_of(one, *map(whole.end_frame, one.ends))]


def _row(run, name):
    own = rows(run.model)
    return own[name] if name in own else int(run.model.layout[at.TERM_ROW]) + pieces(run).index(name)


def law(run, name, piece=0):
    """Law of a connection in a run, whose place and velocity are those that it was last called with."""
    return Law(run.model.laws, _row(run, name) + piece)


def memory(run, name, state=None):
    """What the law of a connection keeps: a view of ``state``, by default of a copy of the run's."""
    model, state = run.model, run.state if state is None else state
    first = film_offset(model.omega2.size, dimensions(model).ports)
    row, count = _row(run, name), max(1, pieces(run).count(name))
    begin, end = model.laws.remembered[[row, row + count]]
    return state[first + begin : first + end]


def components(model, name):
    """Numbers among the unknowns of a stage of the components that one of the engine's own connections couples."""
    row = model.connections[rows(model)[name]]
    return row[at.FIRST : at.FIRST + row[at.COUPLED]]


def scales(model):
    """Motion (n,) of each unknown of a stage that counts like one clearance."""
    return model.scales


def shapes(model, name, side="crank"):
    """Motion (size, ·) of a connection's components on one side: by modes of all rotating bodies, or of the block."""
    own = components(model, name)
    if side == "crank":
        return model.ports[own]
    pairs = np.concatenate((model.pairs, model.pairs + 1.0, model.axial)).astype(int)
    opposite = dict(pairs.tolist())
    return model.block_ports[[opposite[port] - len(model.ports) for port in own]]


def forces_at(run, change=0.0):
    """Forces (n,) on the unknowns of a stage at the run's state, in axes of the frame, along which velocities follow.

    ``change`` (n,) is added to the places u, with velocities and accelerations C_V/C_Q and 1/C_Q times as large.
    """
    model, work, n = run.model, run.work, run.model.scales.size
    model.laws.numbers[of_law.FROZEN] = 0.0
    work.port[at.U : at.UDD + 1] = work.port[at.STATE_U : at.STATE_UDD + 1]
    work.port[at.U : at.UDD + 1, :n] += np.outer([1.0, C_V / C_Q, 1.0 / C_Q], np.broadcast_to(change, n))
    assert port_forces(model, work, work.frames[0].copy(), work.pressures[0].copy(), C_Q, C_V) == 0
    return work.port[at.FORCES, :n].copy()


def tangents_at(run):
    """Tangents (n, n) of :func:`forces_at` by ``change``, as Newton's iteration takes them."""
    n = forces_at(run).size
    found = np.zeros((n, n))
    for row, block in zip(run.model.connections, run.work.blocks, strict=True):
        if row[at.SHAPE] == at.OF_TERMS:
            continue
        own = row[at.FIRST : at.FIRST + row[at.COUPLED]]
        found[np.ix_(own, own)] += block.reshape(4, 4)[: own.size, : own.size]
    return found


def use_films(run, record):
    """Let main bearings be solved by a law's record."""
    run.model.films.entry[:, 1] = keep_record(record, run.model.laws.entry)


def solved_films(run, bearing, **size):
    """Record of films that are solved on a grid, for :func:`use_films`, for a run at level ``reynolds``."""
    return rigid_bore(bearing, run.model.bearings, None, run.model.laws.solved, **size)


def film_record(run):
    """Record of the law of the main bearings."""
    return RECORDS[int(run.model.films.entry[0, 1])]


def films_solved(run):
    """Number of films solved outside tables since the start."""
    return float(run.model.laws.solved[0])


def film_parameters(run, i=0):
    """Parameters (COLUMNS,) of a main bearing's film, see :mod:`cranktrain.film.laws.parameters`; a view."""
    return run.model.bearings[i]


def power(source, name):
    """Power (W) of a run's last step, or a column of recorded powers: gas_power, crank_loss, shafts_loss and so on."""
    values = source.work.powers if hasattr(source, "work") else source
    return values.T[getattr(at, name.upper())]


def pressures(run):
    """Pressure (c,) in each cylinder as it acts at the state, Pa."""
    return run.work.pressures[0, : dimensions(run.model).cylinders]


def films(run):
    """Laws of the main bearings as :class:`~cranktrain.film.laws.films.Films`, for what film.laws reads of these."""
    return run.model.films


def count(run, name):
    """Counter of a run's work: steps, stages, iterations, limited, and so on."""
    return float(run.work.counters[getattr(at, f"N_{name.upper()}")])


# Kinematics and response ----------------------------------------------------------------------------------------------


def openings(run, place, velocity, angle=0.0, speed=0.0):
    """Place and velocity (2, size) of each connection by name, at modal places and velocities (n,) of all bodies.

    In axes of the frame at an angle (rad) and a speed (rad/s) of the crank; velocities are those in space.
    """
    model, found = run.model, {}
    d, ddot = np.zeros((2, dimensions(model).ports))
    cos, sin, u, v = math.cos(angle), math.sin(angle), _at_ports(model, place), _at_ports(model, velocity)
    relative_motion(model, cos, sin, speed, u, v, d, ddot)
    for name, k in rows(model).items():
        if model.connections[k, at.SHAPE] != at.OF_EYE and model.laws.traits[k, MASS] == 0.0:
            place_journal(model, k, d, ddot, speed)
            size = model.connections[k, at.COUPLED]
            found[name] = np.array([model.laws.place[k, :size], model.laws.velocity[k, :size]])
    links, moved = model.links, np.zeros((2, model.links.scales.size))
    factors = np.zeros((len(links.terms), 2))
    fill_coefficients(links.terms, frames_at(links.frames, angle), speed, factors)
    for (component, port), (c, rate) in zip(links.terms[:, [top.COMPONENT, top.TERM_PORT]].astype(int),
                                            factors, strict=True):  # fmt: skip
        moved[:, component] += c * u[port], c * v[port] + rate * u[port]
    for name, row in zip(pieces(run), model.connections[int(model.layout[at.TERM_ROW]) :], strict=True):
        part = moved[:, row[at.GAP] : row[at.GAP] + row[at.COUPLED]]
        found[name] = np.hstack((found.get(name, np.zeros((2, 0))), part))
    return found


def _at_ports(model, q):
    u = np.zeros(dimensions(model).ports)
    for row in model.bodies.rows:
        ports, width = row[top.PORTS], row[top.MODES]
        own = model.bodies.shapes[row[top.PORT] : row[top.PORT] + ports, :width]
        u[row[top.PORT] : row[top.PORT] + ports] = own @ q[row[top.MODE] :][:width]
    return u


def steps_at(run, change, angle):
    """Change (n,) of the unknowns of a stage by a change of modal coordinates (n_q,)."""
    step = _at_ports(run.model, change)
    relative_step(run.model, math.cos(angle), math.sin(angle), step)
    return step[: run.model.scales.size]


def modal_forces(run, forces, angle):
    """Modal forces (n_q,) on all bodies of forces (n,) on the unknowns of a stage, without moments of second order."""
    model, f = run.model, np.zeros(dimensions(run.model).ports)
    f[: forces.size] = forces
    reactions(model, math.cos(angle), math.sin(angle), f)
    found, t, standing = np.zeros(model.omega2.size), model.ports.shape[1], len(model.block_ports)
    found[:t] = model.ports.T @ f[: len(model.ports)]
    found[t : t + model.block_ports.shape[1]] = model.block_ports.T @ f[len(model.ports) :][:standing]
    return found


def compliance_at(run, angle, speed):
    """Change (n, n) of the unknowns of a stage by forces on them; the bodies' own equations are for ``speed``."""
    model, work, level = run.model, run.work, at.FACTOR_SLOTS - 1
    assert factor_stage(model, work, level, C_Q, C_V, speed, 0.0, 0.0) == 0
    work.key[level] = -1.0
    terms, turning = model.links.scales.size, work.linear.compliance[level]
    found = np.zeros((terms + model.scales.size,) * 2)
    relative_compliance(model, math.cos(angle), math.sin(angle), turning, turning[len(model.ports) :], found)
    return found[terms:, terms:].T


class Moved(NamedTuple):
    """A frame at a crank angle: angle of its axes, origin (2,) from its crank's axis, derivatives by that angle."""

    angle: float
    angle1: float
    angle2: float
    place: np.ndarray
    place1: np.ndarray
    own1: np.ndarray  # the same and the second one, along the frame's own axes
    own2: np.ndarray


def moved(frame, theta):
    """A frame at a crank angle, rad."""
    row, s = frame.moved(theta), top
    x, y = row[[s.PLACE_X, s.PLACE_Y]], row[[s.PLACE_X1, s.PLACE_Y1]]
    return Moved(row[s.TURNED], row[s.TURN], row[s.TURN2], x, y, row[[s.OWN_X1, s.OWN_Y1]], row[[s.OWN_X2, s.OWN_Y2]])


def measured(end, frame, given, along, about, theta, motion, sign=1.0, sliding=None):
    """What a component measures of an interface's motion (6,) in its ``frame``, at a crank angle.

    Its direction and axis are vectors of the frame ``given``; a frame ``sliding`` takes the end along.
    """
    found = 0.0
    for term in terms_of(end, frame, Direction(given, along, about, sign), sliding):
        apart = moved(term.given, theta).angle - moved(term.own, theta).angle
        lever = 1.0 if term.lever is None else (moved(term.lever, theta).place - moved(term.lever, 0.0).place)[term.way]
        found += term.amplitude * lever * math.cos(apart + term.phase) * motion[term.component]
    return found


def joined_modes(topology):
    """Frequency (rad/s) and damping (1/s) of the modes of bodies that rigid gears join to one, a pair by group."""
    return [(group.omega, group.damping) for group in groups(topology)]


def law_outputs(connection, *frames):
    """Names of a connection's outputs between ends in these frames; ``InputError`` where its law cannot act."""
    return [name for piece in pieces_of(connection, *frames) for name, _, _ in piece.outputs]


# Start of a run -------------------------------------------------------------------------------------------------------


def stroke(model, c):
    """Stroke of the piston of a cylinder (from 0), m."""
    return model.cylinders[c, at.STROKE]


def rigid_torque(model, speed, samples):
    """Torque (samples,) of all rods on a rigid crank at even angles of two turns from 0."""
    found = np.zeros(samples)
    mean_motion.rigid_torque(model, speed, np.zeros(of_law.NUMBERS), np.zeros(of_law.SIZE), found)
    return found


def rods_in_rotation(model, speed, samples):
    """Tangents of the rods in rotation, their forces (N, c, 2) on the pins, and by displacement (N, c, 2, 2)."""
    rows = model.cylinders[:, at.END_ROW].astype(int)
    found = tangents_in_rotation(model, speed, rows, samples)
    ports = model.connections[rows][:, at.FIRST : at.FIRST + 2]
    return found, found.forces[:, ports], found.place[:, rows, :2, :2]


def leaning(model, speed):
    """Modal places and velocities (2, n) of all bodies at the start of a run whose block leans and rocks."""
    size = dimensions(model)
    work = make_work(model, state_size(size.modes, size.ports, size.films))
    found = np.zeros((2, size.modes))
    mean_motion.rigid_motion(model, work.start, speed)
    assert mean_motion.lean(model, work, speed, *found) == 0
    return found


# Steps and what they keep ---------------------------------------------------------------------------------------------


def make_anew(run):
    """Let a run make the matrices of its stages anew."""
    run.work.key[:] = -1.0


def take_method(run, name):
    """Let a run go on by another integrator, until :func:`take_back` of what this returns."""
    kept = run.model, run.work
    run.model = run.model._replace(stages=integrator_table(name))
    run.work = make_work(run.model, run.state.size)
    return kept


def take_back(run, kept):
    """Let a run go on as before :func:`take_method`."""
    run.model, run.work = kept
    make_anew(run)


def retuned(model, mode, omega):
    """Model with another frequency (rad/s) of a mode that touches nothing."""
    squares = model.omega2.copy()
    squares[mode] = omega**2
    return model._replace(omega2=squares)


def let_go(run, big_ends=None):
    """Take the drive line's springs and dampers off; with ``big_ends`` (c,), kg, rods and pistons are these on pins."""
    model = run.model
    scalars = model.scalars.copy()
    scalars[[at.SHAFT_K, at.SHAFT_C]] = 0.0
    if big_ends is not None:
        # In place, since the law of the rods shares this array.
        model.cylinders[:, at.M_BIG] = big_ends
        model.cylinders[:, [at.M_OSC, at.DELTA_J]] = 0.0
    run.model = model._replace(scalars=scalars, shaft_laws=0.0 * model.shaft_laws)
    make_anew(run)


def forget(run, state):
    """Clear what the integrator and the laws keep of earlier steps in a state, but for accelerations."""
    state[offset(HISTORY, run.model.omega2.size) :] = 0.0


def settle_method(run, state):
    """Let the integrator's own acceleration in a state be the bodies', as it is where nothing changes."""
    n = run.model.omega2.size
    state[offset(AUXILIARY, n) : offset(AUXILIARY + 1, n)] = motion(run, state)[2]


def losing_peaks(engine, settings, gas):
    """Integrators by which largest pressures of elastic films do not converge, as a model is told; a row for each."""
    methods = basis(engine, settings, gas).methods
    assert methods.shape == (len(INTEGRATORS), at.METHOD_COLUMNS)
    return [name for name, row in zip(INTEGRATORS, methods, strict=True) if row[at.LOSES_PEAKS]]


def lose_peaks(model, name, whether):
    """Mark an integrator as one by which largest pressures of elastic films do not converge."""
    model.basis.methods[list(INTEGRATORS).index(name), at.LOSES_PEAKS] = float(whether)


def inputs_in_force(run):
    """How inputs (i,) run over a step: (rows, i), of which the first are value and rate; a copy."""
    assert (at.VALUE, at.RATE) == (0, 1)
    return run.work.inputs.copy()


def give_stages(run, places, values):
    """Give inputs (s, i) at the stages of the next step, whose places (s,) are shares of it."""
    run.work.staged[1 : 1 + len(places), 0] = places
    run.work.staged[1 : 1 + len(places), 1:] = values
    run.work.staged[0, at.STAGES_GIVEN] = len(places)


def stages_given(run):
    """Number of stages of the next step that inputs are given for."""
    return int(run.work.staged[0, at.STAGES_GIVEN])


def delayed(model, steps):
    """Model to which pressures come later by so many communication steps."""
    choices = model.choices.copy()
    choices[at.GAS_DELAY] = steps
    return model._replace(choices=choices)


def bare_run():
    """What settling reads of a model with one mode and nothing else, of given speed, and its state."""
    scalars, layout, none = np.zeros(at.SCALARS), np.zeros(at.LAYOUT), np.zeros((0, 0))
    scalars[at.DRIVEN] = 1.0
    layout[[at.JOINT_ROW, at.DAMPER_ROW]] = -1.0
    model = SimpleNamespace(
        omega2=np.ones(1), scalars=scalars, layout=layout, block_ports=none, bearings=none, ports=np.zeros((1, 0)),
        connections=np.zeros((1, at.CONNECTION), dtype=int), cylinders=none, scales=np.zeros(0),
        bodies=SimpleNamespace(rows=np.zeros((top.OTHERS, top.BODY), dtype=int)),
        links=SimpleNamespace(scales=np.zeros(0)),
        laws=SimpleNamespace(remembered=np.zeros(1)),
    )  # fmt: skip
    return model, np.zeros(state_size(1, 0))
