"""The verb ``damper-optimum``: optimum damping of a torsional damper, for two masses or for an engine's crank."""

import math
from dataclasses import KW_ONLY, dataclass
from typing import Annotated, Any

from cranktrain.cli.bodies import bare_crankshaft, own_mesh
from cranktrain.cli.console import show_rows
from cranktrain.cli.functions import verb_alone
from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option

DESCRIPTION = """\
Optimum damping of a torsional damper, for two masses or for a torsional mode of an engine.

The damper's ring is coupled to its hub by damping alone.

With --inertia-ratio: Houdaille's two masses, a hub on a spring and a ring of MU times the hub's inertia.
With ENGINE: the [damper] of the engine file on the pulley, for one torsional mode of the cranktrain (at rest, rods as
mean masses, bearings as springs, with the structure's damping, free to turn; the pulley includes the damper's housing).
Only that mode is excited; all modes respond to the ring.

damping_ratio   c / (2 I w): I is the hub's inertia, for an engine the effective inertia of the mode at the pulley; w
                is the frequency without ring, rad/s
amplification   largest amplitude of the hub over its static amplitude, 1/(I w^2) per torque, under the same torque
frequency_ratio frequency of that largest amplitude over w
"""


@dataclass(frozen=True)
class DamperOptimum(words.MeshUnits):
    """Question of :func:`damper_optimum`."""

    engine: words.EngineFile | None = None
    _: KW_ONLY
    inertia_ratio: Annotated[float | None, Option("MU", "ring over hub inertia; takes no ENGINE")] = None
    mode: Annotated[int | None, Option("N", "first (default) or second torsional mode of the engine")] = None
    mesh: Annotated[
        words.File | None, Option("FILE", "own mesh (.msh, .inp, .unv, .bdf) with named journal surfaces")
    ] = None


@verb_alone(DamperOptimum, DESCRIPTION)
def damper_optimum(ask: DamperOptimum) -> VerbResult:
    """Find the optimum of two masses or of an engine's damper."""
    from cranktrain.studies.torsion.damper_optimum import houdaille_optimum, optimal_damping, two_mass_modes

    if (ask.engine is None) == (ask.inertia_ratio is None):
        raise InputError("damper-optimum takes either an ENGINE or --inertia-ratio MU")
    if ask.inertia_ratio is None:
        return _of_engine(ask)
    if ask.mode is not None or ask.mesh is not None:
        raise InputError("--mode and --mesh belong to an ENGINE; two masses have one mode and no mesh")
    closed = houdaille_optimum(ask.inertia_ratio)
    searched, _ = optimal_damping(two_mass_modes(), 0, ask.inertia_ratio)
    return VerbResult.of(
        {**closed._asdict(), "by_search": searched._asdict()}, "damper-optimum", ratio=ask.inertia_ratio
    )


def show(found: VerbResult) -> None:
    """Print the optimum and, for comparison, that of two masses: in closed form, and for two masses also by search."""
    if "by_search" in found:
        rows = [
            (key.replace("_", " "), f"{found[key]:.6f}", f"{other:.6f}") for key, other in found["by_search"].items()
        ]
        title = f"Houdaille damper, ring over hub {found.beside['ratio']:g}"
        show_rows(title, ("", "closed form", "by search"), rows)
        return
    engine, two = found.beside["engine"], found["two_masses"]
    critical = 4.0 * math.pi * found["mode_hz"] * found["effective_inertia_kgm2"]
    rows = [
        ("damping / N m s/rad", f"{found['damping_nms_per_rad']:.2f}", f"{two['damping_ratio'] * critical:.2f}"),
        *((key.replace("_", " "), f"{found[key]:.4f}", f"{other:.4f}") for key, other in two.items()),
    ]
    show_rows(
        f"{engine.title}: damper on torsional mode {found['mode']}, {found['mode_hz']:.1f} Hz without its ring",
        ("", "on the crank", "two masses"),
        rows,
    )
    print(
        f"effective inertia at the pulley {found['effective_inertia_kgm2']:.4f} kg m^2, ring "
        f"{found['ring_inertia_kgm2']:.4f} kg m^2 (ratio {found['inertia_ratio']:.3f})"
    )
    own = found["damper"]
    print(
        f"the engine's damper at {own['temperature_c']:.0f} degC: {own['damping_nms_per_rad']:.1f} N m s/rad at that "
        "frequency, small amplitude"
    )


def _of_engine(ask: DamperOptimum) -> VerbResult:
    """Optimum of an engine's damper for one torsional mode."""
    from cranktrain.loads.damper import damper_parameters, damper_temperature, damping_coefficient, required_damper
    from cranktrain.studies.torsion.damper_optimum import crank_optimum, houdaille_optimum

    assert ask.engine is not None
    engine = load_engine(ask.engine)
    damper = required_damper(engine)
    number = 1 if ask.mode is None else ask.mode
    if number not in (1, 2):
        raise InputError(f"--mode {number}: give 1 or 2, the first or the second torsional mode")
    body, _ = bare_crankshaft(engine, own_mesh(ask.mesh, ask.mesh_unit))
    found = crank_optimum(engine, body, number)
    two = houdaille_optimum(found.inertia_ratio)
    temperature = damper_temperature(damper, damper.temperature_speeds[-1])
    own = damping_coefficient(damper_parameters(damper, temperature, found.hz))
    result: dict[str, Any] = {
        **found.optimum._asdict(),
        "damping_nms_per_rad": found.damping,
        "mode": number,
        "mode_hz": found.hz,
        "effective_inertia_kgm2": found.inertia,
        "ring_inertia_kgm2": damper.ring_inertia,
        "inertia_ratio": found.inertia_ratio,
        "two_masses": two._asdict(),
        "damper": {"temperature_c": temperature - 273.15, "damping_nms_per_rad": own},
    }
    return VerbResult.of(result, "damper-optimum", engine=engine)
