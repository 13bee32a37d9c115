"""Torsional vibration stress of propulsion shafts compared with the limits of rule IACS UR M68.

The stress is that of the plain section, τ = T/W with W = π (d⁴ − d_i⁴)/(16 d), for half the range of the torque over a
cycle, the synthesis of all orders. With λ = n/n₀ and the rated speed n₀ its limit for continuous operation is

    τ_C = (σ_B + 160)/18 · c_K c_D (3 − 2 λ²)    λ < 0.9
    τ_C = (σ_B + 160)/18 · c_K c_D · 1.38        0.9 ≤ λ ≤ 1.05

and for quick passage through a barred speed range, which is permitted only below λ = 0.8,

    τ_T = 1.7 τ_C/√c_K

in N/mm², with c_D = 0.35 + 0.93 d^−0.2 (d in mm) and the factor c_K of the shaft's design. A barred range around the
speed n_c of the largest stress extends from 16 n_c/(18 − λ_c) to (18 − λ_c) n_c/16.

The rule limits σ_B to 800 N/mm², and to 600 N/mm² for propeller shafts. It also limits carbon and carbon-manganese
steels to 600 N/mm². The engine file does not state the kind of steel, so give at most 600 N/mm² for these.

Source: IACS Unified Requirement M68, Dimensions of propulsion shafts and their permissible torsional vibration
stresses, Rev. 2 (April 2015), M68.3, M68.5 and M68.6.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.core.units import RPM
from cranktrain.engine.model import Engine
from cranktrain.engine.torsional_chain import Shaft
from cranktrain.results.columns import NOTHING, cell
from cranktrain.results.run_up.run_up import LARGEST, LEAST, RunUp
from cranktrain.results.tables import Table

DESIGN_FACTORS = {
    "straight": 1.0,
    "shrink-fit": 1.0,
    "keyway-tapered": 0.6,
    "keyway-cylindrical": 0.45,
    "radial-hole": 0.5,
    "slot": 0.3,
    "thrust": 0.85,
    "propeller": 0.55,
    "stern-tube": 0.8,
}
"""Factor c_K by a shaft's ``section``: intermediate shafts with integral flanges or shrunk couplings, keyways in a
tapered or cylindrical end, a radial hole, a longitudinal slot; thrust shafts; propeller shafts from the propeller to
the forward end of the aftmost bearing, and from there to the forward stern-tube seal."""
OF_PROPELLER = ("propeller", "stern-tube")
STRONGEST, STRONGEST_PROPELLER = 800.0, 600.0
"""Largest tensile strengths that the rule accepts, N/mm²: other shafts, propeller shafts."""
NEAR_RATED, FASTEST, BARRED = 0.9, 1.05, 0.8
"""Speed ratios λ: above NEAR_RATED the limit is constant, at FASTEST it ends, below BARRED speed ranges may be
barred."""


def section_modulus(shaft: Shaft) -> float:
    """Polar section modulus of a shaft, m³."""
    return math.pi * (shaft.diameter**4 - shaft.bore**4) / (16.0 * shaft.diameter)


def permissible_stress(shaft: Shaft, ratio: Array) -> tuple[Array, Array]:
    """Permissible stress (Pa) for continuous and for transient operation at speed ratios λ; NaN beyond 1.05.

    The transient limit is NaN above λ = 0.8, where no range may be barred.
    """
    most = STRONGEST_PROPELLER if shaft.section in OF_PROPELLER else STRONGEST
    strength = min(1e-6 * shaft.strength, most)
    factor = DESIGN_FACTORS[shaft.section]
    size = 0.35 + 0.93 * (1e3 * shaft.diameter) ** -0.2
    course = np.where(ratio < NEAR_RATED, 3.0 - 2.0 * ratio**2, 1.38)
    continuous = 1e6 * (strength + 160.0) / 18.0 * factor * size * np.where(ratio <= FASTEST, course, np.nan)
    return continuous, np.where(ratio <= BARRED, 1.7 * continuous / math.sqrt(factor), np.nan)


def has_sections(engine: Engine) -> bool:
    """True if at least one shaft of the engine's drive line has a section in the engine file."""
    line = engine.drive_line_chain
    return line is not None and any(line.diameters)


def shaft_stresses(engine: Engine, run_up: RunUp) -> list[dict[str, Any]]:
    """Stress over speed of each shaft with a diameter, from a run-up in the frequency domain; JSON-able.

    Keys carry their units. ``barred_rpm`` is the rule's range around the speed of the largest stress relative to the
    continuous limit, None if no stress exceeds this limit. Raises ``InputError``: shafts without strength, an engine
    without rated speed, a run-up without the torques of its shafts.
    """
    line, found = engine.drive_line_chain, []
    assert line is not None
    if engine.load is None:
        raise InputError(f"engine '{engine.name}' has no [load], whose speed is the rated one of the rule; add it")
    ratio = run_up.speeds / engine.load.speed
    for number, shaft in enumerate(line.chain.shafts, 1):
        if not shaft.diameter:
            continue
        name = f"{shaft.between[0]} to {shaft.between[1]}"
        if not shaft.strength:
            raise InputError(f"drive line: shaft {number} ({name}) has a diameter and no strength; give the steel's")
        if shaft.bore >= shaft.diameter:
            raise InputError(f"drive line: shaft {number} ({name}): bore is not smaller than diameter; correct it")
        output = f"shaft[{name}].torque"
        if output not in run_up.extremes:
            raise InputError(f"run-up has no '{output}'; run it with --method harmonic-balance")
        extremes = run_up.extremes[output]
        amplitude = 0.5 * (extremes[:, LARGEST] - extremes[:, LEAST])
        stress = amplitude / section_modulus(shaft)
        continuous, transient = permissible_stress(shaft, ratio)
        found.append({
            "shaft": name,
            "diameter_mm": 1e3 * shaft.diameter,
            "section": shaft.section,
            "design_factor": DESIGN_FACTORS[shaft.section],
            "torque_amplitude_knm": (1e-3 * amplitude).tolist(),
            "stress_mpa": (1e-6 * stress).tolist(),
            "continuous_mpa": (1e-6 * continuous).tolist(),
            "transient_mpa": (1e-6 * transient).tolist(),
            **_worst(run_up.speeds / RPM, ratio, stress, continuous, transient),
        })  # fmt: skip
    return found


def stress_table(stresses: list[dict[str, Any]]) -> Table:
    """Table of each shaft at the speed where its stress is closest to the limit."""
    rows = []
    for entry in stresses:
        worst, span = entry["worst"], entry["barred_rpm"]
        barred = NOTHING if span is None else f"{span[0]:.3g} to {span[1]:.3g}"
        rows.append((
            entry["shaft"], f"{entry['diameter_mm']:.0f}", entry["section"], f"{worst['rpm']:.4g}",
            f"{worst['stress_mpa']:.1f}", f"{worst['continuous_mpa']:.1f}",
            cell(worst["transient_mpa"], ".1f"), barred, entry["verdict"],
        ))  # fmt: skip
    header = (
        "shaft", "d / mm", "section", "rev/min", "stress / MPa", "continuous / MPa", "transient / MPa",
        "barred / rev/min", "",
    )  # fmt: skip
    return Table(
        "Torsional vibration stress against IACS UR M68, where it comes nearest to the limit", header, tuple(rows)
    )


def plot_stress(ax: Any, rpm: Array, entry: Mapping[str, Any]) -> None:
    """Draw one shaft's stress over speed with both limits and the barred range."""
    ax.plot(rpm, entry["stress_mpa"], color="#1f4e8c", lw=1.6, label="stress, half of the range")
    ax.plot(rpm, entry["continuous_mpa"], color="#c0392b", lw=1.4, label="limit, continuous")
    ax.plot(rpm, entry["transient_mpa"], color="#c0392b", lw=1.2, ls="--", label="limit, transient")
    if entry["barred_rpm"] is not None:
        ax.axvspan(*entry["barred_rpm"], color="#c0392b", alpha=0.12, lw=0, label="barred range")
    ax.set_title(f"{entry['shaft']}: {entry['diameter_mm']:.0f} mm, {entry['section']}", fontsize=10, loc="left")
    ax.set_ylabel("stress / MPa")
    ax.set_ylim(bottom=0.0)
    ax.grid(alpha=0.2)


def _worst(rpm: Array, ratio: Array, stress: Array, continuous: Array, transient: Array) -> dict[str, Any]:
    """Speed at which a shaft's stress is closest to its limit, barred range, and verdict."""
    use = stress / continuous
    if not np.isfinite(use).any():
        nothing = dict.fromkeys(("rpm", "stress_mpa", "continuous_mpa", "transient_mpa"), math.nan)
        return {"worst": nothing, "barred_rpm": None, "verdict": "no speed with a limit"}
    at = int(np.nanargmax(use))
    worst = {
        "rpm": float(rpm[at]),
        "stress_mpa": 1e-6 * float(stress[at]),
        "continuous_mpa": 1e-6 * float(continuous[at]),
        "transient_mpa": 1e-6 * float(transient[at]),
    }
    if use[at] <= 1.0:
        return {"worst": worst, "barred_rpm": None, "verdict": "within the limit"}
    over = use > 1.0
    if np.any(over & (ratio > BARRED)):
        verdict = f"over the limit above {BARRED:g} of the rated speed, where no range may be barred"
    elif np.any(stress[over] > transient[over]):
        verdict = "over the transient limit"
    else:
        verdict = "barred range"
    reach = 18.0 - float(ratio[at])
    return {
        "worst": worst,
        "barred_rpm": [16.0 * worst["rpm"] / reach, reach * worst["rpm"] / 16.0],
        "verdict": verdict,
    }
