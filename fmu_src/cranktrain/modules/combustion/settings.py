"""What a combustion model is made of: one frozen record in SI, and the arrays that kernels take."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.build_mark import build_mark
from cranktrain.core.errors import InputError, nearest
from cranktrain.modules.combustion.cylinder import swept_volume
from cranktrain.modules.combustion.gas import gas_constant, gas_table, internal_energy, stoichiometric_air
from cranktrain.modules.combustion.slots import CHOICES, N_INTEGRATED, NOW, NUMBERS
from cranktrain.modules.combustion.stepping import ROWS, STAGES
from cranktrain.modules.crank_angle import ANGLES, TIMES

Array = NDArray[np.float64]

LIFTS = ("built-in", "input", "auto")
PORT_SHARE = 0.5
"""Volume of the exhaust port, over the swept volume, that mixes what leaves a cylinder; chosen."""


@dataclass(frozen=True, kw_only=True)
class CycleSettings:
    """Geometry, fuel, burn, valves and manifolds of one engine's cylinders, in SI (angles rad, masses kg).

    Angles count from a cylinder's firing dead centre, opening and closing ones between −2π and 4π with the intake's
    before, the exhaust's behind it; ``firing_angles`` are the crank's angles at those dead centres. ``fuel_mass`` and
    ``injection_angle`` are what the inputs start from, ``start_cycles`` the cycles run before the start.
    """

    name: str
    title: str
    bore: float
    stroke: float
    rod_length: float
    compression_ratio: float
    firing_angles: tuple[float, ...]
    intake_pressure: float
    intake_temperature: float
    exhaust_pressure: float
    exhaust_temperature: float
    wall_temperature: float
    fuel_mass: float
    injection_angle: float
    heating_value: float
    hydrogen_per_carbon: float
    ignition_factor: float
    ignition_exponent: float
    ignition_temperature: float
    ignition_by_ratio: float
    premixed_factor: float
    premixed_by_ratio: float
    premixed_by_delay: float
    premixed_duration: float
    premixed_exponent: float
    diffusion_duration: float
    diffusion_exponent: float
    reference_ratio: float
    reference_speed: float
    intake_diameter: float
    intake_count: float
    intake_opens: float
    intake_closes: float
    intake_lift: float
    exhaust_diameter: float
    exhaust_count: float
    exhaust_opens: float
    exhaust_closes: float
    exhaust_lift: float
    curtain: float
    port: float
    pin_offset: float = 0.0
    swirl: float = 0.0
    wall_factor: float = 1.0
    intake_share: float = 0.0
    crankcase_pressure: float = 101325.0
    scatter_fuel: float = 0.0
    scatter_timing: float = 0.0
    scatter_burn: float = 0.0
    seed: float = 1.0
    tolerance: float = 1.0e-6
    start_cycles: float = 3.0
    start_speed: float = 100.0 * math.pi / 30.0
    lift_source: str = "auto"
    angle_source: str = "auto"
    inputs_at: str = "begin"


class Model(NamedTuple):
    """Constants of a run: numbers by their slots, gas table, firing angles (cylinders,), choices and the method."""

    numbers: Array
    gas: Array
    firing: Array
    choices: NDArray[np.int64]
    tableau: Array
    nodes: Array
    defects: Array
    mark: NDArray[np.void]


class Work(NamedTuple):
    """Workspace of the kernels: rates of the stages and values, what holds over a step, and a counter."""

    rows: Array
    now: Array
    counters: NDArray[np.int64]
    mark: NDArray[np.void]


def build_model(settings: CycleSettings, gas: Array | None = None) -> Model:
    """Arrays of a run; ``gas`` replaces air and products by another table, see :func:`.gas.constant_gas`.

    Raises ``InputError`` for values that do not go together.
    """
    check_settings(settings)
    table = gas_table(settings.hydrogen_per_carbon) if gas is None else gas
    given = asdict(settings)
    given["air_demand"] = stoichiometric_air(settings.hydrogen_per_carbon)
    numbers = np.array([float(given.get(name, 0.0)) for name in NUMBERS])
    share = settings.intake_share
    swept = float(swept_volume(numbers))
    density = settings.intake_pressure / (gas_constant(table, share) * settings.intake_temperature)
    scales = {
        "mass_scale": density * swept,
        "energy_scale": density * swept * abs(internal_energy(table, share, 1000.0)),
        "port_mass": PORT_SHARE * swept * settings.exhaust_pressure
        / (gas_constant(table, share) * settings.exhaust_temperature),
    }  # fmt: skip
    for name, value in scales.items():
        numbers[NUMBERS.index(name)] = value
    choices = LIFTS.index(settings.lift_source), ANGLES.index(settings.angle_source), TIMES.index(settings.inputs_at)
    assert len(choices) == len(CHOICES)
    firing = np.array(settings.firing_angles, dtype=float)
    return Model(numbers, table, firing, np.array(choices), *dormand_prince(), build_mark())


def make_work() -> Work:
    """Workspace of one run."""
    return Work(np.zeros((ROWS, N_INTEGRATED)), np.zeros(len(NOW)), np.zeros(1, dtype=np.int64), build_mark())


def dormand_prince() -> tuple[Array, Array, Array]:
    """Tableau (7, 7) whose last row is the solution of fifth order, its nodes, and defects to the fourth-order one."""
    rows = (
        (),
        (1 / 5,),
        (3 / 40, 9 / 40),
        (44 / 45, -56 / 15, 32 / 9),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
        (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    )
    tableau = np.zeros((STAGES, STAGES))
    for k, row in enumerate(rows):
        tableau[k, : len(row)] = row
    fourth = np.array([5179 / 57600, 0.0, 7571 / 16695, 393 / 640, -92097 / 339200, 187 / 2100, 1 / 40])
    return tableau, tableau.sum(axis=1), tableau[-1] - fourth


def check_settings(settings: CycleSettings) -> None:
    """Refuse values that no engine has together; ``InputError`` names the one and what it must be."""
    s = settings
    for name, names in (("lift_source", LIFTS), ("angle_source", ANGLES), ("inputs_at", TIMES)):
        if getattr(s, name) not in names:
            raise InputError(f"{name} '{getattr(s, name)}' is not known; {nearest(str(getattr(s, name)), names)}")
    for entry in fields(s):
        value = getattr(s, entry.name)
        if isinstance(value, float) and not math.isfinite(value):
            raise InputError(f"{entry.name} is {value}; it must be a finite number")
    reach = 0.5 * s.stroke + abs(s.pin_offset)
    if not s.rod_length > reach > 0.0:
        raise InputError(
            f"rod_length {1e3 * s.rod_length:g} mm does not exceed crank radius and pin offset, {1e3 * reach:g} mm"
        )
    if not s.compression_ratio > 1.0:
        raise InputError(f"compression_ratio {s.compression_ratio:g} must be above 1; diesels have 14 to 20")
    turns = 180.0 / math.pi
    if not -4.0 * math.pi <= s.intake_opens < s.intake_closes < 0.0:
        raise InputError(
            f"intake valve from {turns * s.intake_opens:g} to {turns * s.intake_closes:g} deg; it opens before it "
            "closes, both between -720 and 0 deg after firing dead centre"
        )
    if not 0.0 < s.exhaust_opens < s.exhaust_closes <= 4.0 * math.pi:
        raise InputError(
            f"exhaust valve from {turns * s.exhaust_opens:g} to {turns * s.exhaust_closes:g} deg; it opens before it "
            "closes, both between 0 and 720 deg after firing dead centre"
        )
