"""TOML tables of a measured file, read by ``cranktrain identify``.

[parameters]                             # what is sought; numbers in ``unit``, texts with a unit or "-10 %"
"damper.viscosity" = { low = "40 Pa s", high = "200 Pa s", prior = 0.3 }
"damping.torsional_ratios[1]" = {}       # from a quarter to four times the engine's own value
load = { low = 0.8, high = 1.2 }         # fraction of the full-load burn
"zero.pulley" = { low = "-3 deg", high = "3 deg" }     # where the encoder of a set counts from

[[orders]]                               # as written by ``cranktrain measured --output``
name = "pulley"
file = "orders.csv"
output = "pulley.torsion"
orders = [3, 6, 9]
wheel = true                             # whole orders have a constant of the wheel; false of a laser vibrometer
noise = "0.001 deg"                      # standard deviation; else from the file's bands, else from the residuals

[[torque]]                               # orders of a shaft's torque
file = "torque.csv"
shaft = "flywheel to gearbox"

[[orbit]]                                # of a main journal over the crank angle, at one speed; --method time
file = "orbit.csv"
bearing = "main[3]"
rpm = 2000

[[frequencies]]                          # natural frequency, or critical speed of an order
number = 1
hz = 237
deviation = 0.005

[[decay]]                                # free decay of a mode: damping ratio, logarithmic decrement, or a signal
number = 1
damping_ratio = 0.021
deviation = 0.1

[[modes]]                                # shape of a mode, compared by its MAC
number = 1
shape = { pulley = 1.0, "main[4]" = 0.55, flywheel = -0.2 }
deviation = 0.03

[hold_out]                               # measured, not fitted, predicted with bands
speeds_rpm = [1500, 1900]

[targets.bending_1]                      # frequencies of the cranktrain that bends, by their shapes; ``block`` beside
shape = "bending"
hz = 106
tolerance = 0.02
source = "modal test"

A file of ``[targets]`` alone is a calibration and may have ``[derived]``, see
:mod:`cranktrain_lab.calibration.targets`, whose tables they are. ``of = "mounts"`` in ``[[frequencies]]`` is one of
the six frequencies of the engine as a whole on its mounts.
"""

from typing import Annotated, Literal

from msgspec import field

from cranktrain.core.typed_file import Table, between
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain.results.run_up.run_up import FLYWHEEL, TORSION
from cranktrain_lab.calibration.targets import TargetsTable

TWIST = "twist"
OUTPUTS = (TORSION, FLYWHEEL, TWIST)
"""Outputs of measured orders of rotation."""
LEVELS = ("linear", "harmonic-balance", "time")
NEXT, NONE = "next", "none"
"""Special values for the crank level above the fitted level: the next bending level, or none."""
"""Levels of the model, the cheapest first."""
_Rpm = Annotated[float, between(SLOWEST_RPM, FASTEST_RPM, "rev/min", "speed")]
_Deviation = Annotated[float, between(1e-6, 1.0, "e.g. 0.005 for half a per cent", "1", "1")]
_Number = Annotated[int, between(1, 20, "mode")]
_Amount = float | str


class RangeTable(Table, kw_only=True, rename={"first": "from", "last": "to"}):
    """Range of a set's speeds to use, rev/min."""

    first: _Rpm
    last: _Rpm

    remedy = "speeds have from and to, rev/min"


class _OrdersTable(Table, kw_only=True):
    """Keys that measured orders of rotation and of torque have in common."""

    file: str
    name: str = ""
    orders: list[float] = field(default_factory=list)
    speeds: RangeTable | None = None
    noise: _Amount | None = None
    amplitudes_only: bool = False


class OrdersTable(_OrdersTable, kw_only=True):
    """TOML table of measured orders over speed, with amplitude and phase.

    ``wheel``: True if a toothed wheel or encoder measured the orders, so that whole orders have an unknown constant. By
    default the column of this name in the file decides, or true without the column.
    """

    output: Literal[OUTPUTS] = TORSION  # type: ignore[valid-type]
    wheel: bool | None = None


class TorqueTable(_OrdersTable, kw_only=True):
    """TOML table of measured torque orders of a shaft of the drive line."""

    shaft: str


class OrbitTable(Table, kw_only=True):
    """TOML table of a measured orbit: displacement of a main journal in its bore over the crank angle, at one speed."""

    file: str
    bearing: str
    rpm: _Rpm
    name: str = ""
    columns: list[str] = field(default_factory=list)
    probe_angle: _Amount = 0.0
    centre: Literal["free", "bore"] = "free"
    noise: _Amount | None = None


class FrequencyTable(Table, kw_only=True):
    """TOML table of a measured torsional or mount natural frequency, or of the critical speed of an order."""

    of: Literal["torsion", "mounts"] = "torsion"
    number: _Number = 1
    hz: Annotated[float, between(0.01, 1e5, "Hz", "frequency")] | None = None
    order: Annotated[float, between(0.5, 100.0, "per revolution")] | None = None
    rpm: _Rpm | None = None
    deviation: _Deviation = 0.005
    damper: bool = False
    name: str = ""


class DecayTable(Table, kw_only=True):
    """TOML table of a measured decay of a torsional mode, as a number or as the ``channel`` of a ``file``."""

    number: _Number = 1
    damping_ratio: Annotated[float, between(1e-6, 0.99, "damping ratio", "1", "1")] | None = None
    log_decrement: Annotated[float, between(1e-6, 50.0, "logarithmic decrement", "1", "1")] | None = None
    file: str | None = None
    channel: str | None = None
    deviation: _Deviation = 0.05
    damper: bool = False
    name: str = ""


class ModeTable(Table, kw_only=True):
    """TOML table of a measured torsional mode shape: rotations of pulley, mains and flywheel, in any scale."""

    shape: dict[str, float]
    number: _Number = 1
    deviation: _Deviation = 0.03
    name: str = ""


class SoughtTable(Table, kw_only=True):
    """TOML table of a sought parameter: bounds, start, and relative standard deviation of prior knowledge."""

    low: _Amount | None = None
    high: _Amount | None = None
    start: _Amount | None = None
    prior: Annotated[float, between(1e-4, 10.0, "of its start", "1", "1")] | None = None
    unit: str = "1"
    note: str = ""


class HoldOutTable(Table, kw_only=True):
    """TOML table of measured speeds that are predicted and not fitted."""

    speeds_rpm: list[_Rpm]

    remedy = "[hold_out] has speeds_rpm, a list"


class MeasuredTable(TargetsTable, kw_only=True):
    """Whole measured file: measured data of an engine and the parameters sought from them."""

    parameters: dict[str, SoughtTable] = field(default_factory=dict)  # type: ignore[assignment]
    orders: list[OrdersTable] = field(default_factory=list)
    torque: list[TorqueTable] = field(default_factory=list)
    orbit: list[OrbitTable] = field(default_factory=list)
    frequencies: list[FrequencyTable] = field(default_factory=list)
    decay: list[DecayTable] = field(default_factory=list)
    modes: list[ModeTable] = field(default_factory=list)
    hold_out: HoldOutTable | None = None
    load: Annotated[float, between(0.0, 2.0, "of the full-load burn", "1", "1")] = 1.0
    damper: bool | None = None
    inherit: bool = True
    title: str = ""

    @property
    def has_sets(self) -> bool:
        """True if there is a data set other than targets."""
        return bool(self.orders or self.torque or self.orbit or self.frequencies or self.decay or self.modes)
