"""Running in of a straight shell: the relief by wear at which the shell's edges no longer touch.

Films are thinnest at the lowest speed of the full-load range. Each pass runs the engine at level ``reynolds``, finds
the least gap of every slice ζ over one cycle, all mains and both ends, and wears the shell where this gap is less than
half the roughness:

    g(ζ) += 0.7 max(0, ½ σ − least gap(ζ)),

smoothed over neighbouring slices. All shells wear equally, because an engine gets one set of equal shells. The profile
of :mod:`cranktrain.film.contact.gap` is fitted to the worn shape by least squares.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.kernel import keep_record
from cranktrain.core.reduced_body import Array
from cranktrain.core.units import RPM
from cranktrain.dynamics.simulation import Parts, Settings, Simulation
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.film.contact.asperity import HIGHEST
from cranktrain.film.contact.gap import relief
from cranktrain.film.contact.journal import REACH2, RELIEF
from cranktrain.film.contact.journal import ZETA as LINE_ZETA
from cranktrain.film.journal.grid import FACE_PROFILE, FACE_ZETA, PROFILE, ZETA
from cranktrain.film.laws.rigid_bore import rigid_bore
from cranktrain.store.engine_text import Written, engine_text, new_path, rewritten, write_new
from cranktrain.structure import assembly

PASSES, CYCLES, PER_CYCLE = 9, 3, 288
"""Number of passes, cycles of a run (the last cycle is evaluated), and samples per cycle."""
WEAR, WANTED = 0.7, 0.5
"""Fraction of the missing gap that one pass wears off, and required gap as a fraction of the roughness."""
SLICES = 101
SMOOTHING = np.array([0.25, 0.5, 0.25])


def run_in(
    engine: str | Path | Engine,
    out: str | Path | None = None,
    *,
    speed_rpm: float | None = None,
    crank: str = "solid",
    passes: int = PASSES,
    cycles: int = CYCLES,
    say: Callable[[str], None] = lambda stage: None,
    follow: Callable[[float], None] = lambda share: None,
) -> dict[str, Any]:
    """Run in the shells of an engine's mains. Return results for JSON, and write engine file ``out`` if given.

    Raises ``InputError`` for an engine without plain mains, a speed that is not positive, or an ``out`` that exists.

    Parameters
    ----------
    engine : path, or the name of a shipped engine
    speed_rpm : speed; by default the lowest speed with oil temperatures
    crank : fidelity level of a bending crank
    passes, cycles : number of passes, and of cycles of each run
    say, follow : called with each pass, and with the completed fraction

    Returns
    -------
    ``speed_rpm``, ``relief_depth_um``, ``relief_share``, ``relief_exponent``, ``fit_error_um`` (RMS), ``zeta`` and
    ``worn_um`` (the shape itself), ``least_gap_um`` of each pass, ``file``
    """
    base, old = load_engine(engine), engine_text(engine).text
    bearing = base.plain_mains
    speed = speed_rpm or base.oil.temperature_speeds[0] / RPM
    if not speed > 0.0:
        raise InputError(f"run-in: speed {speed:g} rev/min must be above zero; give the lowest speed at full load")
    new = new_path(Path(out)) if out is not None else None
    straight = replace(base, main_bearing=replace(bearing, relief_depth=0.0))
    settings = assembly.checked(straight, Settings(crank=crank, bearings="reynolds"))
    body = assembly.running_crank(assembly.fitted_engine(straight, settings), crank, say=say)
    zeta = np.linspace(0.0, 1.0, SLICES)
    worn, gaps = np.zeros(SLICES), []
    for k in range(passes):
        simulation = Simulation(straight, body, settings, parts=Parts())
        simulation.inputs[0] = speed * RPM
        simulation.initialize()
        _put_profile(simulation, zeta, worn)
        least = least_gaps(simulation, zeta, worn, cycles)
        gaps.append(1e6 * float(least.min()))
        say(f"pass {k + 1} of {passes}: least gap {gaps[-1]:.3f} um, relief {1e6 * worn[-1]:.2f} um")
        follow((k + 1) / passes)
        missing = WEAR * np.maximum(0.0, WANTED * bearing.roughness - least)
        worn += np.convolve(np.pad(missing, 1, mode="edge"), SMOOTHING, mode="valid")
    found = fitted_relief(zeta, worn)
    if new is not None:
        note = f"run-in at {speed:.6g} rev/min, {passes} passes of wear; see cranktrain run-in"
        write_relief(new, old, base, found, note, {})
    return {
        "engine": base.name, "speed_rpm": speed, **found, "least_gap_um": gaps,
        "file": str(new) if new is not None else None,
    }  # fmt: skip


def _put_profile(simulation: Simulation, zeta: Array, worn: Array) -> None:
    """Set the worn shape, m, at |ζ| from 0 to 1 in the films of a simulation."""
    model = simulation.model
    bearing = simulation.engine.plain_mains
    bore = rigid_bore(bearing, model.bearings, None, model.laws.solved)
    for row, of in ((PROFILE, ZETA), (FACE_PROFILE, FACE_ZETA)):
        bore.grid.axial[row] = np.interp(np.abs(bore.grid.axial[of]), zeta, worn) / bearing.clearance
    line = bore.contact.line
    line[RELIEF] = np.interp(np.abs(line[LINE_ZETA]), zeta, worn)
    reach = bearing.clearance + line[RELIEF] - HIGHEST * bearing.roughness
    line[REACH2] = reach**2
    model.laws.entry[list(simulation.engine.plain_numbers), 1] = keep_record(bore, model.laws.entry)


def least_gaps(simulation: Simulation, zeta: Array, worn: Array, cycles: int) -> Array:
    """Run ``cycles`` cycles. Return the last cycle's least gap (m) at each |ζ|, over all mains and both ends."""
    clearance = simulation.engine.plain_mains.clearance
    begin, h = simulation.time, 4.0 * math.pi / simulation.inputs[0] / PER_CYCLE
    least = np.full(zeta.size, np.inf)
    for k in range(cycles * PER_CYCLE):
        simulation.step(begin + (k + 1) * h)
        if k < (cycles - 1) * PER_CYCLE:
            continue
        place = simulation.model.films.place[:, :, None]
        for end in (zeta, -zeta):
            far = np.hypot(place[:, 0] + end * place[:, 2], place[:, 1] + end * place[:, 3]).max(axis=0)
            least = np.minimum(least, clearance + worn - far)
    return least


def fitted_profile(zeta: Array, worn: Array) -> tuple[float, float, float]:
    """Fit depth (m), fraction and exponent of a profile to a worn shape by least squares. Depth 0 is straight."""
    if not worn.max() > 0.0:
        return 0.0, 0.5, 2.0
    best, least = (float(worn[-1]), 1.0, 2.0), math.inf
    for share in np.linspace(0.05, 1.0, 96):
        rise = np.maximum(zeta - 1.0 + share, 0.0) / share
        for exponent in np.linspace(1.0, 4.0, 61):
            form = rise**exponent
            depth = float(form @ worn / (form @ form))
            error = float(((depth * form - worn) ** 2).sum())
            if error < least:
                best, least = (depth, float(share), float(exponent)), error
    return best


def fitted_relief(zeta: Array, worn: Array) -> dict[str, Any]:
    """Return a worn shape (n,), m, at |ζ| (n,), and the profile fitted to it, for JSON."""
    depth, share, exponent = fitted_profile(zeta, worn)
    fitted = np.array([relief(place, (depth, share, exponent)) for place in zeta])
    return {
        "relief_depth_um": 1e6 * depth, "relief_share": share, "relief_exponent": exponent,
        "fit_error_um": 1e6 * float(np.sqrt(np.mean((fitted - worn) ** 2))), "zeta": zeta.tolist(),
        "worn_um": (1e6 * worn).tolist(),
    }  # fmt: skip


def write_relief(
    new: Path, old: str, base: Engine, found: Mapping[str, Any], note: str, more: Mapping[str, float]
) -> None:
    """Write the engine file ``new`` with the profile of :func:`fitted_relief`, and ``more`` values of its mains."""
    values = {
        "relief_depth": 1e-6 * found["relief_depth_um"], "relief_share": found["relief_share"],
        "relief_exponent": found["relief_exponent"], **more,
    }  # fmt: skip
    changes = {f"main_bearing.{key}": Written(value, "derived", note) for key, value in values.items()}
    write_new(new, rewritten(old, base, changes))
