"""Modes in motion of an engine at a level and a speed, and the stand-in springs of its films; JSON-able."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cranktrain.core.errors import SolverError
from cranktrain.core.units import RPM
from cranktrain.dynamics.cycle_run import run_cycles
from cranktrain.dynamics.model.settings import Settings, step_each_row
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import Gas
from cranktrain.results.columns import NOTHING
from cranktrain.results.strength.recorded_cycle import whole
from cranktrain.results.tables import Table
from cranktrain.structure.assembly import Assembly
from cranktrain.structure.crank.modal import listed_to
from cranktrain.structure.in_motion.cycle_means import main_tangents, tangents_over_cycle
from cranktrain.structure.in_motion.eigenproblem import PARTS, ModesInMotion, modes_in_motion

SETTLE = 1.0e-4
"""Largest settling error of the run whose cycle is linearised."""
SPRING_LEVELS = Settings(bearings="impedance", block="ground")
SPRING_RPM = 1000.0
"""Levels, and speed in rev/min, of the full-load run whose films give the stand-in springs. If the engine's range
excludes this speed, the nearest of its speeds is used."""
ANSWERS = 0.1
"""Fraction of the largest pulley torsion at resonance of any mode, from which a mode is torsional."""
MOSTLY_BLOCK = 0.5
"""Fraction of a mode's kinetic energy in the block from which the mode is one of the block."""


def settled_simulation(made: Assembly, speed: float, gas: Gas | None = None) -> Simulation:
    """A simulation at the start of its settled cycle at ``speed`` (rad/s); ``SolverError`` for a step that fails."""
    simulation = Simulation(made.engine, made.body, step_each_row(made.settings), gas, made.parts)
    simulation.inputs[0] = speed
    simulation.initialize()
    whole(run_cycles(simulation, None, SETTLE, None, None))
    return simulation


def reference_speed(engine: Engine) -> float:
    """Default speed (rad/s) of modes in motion: the speed of the largest heat per cycle."""
    return engine.best_speed


def motion_report(made: Assembly, speed: float | None = None, gas: Gas | None = None) -> dict[str, Any]:
    """Modes about the settled cycle at full load and a speed (rad/s); if the run fails, its reason as ``failed``.

    ``gas`` are measured pressures in place of the engine's own.
    """
    speed = reference_speed(made.engine) if speed is None else speed
    settings = made.settings
    state = {
        "crank": settings.crank, "bearings": settings.bearings, "block": settings.block, "damper": settings.damper,
        "rpm": speed / RPM, "load": settings.gas_load,
    }  # fmt: skip
    try:
        found = modes_in_motion(settled_simulation(made, speed, gas))
    except SolverError as error:
        return {"state": state, "modes": [], "first_torsional_hz": None, "failed": str(error)}
    first = found.torsional_hz if found.torsional >= 0 else None
    modes = listed(found, made.engine.speeds)
    return {"state": state, "modes": modes, "first_torsional_hz": first, "definition": DEFINITION}


TORSIONAL = (
    "A mode is torsional where the pulley's torsion at resonance, by the engine's orders within its speeds, is a tenth "
    "or more of that of the strongest mode, or where most of its kinetic energy is torsion"
)
DEFINITION = (
    "small motions about the settled cycle of a run, as seen from the turning crank: films by the mean law of their "
    "tangents in series with crank and block, collar as it runs, rods as mean masses, drive line and mounts as they "
    f"are. {TORSIONAL}"
)


def listed(found: ModesInMotion, speeds: tuple[float, float]) -> list[dict[str, Any]]:
    """Modes of the crank up to 1000 Hz, or up to the first torsional mode: Hz, damping ratio, shape, energy fractions.

    ``order`` is the order that gives the largest torsion of the pulley (``pulley_deg``) in resonance with the mode
    within the ``speeds`` (lowest and highest, rad/s); None if no order is in resonance.
    """
    highest = listed_to([found.torsional_hz if found.torsional >= 0 else None])
    sizes = found.at_resonance(*speeds)
    strongest, largest = sizes.argmax(axis=1), sizes.max(axis=1)
    answering = found.of_crank & (largest > 0.0)
    answering &= largest >= ANSWERS * largest[answering].max(initial=0.0)
    modes = []
    for k, shares in enumerate(found.shares):
        shape = "torsional" if answering[k] else PARTS[int(np.argmax(shares))]
        if found.hz[k] > highest or shares[PARTS.index("block")] >= MOSTLY_BLOCK:
            continue
        modes.append(
            {
                "hz": float(found.hz[k]),
                "damping_ratio": float(found.damping_ratios[k]),
                "shape": shape if found.of_crank[k] else "drive line",
                "pulley_deg": math.degrees(largest[k]),
                "order": float(found.orders[strongest[k]]) if largest[k] else None,
                "shares": dict(zip(PARTS, shares.tolist(), strict=False)),
            }
        )
    return modes


def state_text(state: Mapping[str, Any]) -> str:
    """Text on the state (levels, speed, load) about which modes in motion were computed."""
    block = "on ground" if state["block"] == "ground" else "in the flexible block"
    damper = ", with damper" if state["damper"] != "none" else ""
    levels = f"crank {state['crank']}, bearings {state['bearings']}, {block}{damper}"
    return f"{levels}, {state['rpm']:.0f} rev/min, load {state['load']:g}"


def motion_table(report: Mapping[str, Any]) -> Table:
    """Table of modes in motion with their state in the title; on ground without a column for the block."""
    shown = {part for mode in report["modes"] for part in mode["shares"]}
    if report["state"]["block"] == "ground" and "added" not in shown:
        shown -= {"block"}
    parts = [part for part in PARTS if part in shown]
    rows = tuple(
        (
            f"{mode['hz']:.1f}", mode["shape"], f"{100.0 * mode['damping_ratio']:.1f}",
            *((NOTHING, NOTHING) if mode["order"] is None else (f"{mode['pulley_deg']:.2g}", f"{mode['order']:g}")),
            *(f"{100.0 * mode['shares'][part]:.0f}" for part in parts),
        )
        for mode in report["modes"]
    )  # fmt: skip
    header = ("Hz", "shape", "damping / %", "pulley / deg", "by order", *(f"{part} / %" for part in parts))
    return Table(f"Cranktrain in motion: {state_text(report['state'])}", header, rows)


def spring_rpm(engine: Engine) -> float:
    """Speed, rev/min, of the run whose films give the stand-in springs."""
    low, high = (speed / RPM for speed in engine.speeds)
    return float(f"{min(max(SPRING_RPM, low), high):.9g}")


def film_springs(made: Assembly) -> dict[str, float]:
    """Stand-in springs of level ``linear``: ``film_stiffness_x`` and ``film_stiffness_y``, N/m.

    Each is the median over the cycle and over all plain mains of ∂F/∂x or ∂F/∂y of the films in axes at rest, at
    :func:`spring_rpm` and full load. ``made`` is of ``SPRING_LEVELS``. Raises ``SolverError`` where the run fails.
    """
    simulation = settled_simulation(made, spring_rpm(made.engine) * RPM)
    stiffness, _ = main_tangents(simulation.model, tangents_over_cycle(simulation))
    plain = list(made.engine.plain_numbers)
    x, y = (float(np.median(stiffness[:, plain, k, k])) for k in (0, 1))
    return {"film_stiffness_x": x, "film_stiffness_y": y}


def springs_report(made: Assembly) -> dict[str, Any]:
    """Stand-in springs from a run and from the engine file, N/m; ``failed`` holds the reason if the run fails."""
    own, rpm = made.engine.plain_mains, spring_rpm(made.engine)
    said = {"engine_x": own.stiffness_x, "engine_y": own.stiffness_y, "rpm": rpm, "rule": SPRING_RULE.format(rpm)}
    try:
        return said | film_springs(made)
    except SolverError as error:
        return said | {"film_stiffness_x": None, "film_stiffness_y": None, "failed": str(error)}


def springs_text(report: Mapping[str, Any]) -> str:
    """One line that compares the engine file's stand-in springs with those from a run."""
    if "failed" in report:
        return f"Stand-in springs: the run fails ({report['failed']})"
    pairs = [(report[f"film_stiffness_{axis}"], report[f"engine_{axis}"]) for axis in "xy"]
    parts = [f"{axis} {film:.3g} N/m (engine file {own:.3g})" for axis, (film, own) in zip("xy", pairs, strict=True)]
    return f"Stand-in springs, {report['rule']}: {', '.join(parts)}"


SPRING_RULE = "medians of the films' stiffness over a cycle and all mains at {:g} rev/min, full load"


def states_text(modes: Mapping[str, Any]) -> str:
    """Text on the meaning of modes at rest and in motion, with the first torsional frequency of both if known."""
    block = modes.get("block")
    rest = (modes["cranktrain"] if block is None else block)["first_torsional_hz"]
    motion = modes.get("in_motion", {}).get("first_torsional_hz")
    if not rest or not motion:
        return _STATES
    return (
        f"{_STATES} The first torsional mode is therefore listed twice: {rest:.0f} Hz at rest"
        f"{'' if block is None else ' in the flexible block'} and {motion:.0f} Hz in motion at "
        f"{modes['in_motion']['state']['rpm']:.0f} rev/min are one mode on two supports."
    )


_STATES = (
    "At rest the crank stands on springs that stand in for its bearings, and its thrust collar is closed. In motion it "
    "vibrates about the settled cycle of a run, on its films or rollers as they are there: resonances of run-ups are "
    "those of the modes in motion."
)
