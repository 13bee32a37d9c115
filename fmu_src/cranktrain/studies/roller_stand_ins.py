r"""Linear stand-in springs of roller main bearings, derived from the rollers over a running cycle.

A bearing's tangent varies over a cycle from zero, where the journal crosses its clearance, to the tangent of the
largest load. The stand-in spring must have the mean compliance of the bearing in series with the crankshaft, because a
journal that is free for a moment is still held by the elastic crankshaft. Let k(t) be half the trace of the tangent in
the plane over a settled cycle, and z the elastic stiffness of the free crankshaft at this journal (without rigid
motions, because inertia balances the load):

    1/(k + z) = mean of 1/(k(t) + z),      1/z = ½ Σ_x,y Σ_n φ²/ω_n²,

and likewise in tilt. The mean of k(t), the limit of a very stiff crankshaft, is too stiff a spring; the limit of a very
soft crankshaft is the harmonic mean. Both isotropic parts are the same in axes at rest and in axes of the crank.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array, ReducedBody
from cranktrain.core.units import RPM
from cranktrain.dynamics.cycle_run import communication_step, run_cycles
from cranktrain.dynamics.model.settings import Settings, step_each_row
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import RollerBearings
from cranktrain.engine.roller_bearing import CONTACT_LAWS, main_roller
from cranktrain.film.laws.films import ANGLE, COS, SIN
from cranktrain.film.laws.roller import FIRST_ANGLE, IN_LOOP
from cranktrain.film.laws.roller_contacts import BY_PLACE, WORK, force_at
from cranktrain.results.strength.recorded_cycle import whole
from cranktrain.store.engine_text import Written, engine_text, new_path, rewritten, rounded, write_new
from cranktrain.structure.assembly import Progress, assemble

RIGID = 6
"""Rigid modes of a body, which come first."""
SETTLE = 1.0e-4
"""Largest settling error."""


class RollerCycle(NamedTuple):
    """Rollers of b mains at N samples of a settled cycle, in axes of the crank's frame.

    ``tangents`` (N, b, 4, 4) N/m by x, y and the end's displacement; ``forces`` (N, b, 2) N on the journals; ``angle``
    (N,) of the frame, rad.
    """

    tangents: Array
    forces: Array
    angle: Array


class StandIns(NamedTuple):
    """Linear stand-ins of b mains: radial N/m and tilting N m/rad, (b,), and the crankshaft's own radial stiffness."""

    stiffness: Array
    tilt_stiffness: Array
    crank_stiffness: Array


def roller_cycle(simulation: Simulation) -> RollerCycle:
    """Rollers over the next cycle of a simulation that has settled."""
    rollers = required_rollers(simulation.engine)
    bearings = [main_roller(rollers, i) for i in range(len(rollers.rollers))]
    speed, began = float(simulation.inputs[0]), simulation.time
    step = communication_step(speed, simulation.settings.step)
    count = round(4.0 * math.pi / speed / step)
    tangents, forces = np.zeros((count, len(bearings), 4, 4)), np.zeros((count, len(bearings), 2))
    angle = np.zeros(count)
    for k in range(count):
        simulation.step(began + (k + 1) * step)
        films = simulation.model.films
        angle[k] = math.atan2(films.numbers[SIN], films.numbers[COS])
        for i, (main, bearing) in enumerate(zip(simulation.engine.roller_mains, bearings, strict=True)):
            cage = bearing.cage_ratio * films.numbers[ANGLE] if rollers.variable else 0.0
            out = force_at(bearing, films.place[main], FIRST_ANGLE + cage - angle[k], IN_LOOP)
            tangents[k, i] = -out[BY_PLACE:WORK].reshape(4, 4)
            forces[k, i] = out[:2]
    return RollerCycle(tangents, forces, angle)


def stand_ins(engine: Engine, body: ReducedBody, cycle: RollerCycle) -> StandIns:
    """Stand-in springs with the mean compliance of the rollers in series with the crankshaft ``body`` of a run."""
    lever = 0.5 * np.array(required_rollers(engine).roller_length)
    radial = 0.5 * np.trace(cycle.tangents[:, :, :2, :2], axis1=2, axis2=3)
    tilting = 0.5 * np.trace(cycle.tangents[:, :, 2:, 2:], axis1=2, axis2=3) * lever**2
    own, own_tilt = (elastic_stiffness(body, engine.roller_mains, first) for first in (0, 3))
    return StandIns(in_series(radial, own), in_series(tilting, own_tilt), own)


def in_series(tangents: Array, own: Array) -> Array:
    """Spring (b,) whose mean compliance in series with ``own`` (b,) is that of ``tangents`` (N, b)."""
    return np.asarray(1.0 / np.mean(1.0 / (tangents + own), axis=0) - own)


def elastic_stiffness(body: ReducedBody, mains: Sequence[int], first: int) -> Array:
    """Elastic stiffness (b,) of a free body at main journals, from 0: radial (``first`` 0, N/m), tilting (3, N m)."""
    found = []
    for i in mains:
        rows = body.shapes[body.index(f"main[{i + 1}]"), first : first + 2, RIGID:] / body.omega[RIGID:]
        found.append(2.0 / float(np.sum(rows**2)))
    return np.array(found)


def required_rollers(engine: Engine) -> RollerBearings:
    """Roller bearings of an engine; ``InputError`` if its mains are not roller bearings."""
    if engine.main_roller is None:
        raise InputError(f"engine '{engine.name}' has no [main_roller]; its main bearings are not roller bearings")
    return engine.main_roller


def running_rollers(
    engine: Engine, rpm: float, settings: Settings | None = None, say: Progress = lambda stage: None
) -> dict[str, Any]:
    """Tangents of an engine's rollers over a settled cycle, and the stand-in springs from them; JSON-able.

    The contact law is that of the engine file, or Palmgren's if that is linear. Raises ``InputError``.

    Parameters
    ----------
    rpm : speed, rev/min
    settings : levels of the run; those of a plain ``simulate`` unless given
    """
    rollers = required_rollers(engine)
    law = rollers.law if rollers.law in CONTACT_LAWS else "palmgren"
    engine = replace(engine, main_roller=replace(rollers, law=law))
    made = assemble(engine, settings or Settings(), say=say)
    simulation = Simulation(engine, made.body, step_each_row(made.settings), parts=made.parts)
    simulation.inputs[0] = rpm * RPM
    simulation.initialize()
    result = whole(run_cycles(simulation, None, SETTLE, None, say))
    cycle = roller_cycle(simulation)
    found = stand_ins(engine, made.body, cycle)
    return {
        "engine": engine.name,
        "rpm": rpm,
        "load": made.settings.gas_load,
        "block": made.settings.block,
        "law": law,
        "cycles": result.settling.cycles,
        "periodic": result.settling.repeats == 1,
        "mains": [_entry(engine, cycle, found, i) for i in range(len(rollers.rollers))],
        "rule": "spring in series with the free crankshaft's elastic stiffness at the journal that yields on average "
        "as the rollers do over the cycle",
    }


def _entry(engine: Engine, cycle: RollerCycle, found: StandIns, i: int) -> dict[str, Any]:
    """Entries of a report for one bearing."""
    rollers = required_rollers(engine)
    plane = cycle.tangents[:, i, :2, :2]
    radial = 0.5 * np.trace(plane, axis1=1, axis2=2)
    tilting = 0.5 * np.trace(cycle.tangents[:, i, 2:, 2:], axis1=1, axis2=2) * (0.5 * rollers.roller_length[i]) ** 2
    load = np.hypot(*cycle.forces[:, i].T)
    loaded = load > 0.0
    along = cycle.forces[loaded, i] / load[loaded, None]
    across = np.stack((-along[:, 1], along[:, 0]), axis=1)
    by_load, by_side = (np.einsum("ni,nij,nj->n", axis, plane[loaded], axis) for axis in (along, across))
    cos, sin = np.cos(cycle.angle), np.sin(cycle.angle)
    turn = np.stack((np.stack((cos, -sin), axis=-1), np.stack((sin, cos), axis=-1)), axis=-2)
    at_rest = turn @ plane @ turn.transpose(0, 2, 1)
    kn = 1e-3
    return {
        "main": engine.roller_mains[i] + 1,
        "load_n": {"mean": float(load.mean()), "median": float(np.median(load)), "largest": float(load.max())},
        "loaded_fraction": float(loaded.mean()),
        "tangent_n_per_mm": {
            "mean": kn * float(radial.mean()),
            "median": kn * float(np.median(radial)),
            "along_load": _mean(kn * by_load),
            "across_load": _mean(kn * by_side),
            "turning": {"x": kn * float(plane[:, 0, 0].mean()), "y": kn * float(plane[:, 1, 1].mean())},
            "at_rest": {"x": kn * float(at_rest[:, 0, 0].mean()), "y": kn * float(at_rest[:, 1, 1].mean())},
        },
        "tilt_tangent_nm_per_rad": {"mean": float(tilting.mean()), "median": float(np.median(tilting))},
        "crank_n_per_mm": kn * float(found.crank_stiffness[i]),
        "stand_in": {
            "stiffness_n_per_mm": kn * float(found.stiffness[i]),
            "tilt_stiffness_nm_per_rad": float(found.tilt_stiffness[i]),
        },
        "engine_file": {
            "stiffness_n_per_mm": kn * rollers.stiffness[i],
            "tilt_stiffness_nm_per_rad": rollers.tilt_stiffness[i],
        },
    }


def _mean(values: Array) -> float | None:
    """Mean over a bearing's loaded samples; None if it is never loaded."""
    return float(values.mean()) if values.size else None


def with_stand_ins(engine: str | Path | Engine, out: str | Path, report: dict[str, Any]) -> Path:
    """Write a copy of an engine file with the stand-in springs of a :func:`running_rollers` report; returns its path.

    Raises ``InputError``: an ``out`` that exists, or an engine file with several entries on a line.
    """
    base = load_engine(engine)
    load = "full load" if report["load"] == 1.0 else f"{report['load']:g} of full load"
    note = (
        f"level linear; as compliant, in series with the crankshaft, as the rollers are on average over a cycle at "
        f"{report['rpm']:g} rev/min and {load}, cranktrain bearing roller --engine --speed"
    )
    changes = {}
    for row, entry in enumerate(report["mains"], 1):
        stiffness, tilt = entry["stand_in"]["stiffness_n_per_mm"], entry["stand_in"]["tilt_stiffness_nm_per_rad"]
        changes[f"main_roller.stiffness[{row}]"] = Written(rounded(1e3 * stiffness), "derived", note)
        changes[f"main_roller.tilt_stiffness[{row}]"] = Written(rounded(tilt), "derived", note)
    new = new_path(Path(out))
    write_new(new, rewritten(engine_text(engine).text, base, changes))
    return new
