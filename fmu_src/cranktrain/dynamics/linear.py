"""Small motions of bodies and connections about uniform rotation: M, C and K from the rows of the running model.

A body moves in axes of its frame, which turns at rΩ. Its modes q have the parts q_s of bands s,

    q = Re Σ_s q_s exp((λ + isΩ) t),    M = I,    C = D + 2rΩG + 2isΩ,
    K = ω² + r²Ω² (K_σ − C_σ) + isΩ (D + 2rΩG) − s²Ω²

with shafts of the drive line and mounts of the block added to D and ω². A component d of a connection measures ports u
with coefficients that turn with the angle between two frames (:mod:`cranktrain.dynamics.topology.terms`),

    d = Σ c(θ) u,    c = Σ_h c_h exp(ihθ),    d_s = R_s q = Σ_h c_h u_{s−h}

and its force has the mean tangents A, V, P by acceleration, velocity and displacement. The virtual work of band s adds

    M −= R_sᴴ A R_s,    C −= R_sᴴ (V + 2isΩ A) R_s,    K −= R_sᴴ (P + isΩ V − s²Ω² A) R_s.

The mean tangents are exact for laws that are constant in axes of the component. Variation of the laws about their
means, and all other bands, are left out (Hill's method, truncated).

The crank moves in band 0. Any other body moves in the bands in which its motion is slow as seen from its own axes (0),
from axes at rest (±r) or, where it is at rest or joined to the crank, from the crank's axes (± the difference of both
ratios). A band of a component counts if each body but the block that the component measures moves in it, or never can.
Otherwise the missing body would act as if it were held, which only a block nearly is. A gear on the crank therefore
feels the crank's rotation and not its motion across.

Forces at displaced points have moments about the axes of their bodies, with their mean forces as coefficients.

Source: Wereley, *Analysis and control of linear periodically time varying systems* (1991), chapter 3.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import Array
from cranktrain.core.types import ComplexArray
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.records import ModelArrays
from cranktrain.dynamics.tangents import Tangents, forces_in_rotation, tangents_in_rotation
from cranktrain.dynamics.topology import slots as top
from cranktrain.dynamics.topology.frames import coefficients_at
from cranktrain.loads.torsional_line import DAMPING, STIFFNESS

ACROSS = np.array([[0.0, -1.0], [1.0, 0.0]])
"""Matrix of the cross product e_z × in the plane."""
NEWTON_STEPS, SETTLED = 50, 1.0e-9
"""Most steps towards the mean places of connections, and relative change of the modes at which they end."""
SINGULAR = 1.0e-12
"""Singular value of the stiffness, relative to the largest, below which a mode is free, and rests."""


class Equations(NamedTuple):
    """Equations of small motions M ẍ + C ẋ + K x = 0 (n, n), real where all bands are 0, else complex."""

    mass: NDArray[Any]
    damping: NDArray[Any]
    stiffness: NDArray[Any]

    @property
    def first_order(self) -> NDArray[Any]:
        """Matrix A (2 n, 2 n) of ẏ = A y with y = (x, ẋ)."""
        n, inverse = len(self.mass), np.linalg.inv(self.mass)
        return np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ self.stiffness, -inverse @ self.damping]])

    def add(self, rows: NDArray[Any], tangents: Sequence[Array], shift: complex = 0.0) -> None:
        """Add a law with components ``rows`` (c, n) and tangents A, V, P (c, c) in a band with ``shift`` isΩ, 1/s."""
        acceleration, velocity, place = tangents
        left = rows.conj().T
        for matrix, tangent in zip(
            self,
            (
                acceleration,
                velocity + 2.0 * shift * acceleration,
                place + shift * velocity + shift**2 * acceleration,
            ),
            strict=True,
        ):
            change = left @ tangent @ rows
            matrix -= change if np.iscomplexobj(matrix) else change.real  # bands s and −s add up to a real one


class SmallMotions:
    """Coordinates of small motions of a model: modes of bodies in their bands, the crank's in band 0 first.

    ``still``: at rest at crank angle 0, where all motion is in band 0; for models whose connections are all of terms.

    Attributes
    ----------
    mode, band : (n,) number of the mode in the model, and band, of each coordinate
    bands : all bands of components that count
    """

    def __init__(self, model: ModelArrays, still: bool = False) -> None:
        self._model, self._still = model, still
        frames = model.links.frames
        used = {int(f) for f in model.bodies.rows[top.OTHERS :, top.FRAME_OF]}
        if not still and any(frames[f, top.FRAME_KIND] != top.TURNING for f in used):
            raise SolverError(
                "bodies that move as rod or piston do not turn uniformly, so their small motions have no constant "
                "coefficients"
            )
        self._terms = self._measured()
        own = self._bands()
        coordinates = [
            (mode, band) for first, count, bands in own for band in bands for mode in range(first, first + count)
        ]
        self.mode = np.array([mode for mode, _ in coordinates], dtype=np.int64)
        self.band = np.array([band for _, band in coordinates])
        found = np.unique(np.round(np.add.outer(np.unique(self.band), np.unique(self._terms.harmonic)), 9))
        rows = {float(band): self._rows(float(band)) for band in found}
        self._components = {
            band: one if np.any(one.imag) else one.real.copy() for band, one in rows.items() if np.any(one)
        }

    @property
    def added(self) -> int:
        """Number of modes of bodies other than crank and block, which come last in the model."""
        rows = self._model.bodies.rows[top.OTHERS :]
        apart = rows[:, top.MODE] >= self._model.ports.shape[1]  # without bodies on rigid gears of the crank
        return int(rows[(rows[:, top.ENDS_GROUP] > 0) & apart, top.MODES].sum())

    @property
    def bands(self) -> list[float]:
        """All bands in which components move."""
        return list(self._components)

    def components(self, band: float = 0.0) -> NDArray[Any]:
        """Rows (c, n) of all components in a band: those of terms, then those that are ports."""
        count = self._model.links.scales.size + self._model.scales.size
        return self._components.get(band, np.zeros((count, self.mode.size)))

    def numbers(self, connection: int) -> NDArray[np.int64]:
        """Numbers of the components of a connection."""
        row = self._model.connections[connection]
        if connection < int(self._model.layout[at.TERM_ROW]):
            return np.asarray(self._model.links.scales.size + row[at.FIRST : at.FIRST + row[at.COUPLED]])
        return np.arange(row[at.GAP], row[at.GAP] + row[at.COUPLED])

    def motion(self, rows: Array, first: int = 0, band: float = 0.0) -> Array:
        """Rows (c, n) in a band of what ``rows`` (c, k) give of the model's modes from ``first`` on."""
        local = self.mode - first
        own = (self.band == band) & (local >= 0) & (local < rows.shape[1])
        found = np.zeros((len(rows), self.mode.size))
        found[:, own] = rows[:, local[own]]
        return found

    def port(self, port: int, band: float = 0.0) -> Array:
        """Row (n,) of the motion of a port of crank, block or any other body in a band."""
        row = self._model.bodies.rows[self._owner(port)]
        shape = self._model.bodies.shapes[port, : row[top.MODES]]
        return self.motion(shape[None], int(row[top.MODE]), band)[0]

    def equations(self, speed: float, laws: Tangents) -> Equations:
        """Equations at a speed (rad/s) with the mean tangents of all connections."""
        parts = Equations(*self._bodies(speed))
        for k, row in enumerate(self._model.connections):
            count, numbers = int(row[at.COUPLED]), self.numbers(k)
            tangents = [part[k, :count, :count] for part in (laws.acceleration, laws.velocity, laws.place)]
            for band, components in self._components.items():
                rows = components[numbers]
                if np.any(rows):
                    parts.add(rows, tangents, 1j * band * speed if band else 0.0)
            if row[at.SHAPE] == at.OF_PORTS and row[at.SPIN] >= 0 and row[at.TURNED] >= 0:
                self._journal_moments(parts, row, tangents[1:], laws, self.components()[numbers])
        self._interface_moments(parts, laws)
        return parts

    def _bodies(self, speed: float) -> list[NDArray[Any]]:
        """M, C, K of all bodies, with shafts of the drive line and mounts."""
        model, n = self._model, self._model.omega2.size
        damping, stiffness = np.diag(model.damping), np.diag(model.omega2)
        for b, row in enumerate(model.bodies.rows):
            own, count = slice(row[top.OWN_MODE], row[top.OWN_MODE] + row[top.MODES]), int(row[top.MODES])
            modes = slice(row[top.MODE], row[top.MODE] + count)
            turned = model.bodies.constants[b, top.RATE] * speed
            damping[modes, modes] += 2.0 * turned * model.bodies.gyroscopic[own, :count].T
            stiffness[modes, modes] += turned**2 * model.bodies.spin[own, :count].T
        t, n_b = model.shafts.shape[1], model.block.stiffness.shape[0]
        for twist, law in zip(model.shafts, model.shaft_laws, strict=True):
            damping[:t, :t] += law[DAMPING] * np.outer(twist, twist)
            stiffness[:t, :t] += law[STIFFNESS] * np.outer(twist, twist)
        damping[t : t + n_b, t : t + n_b] += model.block.damping
        stiffness[t : t + n_b, t : t + n_b] += model.block.stiffness
        same, at_modes = np.equal.outer(self.band, self.band), np.ix_(self.mode, self.mode)
        mass, damping, stiffness = (np.where(same, part[at_modes], 0.0) for part in (np.eye(n), damping, stiffness))
        if not np.any(self.band):
            return [mass, damping, stiffness]
        shift = 1j * self.band * speed
        return [mass + 0j, damping + 2.0 * shift * mass, stiffness + shift * damping + shift**2 * mass]

    def _journal_moments(
        self, parts: Equations, row: NDArray[np.int64], tangents: Sequence[Array], laws: Tangents, rows: NDArray[Any]
    ) -> None:
        """Add the moments u × f of a connection of ports about crank and block, with u of the crank."""
        ports = row[at.FIRST : at.FIRST + row[at.COUPLED]]
        turned = self.port(row[at.TURNED])
        if row[at.REACTS] >= 0:
            turned = turned - self.port(row[at.REACTS])
        across = np.kron(np.eye(ports.size // 2), ACROSS)
        # The moment u × f = −uᵀ (e_z×) f, differentiated by the arguments of f and by u.
        arm = -laws.displaced[ports] @ across
        for part, tangent in zip(parts[1:], tangents, strict=True):
            part -= np.outer(turned, arm @ tangent @ rows)
        moved = np.array([self.port(port) for port in ports])
        parts.stiffness[:] -= np.outer(turned, -(across @ laws.forces[ports]) @ moved)

    def _interface_moments(self, parts: Equations, laws: Tangents) -> None:
        """Add the moments of mean forces at displaced interfaces, about the centre of mass of an added body."""
        model = self._model
        for held in model.links.interfaces:
            owner, x, y, turn = held[[top.OWNER, top.PORT_X, top.PORT_Y, top.PORT_TURN]].astype(int).tolist()
            if not (laws.forces[x] or laws.forces[y]):
                continue
            row = model.bodies.rows[owner]
            centre = model.bodies.centre[:2, row[top.OWN_MODE] : row[top.OWN_MODE] + row[top.MODES]]
            for band in np.unique(
                self.band[np.isin(self.mode, np.arange(row[top.MODE], row[top.MODE] + row[top.MODES]))]
            ):
                at_x, at_y = self.port(x, band), self.port(y, band)
                if owner >= top.OTHERS:
                    moved = self.motion(centre, int(row[top.MODE]), band)
                    at_x, at_y = at_x - moved[0], at_y - moved[1]
                change = laws.forces[y] * at_x - laws.forces[x] * at_y
                parts.stiffness[:] -= np.outer(self.port(turn, band), change)

    def _owner(self, port: int) -> int:
        """Number of the body that has a port."""
        rows = self._model.bodies.rows
        return int(np.flatnonzero((rows[:, top.PORT] <= port) & (port < rows[:, top.PORT] + rows[:, top.PORTS]))[0])

    def _bands(self) -> Iterator[tuple[int, int, list[float]]]:
        """First mode, number of modes and bands of each body, or of each group of bodies with common modes."""
        model, terms = self._model, self._terms
        on_crank = {
            b
            for j in range(model.links.scales.size)
            if top.OF_CRANK in (own := set(terms.body[terms.component == j].tolist()))
            for b in own
        }
        bands: dict[tuple[int, int], set[float]] = {}
        turning = model.ports.shape[1]  # modes of the crank and of bodies on rigid gears with it
        for b, row in enumerate(model.bodies.rows):
            first, count = int(row[top.MODE]), int(row[top.MODES])
            ratio = round(float(model.links.frames[row[top.FRAME_OF], top.RATIO]), 9) if b >= top.OTHERS else 1.0 - b
            own = bands.setdefault((first, count), {0.0})
            if first >= turning and not self._still:
                own |= {abs(ratio), -abs(ratio)}
                if b in on_crank or ratio == 0.0:
                    own |= {ratio - 1.0, 1.0 - ratio}
        for (first, count), found in bands.items():
            if count > 0:
                yield first, count, sorted(found, key=lambda s: (abs(s), -s))

    def _measured(self) -> "_Terms":
        """What each component measures: ports with their coefficients by harmonics of the crank angle."""
        model, links = self._model, self._model.links
        found: list[tuple[int, int, float, complex]] = []
        at_rest = coefficients_at(links.frames, links.terms, 0.0)
        for term, (port, _), value in zip(links.terms, links.taken.tolist(), at_rest.tolist(), strict=True):
            given, own = (links.frames[int(term[slot])] for slot in (top.GIVEN_FRAME, top.OWN_FRAME))
            harmonic = round(float(given[top.RATIO] - own[top.RATIO]), 9)
            angle = given[top.START] - own[top.START] + term[top.ANGLE]
            component, size = int(term[top.COMPONENT]), float(term[top.AMPLITUDE])
            if harmonic == 0.0 or self._still:
                found.append((component, port, 0.0, value))
            else:
                for sign in (1.0, -1.0):
                    found.append((component, port, sign * harmonic, 0.5 * size * np.exp(1j * sign * angle)))
        first = links.scales.size
        found += [(first + port, port, 0.0, 1.0) for port in range(model.scales.size)]
        for port, other in model.pairs.astype(int).tolist():
            # Motion of the block in axes of the crank: cos θ w_x + sin θ w_y, cos θ w_y − sin θ w_x.
            for sign in (1.0, -1.0):
                found += [
                    (first + port, other, sign, -0.5), (first + port, other + 1, sign, 0.5j * sign),
                    (first + port + 1, other + 1, sign, -0.5), (first + port + 1, other, sign, -0.5j * sign),
                ]  # fmt: skip
        found += [(first + port, other, 0.0, -1.0) for port, other in model.axial.astype(int).tolist()]
        columns = list(zip(*found, strict=True)) or [(), (), (), ()]
        ports = np.array(columns[1], dtype=np.int64)
        body = np.array([self._owner(port) for port in ports], dtype=np.int64)
        return _Terms(np.array(columns[0], dtype=np.int64), ports, body, np.array(columns[2]), np.array(columns[3]))

    def _rows(self, band: float) -> ComplexArray:
        """Rows (components, n) of all components in a band; zero where a body of the component does not move in it.

        A block that does not move in a band counts as held.
        """
        model, terms = self._model, self._terms
        count = model.links.scales.size + model.scales.size
        found = np.zeros((count, self.mode.size), dtype=complex)
        moves = np.zeros((count, len(model.bodies.rows)), dtype=bool)
        measured = moves.copy()
        moves[:, top.OF_BLOCK] = True
        measured[terms.component, terms.body] |= np.any(model.bodies.shapes[terms.port], axis=1)
        for component, port, body, harmonic, coefficient in zip(*terms, strict=True):
            row = self.port(port, round(band - harmonic, 9))
            found[component] += coefficient * row
            moves[component, body] |= np.any((self.band == round(band - harmonic, 9)) & self._of_body(body))
        found[np.any(measured & ~moves, axis=1)] = 0.0
        return found

    def _of_body(self, body: int) -> NDArray[np.bool_]:
        """True for coordinates (n,) of a body."""
        row = self._model.bodies.rows[body]
        return np.asarray((self.mode >= row[top.MODE]) & (self.mode < row[top.MODE] + row[top.MODES]))


def mean_places(model: ModelArrays, rows: Iterable[int] | None = None) -> Array:
    """Mean motion (k, 4) of connections of terms under the mean of their loads, by Newton's method.

    Bodies are held by the connections in ``rows``, or by all; what these exert without motion is in balance. A mean
    torque presses teeth on one of their flanks, whose normal then joins motion along and across the pitch circle.
    """
    taken = list(range(len(model.connections)) if rows is None else rows)
    terms, places = [k for k in taken if k >= int(model.layout[at.TERM_ROW])], np.zeros((len(model.connections), 4))
    still = forces_in_rotation(model, terms, places)
    loads = model.connections[:, at.IS_LOAD] > 0
    if not np.any(still[loads]):
        return places
    still[loads] = 0.0
    motions = SmallMotions(model, still=True)
    x, components = np.zeros(motions.mode.size), motions.components()
    for _ in range(NEWTON_STEPS):
        laws = tangents_in_rotation(model, rows=taken, places=places).mean()
        stiffness, forces = motions.equations(0.0, laws).stiffness, forces_in_rotation(model, terms, places) - still
        balance = -stiffness @ x
        for k in terms:
            own, count = components[motions.numbers(k)], model.connections[k, at.COUPLED]
            balance += own.T @ (forces[k, :count] - laws.place[k, :count, :count] @ (own @ x))
        step = np.linalg.lstsq(stiffness, balance, rcond=SINGULAR)[0]
        x += step
        for k in terms:
            places[k, : model.connections[k, at.COUPLED]] = components[motions.numbers(k)] @ x
        if np.max(np.abs(step)) <= SETTLED * np.max(np.abs(x)):
            break
    return places


class _Terms(NamedTuple):
    """Terms (t,) of all components: those of sums of terms first, then those that are ports."""

    component: NDArray[np.int64]
    port: NDArray[np.int64]
    body: NDArray[np.int64]
    harmonic: Array
    coefficient: NDArray[Any]
