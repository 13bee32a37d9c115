"""Indices of the combustion module's numbers, inputs and states in their arrays.

A state vector is a head, followed for each cylinder by its ``INTEGRATED`` quantities and the ``MEMORY`` of its cycle.
"""

from cranktrain.modules.crank_angle import HEAD as CRANK_HEAD

GIVEN = (
    "bore", "stroke", "rod_length", "pin_offset", "compression_ratio", "crankcase_pressure", "wall_temperature",
    "swirl", "heating_value", "air_demand", "ignition_factor", "ignition_exponent", "ignition_temperature",
    "ignition_by_ratio", "premixed_factor", "premixed_by_ratio", "premixed_by_delay", "premixed_duration",
    "premixed_exponent",
    "diffusion_duration", "diffusion_exponent", "reference_ratio", "reference_speed", "intake_share",
    "intake_diameter", "intake_count", "exhaust_diameter", "exhaust_count", "curtain", "port",
    "intake_opens", "intake_closes", "intake_lift", "exhaust_opens", "exhaust_closes", "exhaust_lift",
    "scatter_fuel", "scatter_timing", "scatter_burn", "seed", "tolerance", "wall_factor", "sparks", "burn_fraction",
    "burn_efficiency", "burn_pressure", "burn_temperature", "burn_residual",
)  # fmt: skip
"""Fields of the settings that kernels read during steps; ``air_demand`` is derived from the fuel."""
N_GIVEN = len(GIVEN)
NUMBERS = (*GIVEN, "port_mass", "mass_scale", "energy_scale")
"""Names of a model's numbers: given values, and scales derived from given values."""
(
    BORE, STROKE, ROD_LENGTH, PIN_OFFSET, COMPRESSION_RATIO, CRANKCASE_PRESSURE, WALL_TEMPERATURE, SWIRL,
    HEATING_VALUE, AIR_DEMAND, IGNITION_FACTOR, IGNITION_EXPONENT, IGNITION_TEMPERATURE, IGNITION_BY_RATIO,
    PREMIXED_FACTOR, PREMIXED_BY_RATIO, PREMIXED_BY_DELAY, PREMIXED_DURATION, PREMIXED_EXPONENT,
    DIFFUSION_DURATION, DIFFUSION_EXPONENT, REFERENCE_RATIO, REFERENCE_SPEED, INTAKE_SHARE,
    INTAKE_DIAMETER, INTAKE_COUNT, EXHAUST_DIAMETER, EXHAUST_COUNT, CURTAIN, PORT_COEFFICIENT,
    INTAKE_OPENS, INTAKE_CLOSES, INTAKE_LIFT, EXHAUST_OPENS, EXHAUST_CLOSES, EXHAUST_LIFT,
    SCATTER_FUEL, SCATTER_TIMING, SCATTER_BURN, SEED, TOLERANCE, WALL_FACTOR, SPARKS, BURN_FRACTION,
    BURN_EFFICIENCY, BURN_PRESSURE, BURN_TEMPERATURE, BURN_RESIDUAL, PORT_MASS, MASS_SCALE, ENERGY_SCALE,
) = range(len(NUMBERS))  # fmt: skip

RUN_NUMBERS = (
    *GIVEN, "intake_pressure", "intake_temperature", "exhaust_pressure", "exhaust_temperature", "start_cycles",
    "start_speed", "lift_source", "angle_source", "inputs_at",
)  # fmt: skip
"""Names of a run's numbers: given values, then values for preparation and start only; firing angles follow."""
(
    CHARGE_PRESSURE, CHARGE_TEMPERATURE, BACK_PRESSURE, BACK_TEMPERATURE, START_CYCLES, START_SPEED, LIFT_SOURCE,
    ANGLE_SOURCE, INPUTS_AT,
) = range(N_GIVEN, len(RUN_NUMBERS))  # fmt: skip
FIRING = len(RUN_NUMBERS)

LIFTS = ("built-in", "input", "auto")
"""Sources of the lifts: built-in, the inputs, or the inputs from the first one that is not 0."""
CHOICES = ("given_lift", "given_angle", "ends")
"""Choices of a model: indices in ``LIFTS``, and ``ANGLES`` and ``TIMES`` of :mod:`cranktrain.modules.crank_angle`."""
GIVEN_LIFT, GIVEN_ANGLE, ENDS = range(len(CHOICES))
_NEVER, ALWAYS, ONCE_SEEN = range(3)

COMMON_INPUTS = (
    "crank.speed", "crank.angle", "intake.pressure", "intake.temperature", "exhaust.pressure", "exhaust.temperature",
)  # fmt: skip
SPEED, ANGLE, INTAKE_P, INTAKE_T, EXHAUST_P, EXHAUST_T = range(len(COMMON_INPUTS))
CYLINDER_INPUTS = (
    "fuel_mass", "injection_angle", "intake_lift", "exhaust_lift", "volume_deviation", "volume_deviation_rate",
)  # fmt: skip
"""Inputs of each cylinder, which follow the common inputs."""
SPARKED = {
    "fuel_mass": "air_ratio", "injection_angle": "spark_angle", "air_ratio": "fuel_mass",
    "ignition_delay": "burn_duration",
}  # fmt: skip
"""Names of inputs and outputs of a cylinder that have another meaning with spark ignition."""
FUEL_MASS, INJECTION, LIFT_IN, LIFT_OUT, DEVIATION_IN, DEVIATION_RATE_IN = range(len(CYLINDER_INPUTS))
OF_CYLINDER = len(CYLINDER_INPUTS)
FIRST_CYLINDER = len(COMMON_INPUTS)

HEAD = (*CRANK_HEAD, "steps", "rejected", "lifts_seen", "rich")
(
    TIME, OWN_ANGLE, PARTNER_ANGLE, ANGLE_SEEN, LAST_INTERVAL, LAST_ANGLE, LAST_SPEED, STEPS, REJECTED, LIFTS_SEEN,
    RICH,
) = range(len(HEAD))  # fmt: skip

INTEGRATED = (
    "mass", "products", "energy", "delay", "burnt", "work", "wall", "intake", "exhaust", "intake_enthalpy",
    "exhaust_enthalpy", "pool", "pool_products", "pool_enthalpy", "port", "vapour",
)  # fmt: skip
"""Integrated quantities of a cylinder: gas, burnt fuel, balances, gas blown back into the ports, and fuel vapour."""
(
    MASS, PRODUCTS, ENERGY, DELAY, BURNT, WORK, WALL, INTAKE, EXHAUST, INTAKE_ENTHALPY,
    EXHAUST_ENTHALPY, POOL, POOL_PRODUCTS, POOL_ENTHALPY, PORT, VAPOUR,
) = range(len(INTEGRATED))  # fmt: skip
N_INTEGRATED = len(INTEGRATED)

MEMORY = (
    "phi", "pressure", "temperature", "step", "phase", "cycle", "fuel", "soi", "soi_time", "clock", "ignition", "ratio",
    "premixed_fuel", "diffusion_fuel", "premixed_for", "diffusion_for", "closed", "closed_pressure",
    "closed_temperature", "closed_volume", "lift_in", "lift_out", "work_start", "wall_start", "burnt_start", "peak",
    "peak_angle", "cycle_work", "cycle_wall", "cycle_heat", "cycle_peak", "cycle_peak_angle", "cycle_delay", "injected",
    "first_mass", "first_energy", "first_volume", "deviation", "deviation_rate", "last_deviation",
    "last_deviation_rate", "air", "added", "added_energy", "spark_pressure", "spark_temperature", "spark_products",
    "spark_vapour", "spark_burnt",
)  # fmt: skip
"""Values that a cylinder stores during its cycle."""
(
    PHI, PRESSURE, TEMPERATURE, STEP, PHASE, CYCLE, FUEL, SOI, SOI_TIME, CLOCK, IGNITION, RATIO,
    PREMIXED_FUEL, DIFFUSION_FUEL, PREMIXED_FOR, DIFFUSION_FOR, CLOSED, CLOSED_PRESSURE,
    CLOSED_TEMPERATURE, CLOSED_VOLUME, LAST_LIFT_IN, LAST_LIFT_OUT, WORK_START, WALL_START, BURNT_START, PEAK,
    PEAK_ANGLE, CYCLE_WORK, CYCLE_WALL, CYCLE_HEAT, CYCLE_PEAK, CYCLE_PEAK_ANGLE, CYCLE_DELAY, INJECTED,
    FIRST_MASS, FIRST_ENERGY, FIRST_VOLUME, DEVIATION, DEVIATION_RATE, LAST_DEVIATION, LAST_DEVIATION_RATE,
    AIR, ADDED, ADDED_ENERGY, SPARK_PRESSURE, SPARK_TEMPERATURE, SPARK_PRODUCTS, SPARK_VAPOUR, SPARK_BURNT,
) = range(N_INTEGRATED, N_INTEGRATED + len(MEMORY))  # fmt: skip
SIZE = N_INTEGRATED + len(MEMORY)

WAITING, ARMED, DELAYED, BURNING = 0.0, 1.0, 2.0, 3.0
"""Phases of a cylinder's cycle: fuel not sampled yet, before injection, before ignition, burning or burnt."""

OUTPUTS = (
    "pressure.angle", "indicated.torque", "indicated.torque_mean", "indicated.pressure_mean", "heat.released",
    "heat.walls", "gas.work", "fuel.burnt", "intake.mass", "exhaust.mass", "balance.mass", "balance.energy",
    "solver.steps", "solver.rejected",
)  # fmt: skip
CYLINDER_OUTPUTS = (
    "pressure", "temperature", "mass", "products", "pressure_mean", "pressure_peak", "peak_angle", "heat_released",
    "wall_heat", "ignition_delay", "deviation_taken", "trapped_air", "air_ratio",
)  # fmt: skip
"""Outputs of each cylinder; the fifth to the tenth refer to its last complete cycle, the last two to its last fuel."""

NOW = (
    "speed", "intake_p", "intake_t", "exhaust_p", "exhaust_t", "lift_in", "lift_out", "slope_in", "slope_out",
    "pressure", "temperature", "stiffness", "lifts_given", "deviation", "deviation_slope",
    "deviation_bend", "deviation_twist",
)  # fmt: skip
"""Slots of the workspace: constants over a communication step, and results of the last evaluation."""
(
    NOW_SPEED, NOW_INTAKE_P, NOW_INTAKE_T, NOW_EXHAUST_P, NOW_EXHAUST_T, NOW_LIFT_IN, NOW_LIFT_OUT, SLOPE_IN, SLOPE_OUT,
    FOUND_P, FOUND_T, STIFFNESS, LIFTS_GIVEN, NOW_DEVIATION, DEVIATION_SLOPE, DEVIATION_BEND, DEVIATION_TWIST,
) = range(len(NOW))  # fmt: skip
