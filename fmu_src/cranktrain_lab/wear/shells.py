"""Worn shells of an engine's main bearings: state, effect on films, and wear over a cycle.

Each shell has a map of worn depth w(φ, ζ) in axes at rest, and the combined roughness σ of shell and journal. The film
depends only on half the sum of the surface speeds if the shell is axisymmetric. Films and contact therefore use the
deepest meridian all round, g(ζ) = max w over φ, which is the loaded one. Elsewhere the film is thick, and the
difference between g and w matters less.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from cranktrain.core.kernel import keep_record
from cranktrain.core.reduced_body import Array
from cranktrain.core.spline import not_a_knot
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.parts import PlainBearing
from cranktrain.film.contact.asperity import HIGHEST, bearing_contact_constants, contact_table
from cranktrain.film.contact.gap import SMOOTH
from cranktrain.film.contact.journal import REACH2, RELIEF, SLICES, WEIGHT, bearing_contact, slice_resultants
from cranktrain.film.contact.journal import ZETA as LINE_ZETA
from cranktrain.film.contact.wear import (
    DECREASE,
    MAPS,
    PRESSURE,
    RATE,
    WearLaw,
    end_pressure,
    worn_rates,
    worn_surfaces,
)
from cranktrain.film.journal.grid import EDGE, FACE_PROFILE, FACE_ZETA, PROFILE, ROUGHNESS, ZETA
from cranktrain.film.laws.films import COS, SIN
from cranktrain.film.laws.rigid_bore import RigidBore, rigid_bore

ANGLES = 120
"""Number of meridians of a wear map (every 3 degrees, a fifth of a contact arc)."""
PER_CYCLE = 288
"""Number of samples per cycle for the wear."""


@dataclass(frozen=True)
class Shells:
    """Wear state of b bearing shells.

    Attributes
    ----------
    zeta, weight : (n,) slices, from −1 to 1, and integration weights over the width, m
    new : (n,) relief of the new shells, m
    worn : (b, ANGLES, n) worn depth, m
    sigma : (b,) roughness, m
    alike : True if all shells get the deepest profile of all and of both ends, as for one set of equal shells
    """

    zeta: Array
    weight: Array
    new: Array
    worn: Array
    sigma: Array
    alike: bool = False

    @property
    def profiles(self) -> Array:
        """Relief (m) of b shells at n points across the width, (b, n), as films use it."""
        worn = self.worn.max(axis=1)
        if self.alike:
            deepest = worn.max(axis=0)
            worn = np.repeat(np.maximum(deepest, deepest[::-1])[None], len(worn), axis=0)
        return np.asarray(self.new + worn)

    def volumes(self, radius: float) -> Array:
        """Return the worn volume of each shell, (b,) m³."""
        return np.asarray(self.worn.mean(axis=1) @ self.weight * (2.0 * math.pi * radius))


def new_shells(bearing: PlainBearing, count: int, alike: bool = False) -> Shells:
    """Return new shells of ``count`` bearings."""
    line = bearing_contact(bearing).line
    zeta = line[LINE_ZETA]
    worn = np.zeros((count, ANGLES, zeta.size))
    return Shells(zeta, line[WEIGHT], line[RELIEF], worn, np.full(count, bearing.roughness), alike)


@dataclass(frozen=True)
class Wear:
    """Wear of b shells over one cycle. Values are means over the cycle unless stated otherwise.

    Attributes
    ----------
    rate, decrease : (b, ANGLES, n) ∂w/∂t, m/s, and its decrease with w, 1/s
    volume_rate : (b,) rate of worn volume, m³/s
    smoothing : (b,) rate of the wear depth that smooths the roughness, m/s
    contact_load : (b,) ∫ p dA, N; ``load`` (b,) magnitude of the bearing's force, N
    contact_power, friction_power : (b,) power of the asperities, and of film and asperities, W
    work_rate : (b,) ∫ p v dA, W
    largest_pressure, least_gap : (b,) asperity pressure, Pa, and gap between mean planes, m; extremes of the cycle
    """

    rate: Array
    decrease: Array
    volume_rate: Array
    smoothing: Array
    contact_load: Array
    load: Array
    contact_power: Array
    friction_power: Array
    work_rate: Array
    largest_pressure: Array
    least_gap: Array


class WornFilms:
    """Films of a simulation's plain mains on worn shells.

    Parameters
    ----------
    simulation : initialized simulation at bearing level reynolds
    law : wear law
    """

    def __init__(self, simulation: Simulation, law: WearLaw) -> None:
        self.simulation, self.law = simulation, law
        self.bearing = simulation.engine.plain_mains
        self.numbers = list(simulation.engine.plain_numbers)
        model = simulation.model
        self.bores = [rigid_bore(self.bearing, model.bearings, None, model.laws.solved) for _ in self.numbers]
        for number, bore in zip(self.numbers, self.bores, strict=True):
            model.laws.entry[number, 1] = keep_record(bore, model.laws.entry)
        self.table = contact_table()
        angle = np.arange(ANGLES) * (2.0 * math.pi / ANGLES)
        self.angles = np.array([np.cos(angle), np.sin(angle)])

    def put(self, shells: Shells) -> None:
        """Use these worn shells in the simulation's films from now on."""
        self.shells, self.profiles = shells, shells.profiles
        for bore, profile, sigma in zip(self.bores, self.profiles, shells.sigma, strict=True):
            put_shell(bore, self.bearing, shells.zeta, profile, float(sigma))

    def run(self, cycles: int) -> Wear:
        """Run ``cycles`` cycles and return the wear of the last cycle."""
        simulation = self.simulation
        first, h = simulation.time, 4.0 * math.pi / simulation.inputs[0] / PER_CYCLE
        tally = _Tally(self)
        for k in range(cycles * PER_CYCLE):
            simulation.step(first + (k + 1) * h)
            if k >= (cycles - 1) * PER_CYCLE:
                tally.add()
        return tally.wear()


class _Tally:
    """Accumulator of sums over the samples of one cycle."""

    def __init__(self, films: WornFilms) -> None:
        self.films = films
        bearing, shells, speed = films.bearing, films.shells, float(films.simulation.inputs[0])
        self.speed, self.sliding = speed, 0.5 * bearing.diameter * speed
        count = len(films.numbers)
        self.maps = np.zeros((count, MAPS, ANGLES, shells.zeta.size))
        self.pressure, self.gap = np.zeros(count), np.full(count, math.inf)
        self.load, self.friction = np.zeros(count), np.zeros(count)
        self.constants = [bearing_contact_constants(worn_surfaces(bearing, float(s))) for s in shells.sigma]
        gap = films.law.end_gap * bearing.roughness
        bearable = [end_pressure(constants, films.table, gap) for constants in self.constants]
        rate = films.law.per_work(bearing) * self.sliding
        self.settings = [np.array([bearing.clearance, rate, p, 1.0 / PER_CYCLE]) for p in bearable]
        self.line = np.array([shells.zeta, shells.weight])
        names = {name: k for k, name in enumerate(films.simulation.output_names)}
        self.places = [
            [names[f"bearing[{number + 1}].{of}"] for of in ("force.x", "force.y", "friction_torque")]
            for number in films.numbers
        ]

    def add(self) -> None:
        """Add the simulation's present sample to the sums."""
        films, simulation = self.films, self.films.simulation
        cos, sin = simulation.model.films.numbers[[COS, SIN]]
        for i, number in enumerate(films.numbers):
            x, y, a, b = simulation.model.films.place[number]
            place = np.array([cos * x - sin * y, sin * x + cos * y, cos * a - sin * b, sin * a + cos * b])
            highest, least = worn_rates(
                place, films.profiles[i], self.line, films.angles, self.constants[i], films.table, self.settings[i],
                self.maps[i],
            )  # fmt: skip
            self.pressure[i], self.gap[i] = max(self.pressure[i], highest), min(self.gap[i], least)
            fx, fy, torque = simulation.outputs[self.places[i]]
            self.load[i] += math.hypot(fx, fy) / PER_CYCLE
            self.friction[i] += abs(torque) * self.speed / PER_CYCLE

    def wear(self) -> Wear:
        """Return the wear of the cycle whose samples were added."""
        films, bearing = self.films, self.films.bearing
        rate, decrease, pressure = self.maps[:, RATE], self.maps[:, DECREASE], self.maps[:, PRESSURE]
        area = films.shells.weight * (math.pi * bearing.diameter / ANGLES)
        volume = (rate @ area).sum(axis=1)
        squared = (rate**2 @ area).sum(axis=1)
        smoothing = np.divide(squared, volume, out=np.zeros_like(volume), where=volume > 0.0)
        load = (pressure @ area).sum(axis=1)
        return Wear(
            rate, decrease, volume, smoothing, load, self.load, bearing.boundary_friction * load * self.sliding,
            self.friction, load * self.sliding, self.pressure, self.gap,
        )  # fmt: skip


@cache
def _spline_fit(count: int) -> Array:
    """Return the matrix (n + 2, n + 2) from values to spline coefficients, the inverse of ``log_spline``'s matrix."""
    return np.asarray(np.linalg.inv(not_a_knot(count)))


def put_shell(bore: RigidBore, bearing: PlainBearing, zeta: Array, profile: Array, sigma: float) -> None:
    """Set ``profile`` (n,), m, of the shell at ``zeta`` (n,) and roughness ``sigma``, m, in the film of one bearing."""
    grid, c = bore.grid, bearing.clearance
    for row, of in ((PROFILE, ZETA), (FACE_PROFILE, FACE_ZETA)):
        grid.axial[row] = np.interp(grid.axial[of], zeta, profile) / c
    grid.shear[2] = np.interp(grid.shear[0], zeta, profile) / c
    grid.settings[ROUGHNESS], grid.settings[EDGE] = max(sigma / c, SMOOTH), 0.5 * (profile[0] + profile[-1]) / c
    surfaces = bearing_contact_constants(worn_surfaces(bearing, sigma))
    dimensions = 0.5 * bearing.diameter, c, bearing.width
    bore.contact.constants[:], values = slice_resultants(*dimensions, surfaces, bore.contact.table)
    knots = np.concatenate([np.log(values), np.zeros((2, values.shape[1]))])
    bore.contact.slices[:] = _spline_fit(len(values)) @ knots
    line = bore.contact.line
    line[RELIEF] = np.interp(line[LINE_ZETA], zeta, profile)
    line[REACH2] = (c + line[RELIEF] - HIGHEST * sigma) ** 2
    # The film skips a part of the width by a test of the part's two ends, so both ends get the part's nearest reach.
    parts = line[REACH2].reshape(-1, SLICES)
    parts[:, [0, -1]] = parts.min(axis=1, keepdims=True)
