"""An elastic film as tests use it: a main bearing of the six with made-up bore shapes, stepped by backward Euler."""

import numpy as np

from cranktrain.film.elastic.content import CONTENT
from cranktrain.film.elastic.film import CONVERGED, elastic_film
from cranktrain.film.elastic.grid import (
    DAMPING,
    FILL_MEAN,
    FORCE,
    OIL,
    SIDE_FLOW,
    STIFFNESS,
    SUPPLY_FLOW,
    ElasticGrid,
)
from cranktrain.film.elastic.grid import VISCOSITY as VISCOSITY_AT
from cranktrain.film.elastic.workspace import PREPARED, WEIGHT, lane_work
from cranktrain.film.laws.ehd import elastic_memory

DIAMETER, WIDTH, CLEARANCE, VISCOSITY, SPEED = 0.085, 0.030, 40e-6, 0.0143, 209.4
GRID, STEP = ElasticGrid(48, 7), np.radians(1.0)
COMPLIANCE = np.array([0.6, 0.6, 0.2, 0.24, 0.24, 0.24, 0.24, 0.15, 0.15, 0.12, 0.12]) * 1e-9


def bore_shapes(grid, count):
    """Ovals, a widening, triangles and their changes along the bore, (count, n_phi, n_z + 2)."""
    phi, zeta = np.meshgrid(grid.angles, grid.zetas, indexing="ij")
    bow = zeta**2 - 1 / 3
    forms = [
        np.cos(2 * phi), np.sin(2 * phi), np.ones_like(phi), np.cos(3 * phi), np.sin(3 * phi),
        np.cos(2 * phi) * bow, np.sin(2 * phi) * bow, np.cos(2 * phi) * zeta, np.sin(2 * phi) * zeta,
        np.cos(4 * phi), np.sin(4 * phi),
    ]  # fmt: skip
    return np.array(forms[:count]).reshape(count, *phi.shape)


class Bearing:
    """One film with its memory: the state at the step's start, and the warm start."""

    def __init__(self, grid, count=0, softness=1.0, **options):
        self.grid, self.count = grid, count
        sizes = {"diameter": DIAMETER, "width": WIDTH, "clearance": CLEARANCE, "viscosity": VISCOSITY}
        sizes |= {name: options.pop(name) for name in list(options) if name in sizes}
        self.clearance = sizes["clearance"]
        self.film = grid.film(
            **sizes, shapes=bore_shapes(grid, count), compliance=softness * COMPLIANCE[:count], **options
        )
        self.work = lane_work(self.film)
        made = elastic_memory(self.film, 1)
        self.memory = made._replace(known=made.start_shapes, content=np.zeros((1, CONTENT, 0)))
        self.start, self.start_delta, self.start_position = (
            rows[0] for rows in (made.start, made.start_shapes, made.start_place)
        )
        self.unknowns, self.delta, self.out = made.unknowns[0], made.shapes[0], made.out[0]

    def solve(self, position, velocity=(0, 0, 0, 0), speed=SPEED, dt=np.inf, gain=None, tangents=True):
        """Solve at a position (m) and velocity (m/s); the result's status."""
        self.memory.motions[0], self.memory.speeds[0] = [position, velocity], speed
        self.work.marks[0, 0, PREPARED] = 0.0
        clock = float(dt), float(dt if gain is None else gain)
        viscosity = float(self.film.constants[VISCOSITY_AT])
        return elastic_film(self.film, self.work, 0, clock, self.memory, viscosity, tangents)

    @property
    def weights(self):
        """Weights of the pressure along ζ at all lines, (n_phi, n_z + 2)."""
        return self.work.nodes[0, WEIGHT].reshape(self.grid.n_phi, -1).copy()

    def settle(self, *args, **options):
        """Solve and insist on convergence; forces (4,)."""
        assert self.solve(*args, **options) == CONVERGED
        return self.forces

    def accept(self, position):
        """What was solved last becomes the start of the next step."""
        self.start[:], self.start_delta[:] = self.unknowns, self.delta
        self.start_position[:] = position

    def forget(self):
        """A cold start: full film without pressure, round bore."""
        self.unknowns[:] = 0
        self.delta[:] = 0

    @property
    def forces(self):
        return self.out[FORCE : FORCE + 4].copy()

    @property
    def stiffness(self):
        return self.out[STIFFNESS : STIFFNESS + 16].reshape(4, 4).copy()

    @property
    def damping(self):
        return self.out[DAMPING : DAMPING + 16].reshape(4, 4).copy()

    @property
    def pressure(self):
        """Film pressure at the nodes, (n_phi, n_z), Pa."""
        unit = 12 * self.film.constants[6] * (self.film.constants[3] / self.film.constants[5]) ** 2
        return unit * np.maximum(self.unknowns, 0).reshape(self.grid.n_phi, self.grid.n_z)


def orbit(angle, highest, tilt=0.03):
    """Position and its derivative by the angle, over the clearance, (4,) each: eccentricity and direction vary."""

    def place(t):
        e = 0.7 + (highest - 0.7) * np.cos(3 * t)
        phi = 0.5 * np.pi + 1.1 * np.sin(1.5 * t) + 0.4 * np.sin(3 * t)
        return np.array([e * np.cos(phi), e * np.sin(phi), tilt * np.sin(1.5 * t), tilt * np.cos(3 * t)])

    return place(angle), (place(angle + 1e-5) - place(angle - 1e-5)) / 2e-5


def carry(bearing, load, step, steps, speed=SPEED, record=(), position=(0.1, -0.7, 0.0, 0.0)):
    """Massless journal under ``load(angle)`` (4,) for as many steps of ``step`` rad; entries of ``out``, (steps, ·)."""
    h = step / speed
    c = bearing.clearance
    position = c * np.array(position)
    bearing.start_position[:] = position
    velocity = np.zeros(4)
    rows = []
    for n in range(1, steps + 1):
        applied = load(n * step)
        start = bearing.start_position.copy()
        position = start + h * velocity
        for _ in range(60):
            velocity = (position - start) / h
            rest = bearing.settle(position, velocity, speed, h) + applied
            if abs(rest).max() < 1e-4 * abs(applied).max():
                break
            change = -np.linalg.solve(bearing.stiffness + bearing.damping / h, rest)
            position = position + change * min(1.0, 0.15 * c / abs(change).max())
        else:
            raise AssertionError(f"the journal found no place at step {n}")
        bearing.accept(position)
        rows.append(bearing.out[list(record)])
    return np.array(rows)


def grooved(grid=GRID, count=0, **options):
    """A groove along the middle of the upper half, as wide as the grid says, fed with 4 bar."""
    around = (grid.angles >= np.radians(30)) & (grid.angles <= np.radians(150) * (1.0 + 1e-12))
    mask = np.outer(around, np.abs(grid.zetas[1:-1]) <= grid.groove + 1.1e-6).astype(float)
    return Bearing(grid, count, supply=mask, supply_pressure=4e5, **options)


def follow(bearing, steps, highest=0.9, step=STEP, speed=SPEED, visit=None):
    """Along the orbit; ``visit(n, position, velocity, h)`` after each solution."""
    h = step / SPEED
    bearing.start_position[:] = bearing.clearance * orbit(0, highest)[0]
    for n in range(1, steps + 1):
        place, slope = orbit(n * step, highest)
        position, velocity = bearing.clearance * place, bearing.clearance * slope * SPEED
        bearing.settle(position, velocity, speed, h)
        if visit:
            visit(n, position, velocity, h)
        bearing.accept(position)


def tangent_errors(bearing, position, velocity, h, speed=SPEED):
    """Errors of stiffness and damping of what was solved last, over their largest entry, against central differences.

    A film all ruptured carries nothing and has none. The film is left as it was found, less its result.
    """
    keep = bearing.unknowns.copy(), bearing.delta.copy()
    errors = []
    for which, (tangent, size) in enumerate(((bearing.stiffness, 3e-6), (bearing.damping, 3e-3))):
        slope = np.empty((4, 4))
        for k in range(4):
            forces = []
            for sign in (1, -1):
                place = [position.copy(), velocity.copy()]
                place[which][k] += sign * size * bearing.clearance
                bearing.unknowns[:], bearing.delta[:] = keep
                forces.append(bearing.settle(*place, speed, h))
            slope[:, k] = (forces[0] - forces[1]) / (2 * size * bearing.clearance)
        if slope.any():
            errors.append(abs(tangent - slope).max() / abs(slope).max())
    bearing.unknowns[:], bearing.delta[:] = keep
    return errors


def fill_up(bearing, position, fill, steps, tolerance):
    """Fill a bearing at a fixed place from ``fill`` on; the stored oil must follow supply less side flow every step.

    Shares filled after each step; ``tolerance`` over the oil that is there.
    """
    bearing.start[:] = fill - 1.0
    bearing.start_position[:] = position
    h = np.radians(5) / SPEED
    bearing.settle(position, dt=1e-12)
    oil = bearing.out[OIL] - 1e-12 * (bearing.out[SUPPLY_FLOW] - bearing.out[SIDE_FLOW])
    fills = []
    for _ in range(steps):
        bearing.settle(position, dt=h)
        gained = h * (bearing.out[SUPPLY_FLOW] - bearing.out[SIDE_FLOW])
        assert abs(bearing.out[OIL] - oil - gained) <= tolerance * oil
        oil = bearing.out[OIL]
        fills.append(bearing.out[FILL_MEAN])
        bearing.accept(position)
    return fills
