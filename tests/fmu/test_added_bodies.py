"""FMUs of engines with added bodies, to the bit as in a run: elastic rods, and a shaft on all laws of the engine."""

import json
import math
from dataclasses import fields, replace

import pytest
from coarse_engines import NATIVE, built
from scripts import example
from tests.film_tables import RATIO, coarse_table

from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Parts, Simulation
from cranktrain.engine.additions import BodyTable, ConnectionTable, FrameTable
from cranktrain.engine.connections import Film, Load, RingDamper, Roller, SlidingJoint, Spring, Thrust
from cranktrain.fmu.flat import FlatModel
from cranktrain.structure.additions import read_added
from cranktrain.structure.assembly import running_crank

STEP, STEPS = 2e-4, 60
RUN = """
import json
unit = Unit(sys.argv[1], "mine")
unit.start({"speed": 150.0, "crank.level": "rigid", "bearing.level": "linear"})
unit.run(int(sys.argv[2]), float(sys.argv[3]))
print(json.dumps(dict(zip(unit.outputs, unit.bits()))))
"""


@pytest.fixture(scope="module")
def with_rods():
    """The four of the example: rods between films, and pistons on their skirts under gas, are bodies."""
    module = example("elastic_rod")
    engine = module.engine_with(module.RODS)
    return FlatModel(engine, {"rigid": running_crank(engine, "rigid")}, added=read_added(engine))


def outputs_of_a_run(model, bearings, parts):
    """Outputs by name after the steps that the FMU takes."""
    settings = Settings(crank="rigid", bearings=bearings, block="ground")
    run = Simulation(model.engine, model.cranks["rigid"], settings, parts=parts)
    run.inputs[0] = 150.0
    run.initialize(0.0)
    for k in range(STEPS):
        run.step(k * STEP + STEP)
    return dict(zip(run.output_names, map(float, run.outputs), strict=True))


def test_an_fmu_with_rods_as_bodies_gives_the_runs_bits(with_rods, script, tmp_path):
    found = json.loads(script(RUN, built(with_rods, tmp_path, NATIVE), STEPS, STEP).stdout)
    ours = outputs_of_a_run(with_rods, "linear", Parts(bodies=with_rods.added))
    names = [name for name in ours if name.startswith(("rod[", "piston[", "connection[")) or ".torsion" in name]
    assert "connection[gas_4].force" in names and all(math.isfinite(ours[name]) for name in names)
    assert {name: ours[name].hex() for name in names} == {name: found[name] for name in names}


RESTORED = """
import json
unit = Unit(sys.argv[1], "mine")
unit.start({"speed": 150.0, "crank.level": "rigid", "bearing.level": "impedance"})
steps, h = int(sys.argv[2]), float(sys.argv[3])
unit.run(steps // 2, h)
state = unit.fmu.getFMUstate()
found = []
for again in range(2):
    unit.fmu.setFMUstate(state)
    unit.run(steps - steps // 2, h, steps // 2)
    found.append(dict(zip(unit.outputs, unit.bits())))
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def with_shaft(model):
    """The six and beside it a shaft, with a ring and a sleeve, on every law that the engine uses itself."""
    engine, crank = model.engine, model.cranks["rigid"]
    x, names, z = 0.35, ("front", "middle", "rear", "end"), (-0.1, 0.0, 0.1, 0.2)
    frame = FrameTable("backwards", -2.0, (x, 0.0))

    def body(name, mass, inertia, interfaces, places):
        count = len(interfaces)
        return BodyTable(
            name, "backwards", mass=mass, inertia=(inertia, inertia, inertia), centre=(x, 0.0, 0.0),
            interfaces=interfaces, x=(x,) * count, y=(0.0,) * count, z=places,
        )  # fmt: skip

    bodies = body("shaft", 4.0, 0.02, names, z), body("ring", 3.0, 0.01, ("hub",), (0.0,)), body(
        "sleeve", 2.0, 0.01, ("hub",), (0.0,))  # fmt: skip
    film = {"contact_height": 1e-6, "contact_pressure": 3e8, "viscosity": 0.01}
    rollers = Roller(
        rollers=9, roller_diameter=6e-3, roller_length=8e-3, pitch_diameter=31e-3, clearance=1e-5, stiffness=1e8,
        tilt_stiffness=1e3, damping=2e3, tilt_damping=1.0, variable=True,
    )  # fmt: skip
    collar = Thrust(
        clearance=2e-4, inner_diameter=0.03, outer_diameter=0.05, pads=4, pad_fraction=0.8, taper=2e-5,
        contact_height=2e-6, contact_stiffness=1e9, damping=1e4, collar="tilting",
    )  # fmt: skip
    damper = {entry.name: getattr(engine.damper, entry.name) for entry in fields(engine.damper)}
    damper = {entry.name: damper[entry.name] for entry in fields(RingDamper) if entry.name != "fluid"}
    spline = SlidingJoint(
        joint="spline", joint_stiffness=1e7, joint_damping=1e3, turning_stiffness=1e4, turning_damping=10.0,
        spline_radius=0.02, friction=0.1,
    )  # fmt: skip
    held = Spring((1e8, 1e8, 1e6), (1e4, 1e4, 1e2), (1e4, 1e4, 0.0), (10.0, 10.0, 0.0))
    push = Load((0.0, 900.0, 200.0), (0.0, 0.0, 20.0), 3.0)
    remembered = Film(diameter=0.03, width=0.015, clearance=2e-5, level="ehd", bore="rigid", **film)
    tabled = Film(
        diameter=0.04, width=0.04 * RATIO, clearance=4e-5, relief_depth=6e-6, roughness=4e-7, level="table", **film
    )
    connections = (
        ConnectionTable("rollers", "roller", ("shaft.front", "ground"), roller=rollers),
        ConnectionTable("collar", "thrust", ("shaft.middle", "ground"), thrust=collar),
        ConnectionTable("remembered", "film", ("shaft.rear", "ground"), film=remembered),
        ConnectionTable("tabled", "film", ("shaft.end", "ground"), film=tabled),
        ConnectionTable("damper", "damper", ("shaft.middle", "ring.hub"), damper=RingDamper(**damper)),
        ConnectionTable("ring", "spring", ("ring.hub", "ground"), spring=held),
        ConnectionTable("spline", "axial_joint", ("shaft.middle", "sleeve.hub"), axial_joint=spline),
        ConnectionTable("sleeve", "spring", ("sleeve.hub", "ground"), spring=held),
        ConnectionTable("push", "load", ("shaft.middle", "ground"), load=push),
    )
    engine = replace(engine, name="six_with_shaft", frame=(frame,), body=bodies, connection=connections)
    return model._replace(engine=engine, cranks={"rigid": crank}, film_tables=(coarse_table(),))


def test_an_fmu_with_the_engines_laws_on_a_shaft_gives_the_runs_bits(with_shaft, script, tmp_path):
    """What connections remember is part of the unit's state as well."""
    fmu = built(with_shaft, tmp_path, NATIVE)
    first, second = json.loads(script(RESTORED, fmu, STEPS, STEP).stdout)
    ours = outputs_of_a_run(with_shaft, "impedance", Parts(film_tables=with_shaft.film_tables))
    names = [name for name in ours if name.startswith(("shaft.s", "shaft.p", "ring", "sleeve", "connection["))]
    moving = ("rollers].force.x", "collar].moment.x", "remembered].oil_flow", "tabled].force.y", "damper].heat")
    assert all(abs(ours[f"connection[{name}"]) > 0.0 for name in (*moving, "spline].force.z"))
    assert all(math.isfinite(ours[name]) for name in names)
    assert {name: ours[name].hex() for name in names} == {name: first[name] for name in names}
    assert first == second
