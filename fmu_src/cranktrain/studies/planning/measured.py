"""Errors and costs of a scene's model from short runs, which are stored: the input of a plan.

The last cycle of the wanted outputs is kept under a digest of all its input: engine, bodies, running code, settings,
speed, cycles, pressure trace and outputs.
"""

import math
from dataclasses import replace
from hashlib import sha256

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.units import RPM
from cranktrain.film.laws.register import DEAR, DEAREST, bearing_law
from cranktrain.store.kept import Kept, digest
from cranktrain.studies.planning.difference import LastCycle, last_cycle, relative_differences
from cranktrain.studies.planning.scene_model import Case, SceneModel

SLOW = {DEAR: 3, DEAREST: 2}
"""Largest number of cycles of a measurement, by the cost class of its bearing level: for films solved online and the
cases that they are compared with. All other cases take as many cycles as a run of the scene."""
REPEATED_BELOW = 0.5
"""Runs shorter than this, s, are timed twice, and the faster time counts."""


class Measured:
    """Measured figures of a scene's model, from the cache or from short runs.

    ``model``: the scene's model.
    """

    def __init__(self, model: SceneModel) -> None:
        self.model = model
        self.scene = model.scene
        self.store = Kept("plans")

    def cycles(self, *cases: Case) -> int | None:
        """Number of cycles of the runs that compare these cases; None if they run until the outputs repeat."""
        few = [SLOW[cost] for case in cases if (cost := bearing_law(case.bearings).cost) in SLOW]
        return min([*few, self.scene.cycles or max(few)]) if few else self.scene.cycles

    def run(self, case: Case, speed: float, cycles: int | None) -> LastCycle:
        """Last cycle of a run of ``case`` at a speed (rad/s); ``SolverError`` if the run fails."""
        key = self._key(case, speed, cycles)
        kept = self.store.arrays(key)
        if kept is None:
            found = self._measure(case, speed, cycles)
            kept = {
                "values": found.values,
                "cost": np.array([found.seconds, found.real_time_factor]),
                "settling": found.settling,
            }
            self.store.keep_arrays(key, kept)
        seconds, factor = kept["cost"].tolist()
        return LastCycle(kept["values"], seconds, factor, kept["settling"])

    def _measure(self, case: Case, speed: float, cycles: int | None) -> LastCycle:
        """Run a case. A short run is repeated, and the cost of the faster one counts."""
        self.model.say(f"measuring {case} at {speed / RPM:.0f} rev/min")
        run = self.model.run(case, speed, cycles)
        found = last_cycle(run, self.scene.outputs)
        if run.seconds < REPEATED_BELOW:
            again = self.model.run(case, speed, cycles)
            if again.seconds < run.seconds:
                found = replace(found, seconds=again.seconds, real_time_factor=again.real_time_factor)
        return found

    def difference(self, case: Case, reference: Case, speed: float) -> Array:
        """Relative difference of two cases at a speed for each wanted output, (outputs,); infinite if a run fails."""
        cycles = self.cycles(case, reference)
        try:
            one, other = (self.run(c, speed, cycles) for c in (case, reference))
        except SolverError as error:
            self.model.say(f"{case} against {reference}: {error}")
            return np.full(len(self.scene.outputs), math.inf)
        return relative_differences(one, other, speed, self.scene.frequency)

    def worst(self, case: Case, reference: Case, speeds: tuple[float, ...]) -> Array:
        """Largest relative difference of each wanted output over speeds, (outputs,)."""
        return np.max([self.difference(case, reference, speed) for speed in speeds], axis=0)

    def settling(self, case: Case, speeds: tuple[float, ...]) -> Array:
        """Settling error of a run of the scene in each wanted output, (outputs,), the largest over speeds.

        If a measurement is shorter than a run, it is the largest error that the run may have.
        """
        cycles = self.cycles(case)
        if cycles != self.scene.cycles:
            return np.full(len(self.scene.outputs), self.model.settle)
        return np.asarray(np.max([self.run(case, speed, cycles).settling for speed in speeds], axis=0))

    def cost(self, case: Case, speeds: tuple[float, ...]) -> float:
        """Mean real-time factor of a case over speeds; infinite if a run fails."""
        try:
            return float(np.mean([self.run(case, v, self.cycles(case)).real_time_factor for v in speeds]))
        except SolverError:
            return math.inf

    def _key(self, case: Case, speed: float, cycles: int | None) -> str:
        """Digest of all inputs of a run, the key under which its last cycle is stored."""
        scene, model = self.scene, self.model
        made = model.assembly(case)
        parts = made.parts
        trace = scene.pressure
        return digest(
            __file__,
            scene.engine,
            _content(made.body),
            parts.block.digest if parts.block is not None else "",
            [table.settings for table in (parts.table, parts.big_end_table) if table is not None],
            model.settings(case),
            [repr(speed), cycles, repr(model.settle)],
            [sha256(trace.file.read_bytes()).hexdigest(), trace.unit, trace.tdc_deg] if trace else None,
            scene.outputs,
        )


def _content(body: ReducedBody) -> str:
    """Digest of a body's contents; the digest of its input does not include the sources that made the body."""
    arrays = (body.omega, body.shapes, body.stress_stiffness, body.centrifugal_load, body.inertia)
    return sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()
