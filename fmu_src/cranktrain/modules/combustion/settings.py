"""Settings of a combustion model as one frozen record in SI, and the run made from them."""

from __future__ import annotations

import math
from dataclasses import MISSING, dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from cranktrain.core.build_mark import build_mark
from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.modules.combustion import slots as at
from cranktrain.modules.combustion.advance import N_HEAD, N_OF_CYLINDER, N_OUTPUTS
from cranktrain.modules.combustion.cylinder import OK
from cranktrain.modules.combustion.equilibrium import SHIFTS, burnt_table
from cranktrain.modules.combustion.gas import gas_table, mixture_table, stoichiometric_air
from cranktrain.modules.combustion.preparation import (
    INTAKE_ANGLES,
    NO_COMPRESSION,
    SHORT_ROD,
    check_numbers,
    prepare_model,
)
from cranktrain.modules.combustion.run_record import Model, Run, Work
from cranktrain.modules.combustion.stepping import ROWS, STAGES
from cranktrain.modules.crank_angle import ANGLES, TIMES
from cranktrain.modules.module_settings import check_values, run_numbers, stated

if TYPE_CHECKING:  # an FMU contains the settings without the quantities of module files
    from cranktrain.engine import quantities as q
    from cranktrain.modules.combustion import quantities as own


CHOICES = {"lift_source": at.LIFTS, "angle_source": ANGLES, "inputs_at": TIMES}
"""Settings that are one of several names; a run's numbers hold the index of the name."""
MEND_INTAKE = "it opens before it closes, both between -720 and 0 deg after firing dead centre"
MEND_EXHAUST = "it opens before it closes, both between 0 and 720 deg after firing dead centre"


@dataclass(frozen=True, kw_only=True)
class CycleSettings:
    """Geometry, fuel, burn, valves and manifolds of one engine's cylinders, in SI (angles rad, masses kg).

    Angles are counted from a cylinder's firing dead centre. Opening and closing angles are within −4π to 0 for the
    intake and 0 to 4π for the exhaust. ``firing_angles`` are the crank angles of the cylinders' firing dead centres.
    ``fuel_mass`` (with ``sparks`` = 1, spark ignition, ``air_ratio``) and ``injection_angle``, then the spark's, are
    initial inputs; ``start_cycles`` is the number of cycles run before the start. ``premixed_duration`` to
    ``diffusion_exponent`` describe both Wiebe functions; those of spark ignition share the fuel by ``burn_fraction``.
    """

    name: str
    title: str
    bore: float
    stroke: float
    rod_length: float
    compression_ratio: float
    firing_angles: tuple[float, ...]
    intake_pressure: q.GasPressure = field(metadata=stated("manifolds.intake_pressure", 0.0))
    intake_temperature: float
    exhaust_pressure: q.GasPressure = field(metadata=stated("manifolds.exhaust_pressure", 0.0))
    exhaust_temperature: q.Temperature = field(metadata=stated("manifolds.exhaust_temperature"))
    wall_temperature: float
    injection_angle: q.Angle = field(metadata=stated("injection.start", spark__angle=MISSING))
    heating_value: own.HeatingValue = field(metadata=stated("fuel.heating_value"))
    hydrogen_per_carbon: own.HydrogenRatio = field(metadata=stated("fuel.hydrogen_per_carbon"))
    premixed_duration: q.Duration = field(metadata=stated("premixed.duration", burn__duration=MISSING))
    premixed_exponent: q.WiebeExponent = field(metadata=stated("premixed.exponent", burn__exponent=MISSING))
    reference_speed: q.RatedSpeed = field(metadata=stated("diffusion.reference_speed", burn__reference_speed=MISSING))
    intake_diameter: q.Size = field(metadata=stated("valves.intake_diameter"))
    intake_count: own.Valves = field(metadata=stated("valves.intake_count"))
    intake_opens: q.Angle = field(metadata=stated("valves.intake_opens"))
    intake_closes: float
    intake_lift: own.Lift = field(metadata=stated("valves.intake_lift"))
    exhaust_diameter: q.Size = field(metadata=stated("valves.exhaust_diameter"))
    exhaust_count: own.Valves = field(metadata=stated("valves.exhaust_count"))
    exhaust_opens: float
    exhaust_closes: q.Angle = field(metadata=stated("valves.exhaust_closes"))
    exhaust_lift: own.Lift = field(metadata=stated("valves.exhaust_lift"))
    curtain: q.Share = field(metadata=stated("valves.curtain"))
    port: q.Share = field(metadata=stated("valves.port"))
    sparks: float = 0.0
    fuel_mass: own.FuelMass = field(default=0.0, metadata=stated("injection.mass"))
    ignition_factor: own.DelayFactor = field(default=1.0, metadata=stated("ignition.factor"))
    ignition_exponent: own.Exponent = field(default=0.0, metadata=stated("ignition.exponent"))
    ignition_temperature: q.TemperatureDifference = field(default=0.0, metadata=stated("ignition.temperature"))
    ignition_by_ratio: own.Exponent = field(default=0.0, metadata=stated("ignition.by_ratio"))
    premixed_factor: own.Exponent = field(default=0.0, metadata=stated("premixed.factor"))
    premixed_by_ratio: own.Exponent = field(default=0.0, metadata=stated("premixed.by_ratio"))
    premixed_by_delay: own.Exponent = field(default=0.0, metadata=stated("premixed.by_delay"))
    diffusion_duration: q.Duration = field(
        default=1.0, metadata=stated("diffusion.duration", burn__second_duration=1.0)
    )
    diffusion_exponent: q.WiebeExponent = field(
        default=1.0, metadata=stated("diffusion.exponent", burn__second_exponent=1.0)
    )
    reference_ratio: own.Ratio = field(default=1.0, metadata=stated("diffusion.reference_ratio"))
    air_ratio: own.AirRatio = field(default=1.0, metadata=stated("spark.air_ratio"))
    burn_fraction: own.Part = field(default=1.0, metadata=stated("burn.fraction", 1.0))
    burn_efficiency: own.Part = field(default=1.0, metadata=stated("burn.efficiency", 1.0))
    burn_pressure: q.GasPressure = field(default=1e6, metadata=stated("burn.reference_pressure"))
    burn_temperature: q.Temperature = field(default=700.0, metadata=stated("burn.reference_temperature"))
    burn_residual: own.Part = field(default=0.0, metadata=stated("burn.reference_residual"))
    scatter_pressure: own.Scatter = field(default=0.0, metadata=stated("scatter.mean_pressure", 0.0))
    pin_offset: float = 0.0
    swirl: own.Factor = field(default=0.0, metadata=stated("walls.swirl"))
    wall_factor: own.Factor = field(default=1.0, metadata=stated("walls.factor"))
    intake_share: own.Part = field(default=0.0, metadata=stated("manifolds.intake_share"))
    crankcase_pressure: float = 101325.0
    scatter_fuel: float = 0.0
    scatter_timing: float = 0.0
    scatter_burn: float = 0.0
    seed: float = 1.0
    tolerance: float = 1.0e-6
    start_cycles: float = 3.0
    start_speed: float = 100.0 * RPM
    lift_source: str = "auto"
    angle_source: str = "auto"
    inputs_at: str = "begin"

    @property
    def variant(self) -> str:
        """Kind of ignition, which entries of the FMU's interface name."""
        return "spark" if self.sparks else "compression"


def make_run(settings: CycleSettings, gas: Array | None = None) -> Run:
    """Make a prepared run with the inputs of the settings; the state is not started yet.

    ``gas`` replaces air and products by another table in the form of :func:`.gas.gas_table`. Raises ``InputError`` for
    contradictory values.
    """
    count = len(settings.firing_angles)
    model, work = build_model(settings, gas), make_work(count)
    inputs = np.zeros(at.FIRST_CYLINDER + count * at.OF_CYLINDER)
    for slot, name in ((at.INTAKE_P, "intake_pressure"), (at.INTAKE_T, "intake_temperature"),
                       (at.EXHAUST_P, "exhaust_pressure"), (at.EXHAUST_T, "exhaust_temperature")):  # fmt: skip
        inputs[slot] = getattr(settings, name)
    fuel = settings.air_ratio if settings.sparks else settings.fuel_mass
    inputs[at.FIRST_CYLINDER + at.FUEL_MASS :: at.OF_CYLINDER] = fuel
    inputs[at.FIRST_CYLINDER + at.INJECTION :: at.OF_CYLINDER] = settings.injection_angle
    outputs = np.zeros(N_OUTPUTS + count * N_OF_CYLINDER)
    return Run(model, work, np.zeros(work.trial.size), inputs, outputs, numbers_of(settings))


def build_model(settings: CycleSettings, gas: Array | None = None) -> Model:
    """Constants of a run, see :func:`make_run`."""
    check_settings(settings)
    fuel, burnt = settings.hydrogen_per_carbon, np.zeros((1, SHIFTS))
    table = gas
    if settings.sparks:
        table, burnt = mixture_table(fuel), burnt_table(fuel)
    elif table is None:
        table = gas_table(fuel)
    firing = np.zeros(len(settings.firing_angles))
    choices = np.zeros(len(at.CHOICES), dtype=np.int64)
    model = Model(np.zeros(len(at.NUMBERS)), table, burnt, firing, choices, *dormand_prince(), build_mark())
    prepare_model(numbers_of(settings), model)
    return model


def make_work(cylinders: int) -> Work:
    """Workspace of one run."""
    trial = np.zeros(N_HEAD + cylinders * at.SIZE)
    counters = np.zeros(1, dtype=np.int64)
    return Work(np.zeros((ROWS, at.N_INTEGRATED)), np.zeros(len(at.NOW)), counters, trial, build_mark())


def numbers_of(settings: CycleSettings) -> Array:
    """Numbers of a run in the order of ``slots.RUN_NUMBERS``, followed by the firing angles."""
    air = stoichiometric_air(settings.hydrogen_per_carbon)
    return run_numbers(settings, at.RUN_NUMBERS, CHOICES, air_demand=air)


def dormand_prince() -> tuple[Array, Array, Array]:
    """Tableau (7, 7) with the fifth-order solution in the last row, its nodes, and differences to the fourth order."""
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
    """Raise ``InputError`` for contradictory values; the message names the value and what it must be."""
    check_values(settings, CHOICES)
    status = check_numbers(numbers_of(settings))
    if status != OK:
        raise InputError(_refusal(settings, status))


def _refusal(settings: CycleSettings, status: int) -> str:
    """Error message for a status of :mod:`.preparation`, with values of the ``settings``."""
    s, turns = settings, 180.0 / math.pi
    if status == SHORT_ROD:
        reach = 0.5 * s.stroke + abs(s.pin_offset)
        return f"rod_length {1e3 * s.rod_length:g} mm does not exceed crank radius and pin offset, {1e3 * reach:g} mm"
    if status == NO_COMPRESSION:
        return f"compression_ratio {s.compression_ratio:g} must be above 1; diesels have 14 to 20"
    if status == INTAKE_ANGLES:
        span = f"from {turns * s.intake_opens:g} to {turns * s.intake_closes:g} deg"
        return f"intake valve {span}; {MEND_INTAKE}"
    span = f"from {turns * s.exhaust_opens:g} to {turns * s.exhaust_closes:g} deg"
    return f"exhaust valve {span}; {MEND_EXHAUST}"
