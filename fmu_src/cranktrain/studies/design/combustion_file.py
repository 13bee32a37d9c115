"""Module file of the combustion of an engine: rules of practice, and values found by running the module.

Petrol: the spark is that of the largest torque at a given speed, for a new engine the rated one. The charge at this
spark is the reference of the burn's duration. A charged engine gets the intake pressure that gives its indicated mean
effective pressure at this speed.

Diesel: fuel for the indicated mean effective pressure, boost for the air ratio of practice, and a start of injection
for a usual ratio of peak and compression pressure (Mollenhauer and Tschöke have 1.3 to 1.6). Delay and burn are those
of the shipped six, which were fitted to a measured engine, at the same mean piston speed.

Valves are those of four valves a cylinder, Heywood, *Internal Combustion Engine Fundamentals* (1988), section 6.3.
"""

import math
from typing import NamedTuple

from cranktrain.core.units import RPM
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.modules.combustion.file import FILE, cycle_settings
from cranktrain.modules.combustion.performance import STEP, best_spark, settled_cycle
from cranktrain.modules.combustion.settings import CycleSettings
from cranktrain.studies.design.document import Block, Document, chosen, derived
from cranktrain.studies.design.rules import CHARGED
from cranktrain.studies.design.sizes import FUELS, Fuel

PETROL = "petrol"
AMBIENT = 1.0e5
"""Intake pressure of an engine that is not charged, Pa."""
LEAST_OF_DIESELS = 13.5
"""Least compression ratio of diesels; charges of petrol and air would knock."""
PEAK_RATIO = 1.45
"""Peak over compression pressure of a diesel at this speed."""
FITTED_SPEED = 2198.0 * RPM * 0.137
"""Speed (rad/s) times stroke (m) of the engine to which delay and burn of diesels were fitted."""
EARLIEST, LATEST, ROUNDS = math.radians(-30.0), math.radians(5.0), 4
CALIBRATED = "of the six of 105 x 137 mm, docs/combustion.md, Calibration"


class Found(NamedTuple):
    """Values found by running the module (SI).

    Angle of spark or start of injection; intake pressure; fuel of a diesel; pressure, temperature and burnt fraction of
    the charge at the spark; indicated mean effective pressure that came out.
    """

    angle: float
    intake: float
    fuel: float
    pressure: float = 12e5
    temperature: float = 700.0
    residual: float = 0.05
    reached: float = 0.0


class Aim(NamedTuple):
    """What a combustion is made for: an engine, its fuel, and its indicated mean effective pressure (Pa) at a speed.

    ``fuel`` has the values of practice for the fuel, ``petrol`` or ``diesel``; ``speed`` is in rad/s.
    """

    engine: Engine
    fuel_name: str
    fuel: Fuel
    imep: float
    speed: float

    @property
    def bore(self) -> float:
        """Bore, m."""
        return self.engine.cylinders.bore

    @property
    def stroke(self) -> float:
        """Stroke, m."""
        return 2.0 * self.engine.crankshaft.throw

    @property
    def at_speed(self) -> str:
        """Words for the speed."""
        return f"at {self.speed / RPM:.0f} rev/min"


def aim_of(engine: Engine) -> Aim:
    """Aim for an engine file: mean pressure of its built-in trace, and the fuel that its compression ratio allows."""
    fuel_name = PETROL if engine.cylinders.compression_ratio < LEAST_OF_DIESELS else "diesel"
    return Aim(engine, fuel_name, FUELS[fuel_name], GasTrace.from_engine(engine).imep, engine.best_speed)


def combustion_text(name: str, reference: str, aim: Aim) -> str:
    """Text of the module file ``name_combustion.toml``; ``reference`` is the name of an engine or path of its file."""
    found = (_fitted_petrol if aim.fuel_name == PETROL else _fitted_diesel)(aim)
    lines = (
        f"Combustion of {name} by rules of practice, for {aim.fuel_name}.",
        "Values found by running the module say so. Put in what you know; docs/combustion.md has",
        "the keys. Geometry, firing angles and the other ends of the valves' lifts are in the engine's file.",
    )
    made = Document(f"{name}_combustion", f"Combustion of {aim.engine.title}", lines, _blocks(aim, found))
    return made.text.replace("\nname = ", f'\nmodule = "combustion"\nengine = "{reference}"\nname = ', 1)


def _settings(aim: Aim, found: Found) -> CycleSettings:
    values = {FILE.places[f"{block.name}.{entry.key}"]: entry.si
              for block in _blocks(aim, found) for entry in block.entries}  # fmt: skip
    return cycle_settings(values, aim.engine, "new", "new")


def _fitted_petrol(aim: Aim) -> Found:
    charged = aim.engine.burn.intake_pressure > CHARGED
    found = Found(math.radians(-25.0), aim.engine.burn.intake_pressure if charged else AMBIENT, 0.0)
    for _ in range(ROUNDS):
        settings = _settings(aim, found)
        angle = best_spark(settings, aim.speed)
        cycle = settled_cycle(_settings(aim, found._replace(angle=angle)), aim.speed)
        at = round((angle + 4.0 * math.pi) / STEP) - 1
        pressure, temperature, residual = (
            float(cycle[f"cylinder[1].{key}"][at]) for key in ("pressure", "temperature", "products")
        )
        reached = float(cycle["indicated.pressure_mean"][-1])
        intake = found.intake * (aim.imep / reached if charged else 1.0)
        found = Found(angle, intake, 0.0, pressure, temperature, residual, aim.imep if charged else reached)
    return found


def _fitted_diesel(aim: Aim) -> Found:
    charged = aim.engine.burn.intake_pressure > CHARGED
    found = Found(
        math.radians(-10.0),
        aim.engine.burn.intake_pressure if charged else AMBIENT,
        0.4 * aim.engine.burn.heat / 42.8e6,
    )
    for _ in range(ROUNDS):
        cycle = settled_cycle(_settings(aim, found), aim.speed)
        reached, ratio = float(cycle["indicated.pressure_mean"][-1]), float(cycle["cylinder[1].air_ratio"][-1])
        fuel = found.fuel * aim.imep / reached
        intake = found.intake * (aim.fuel.air / ratio * fuel / found.fuel if charged else 1.0)
        found = found._replace(fuel=fuel, intake=intake, reached=aim.imep)
        motored = settled_cycle(_settings(aim, found._replace(fuel=0.0)), aim.speed)
        limit = PEAK_RATIO * float(motored["cylinder[1].pressure_peak"][-1])
        low, high = EARLIEST, LATEST
        while high - low > math.radians(0.2):
            middle = 0.5 * (low + high)
            cycle = settled_cycle(_settings(aim, found._replace(angle=middle)), aim.speed)
            low, high = (middle, high) if cycle["cylinder[1].pressure_peak"][-1] > limit else (low, middle)
        found = found._replace(angle=0.5 * (low + high))
    return found


def _blocks(aim: Aim, found: Found) -> tuple[Block, ...]:
    own = _petrol if aim.fuel_name == PETROL else _diesel
    return (*own(aim, found), _valves(aim), _manifolds(aim, found), _walls(aim))


def _petrol(aim: Aim, found: Found) -> tuple[Block, ...]:
    _, duration, exponent = aim.fuel.burn
    rule = f"of the charge at this spark {aim.at_speed}, found by running the module"
    return (
        Block("fuel", "Petrol.", (
            chosen("heating_value", 43.0, "MJ/kg", "lower; petrol has 42 to 44"),
            chosen("hydrogen_per_carbon", 1.87, "1", "petrol"),
        )),
        Block("spark", "Initial inputs of the FMU.", (
            derived("angle", round(math.degrees(found.angle), 1), "deg",
                    f"largest torque {aim.at_speed}, found by running the module; knock is not modelled and may ask "
                    "for a later spark"),
            chosen("air_ratio", aim.fuel.air, "1", "lambda; a three-way catalyst wants 1"),
        )),
        Block("burn", "One Wiebe function from the spark; its duration follows speed and charge.", (
            chosen("duration", duration, "deg", "to 99.9 %, of the engine file's cycle: 10 to 90 % in 0.45 of it"),
            chosen("exponent", exponent, "1", "of the engine file's cycle"),
            chosen("fraction", 1.0, "1", "of the fuel; below 1 with a second_duration and second_exponent"),
            chosen("efficiency", 0.98, "1", "warm engines burn 95 to 98 % (Heywood 1988, section 3.5.4)"),
            derived("reference_speed", aim.speed / RPM, "rev/min", "to which the charge at the spark belongs"),
            derived("reference_pressure", 1e-5 * found.pressure, "bar", rule),
            derived("reference_temperature", found.temperature, "K", rule),
            derived("reference_residual", found.residual, "1", rule),
        )),
    )  # fmt: skip


def _diesel(aim: Aim, found: Found) -> tuple[Block, ...]:
    fuel = f"indicated mean effective pressure of {1e-5 * found.reached:.3g} bar {aim.at_speed}, by running the module"
    reference = FITTED_SPEED / aim.stroke / RPM
    return (
        Block("fuel", "Diesel fuel.", (
            chosen("heating_value", 42.8, "MJ/kg", "lower"), chosen("hydrogen_per_carbon", 1.86, "1", "diesel fuel"),
        )),
        Block("injection", "Initial inputs of the FMU.", (
            derived("mass", 1e6 * found.fuel, "mg", fuel),
            derived("start", round(math.degrees(found.angle), 1), "deg",
                    f"peak of {PEAK_RATIO:g} times the compression pressure {aim.at_speed}, found by running"),
        )),
        Block("ignition", "Delay of Assanis et al. 2003.", (
            chosen("factor", 2.4, "ms", "Assanis et al. 2003, pressure in bar"),
            chosen("exponent", 1.02, "1", "Assanis et al. 2003"),
            chosen("temperature", 2100.0, "K", "Assanis et al. 2003"),
            chosen("by_ratio", 0.2, "1", "Assanis et al. 2003"),
        )),
        Block("premixed", "Fraction of Watson, Pilley and Marzouk 1980.", (
            chosen("factor", 0.793, "1", CALIBRATED), chosen("by_ratio", 0.37, "1", "published"),
            chosen("by_delay", 0.26, "1", "published"), chosen("duration", 11.9, "deg", CALIBRATED),
            chosen("exponent", 2.0, "1", "usual"),
        )),
        Block("diffusion", "Woschni and Anisits 1973.", (
            chosen("duration", 117.0, "deg", CALIBRATED), chosen("exponent", 0.504, "1", CALIBRATED),
            chosen("reference_ratio", 0.6, "1", "of the calibration"),
            derived("reference_speed", reference, "rev/min", "mean piston speed of the calibration, 10 m/s"),
        )),
    )  # fmt: skip


def _valves(aim: Aim) -> Block:
    intake, exhaust = (0.36, 0.31) if aim.fuel_name == PETROL else (0.325, 0.305)
    size = "seat; four valves a cylinder"
    return Block("valves", "Two intake and two exhaust valves.", (
        derived("intake_diameter", 1e3 * intake * aim.bore, "mm", f"{intake:g} B, {size}"),
        chosen("intake_count", 2, "1", "usual"),
        chosen("intake_opens", -370.0, "deg", "10 degrees before the dead centre of the gas exchange"),
        derived("intake_lift", 1e3 * 0.28 * intake * aim.bore, "mm", "0.28 of the diameter"),
        derived("exhaust_diameter", 1e3 * exhaust * aim.bore, "mm", f"{exhaust:g} B, {size}"),
        chosen("exhaust_count", 2, "1", "usual"),
        chosen("exhaust_closes", 370.0, "deg", "10 degrees behind the dead centre of the gas exchange"),
        derived("exhaust_lift", 1e3 * 0.28 * exhaust * aim.bore, "mm", "0.28 of the diameter"),
        chosen("curtain", 0.65, "1", "on the curtain; Heywood has 0.6 to 0.7"),
        chosen("port", 0.75, "1", "on the seat's area, which the stem narrows"),
    ))  # fmt: skip


def _manifolds(aim: Aim, found: Found) -> Block:
    charged = found.intake != AMBIENT
    reached = f"{1e-5 * found.reached:.3g} bar indicated {aim.at_speed}"
    if charged and aim.fuel_name != PETROL:
        rule = f"absolute; air for {aim.fuel.air:g} times what the fuel needs, found by running the module"
    else:
        rule = (
            f"absolute; for {reached}, found by running the module" if charged else f"absolute; not charged: {reached}"
        )
    back = (0.9 if aim.fuel_name != PETROL else 1.0) * found.intake if charged else 1.05e5
    return Block("manifolds", "Inputs of the FMU; less intake pressure is part load of a petrol engine.", (
        derived("intake_pressure", 1e-5 * found.intake, "bar", rule),
        derived("exhaust_pressure", 1e-5 * back, "bar",
                "absolute; before the turbine" if charged else "absolute; before the silencer"),
        chosen("exhaust_temperature", 850.0 if aim.fuel_name != PETROL else 1000.0, "K", "of what flows back"),
        chosen("intake_share", 0.0, "1", "no exhaust gas recirculation"),
    ))  # fmt: skip


def _walls(aim: Aim) -> Block:
    return Block("walls", "Woschni's coefficient.", (
        chosen("factor", 1.0, "1", "as published"),
        chosen("swirl", 0.0 if aim.fuel_name == PETROL else 1.0, "1", "circumferential over mean piston speed"),
    ))  # fmt: skip
