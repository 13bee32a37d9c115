"""An FMU of an engine with added bodies: an elastic rod and its piston, to the bit as in a run."""

import json
import math
from dataclasses import replace

import pytest
from coarse_engines import NATIVE, built

from cranktrain.dynamics.model.arrays import Parts
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.additions import BodyTable, ConnectionTable, FrameTable
from cranktrain.engine.connections import Gas, Liner, Spring
from cranktrain.structure.additions import read_added

STEP, STEPS = 2e-4, 60
RUN = """
import json
unit = Unit(sys.argv[1], "mine")
unit.start({"speed": 150.0, "crank.level": "rigid", "bearing.level": "linear"})
unit.run(int(sys.argv[2]), float(sys.argv[3]))
print(json.dumps(dict(zip(unit.outputs, unit.bits()))))
"""


@pytest.fixture(scope="module")
def with_rod(model):
    """The six without block, rod and piston of its last cylinder as bodies."""
    engine, crank = model.engine, model.cranks["rigid"]
    z = float(crank.positions[crank.index("pin[6]"), 2])
    top = engine.crankshaft.throw + engine.rod.length
    frames = tuple(FrameTable(kind, motion=kind, cylinder=6) for kind in ("rod", "piston"))
    rod = BodyTable(
        "rod[6]", "rod", along="y", stations=(0.0, engine.rod.length), areas=(6e-4,), second_moments=(8e-8,),
        interfaces=("big", "small"), y=(0.0, engine.rod.length), z=(z,),
    )  # fmt: skip
    piston = BodyTable(
        "piston[6]", "piston", mass=engine.cylinders.piston_mass, inertia=(2e-3, 2e-3, 2e-3), centre=(0.0, top, z),
        interfaces=("pin",), x=(0.0,), y=(top,), z=(z,),
    )  # fmt: skip
    held = Spring((2e9, 2e9, 1e6), (2e4, 2e4, 1e2), (1e4, 1e4, 0.0), (10.0, 10.0, 0.0))
    along = Spring((0.0, 0.0, 1e6), (0.0, 0.0, 1e2), (1e4, 1e4, 0.0), (10.0, 10.0, 0.0))
    skirt = Liner(
        upper_stiffness=3e7, lower_stiffness=2e7, upper_height=0.02, lower_height=-0.03, upper_damping=1e3,
        lower_damping=1e3, friction=0.05,
    )  # fmt: skip
    pin = "piston[6].pin"
    connections = (
        ConnectionTable("big", "spring", ("crank.pin[6]", "rod[6].big"), spring=held),
        ConnectionTable("small", "spring", (pin, "rod[6].small"), spring=held),
        ConnectionTable("along", "spring", (pin, "ground"), spring=along),
        ConnectionTable("skirt", "liner", (pin, "ground"), liner=skirt),
        ConnectionTable("gas", "gas", (pin, "ground"), gas=Gas(engine.cylinders.bore, 6)),
    )
    engine = replace(engine, name="six_with_rod", frame=frames, body=(rod, piston), connection=connections)
    return model._replace(engine=engine, cranks={"rigid": crank}, added=read_added(engine))


def test_an_fmu_with_a_rod_as_body_gives_the_runs_bits(with_rod, script, tmp_path):
    fmu = built(with_rod, tmp_path, NATIVE)
    found = json.loads(script(RUN, fmu, STEPS, STEP).stdout)
    run = Simulation(
        with_rod.engine, with_rod.cranks["rigid"], Settings(crank="rigid", bearings="linear", block="ground"),
        parts=Parts(bodies=with_rod.added),
    )  # fmt: skip
    run.inputs[0] = 150.0
    run.initialize(0.0)
    for k in range(STEPS):
        run.step(k * STEP + STEP)
    ours = dict(zip(run.output_names, map(float, run.outputs), strict=True))
    names = [name for name in ours if name.startswith(("rod[6]", "piston[6]", "connection[")) or ".torsion" in name]
    assert "connection[gas].force" in names and all(math.isfinite(ours[name]) for name in names)
    assert {name: ours[name].hex() for name in names} == {name: found[name] for name in names}
