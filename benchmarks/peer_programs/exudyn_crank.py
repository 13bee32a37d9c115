"""Exudyn: the reduced crankshaft on linear bearings under tabulated loads, with nothing of Python in a step.

Both run the six's crank at 2000 rev/min for three cycles from one start and are judged over the last one, each against
itself at a fine step. Bearings are equal both ways across, so that they are constant in the turning frame; rods and
pistons have no mass, no weight acts, and the drive line's axial joint, whose teeth stick and slip, is left out: what is
left is M = 1, D, K, steady forces and the gas on the pins, all read from our own equations. Our run finds the gas
forces itself, at the crank's own angle and the pins' own places; theirs are those of a crank that turns evenly, with
the mean of their tangents in K.
"""

from __future__ import annotations

import math
import statistics
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from benchmarks.other_solvers.first_order import FirstOrder
from benchmarks.peer_programs.environment import Child, Program, child
from benchmarks.peer_programs.equal_error import Point, beside, listed, relative_error
from scipy.interpolate import CubicSpline
from scipy.linalg import null_space

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.structure.assembly import Assembly, assemble

PROGRAM = Program(("exudyn==1.13.6", "numpy>=2"), "run_exudyn.py")
SPEED = 2000.0 * math.pi / 30.0
PERIOD = 4.0 * math.pi / SPEED
CYCLES, SAMPLES, ROUNDS = 3, 72, 5
PIECES = 720
"""Of the loads' splines, in a cycle."""
OWN = {
    "esdirk47": (10.0, 5.0, 2.5), "esdirk4": (10.0, 5.0, 2.5, 1.25), "sdirk4": (5.0, 2.5),
    "generalised-alpha:0.8": (2.5, 1.25, 0.625),
}  # fmt: skip
"""Steps in degrees of our integrators."""
OTHER = [("trapezoidal", 1.0), ("generalised-alpha", 0.8), ("generalised-alpha", 0.5)]
OTHER_DEG = (2.5, 1.25, 0.625, 0.3125, 0.15625)
FINE_OWN, FINE_OTHER = ("sdirk4", 0.15625), ("trapezoidal", 1.0, 0.0390625)
NARROW = 0.1
"""Bore over the six's where both are set beside each other under less load."""
ERRORS = (1e-1, 1e-2, 1e-3)


def bare_engine() -> Assembly:
    """The six without mass of rods and pistons and axial joint, its bearings alike in all directions."""
    engine = replace(load_engine("diesel_i6"), axial_path=None)
    main = engine.main_bearing
    assert main is not None
    rod = replace(engine.rod, big_end_mass=1e-9, small_end_mass=1e-9, inertia=1e-11)
    alike = replace(
        main, stiffness_x=main.stiffness_y, damping_x=main.damping_y, block_stiffness_x=main.block_stiffness_y
    )
    cylinders = replace(engine.cylinders, piston_mass=1e-9)
    made = assemble(engine, Settings(bearings="linear", gravity=0.0))
    return replace(made, engine=replace(made.engine, rod=rod, cylinders=cylinders, main_bearing=alike))


def started(made: Assembly, integrator: str, degrees: float) -> Simulation:
    """A run at its start."""
    settings = replace(made.settings, integrator=integrator, step=math.radians(degrees))
    run = Simulation(made.engine, made.body, settings, None, made.parts)
    run.inputs[0] = SPEED
    run.initialize()
    return run


def linear_job(made: Assembly) -> dict[str, Any]:
    """Matrices and loads of our equations for modes and lead of the frame.

    The first coordinates are the pins' displacements across, on which the loads act.
    """
    run = started(made, "esdirk4", 1.0)
    equations = FirstOrder(run)
    n = equations.modes
    # Unknowns are q, q̇, the lead and its rate.
    places, rates = np.append(np.arange(n), 2 * n), np.append(np.arange(n, 2 * n), 2 * n + 1)
    start = equations.start(run.state)
    times = PERIOD * np.arange(PIECES) / PIECES
    still = np.zeros(2 * n + 2)
    still[2 * n] = start[2 * n]  # the shaft's twist, which sets the angle of the gas; coordinates are what is beyond it
    force = np.array([equations(t, still)[rates] for t in times])
    equations.increments[places] = 1e-7
    equations.increments[rates] = 1e-4
    tangents = np.mean([equations.jacobian(t, still)[rates] for t in times[::10]], axis=0)
    first, cylinders = 2 * run.model.bearings.shape[0] + 1, made.engine.n_cylinders
    pins = np.pad(run.model.ports[first : first + 2 * cylinders], ((0, 0), (0, 1)))
    steady = force.mean(axis=0)
    loads, *_ = np.linalg.lstsq(pins.T, (force - steady).T, rcond=None)
    if np.abs((force - steady).T - pins.T @ loads).max() > 1e-9 * np.abs(force).max():
        raise AssertionError("what varies of the loads acts at the pins alone")
    basis = np.hstack((np.linalg.pinv(pins), null_space(pins)))
    closed = np.hstack((loads, loads[:, :1]))
    spline = CubicSpline(np.arange(PIECES + 1.0), closed, axis=1, bc_type="periodic").c
    back = np.linalg.inv(basis)
    return {
        "mass": basis.T @ basis, "stiffness": -basis.T @ tangents[:, places] @ basis,
        "damping": -basis.T @ tangents[:, rates] @ basis, "steady": basis.T @ steady,
        "loads": np.ascontiguousarray(spline.transpose(2, 0, 1)), "start": back @ (start - still)[places],
        "start_rate": back @ start[rates], "output": np.append(run.model.ends[1], 0.0) @ basis, "period": PERIOD,
        "cycles": CYCLES, "samples": SAMPLES,
    }  # fmt: skip


def own_turn(made: Assembly, integrator: str, degrees: float) -> tuple[float, Array]:
    """Processor seconds of a cycle, and the pulley's torsion over the last one, (SAMPLES,) rad."""
    run = started(made, integrator, degrees)
    step = communication_step(SPEED, math.radians(degrees))
    count = round(PERIOD / step)
    place = run.output_names.index("pulley.torsion")
    rows = np.zeros((CYCLES * count, run.outputs.size))
    began = time.process_time()
    run.series(step, 1, rows)
    seconds = time.process_time() - began
    every = count // SAMPLES
    return seconds / CYCLES, rows[(CYCLES - 1) * count :][every - 1 :: every, place]


def other_turn(exudyn: Child, integrator: str, radius: float, degrees: float) -> tuple[float, Array]:
    """The same of Exudyn."""
    found = exudyn.turn(integrator=integrator, radius=radius, steps=round(720.0 / degrees))
    return found["seconds"], np.array(found["values"])


def lightly_loaded(folder: Path) -> tuple[float, float]:
    """Swing of the torsion of narrow cylinders, rad, whose gas pushes less, and how far both fine runs are apart."""
    made = bare_engine()
    cylinders = replace(made.engine.cylinders, bore=NARROW * made.engine.cylinders.bore)
    made = replace(made, engine=replace(made.engine, cylinders=cylinders))
    exact = own_turn(made, *FINE_OWN)[1]
    job = folder / "light.npz"
    np.savez(job, **linear_job(made))
    with child(PROGRAM, job) as exudyn:
        return float(np.std(exact)), relative_error(other_turn(exudyn, *FINE_OTHER)[1], exact)


def measured() -> dict[str, Any]:
    """Errors and costs of both."""
    made = bare_engine()
    exact = own_turn(made, *FINE_OWN)[1]
    own: dict[str, list[tuple[float, float]]] = {}
    other: dict[str, list[tuple[float, float]]] = {}
    with TemporaryDirectory() as folder:
        job = Path(folder) / "job.npz"
        np.savez(job, **linear_job(made))
        with child(PROGRAM, job) as exudyn:
            theirs = other_turn(exudyn, *FINE_OTHER)[1]
            for _ in range(ROUNDS):
                for name, steps in OWN.items():
                    for degrees in steps:
                        seconds, values = own_turn(made, name, degrees)
                        own.setdefault(f"{name} {degrees:g}°", []).append((relative_error(values, exact), seconds))
                for name, radius in OTHER:
                    for degrees in OTHER_DEG:
                        seconds, values = other_turn(exudyn, name, radius, degrees)
                        label = f"{name} {radius:g} {degrees:g}°" if radius < 1.0 else f"{name} {degrees:g}°"
                        other.setdefault(label, []).append((relative_error(values, theirs), seconds))
            version = exudyn.about["version"]
        swing, apart = lightly_loaded(Path(folder))

    def points(found: dict[str, list[tuple[float, float]]]) -> list[Point]:
        return [Point(name, each[0][0], statistics.median(s for _, s in each)) for name, each in found.items()]

    ours, others = points(own), points(other)
    return {
        "program": f"Exudyn {version}",
        "compared": "reduced crank of the six (58 modes) on linear bearings, gas from tables: torsion of the pulley",
        "cost": "processor time of a cycle of 60 ms",
        "difference_of_references": relative_error(theirs, exact),
        "difference_of_references_under_less_load": apart,
        "torsion_under_less_load_over_full": swing / float(np.std(exact)),
        "own": listed(ours),
        "other": listed(others),
        "at_equal_error": beside(ours, others, ERRORS),
        "not_comparable": "films, rods' mass, weight and the axial joint are left out on both sides; our run finds the "
        "gas forces at the crank's own angle and place, theirs are given with the mean of their tangents, so that the "
        "references are the farther apart the higher the load",
    }
