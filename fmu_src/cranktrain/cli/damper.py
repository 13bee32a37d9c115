"""The verb ``damper-optimum``: optimum damping of a torsional damper, for two masses or for an engine's crank."""

from __future__ import annotations

import argparse
import math
from typing import Any

from cranktrain.cli.bodies import bare_crankshaft, own_meshes
from cranktrain.cli.console import of_words, show_rows
from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.structure.fem.own_mesh import UNITS

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


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument
    add("engine", nargs="?", metavar="ENGINE", help="name of a shipped engine or path of a .toml file")
    add("--inertia-ratio", type=float, metavar="MU", help="ring over hub inertia; takes no ENGINE")
    add("--mode", type=int, metavar="N", help="first (default) or second torsional mode of the engine")
    add("--mesh", metavar="FILE", help="own mesh (.msh, .inp, .unv, .bdf) with named journal surfaces")
    unit = add(
        "--mesh-unit", default="m", metavar="UNIT", help=f"unit of its coordinates: {', '.join(UNITS)} (default m)"
    )  # fmt: skip
    of_words(unit, UNITS)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Find the optimum of two masses or of an engine's damper, and print it unless JSON is wanted."""
    from cranktrain.studies.torsion.damper_optimum import houdaille_optimum, optimal_damping, two_mass_modes

    if (options.engine is None) == (options.inertia_ratio is None):
        raise InputError("damper-optimum takes either an ENGINE or --inertia-ratio MU")
    if options.inertia_ratio is None:
        return _engine(options)
    if options.mode is not None or options.mesh is not None:
        raise InputError("--mode and --mesh belong to an ENGINE; two masses have one mode and no mesh")
    closed = houdaille_optimum(options.inertia_ratio)
    searched, _ = optimal_damping(two_mass_modes(), 0, options.inertia_ratio)
    if not options.json:
        rows = [
            (key.replace("_", " "), f"{value:.6f}", f"{other:.6f}")
            for (key, value), other in zip(closed._asdict().items(), searched, strict=True)
        ]
        show_rows(f"Houdaille damper, ring over hub {options.inertia_ratio:g}", ("", "closed form", "by search"), rows)
    return {**closed._asdict(), "by_search": searched._asdict()}


def _engine(options: argparse.Namespace) -> dict[str, Any]:
    """Optimum of an engine's damper for one torsional mode, printed unless JSON is wanted."""
    from cranktrain.loads.damper import damper_parameters, damper_temperature, damping_coefficient, required_damper
    from cranktrain.studies.torsion.damper_optimum import crank_optimum, houdaille_optimum

    engine = load_engine(options.engine)
    damper = required_damper(engine)
    number = 1 if options.mode is None else options.mode
    if number not in (1, 2):
        raise InputError(f"--mode {number}: give 1 or 2, the first or the second torsional mode")
    own_meshes(options)
    body, _ = bare_crankshaft(engine, options)
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
    if not options.json:
        critical = 4.0 * math.pi * found.hz * found.inertia
        rows = [
            ("damping / N m s/rad", f"{found.damping:.2f}", f"{two.damping_ratio * critical:.2f}"),
            *(
                (key.replace("_", " "), f"{value:.4f}", f"{other:.4f}")
                for (key, value), other in zip(found.optimum._asdict().items(), two, strict=True)
            ),
        ]
        show_rows(
            f"{engine.title}: damper on torsional mode {number}, {found.hz:.1f} Hz without its ring",
            ("", "on the crank", "two masses"),
            rows,
        )
        print(
            f"effective inertia at the pulley {found.inertia:.4f} kg m^2, ring {damper.ring_inertia:.4f} kg m^2 "
            f"(ratio {found.inertia_ratio:.3f})"
        )
        print(
            f"the engine's damper at {temperature - 273.15:.0f} degC: {own:.1f} N m s/rad at that frequency, "
            "small amplitude"
        )
    return result
