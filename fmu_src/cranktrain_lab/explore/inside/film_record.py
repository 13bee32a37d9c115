"""Recording of film pressure in bearings over a cycle, from a running simulation.

Only films that are solved online have pressure at nodes. An elastic film (levels ``ehd``) stores its nodes. A film of
level ``reynolds`` does not, so its law is evaluated once more at the journal's recorded motion. Levels that read a
force from a map or a table have no nodes.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.kernel import RECORDS
from cranktrain.core.types import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.limits import BIG_END, MAIN
from cranktrain.film.elastic import grid as elastic
from cranktrain.film.elastic.balance import pressure_unit
from cranktrain.film.journal import grid as rigid
from cranktrain.film.laws.ehd import ElasticBore
from cranktrain.film.laws.films import OBSERVE, SIZE, SPEED
from cranktrain.film.laws.parameters import CLEARANCE, RADIUS, VISCOSITY
from cranktrain.film.laws.rigid_bore import RigidBore, reynolds_law

ONLINE = "reynolds"
"""Level of main bearings in rigid bores whose films are solved online."""


@dataclass(frozen=True, eq=False)
class FilmPressure:
    """Pressure of one film at f crank angles, n nodes around and m across, in axes of the shell.

    Attributes
    ----------
    pressure : (f, n, m) float32 Pa, above ambient
    faces : (f, n) or (1, n) end angle of each node's cell, rad, which is the start angle of the next cell
    sides : (m + 1,) ends of the cells across, from -1 to 1
    """

    pressure: Array
    faces: Array
    sides: Array

    def cells(self, frame: int) -> tuple[Array, Array]:
        """Return start and end angles (n,) of the nodes' cells, rad, with end after start."""
        end = np.asarray(self.faces[frame % len(self.faces)], dtype=float)
        begin = np.roll(end, 1)
        return end - (end - begin) % (2.0 * math.pi), end

    def force(self, frame: int, radius: float, width: float) -> complex:
        """Return the force on the journal by integration of pressure, x + i y in the shell's axes, N."""
        begin, end = self.cells(frame)
        # The integral is exact for constant pressure in each cell.
        around = 1j * (np.exp(1j * end) - np.exp(1j * begin))
        across = self.pressure[frame].astype(float) @ np.diff(self.sides)
        return complex(0.5 * width * radius * (around @ across))

    def at(self, samples: Any) -> "FilmPressure":
        """Return the film pressure at some of the crank angles (indices ``samples``)."""
        faces = self.faces if len(self.faces) == 1 else self.faces[samples]
        return FilmPressure(self.pressure[samples], faces, self.sides)


class FilmWatch:
    """Recorder of the pressure of all films of a simulation, sample by sample.

    :meth:`look` must be called at each sample of the simulation; :meth:`films` returns the recorded films by bearing
    name.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._seen: dict[str, list[tuple[Any, Any]]] = {}
        self._grids: dict[str, tuple[Array, Array]] = {}
        self._out = np.zeros(SIZE)

    def look(self) -> None:
        """Record the films of the present sample."""
        model = self._simulation.model
        for i in range(model.bearings.shape[0]):
            self._look_at(f"{MAIN}[{i + 1}]", i)
        for c in range(model.cylinders.shape[0]):
            if model.cylinders[c, at.END_PORT] >= 0.0:
                self._look_at(f"{BIG_END}[{c + 1}]", int(model.cylinders[c, at.PIN_ROW]))

    def films(self) -> dict[str, FilmPressure]:
        """Return the recorded films by bearing name."""
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
            film, constants = bore.film, bore.film.constants.copy()
            faces = np.arctan2(film.trig[:, elastic.FACE_SIN], film.trig[:, elastic.FACE_COS])
            self._grids.setdefault(name, (faces, cell_sides(film.lines[:, elastic.ZETA][1:-1])))
            constants[elastic.VISCOSITY] = bore.viscosities[number]
            shape = int(constants[elastic.N_PHI]), int(constants[elastic.N_Z])
            nodes = np.maximum(bore.memory.unknowns[number], 0.0).reshape(shape)
            self._seen.setdefault(name, []).append(
                (np.asarray(pressure_unit.py_func(constants) * nodes, dtype=np.float32), None)
            )
        elif isinstance(bore, RigidBore) and self._simulation.settings.bearings == ONLINE and name.startswith(MAIN):
            pressure, faces = self._solved(name, row, number, bore)
            sides = cell_sides(bore.grid.axial[rigid.ZETA, : bore.grid.axial.shape[1] - 1])
            self._grids.setdefault(name, (faces, sides))
            self._seen.setdefault(name, []).append((pressure, faces))

    def _solved(self, name: str, row: int, number: int, bore: RigidBore) -> tuple[Array, Array]:
        """Solve a film again at its present state. Return pressure (n, m) Pa and faces (n,) rad in axes at rest."""
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


def cell_sides(zetas: Array) -> Array:
    """Return m + 1 cell sides: half way between the m nodes at ``zetas``, and at the ends of the shell."""
    return np.concatenate(([-1.0], 0.5 * (zetas[1:] + zetas[:-1]), [1.0]))
