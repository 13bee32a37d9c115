"""Pressure in the bearings' films over a cycle, read from a simulation while it runs.

Only films that are solved online have a pressure at nodes. An elastic film (levels ``ehd``) keeps its nodes in its
memory. A film of level ``reynolds`` keeps nothing, so its law is asked once more at the journal's recorded motion and
leaves its nodes behind. Levels that read a force from a map or a table have no nodes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.kernel import RECORDS
from cranktrain.core.types import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.bearing_limits import BIG_END, MAIN
from cranktrain.film.elastic import grid as elastic
from cranktrain.film.elastic.height import pressure_unit
from cranktrain.film.journal import grid as rigid
from cranktrain.film.laws.ehd import ElasticBore
from cranktrain.film.laws.films import OBSERVE, SIZE, SPEED
from cranktrain.film.laws.parameters import CLEARANCE, RADIUS, VISCOSITY
from cranktrain.film.laws.rigid_bore import RigidBore, reynolds_law

ONLINE = "reynolds"
"""Level of main bearings in a rigid bore that are solved online."""


@dataclass(frozen=True, eq=False)
class FilmPressure:
    """Pressure of one film at f crank angles, at n nodes around and m across, in the axes of the shell.

    Attributes
    ----------
    pressure : (f, n, m) float32 Pa, above ambient
    faces : (f, n) or (1, n) rad, angle at which the cell of each node ends; it begins where the one before ends
    sides : (m + 1,) ends of the cells across, from -1 to 1
    """

    pressure: Array
    faces: Array
    sides: Array

    def cells(self, frame: int) -> tuple[Array, Array]:
        """Angles (n,) at which the cells of nodes begin and end, rad; the end lies after the begin."""
        end = np.asarray(self.faces[frame % len(self.faces)], dtype=float)
        begin = np.roll(end, 1)
        return end - (end - begin) % (2.0 * math.pi), end

    def force(self, frame: int, radius: float, width: float) -> complex:
        """Integral of the pressure over the journal: force on it, x + i y in the shell's axes, N."""
        begin, end = self.cells(frame)
        # Exact for a pressure that is even over each cell.
        around = 1j * (np.exp(1j * end) - np.exp(1j * begin))
        across = self.pressure[frame].astype(float) @ np.diff(self.sides)
        return complex(0.5 * width * radius * (around @ across))

    def at(self, samples: Any) -> FilmPressure:
        """Some of the crank angles."""
        faces = self.faces if len(self.faces) == 1 else self.faces[samples]
        return FilmPressure(self.pressure[samples], faces, self.sides)


class FilmWatch:
    """Keeps the pressure of all films of a simulation, sample by sample.

    :meth:`look` is to be called while the simulation stands at a sample; :meth:`films` gives what was seen, by the name
    of the bearing.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._seen: dict[str, list[tuple[Array, Array | None]]] = {}
        self._grids: dict[str, tuple[Array, Array]] = {}
        self._out = np.zeros(SIZE)

    def look(self) -> None:
        """Keep the films of the present sample."""
        model = self._simulation.model
        for i in range(model.bearings.shape[0]):
            self._look_at(f"{MAIN}[{i + 1}]", i)
        for c in range(model.cylinders.shape[0]):
            if model.cylinders[c, at.END_PORT] >= 0.0:
                self._look_at(f"{BIG_END}[{c + 1}]", int(model.cylinders[c, at.PIN_ROW]))

    def films(self) -> dict[str, FilmPressure]:
        """All that was seen."""
        found = {}
        for name, seen in self._seen.items():
            faces, sides = self._grids[name]
            moved = [one for _, one in seen if one is not None]
            found[name] = FilmPressure(
                np.stack([pressure for pressure, _ in seen]), np.stack(moved) if moved else faces[None], sides
            )
        return found

    def _look_at(self, name: str, row: int) -> None:
        laws = self._simulation.model.laws
        bore, number = RECORDS.get(int(laws.entry[row, 1])), int(laws.entry[row, 2])
        if isinstance(bore, ElasticBore):
            self._grids.setdefault(name, elastic_cells(bore))
            self._seen.setdefault(name, []).append((elastic_pressure(bore, number), None))
        elif isinstance(bore, RigidBore) and self._simulation.settings.bearings == ONLINE and name.startswith(MAIN):
            pressure, faces = self._solved(name, row, number, bore)
            self._grids.setdefault(name, (faces, rigid_sides(bore)))
            self._seen.setdefault(name, []).append((pressure, faces))

    def _solved(self, name: str, row: int, number: int, bore: RigidBore) -> tuple[Array, Array]:
        """Pressure (n, m) Pa and faces (n,) rad in axes at rest of a film that is solved once more where it is."""
        simulation = self._simulation
        laws = simulation.model.laws
        numbers = laws.numbers.copy()
        speed = name.replace(MAIN, "bearing") + ".speed.relative"
        numbers[SPEED] = simulation.outputs[simulation.output_names.index(speed)]
        address = int(laws.entry[row, 1])
        status = reynolds_law(
            address, OBSERVE, number, laws.place[row], laws.velocity[row], numbers, self._out, self._out
        )
        if status != 0:
            raise SolverError(f"{name}: its film could not be solved for the pressure")
        own, journal = bore.parameters[number], bore.journal
        unit = 12.0 * own[VISCOSITY] * (own[RADIUS] / own[CLEARANCE]) ** 2
        count = bore.grid.axial.shape[1] - 1
        turned = float(simulation.work.frames[0][at.THETA])
        faces = np.arctan2(journal.angle[rigid.FACE_SIN], journal.angle[rigid.FACE_COS]) + turned
        return (unit * journal.pressure[:, :count]).astype(np.float32), faces.astype(np.float32)


def elastic_pressure(bore: ElasticBore, number: int) -> Array:
    """Pressure (n, m) Pa at the nodes of an elastic film at the end of the last step."""
    constants = bore.film.constants.copy()
    constants[elastic.VISCOSITY] = bore.viscosities[number]
    shape = int(constants[elastic.N_PHI]), int(constants[elastic.N_Z])
    nodes = np.maximum(bore.memory.unknowns[number], 0.0).reshape(shape)
    return np.asarray(pressure_unit.py_func(constants) * nodes, dtype=np.float32)


def elastic_cells(bore: ElasticBore) -> tuple[Array, Array]:
    """Faces (n,) rad around and sides (m + 1,) across of the cells of an elastic film's nodes."""
    faces = np.arctan2(bore.film.trig[:, elastic.FACE_SIN], bore.film.trig[:, elastic.FACE_COS])
    zetas = bore.film.lines[:, elastic.ZETA]
    return faces, cell_sides(zetas[1:-1])


def rigid_sides(bore: RigidBore) -> Array:
    """Sides (m + 1,) across of the cells of a rigid bore's nodes."""
    return cell_sides(bore.grid.axial[rigid.ZETA, : bore.grid.axial.shape[1] - 1])


def cell_sides(zetas: Array) -> Array:
    """Sides (m + 1,) of cells whose nodes are at ``zetas`` (m,): half way between them, and the ends of the shell."""
    return np.concatenate(([-1.0], 0.5 * (zetas[1:] + zetas[:-1]), [1.0]))
