"""A combustion of one's own: this file becomes the FMU, see ``own_combustion.py``. Put your model into ``pressure``."""

import ctypes
import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

FIRING = [math.radians(angle) for angle in (0, 480, 240, 600, 120, 360)]  # of cylinders 1 to 6
AREA, RADIUS, ROD, RATIO = 0.25 * math.pi * 0.105**2, 0.06, 0.215, 17.5
CLOSES, HALF = math.radians(-150.0), math.radians(0.5)


class OwnCombustion(Fmi2Slave):
    """Polytropic compression and expansion, and a burn that raises the pressure; six cylinders."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        outputs = ["pressure.angle", "indicated.torque", *(f"cylinder[{c}].pressure" for c in range(1, 7))]
        self.values = {"crank.angle": 0.0, "crank.speed": 200.0, **dict.fromkeys(outputs, 0.0)}
        work = sum(self.pressure(math.radians(k)) * self.growth(math.radians(k)) for k in range(-360, 360))
        self.values["indicated.pressure_mean"] = work * 2.0 * HALF / (2.0 * RADIUS * AREA)
        for k, name in enumerate(self.values):
            access = {"getter": lambda n=name: self.values[n], "setter": lambda v, n=name: self.values.update({n: v})}
            causality = Fmi2Causality.input if k < 2 else Fmi2Causality.output
            self.register_variable(Real(name, causality=causality, **access))

    def volume(self, angle):
        """Volume of a cylinder, m³, at an angle after dead centre, rad."""
        x = RADIUS * math.cos(angle) + math.sqrt(ROD**2 - (RADIUS * math.sin(angle)) ** 2)
        return AREA * (ROD + RADIUS - x + 2.0 * RADIUS / (RATIO - 1.0))

    def growth(self, angle):
        """Its growth over the angle, m³/rad."""
        return (self.volume(angle + HALF) - self.volume(angle - HALF)) / (2.0 * HALF)

    def pressure(self, angle):
        """Pressure of a cylinder, Pa, at an angle after firing dead centre, rad."""
        angle = (angle + 2.0 * math.pi) % (4.0 * math.pi) - 2.0 * math.pi
        burnt = 1.0 - math.exp(-6.9 * max(0.0, (angle + 0.05) / 1.1) ** 1.8)
        closed = 2.6e5 * (self.volume(CLOSES) / self.volume(angle)) ** 1.35 * (1.0 + 1.3 * burnt)
        opened = 0.5 - 0.5 * math.cos(min(max(angle - 2.3, 0.0), 0.8) * math.pi / 0.8)
        return 2.6e5 if angle < CLOSES else (1.0 - opened) * closed + opened * 2.3e5

    def do_step(self, current_time, step_size):
        """Pressures of the end of the step: the angle is turned on by the speed."""
        angle = self.values["pressure.angle"] = self.values["crank.angle"] + self.values["crank.speed"] * step_size
        pressures = [self.pressure(angle - firing) for firing in FIRING]
        self.values |= {f"cylinder[{c}].pressure": p for c, p in enumerate(pressures, start=1)}
        rates = [self.growth(angle - firing) for firing in FIRING]
        self.values["indicated.torque"] = sum((p - 101325.0) * r for p, r in zip(pressures, rates, strict=True))
        return True


ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))  # pythonfmu 0.7 gives one away at each instantiation
