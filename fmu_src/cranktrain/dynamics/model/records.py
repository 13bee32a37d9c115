"""Records of the running model: all arrays that kernels of a run read, and the parts of which they consist."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.kernel import record
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import lump_slots as of
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.numbers import NUMBERS
from cranktrain.dynamics.time.integrators import method_arrays
from cranktrain.dynamics.topology.pieces import REFERENCE_VISCOSITY
from cranktrain.dynamics.topology.records import Bodies, Links
from cranktrain.dynamics.topology.slots import MODE, MODES, OF_BLOCK, OF_CRANK, OTHERS, OWN_MODE, PORT, PORTS, RATE
from cranktrain.film.laws.films import PAIR, Films, IntArray
from cranktrain.loads.built_in_trace import SAMPLES, TRACE_CONSTANTS, TRACE_ROWS
from cranktrain.loads.damper import DAMPER_CONSTANTS

DIRECTIONS = 6
ROOM_TEMPERATURE = 293.15
"""Temperature (K) of a system that has no oil of its own."""


class BlockArrays(NamedTuple):
    """Arrays of block and guided pistons: j mounts and n_s stationary modes, of which the first n_b are the block's."""

    stiffness: Array  # (n_b, n_b) stiffness of the mounts in the block's modes
    damping: Array  # (n_b, n_b) damping of the mounts in the block's modes
    preload: Array  # (n_s,) modal force of the mounts that carries the engine's weight
    weight: Array  # (n_s,) preload of the mounts per m/s² of gravity
    liners: Array  # (c, 2) height of each liner's upper and lower ring along its cylinder from the crank axis, m
    mounts: Array  # (6 j, n_s) displacement and rotation of each mount
    mount_laws: Array  # (6 j, MOUNT_LAW) stiffness, damping and preload of each component of ``mounts``
    cover: Array  # (n_s,) upward displacement of the bottom cover's middle
    motion: Array  # (6, n_s) displacement and rotation of the whole block, at its centre of mass
    guidance: Array  # (10,) see loads.piston_guidance
    piston_shape: Array  # (2, 2) shape P of a guided piston's ports in its modes
    piston_inverse: Array  # (2, 2) inverse mass P Pᵀ of a guided piston at its ports


def no_block(modes: int = 0, cylinders: int = 0) -> BlockArrays:
    """Rigid ground instead of a block, with ``modes`` of guided pistons.

    Liners on rigid ground have no displacement, so their heights do not matter.
    """
    n, z = modes, np.zeros
    liners = np.tile([1.0, -1.0], (cylinders, 1))
    return BlockArrays(
        z((0, 0)), z((0, 0)), z(n), z(n), liners, z((0, n)), z((0, at.MOUNT_LAW)), z(n),
        z((DIRECTIONS, n)), z(10), np.eye(2), np.eye(2),
    )  # fmt: skip


class Basis(NamedTuple):
    """Constants of one engine at its fidelity levels (SI)."""

    oil: Array  # (OIL_CONSTANTS,) see engine.lubricant
    oil_speeds: Array  # (k,) engine speeds, rad/s
    oil_temperatures: Array  # (k,) oil temperatures at the speeds ``oil_speeds``, K
    films: Array  # (FILM_KINDS,) marks of bearings with oil films, see dynamics.model.slots
    damper: Array  # (DAMPER_CONSTANTS,) see loads.damper
    damper_speeds: Array  # (k,) engine speeds, rad/s
    damper_temperatures: Array  # (k,) damper temperatures at these speeds, K
    cylinders: Array  # (CYLINDER_CONSTANTS,) bore and compression ratio, see dynamics.model.slots
    trace: Array  # (TRACE_CONSTANTS,) of the built-in gas trace, see loads.built_in_trace
    trace_rows: Array  # (TRACE_ROWS, SAMPLES) scratch
    methods: Array  # (methods, METHOD_COLUMNS) all integrators of the register
    tables: Array  # (methods, rows, WIDTH) coefficients of the integrators, padded with zeros


def plain_basis() -> Basis:
    """Constants of a system without gas and damper; the oil of films that bring none has a constant viscosity."""
    z = np.zeros
    methods, tables = method_arrays()
    oil = np.array([0.0, REFERENCE_VISCOSITY, 0.0, 0.0])  # Vogel's law A exp(B/(T − C)) with B = C = 0
    return Basis(
        oil, z(1), np.full(1, ROOM_TEMPERATURE), z(at.FILM_KINDS), z(DAMPER_CONSTANTS), z(1), z(1),
        z(at.CYLINDER_CONSTANTS), z(TRACE_CONSTANTS), z((TRACE_ROWS, SAMPLES)),
        np.column_stack([methods, z(len(methods))]), tables,
    )  # fmt: skip


class Lumps(NamedTuple):
    """Constants of a model with t rotating modes (the first r are the crank's), n modes in all, and j mounts."""

    values: Array  # (numbers,) lumped values that the bodies were made for, by slot
    traits: Array  # (TRAITS,) see dynamics.model.lump_slots
    fixed: Array  # (2, COORDINATES, r) modes at flywheel and pulley, see dynamics.model.lump_slots
    units: Array  # (2 MOMENTS, CHANGING, COORDINATES, COORDINATES) matrices of parts with unit moments there
    unit_loads: Array  # (2 MOMENTS, LOADS, COORDINATES) their loads
    places: Array  # (2, 3) positions of flywheel and pulley
    mains: Array  # (b,) positions of the main journals along the axis
    plain: Array  # (b,) 1 if the main bearing has a film
    omega2: Array  # (t,) squared frequencies of the rotating modes
    damping: Array  # (t,) damping of the rotating modes, 1/s
    rod_masses: Array  # (c,) mean mass of each rod on its pin
    gyroscopic: Array  # (t, t) G transposed, as in the model
    matrices: Array  # (CHANGING, r, r) of the crank's modes
    spin: Array  # (t, t) (K_σ − C) transposed, as in the model
    loads: Array  # (LOADS, t) loads by rotation and by a unit acceleration field
    gravity: Array  # (3, n) modal projection of a unit acceleration field
    ports: Array  # (m, t) shapes of the rotating ports
    tilts: Array  # (2b, t) rotation about x and y of each main journal
    ends: Array  # (4, t) motion of flywheel and pulley, see dynamics.model.slots
    shafts: Array  # (s, t) twist of each shaft of the drive line
    lag: Array  # (t,) lag of the drive line's rotors behind a crank that turns slowly by 1 rad
    rotor: Array  # (t,) rotation of a free dynamometer in each mode
    grown: Array  # (t,) slot of the mass or inertia if a mode moves just one lumped part, else NOT_LUMPED
    mount_motion: Array  # (6j, 6) motion of each mount in the block's rigid motions about the origin
    room: Array  # (ROOMS, r, r) scratch
    vectors: Array  # (VECTOR_ROWS, t) scratch
    scratch: Array  # (64,)


def no_lumps() -> Lumps:
    """Constants of a model without lumped data."""
    z = np.zeros
    traits = z(of.TRAITS)
    traits[of.PATH_ROW] = at.NO_PORT
    n, square = z(0), z((0, 0))
    units, fixed = z((2 * of.MOMENTS, of.CHANGING, of.COORDINATES, of.COORDINATES)), z((2, of.COORDINATES, 0))
    return Lumps(
        z(NUMBERS), traits, fixed, units, z((2 * of.MOMENTS, of.LOADS, of.COORDINATES)), z((2, 3)), n, n, n, n, n,
        square, z((of.CHANGING, 0, 0)), square, z((of.LOADS, 0)), z((3, 0)), square, square, z((4, 0)), square, n, n, n,
        z((0, DIRECTIONS)), z((of.ROOMS, 0, 0)), z((of.VECTOR_ROWS, 0)), z(64),
    )  # fmt: skip


@record
class ModelArrays(NamedTuple):
    """Contiguous float64 arrays of the running model (SI).

    Sizes: n modes (n_t of rotating bodies, n_b of the block, two of each guided piston), m ports in the same groups, b
    main bearings, c cylinders.
    """

    omega2: Array  # (n,) squared frequencies of the modes, (rad/s)²
    damping: Array  # (n,) modal damping, 1/s
    gravity: Array  # (3, n) modal projection of a unit acceleration field
    pairs: Array  # (r, 2) rotating and stationary ports, see dynamics.model.ports
    axial: Array  # (0 or 1, 2) rotating and stationary port along the axis
    axis_weights: Array  # (b,) weights of main journals in the displacement of the crank's centre of mass
    shafts: Array  # (s, n_t) twist of each shaft of the drive line (a dynamometer of given speed adds none), then
    # twist of the crank's own shafts that have damping, see dynamics.model.hysteresis
    shaft_laws: Array  # (s, LAW) stiffness and damping of each shaft, see loads.torsional_line
    lag: Array  # (n_t,) amplitudes by which the drive line's rotors lag a crank that turns slowly by 1 rad, else 0
    rotor: Array  # (n_t,) rotation of a free dynamometer in each mode; 0 if its speed is given
    block: BlockArrays
    bodies: Bodies  # crank, block and all other bodies
    links: Links  # connections other than the engine's own
    ends: Array  # (4, n_t): see dynamics.model.slots
    tilts: Array  # (2b, n_t): rotation about x and y of each main journal
    bearings: Array  # (b, COLUMNS) see film.laws.parameters
    laws: Films  # force law of each connection with its memory of a step; empty for a rod with a rigid big end
    pins: Array  # (c, 2) undeformed x, y of each rod's pin
    big_ends: Array  # (c, COLUMNS) like ``bearings``, for the film between pin and rod if the big end is not rigid
    connections: IntArray  # (k, CONNECTION) ports that the force law of each connection couples, see slots
    scales: Array  # (n_newton,) scale of each Newton port: displacement that counts like one clearance
    limited: Array  # (l, 2) ports whose change per iteration is limited; the port it is relative to, or NO_PORT
    judged: Array  # (j,) ports whose error counts in the error of a step
    layout: Array  # (LAYOUT,) see dynamics.model.layout
    damper: Array  # (PARAMETERS,) see loads.damper
    cylinders: Array  # (c, CYLINDER) see dynamics.model.slots
    gas: Array  # (2, k, 4) periodic splines over a cycle: motored, rise by combustion; (2c, k, 4) by cylinder
    scalars: Array  # (SCALARS,) see dynamics.model.slots
    kinks: Array  # (KINKS,) angles after firing dead centre at which the gas trace is least smooth, padded with NO_KINK
    choices: Array  # (CHOICES,) see dynamics.model.slots
    stages: Array  # the integrator's table, see dynamics.time.table, padded with zeros
    basis: Basis  # constants that the preparation of a run reads
    lumps: Lumps  # constants from which the arrays of other lumped data are made
    build: NDArray[np.void]  # (0,) see core.build_mark

    def of_body(self, row: int, name: str) -> Array:
        """Part of a table of :class:`Bodies` that belongs to a body; writing to it changes the model."""
        first = self.bodies.rows[row]
        by_port = name == "shapes"
        begin, count = first[[PORT, PORTS]] if by_port else first[[OWN_MODE, MODES]]
        whole = getattr(self.bodies, name)[begin : begin + count]
        return np.asarray(whole if whole.ndim == 1 else whole[:, : first[MODES]])

    @property
    def ports(self) -> Array:
        """Shapes (m_t, n_t) of the rotating ports."""
        return self.of_body(OF_CRANK, "shapes")

    @property
    def block_ports(self) -> Array:
        """Shapes (m_b, n_b) of the block's ports."""
        return self.of_body(OF_BLOCK, "shapes")

    @property
    def gyroscopic(self) -> Array:
        """G (n_t, n_t) of the rotating body, transposed."""
        return self.of_body(OF_CRANK, "gyroscopic")

    @property
    def spin(self) -> Array:
        """K_σ − C (n_t, n_t) of the rotating body, transposed."""
        return self.of_body(OF_CRANK, "spin")

    @property
    def centrifugal_load(self) -> Array:
        """Modal centrifugal load (n_t,) of the rotating body at unit speed."""
        return self.of_body(OF_CRANK, "centrifugal_load")

    @property
    def euler_load(self) -> Array:
        """Modal load (n_t,) at unit angular acceleration of the rotating body and all that have their modes in it."""
        found = self.of_body(OF_CRANK, "euler_load")
        for row in range(OTHERS, len(self.bodies.rows)):
            if self.bodies.rows[row, MODE] < found.size:
                found = found + self.bodies.constants[row, RATE] * self.of_body(row, "euler_load")
        return found

    @property
    def films(self) -> Films:
        """Force laws of the main bearings: the first rows of ``laws``; both use the same memory."""
        b, laws = self.bearings.shape[0], self.laws
        rows = {name: getattr(laws, name)[:b] for name in ("entry", "traits", "place", "velocity")}
        return laws._replace(remembered=laws.remembered[: b + 1], **rows)


class Dimensions(NamedTuple):
    """Sizes of the arrays, and rows of the force laws that an engine has only once."""

    modes: int
    turning_modes: int
    bearings: int
    cylinders: int
    newton: int  # number of components of motion of all connections
    ports: int
    turning_ports: int
    films: int  # number of values in the state for the memory of force laws and added connections
    crank_modes: int
    thrust: int  # rows of ``connections`` of thrust bearing, axial joint and damper; −1: none
    joint: int
    damper: int
    slides: bool  # whether the axial joint slides
    collar: int  # port of the thrust collar along its axis, and port of the damper's twist (next)
    twist: int
    passes: bool  # whether a step may pass over communication points; the memory of all laws can then be interpolated


def dimensions(model: ModelArrays) -> Dimensions:
    """Sizes of the arrays of a model."""
    rows = model.layout[[at.CRANK_MODES, at.THRUST_ROW, at.JOINT_ROW, at.DAMPER_ROW]].astype(int).tolist()
    crank, thrust, joint, damper = rows
    collar, twist = (int(model.connections[row, at.FIRST]) if row >= 0 else -1 for row in (thrust, damper))
    remembered = np.diff(model.laws.remembered)
    return Dimensions(
        model.omega2.size, int(model.bodies.rows[OF_CRANK, MODES]), model.bearings.shape[0], model.cylinders.shape[0],
        model.scales.size + model.links.scales.size, int(model.layout[at.PORTS]), len(model.ports),
        int(model.laws.remembered[-1]), crank, thrust, joint, damper,
        bool(model.layout[at.SLIDING] > 0.0), collar, twist, bool(np.all((remembered == 0) | (remembered == PAIR))),
    )  # fmt: skip
