"""A rigid rotor on two equal plain bearings, built as the cranktrain that it is.

Rods and pistons weigh nothing; pressures are those of the inputs, ambient until a test sets them.
"""

from dataclasses import replace
from functools import cache

from bodies import rigid_crank

from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.engine.file import load_engine

SPEED, C, NOTHING = 200.0, 4e-5, 1e-7


@cache
def machine():
    engine = load_engine("diesel_i6")
    return replace(
        engine,
        main_bearing=replace(engine.main_bearing, diameter=0.08, width=0.04, clearance=C, relief_depth=0.0),
        crankshaft=replace(engine.crankshaft, throw_angles=(0.0,), main_widths=(0.04, 0.04)),
        cylinders=replace(
            engine.cylinders, pins=(1,), bank_angles=(0.0,), firing_order=(1,), piston_mass=NOTHING
        ),
        rod=replace(engine.rod, big_end_mass=NOTHING, small_end_mass=NOTHING, inertia=NOTHING),
        thrust=replace(engine.thrust, main=1),
    )  # fmt: skip


def rotor(mass, load, speed=SPEED, **choices):
    """Simulation on its films, shaft at ``speed`` (rad/s); ``mass`` (kg) and ``load`` (N) for each of both bearings."""
    body = rigid_crank(machine(), mass=2.0 * mass, inertia=(0.05, 0.05, 0.5), centre=(0.0, 0.0, 0.064))
    settings = Settings(crank="rigid", gas_source="input", gravity=load / mass, **choices)
    simulation = Simulation(machine(), body, settings)
    simulation.inputs[0] = speed
    simulation.initialize()
    return simulation
