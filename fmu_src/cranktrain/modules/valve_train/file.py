"""Module files of valve trains: tables of values with units and origins, firing angles from the engine's own file.

The angles at which the intake closes and the exhaust opens are in the engine file's table ``[combustion]``, as for the
combustion module. The other two angles are also in the combustion module's file; a test compares the valves of both
modules. :class:`.TrainSettings` lists the table and key of each setting.
"""

from typing import Any

from cranktrain.engine import quantities as q
from cranktrain.engine.model import Engine
from cranktrain.modules.module_file import ModuleFile
from cranktrain.modules.valve_train import quantities
from cranktrain.modules.valve_train.settings import TrainSettings, check_settings


def train_settings(values: dict[str, Any], engine: Engine, name: str, title: str) -> TrainSettings:
    """Settings from a module file's values and an engine; ``InputError`` for contradictory values."""
    engine.refuse_two_strokes("the valve-train module")
    settings = TrainSettings(
        name=name,
        title=title,
        firing_angles=engine.firing_angles,
        intake_closes=engine.burn.intake_closes,
        exhaust_opens=engine.burn.exhaust_opens,
        spring_preload=values["spring_rate"] * values.pop("spring.preset"),
        **values,
    )
    check_settings(settings)
    return settings


FILE = ModuleFile(
    quantities,
    TrainSettings,
    train_settings,
    "modules/valve_train/data/valvetrain_i6.toml",
    {
        "intake": "Intake valves of one cam: where the cam's ramp begins, lift, mass of valves and bridge.",
        "exhaust": "Exhaust valves of one cam: where the cam's ramp ends, lift, mass of valves and bridge.",
        "cam": "Base circle and roller (0 is a flat follower), width, ramp, power of the profile, friction, E*.",
        "train": "Follower, pushrod and rocker at the valve: ratio, mass, stiffness, damping, lash.",
        "spring": "Springs of the valves of one cam: rate, length that is strained on the seat, mass, damping.",
        "seat": "Seats of the valves of one cam: stiffness and damping velocity.",
        "drive": "From crank to camshaft: stiffness at the camshaft, damping speed, radius and backlash.",
        "camshaft": "Inertia with its wheel, drag of its bearings, crank speed that it is made for.",
    },
    {"spring.preset": q.Length},
)
"""Description of a valve-train module file: its TOML tables and their titles."""
load = FILE.load
