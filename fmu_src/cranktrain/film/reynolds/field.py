"""Reynolds' equation of a film on a rectangle, with four models of cavitation.

    ∂(θh)/∂t + ∂/∂x (Ū θh − h³/(12η) ∂p/∂x) + ∂/∂z (W̄ θh − h³/(12η) ∂p/∂z) = 0

x is the sliding direction (around a journal: x = Rφ), z is across it; Ū, W̄ are half the sums of both surfaces'
velocities, θ is the fill. The film ruptures at p = 0, so pressures are relative to the cavitation pressure.

``full``            no rupture, tension allowed (Sommerfeld)
``guembel``         the full film's tension is cut off; does not conserve oil
``reynolds``        p ≥ 0 with ∂p/∂n = 0 where the film ruptures (Swift and Stieber); the gap counts as full where it is
                    ruptured, so that oil appears at rupture and vanishes at reformation
``mass-conserving`` p ≥ 0, 0 ≤ θ ≤ 1 and oil conserved everywhere (Jakobsson, Floberg and Olsson). Without a time step
                    the film is the limit of a very long one (``MEMORY``) from a full gap

Node-centred finite volumes: second order where the film is full, first order in the fill. The oil balance
closes to rounding for ``full`` and ``mass-conserving``; for the other two ``FilmSolution.mass_defect`` is the oil that
they create. Assumptions: laminar, isothermal, thin film; viscosity constant across the film. With a law of density the
liquid is compressible: θ of a full film is ρ(p)/ρ(0), and volumes are those at p = 0.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cranktrain.core.errors import InputError, SolverError, nearest
from cranktrain.film.reynolds.cavitation import (
    CONSERVING,
    CONVERGED,
    FULL_FILM,
    REYNOLDS,
    SINGULAR,
    STALLED,
    Balance,
    Space,
    Unknowns,
    film_state,
    oil_balance,
)
from cranktrain.film.reynolds.liquid import Density, compressed_pressure, incompressible, mass_flow_law
from cranktrain.film.reynolds.observables import largest_pressure, outflows, shear_forces
from cranktrain.film.reynolds.piezoviscosity import Law, reduced_pressure, true_pressure, viscosity_factor
from cranktrain.film.reynolds.rough_gap import Roughness, rough_gap
from cranktrain.film.reynolds.supply import Edges, Supply, given_pressures, node_field
from cranktrain.film.reynolds.volumes import (
    Array,
    Faces,
    Rectangle,
    band_order,
    cell_faces,
    cell_sums,
    node_faces,
    rectangle,
)

CAVITATION = {"full": FULL_FILM, "guembel": FULL_FILM, "reynolds": REYNOLDS, "mass-conserving": CONSERVING}
MEMORY = 1e8
"""Time step that replaces ``dt`` for a steady film, over the time in which the largest face flow fills the gap."""
MAX_STAGES = 100
"""Limit of stages that lengthen the time step of a steady mass-conserving film that does not converge at once."""
AMBIENT = Edges()


@dataclass(frozen=True)
class FilmSolution:
    """Solution of a film in SI units; fields are (n_x, n_z).

    Flows are volumes per time out of the film; the flow of a feeding groove is negative. Loads and moments of the
    pressure are sums over nodes, ∫ p f dA = (pressure * f * areas).sum().
    """

    x: Array
    z: Array
    h: Array
    areas: Array
    pressure: Array
    fill: Array
    """Fill θ; above 1 for a compressible liquid under pressure."""
    ruptured: NDArray[np.bool_]
    viscosity: Array
    load: float
    """Load ∫p dA, N."""
    centre: tuple[float, float]
    """Centre of pressure (x, z), m; nan without load."""
    p_max: float
    """Largest pressure, Pa, by parabolas through the largest node and neighbours (films with steps: at the node)."""
    p_max_place: tuple[float, float]
    drag: tuple[tuple[float, float], tuple[float, float]]
    """Shear force (x, z) of the film on the first and on the second surface, N (∓h/2 ∂p and ±ηΔU/h times the fill)."""
    flows: Mapping[str, float]
    """Outflow through each edge with a given pressure and through each supply, m³/s."""
    stored: float
    """Rate of growth of the oil in the film, m³/s."""
    mass_defect: float
    """|Created oil| over the sum of inflow, outflow, growth and flow carried by the surfaces."""
    passes: int
    """Number of active-set iterations."""


def solve_film(
    h: ArrayLike,
    lengths: tuple[float, float],
    *,
    speeds: tuple[float, float] = (0.0, 0.0),
    cross_speeds: tuple[float, float] = (0.0, 0.0),
    viscosity: ArrayLike,
    pressure_viscosity: Law | None = None,
    density: Density | None = None,
    roughness: Roughness | None = None,
    squeeze: ArrayLike = 0.0,
    edges: Edges = AMBIENT,
    periodic: bool = False,
    supplies: Sequence[Supply] = (),
    cavitation: str = "mass-conserving",
    nodes: tuple[ArrayLike, ArrayLike] | None = None,
    stepped: bool = False,
    dt: float | None = None,
    previous: FilmSolution | None = None,
    guess: FilmSolution | None = None,
) -> FilmSolution:
    """Solve Reynolds' equation on a rectangle.

    Parameters
    ----------
    h : (n_x, n_z) > 0, m, film at the nodes. With ``stepped`` the film is constant in each cell between nodes: then
        (n_x − 1, n_z − 1) cells, n_x in x if periodic. n_z = 1: infinitely wide film, results for ``lengths[1]`` of it.
    lengths : extent in x and z, m
    speeds, cross_speeds : velocities (first, second surface) along x and along z, m/s
    viscosity : number or (n_x, n_z), Pa s, at ambient pressure; ``pressure_viscosity`` is the factor η(p)/η(0), a
        function of an array of pressures (Pa), e.g. Barus' or Roelands' law
    density : ρ(p)/ρ(0) and its derivative (1/Pa), a function of an array of pressures (Pa), e.g. that of Dowson and
        Higginson; incompressible by default. The density's own rate counts with ``dt`` only.
    roughness : of the surfaces, for the flow factors of Patir and Cheng. ``h`` is then the nominal film, and the result
        has the mean gap. ``drag`` is that of the mean gap, without shear stress factors.
    squeeze : ∂h/∂t, number or like the nodes, m/s, of a film without history. A ruptured gap that opens keeps its fill
        (mass-conserving).
    edges, supplies : pressures at edges and in grooves; overlapping supplies must have equal pressure
    periodic : whether the film is closed in x; nodes are then in [0, lengths[0])
    cavitation : ``full``, ``guembel``, ``reynolds`` or ``mass-conserving``
    nodes : increasing x and z of the nodes (m, from 0 to the lengths); equally spaced by default
    dt, previous : time step (s) and film at its start: backward Euler in the stored oil θh; needs mass-conserving or
        full, and no ``squeeze``
    guess : a film whose ruptured nodes are the initial guess; it changes the cost, not the result

    Raises
    ------
    InputError, SolverError
        if data are invalid, nothing determines the pressure level, or viscosity grows without bound
    """
    grid, film, faces = _problem(h, lengths, cavitation, periodic, nodes, stepped)
    slip_x, slip_z, growth = np.zeros(film.shape), np.zeros(film.shape), np.ones(film.shape)
    if roughness is not None:
        faces, slip_x, slip_z, film, growth = rough_gap(np.asarray(h, dtype=float), grid, stepped, roughness)
    eta = node_field("viscosity", viscosity, film.shape)
    if not (np.isfinite(eta).all() and eta.min() > 0.0):
        raise InputError(f"viscosity: least value {eta.min():.4g} Pa s; it must be positive everywhere")
    carried_x = _carried("speeds", speeds, faces.film_x, slip_x)
    carried_z = _carried("cross_speeds", cross_speeds, faces.film_z, slip_z)
    pressure, deficit, owner, names = given_pressures(edges, supplies, grid, cavitation)
    free = owner < 0
    source, store, swell = _growth(film, grid, squeeze, growth, dt, previous, cavitation)
    lasting = np.zeros_like(film)
    if dt is None:
        # The factor of deficits in the oil balance (m³/s) for a very long time step makes the fill unique.
        moved = max(float(np.abs(flow).max()) for flow in (carried_x, carried_z, source)) or 1.0
        lasting = film * grid.areas * (moved / (MEMORY * (film * grid.areas).sum()))
    balance = Balance(
        *_conductances(faces, eta, grid), carried_x, carried_z, source, store + lasting, incompressible(film.shape)
    )
    empty, known = np.zeros(free.shape, dtype=bool), previous if guess is None else guess
    if known is not None and known.ruptured.shape == free.shape and cavitation not in ("full", "guembel"):
        empty = (known.ruptured | (known.fill < 1.0)) & free
    order, width = band_order(free, periodic)
    unknowns = Unknowns(order, pressure, deficit, empty, np.zeros(film.shape))
    law = mass_flow_law(pressure_viscosity, density)
    problem = Problem(cavitation, balance, swell, lasting, unknowns, width)
    reduced, balance, passes = _reduced(problem, law, density)
    surplus = np.zeros(film.shape)
    oil_balance(balance, reduced, deficit, surplus)
    if CAVITATION[cavitation] != FULL_FILM:
        reduced, deficit = np.maximum(reduced, 0.0), np.clip(deficit, 0.0, 1.0)
    pressure = reduced if law is None else true_pressure(law, reduced)
    if pressure_viscosity is not None:
        eta = eta * viscosity_factor(pressure_viscosity, pressure)
    content = 1.0 - deficit if density is None else np.where(deficit > 0.0, 1.0 - deficit, density(pressure)[0])
    growing = source + np.where(deficit > 0.0, -balance.store * deficit, swell * (content - 1.0))
    flows, defect = outflows(surplus, owner, names, grid, film, cross_speeds)
    # The error of mass is created oil over all flows and growth, unless it is within rounding of the stored oil.
    carried = float(max(np.abs(balance.c_x).sum(axis=1).max(), np.abs(balance.c_z).sum(axis=0).max()))
    through = carried + sum(abs(flow) for flow in flows.values()) + float(np.abs(growing).sum())
    error = abs(defect) / through if abs(defect) > 1.0e-15 * float(balance.store.sum()) else 0.0
    load = float((pressure * grid.areas).sum())
    moments = (pressure * grid.areas * grid.x[:, None]).sum(), (pressure * grid.areas * grid.z).sum()
    centre = (float(moments[0]) / load, float(moments[1]) / load) if load != 0.0 else (np.nan, np.nan)
    p_max, place = largest_pressure(pressure, free & (not stepped), grid, lengths[0])
    nominal = np.asarray(h, dtype=float)
    shear = cell_sums(1.0 / nominal, grid)[2] if stepped else grid.areas / nominal
    drag = shear_forces(pressure, float((eta * (1.0 - deficit) * shear).sum()), faces, speeds, cross_speeds)
    return FilmSolution(
        grid.x, grid.z, film, grid.areas, pressure, content, empty, eta, load, centre, p_max, place, drag, flows,
        float(growing.sum()), error, passes,
    )  # fmt: skip


def _carried(name: str, speeds: tuple[float, float], film: Array, slip: Array) -> Array:
    """Return the flow that the surfaces carry through each face along one direction if the face is full, m³/s."""
    if len(speeds) != 2 or not np.isfinite(speeds).all():
        raise InputError(f"{name}: two finite velocities in m/s are needed (first and second surface), got {speeds}")
    return np.asarray(0.5 * (speeds[0] + speeds[1]) * film + 0.5 * (speeds[0] - speeds[1]) * slip)


class Problem(NamedTuple):
    """Discrete film problem; the result is written to ``unknowns``."""

    cavitation: str
    balance: Balance
    swell: Array
    lasting: Array
    unknowns: Unknowns
    width: int


def _reduced(problem: Problem, law: Law | None, density: Density | None) -> tuple[Array, Balance, int]:
    """Solve for reduced pressures (pressures if ``law`` is None). Return them, the final balance and the passes."""
    unknowns = problem.unknowns
    pressure, empty = unknowns.pressure, unknowns.empty
    free, passes = unknowns.order >= 0, 0

    def solve(balance: Balance, given: Array, most: int = 0) -> tuple[Array, bool]:
        nonlocal passes
        pressure[~free] = given[~free]
        turns, settled = _solved(problem._replace(balance=balance), most)
        passes += turns
        return pressure.copy(), settled

    balance = problem.balance
    if law is None:
        reduced, _ = solve(balance, pressure)
    elif density is None:
        reduced, _ = solve(balance, reduced_pressure(law, pressure))
    else:
        found, balance = compressed_pressure(pressure.copy(), law, density, (balance, problem.swell), solve)
        reduced = reduced_pressure(law, found)
    if problem.cavitation == "guembel":
        reduced = np.maximum(reduced, 0.0)
        empty[:] = free & (reduced <= 0.0)
    return reduced, balance, passes


def _solved(problem: Problem, most: int) -> tuple[int, bool]:
    """Solve a linear problem by at most ``most`` active-set passes (0: no limit). Return passes and convergence."""
    unknowns = problem.unknowns
    free = unknowns.order >= 0
    count, mode = int(free.sum()), CAVITATION[problem.cavitation]
    band, rest = np.zeros((count, 2 * problem.width + 1)), np.zeros(free.shape)
    space = Space(band, problem.width, np.zeros((count, 1)), np.zeros((2, count)), rest)
    status, passes = _settle(mode, problem.balance, problem.lasting, unknowns, space, most)
    if free.all() and not unknowns.empty.any() and not problem.balance.liquid.swell.any():
        status = SINGULAR  # a sealed gap full of oil, even if rounding hides the zero pivot
    settled = status == CONVERGED and bool(np.isfinite(unknowns.pressure).all())
    if not settled and not (most and status == STALLED):
        reason = "ruptured zones did not settle; try a finer grid or a smaller change of the film"
        if status == SINGULAR:
            reason = "nothing determines the pressure; open an edge, or let oil leave a closing film"
        raise SolverError(f"film ({problem.cavitation}): {reason}")
    return passes, settled


def _problem(
    h: ArrayLike,
    lengths: tuple[float, float],
    cavitation: str,
    periodic: bool,
    nodes: tuple[ArrayLike, ArrayLike] | None,
    stepped: bool,
) -> tuple[Rectangle, Array, Faces]:
    """Check film and grid. Return the grid, the film at the nodes and the faces."""
    if cavitation not in CAVITATION:
        raise InputError(f"cavitation '{cavitation}' does not exist; {nearest(cavitation, CAVITATION)}")
    if len(lengths) != 2 or not (np.isfinite(lengths).all() and min(lengths) > 0.0):
        raise InputError(f"lengths: two positive lengths in m are needed, got {lengths}")
    given = np.asarray(h, dtype=float)
    if given.ndim != 2:
        raise InputError(f"h: a field over x and z is needed, got {given.ndim} dimension(s); use shape (n_x, n_z)")
    if not np.isfinite(given).all() or given.min(initial=np.inf) <= 0.0:
        bad = tuple(int(k) for k in np.argwhere(~(given > 0.0) | ~np.isfinite(given))[0])
        raise InputError(f"h: {given[bad]:.4g} m at {bad}; the film must be positive everywhere")
    n_x = given.shape[0] + (1 if stepped and not periodic else 0)
    n_z = given.shape[1]
    if stepped and (n_z > 1 or (nodes is not None and np.size(nodes[1]) == 2)):
        n_z += 1
    if n_x < 3:
        raise InputError(f"h: {n_x} nodes in x; at least 3 are needed")
    if nodes is None:
        x = np.arange(n_x) * (lengths[0] / (n_x if periodic else n_x - 1))
        z = np.linspace(0.0, lengths[1], n_z) if n_z > 1 else np.array([0.5 * lengths[1]])
    else:
        x, z = (np.asarray(v, dtype=float) for v in nodes)
        for name, places, length, wanted in (("x", x, lengths[0], n_x), ("z", z, lengths[1], n_z)):
            if places.shape != (wanted,):
                raise InputError(f"nodes: {places.shape} places in {name}, but the film h has {wanted}")
            if not (np.isfinite(places).all() and (np.diff(places) > 0.0).all()):
                raise InputError(f"nodes: places in {name} must increase from node to node")
            ring = name == "x" and periodic
            end = length if not ring else places[-1]
            if wanted > 1 and (abs(places[0]) > 1e-9 * length or abs(places[-1] - end) > 1e-9 * length):
                raise InputError(f"nodes: places in {name} must run from 0 to {length:.6g} m")
            if ring and not places[-1] < length:
                raise InputError(f"nodes: a periodic film ends before {length:.6g} m, where it meets its first node")
    grid = rectangle(x, z, lengths, periodic)
    if not stepped:
        return grid, np.ascontiguousarray(given), node_faces(given, grid)
    return grid, cell_sums(given, grid)[2] / grid.areas, cell_faces(given, grid)


def _growth(
    film: Array,
    grid: Rectangle,
    squeeze: ArrayLike,
    growth: Array,
    dt: float | None,
    previous: FilmSolution | None,
    cavitation: str,
) -> tuple[Array, Array, Array]:
    """Return each node's growth rate of oil (m³/s) if full, its decrease by unit deficit, its increase by unit content.

    ``growth`` (n_x, n_z) is the derivative of the mean gap by the film h, 1 between smooth surfaces.
    """
    rate = node_field("squeeze", squeeze, film.shape) * growth
    if not np.isfinite(rate).all():
        raise InputError("squeeze: not finite; give ∂h/∂t in m/s")
    if dt is None:
        return rate * grid.areas, np.maximum(rate, 0.0) * grid.areas, rate * grid.areas
    if not (np.isfinite(dt) and dt > 0.0):
        raise InputError(f"dt: {dt:.4g} s; a time step must be positive")
    if previous is None:
        raise InputError("dt: a time step starts from a film; give previous=, e.g. the steady solution")
    if previous.h.shape != film.shape:
        raise InputError(f"previous: film on {previous.h.shape} nodes, this one has {film.shape}; use one grid")
    if rate.any():
        raise InputError("squeeze: a time step takes it from the films at its ends; leave squeeze out")
    if cavitation in ("guembel", "reynolds"):
        raise InputError(f"dt: cavitation '{cavitation}' keeps no fill; use 'mass-conserving', or squeeze= without dt")
    return (film - previous.h * previous.fill) * grid.areas / dt, film * grid.areas / dt, film * grid.areas / dt


def _conductances(faces: Faces, eta: Array, grid: Rectangle) -> tuple[Array, Array]:
    """Return the conductance h³ width/(12 η Δ) of each face, m³/(Pa s)."""
    eta_x = 0.5 * (eta + np.roll(eta, -1, axis=0))
    eta_z = 0.5 * (eta + np.roll(eta, -1, axis=1))
    step_x = np.where(grid.step_x > 0.0, grid.step_x, 1.0)[:, None]
    step_z = np.where(grid.step_z > 0.0, grid.step_z, 1.0)
    return faces.cube_x / (12.0 * eta_x * step_x), faces.cube_z / (12.0 * eta_z * step_z)


def _settle(
    mode: int, balance: Balance, lasting: Array, unknowns: Unknowns, space: Space, most: int
) -> tuple[int, int]:
    """Solve; if a steady starved film does not converge, use a time step that is lengthened stage by stage."""
    empty = unknowns.empty
    status, passes = film_state(mode, balance, unknowns, space, most)
    if status == SINGULAR and mode != FULL_FILM:
        # The pressure level of a full sealed gap is undetermined, so the gap is filled starting from empty.
        empty[:] = unknowns.order >= 0
        status, turns = film_state(mode, balance, unknowns, space, most)
        passes += turns
    if status == CONVERGED or mode != CONSERVING or most or not lasting.any():
        return status, passes
    settled = np.zeros_like(empty)
    reached, ratio = 10.0 * MEMORY, 10.0
    for _ in range(MAX_STAGES):
        shortening = max(reached / ratio, 1.0)
        empty[:] = settled
        trial = balance._replace(store=balance.store + (shortening - 1.0) * lasting)
        status, turns = film_state(mode, trial, unknowns, space, 0)
        passes += turns
        if status == CONVERGED:
            if shortening == 1.0:
                break
            settled[:] = empty
            reached, ratio = shortening, min(10.0, ratio**1.5)
        else:
            ratio = (reached / shortening) ** 0.5
    return status, passes
