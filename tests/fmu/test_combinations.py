"""Levels of detail in the FMU: each allowed combination runs as the native simulation does, each other is refused."""

import json
import math
from itertools import product

import numpy as np
import pytest
from coarse_engines import NATIVE, built, coarse, is_native
from some import some

from cranktrain.dynamics.simulation import Parts, Settings, Simulation
from cranktrain.engine.levels import CRANKS
from cranktrain.film.laws.ehd import SHAPES
from cranktrain.film.table.database import bearing_settings
from cranktrain.store.film_tables import film_table
from cranktrain.structure.assembly import assemble
from cranktrain.structure.block.saddle import bore_compliance
from cranktrain.structure.rod.eye import eye_compliance

PARAMETERS = {
    "crank": "crank.level",
    "bearings": "bearing.level",
    "big_ends": "big_end.level",
    "block": "block.level",
    "pistons": "piston.level",
    "damper": "damper.level",
    "boundary": "shaft.boundary",
    "gas_source": "gas.source",
    "film_temperature": "film.temperature",
    "control": "solver.control",
    "integrator": "solver.integrator",
}
BEARINGS = {"diesel_i6": ("impedance", "linear"), "diesel_v8": ("roller", "linear")}
SURROUNDINGS = (("ground", "rigid"), ("ground", "guided"), ("flexible", "guided"))
"""Block and pistons; rigid pistons in a flexible block are refused."""
DAMPERS, BOUNDARIES = ("none", "fitted"), ("speed", "torque")
RICHEST = {"big_ends": "impedance", "block": "flexible", "pistons": "guided", "damper": "fitted", "boundary": "torque"}
STEPS, STEP = 30, 1e-4

FMU_RUN = """
import json
steps, h = json.loads(sys.argv[3])
folder, rows = None, []
for parameters in json.loads(sys.argv[2]):
    unit = Unit(sys.argv[1], extracted=folder)
    folder = unit.folder
    unit.start({"speed": 150.0, **parameters})
    unit.run(steps // 2, h)
    unit.set(speed=152.0)
    unit.set_named("shaft.load_torque", 800.0)
    if parameters.get("gas.source") == "input":
        for i, pressure in enumerate(json.loads(sys.argv[4])):
            unit.set_named(f"cylinder[{i + 1}].pressure", pressure)
    unit.run(steps // 2, h, steps // 2)
    rows.append(unit.bits())
    unit.close()
print(json.dumps(rows))
"""


def combination(name, row):
    around, bearings, damper, boundary = row
    block, pistons = SURROUNDINGS[around]
    return {
        "bearings": BEARINGS[name][bearings],
        "block": block,
        "pistons": pistons,
        "damper": DAMPERS[damper],
        "boundary": BOUNDARIES[boundary],
    }


def as_parameters(settings):
    return {PARAMETERS[key]: value for key, value in settings.items()}


def pressures(engine):
    """Another pressure in each cylinder, Pa."""
    return [2e5 + 1e5 * i for i in range(engine.n_cylinders)]


def native_run(model, settings):
    """All outputs by name, exactly, after the steps that ``FMU_RUN`` takes."""
    damped = settings.get("damper") == "fitted"
    flexible = settings.get("block") == "flexible"
    bore = model.block_bore if flexible else model.bore
    parts = Parts(model.table, bore, model.big_end_table, model.block, big_end_bore=model.big_end_bore)
    simulation = Simulation(
        model.engine,
        (model.damped if damped else model.cranks)[settings.get("crank", "solid")],
        Settings(**settings),
        parts=parts,
    )
    simulation.inputs[0] = 150.0
    simulation.initialize(0.0)
    for i in range(STEPS):
        if i == STEPS // 2:
            simulation.inputs[0], simulation.load_torque = 152.0, 800.0
            if settings.get("gas_source") == "input":
                simulation.pressures[:] = pressures(model.engine)
        simulation.step(i * STEP + STEP)
    return dict(zip(simulation.output_names, map(float, simulation.outputs), strict=True))


def check_parity(model, fmu, script, combinations):
    """FMU and native run of each combination agree to the bit; returns the native outputs."""
    chosen = [as_parameters(c) for c in combinations]
    done = script(FMU_RUN, fmu, *map(json.dumps, (chosen, [STEPS, STEP], pressures(model.engine))))
    runs = []
    for settings, bits in zip(combinations, json.loads(done.stdout), strict=True):
        native = native_run(model, settings)
        assert [value.hex() for value in native.values()] == bits, settings
        assert all(map(math.isfinite, native.values())), settings
        runs.append(native)
    return runs


def test_every_combination_of_levels_runs_as_natively(whole, each_fmu, script):
    rows = product(range(3), range(2), range(2), range(2))
    combinations = [combination(whole.engine.name, row) for row in rows]
    runs = check_parity(whole, each_fmu, script, combinations)
    for settings, run in zip(combinations, runs, strict=True):
        # What a level adds shows, and what is absent is 0.
        assert (run["mount[1].force.y"] != 0.0) == (settings["block"] == "flexible")
        assert (run["cover.acceleration"] != 0.0) == (settings["block"] == "flexible")
        assert (run["piston[1].lateral"] != 0.0) == (settings["pistons"] == "guided")
        assert (run["damper.heat"] != 0.0) == (settings["damper"] == "fitted")
    assert len({run["pulley.torsion"] for run in runs}) == len(combinations)


def test_every_crank_level_runs_as_simulate_does(whole, each_fmu, script):
    """A level is made by the one assembly, so that the FMU's crank is that of the command line, with damper or not."""
    engine = whole.engine
    combinations = [{"crank": level, "damper": damper} for level in CRANKS for damper in DAMPERS]
    combinations.append({"crank": "rigid", "bearings": "held"})
    for settings in some(combinations):
        made = assemble(engine, Settings(**settings, block="ground"))
        carried = (whole.damped if settings.get("damper") == "fitted" else whole.cranks)[settings["crank"]]
        for name in ("omega", "shapes", "inertia"):
            assert np.array_equal(getattr(made.body, name), getattr(carried, name)), settings
    check_parity(whole, each_fmu, script, combinations)


def test_further_levels_run_as_natively_in_the_whole_engine(whole, each_fmu, script):
    combinations = [
        RICHEST,
        {**RICHEST, "gas_source": "input"},
        {**RICHEST, "control": "adaptive", "integrator": "esdirk3"},
        {**RICHEST, "crank": "rigid", "big_ends": "rigid"},
        {**RICHEST, "integrator": "generalised-alpha"},
        {**RICHEST, "integrator": "bdf2"},
    ]
    runs = check_parity(whole, each_fmu, script, combinations)
    assert [run["big_end[1].eccentricity"] != 0.0 for run in runs] == [True, True, True, False, True, True]
    assert len({run["pulley.torsion"] for run in runs}) == len(runs)


def test_films_of_their_own_temperatures_run_as_natively(whole, each_fmu, script):
    """The initialization finds the temperatures that ``simulate`` finds, and so does a restored state's."""
    if whole.engine.main_roller is not None:
        pytest.skip("rollers have no film")
    if is_native(each_fmu):
        pytest.skip("a native FMU refuses it, see below")
    warm = {"crank": "rigid", "film_temperature": "heat-balance"}
    warm_run, plain = check_parity(whole, each_fmu, script, [warm, {"crank": "rigid"}])
    assert warm_run["bearing[4].friction_torque"] < 0.95 * plain["bearing[4].friction_torque"]
    script(
        """
import json
unit = Unit(sys.argv[1]).start({"speed": 150.0, **json.loads(sys.argv[2])}).run(5)
state = unit.fmu.getFMUstate()
later = unit.run(5, first=5).bits()
unit.fmu.reset()
unit.fmu.setFMUstate(state)
assert unit.run(5, first=5).bits() == later
""",
        each_fmu, json.dumps(as_parameters(warm)),
    )  # fmt: skip


def test_state_of_the_whole_engine_is_restored_to_the_bit(each_fmu, script, tmp_path):
    """Back in the same instance, and in another process at other levels; the start's inputs count for temperatures."""
    write = """
import json
unit = Unit(sys.argv[1]).start({"speed": 150.0, "gas.load": 0.5, **json.loads(sys.argv[2])}).run(10)
unit.set(speed=160.0)
unit.set_named("shaft.load_torque", -300.0)
unit.run(10, first=10)
state = unit.fmu.getFMUstate()
before = unit.bits()
later = unit.run(20, first=20).bits()
unit.fmu.setFMUstate(state)
assert unit.bits() == before and unit.get("shaft.load_torque") == [-300.0]
assert unit.run(20, first=20).bits() == later
open(sys.argv[3], "wb").write(unit.fmu.serializeFMUstate(state))
print(later)
unit.fmu.reset()
unit.fmu.setFMUstate(state)
assert unit.run(20, first=20).bits() == later
"""
    read = """
unit = Unit(sys.argv[1]).start({"block.level": "ground", "damper.level": "none"}).run(5)
unit.fmu.setFMUstate(unit.fmu.deSerializeFMUstate(open(sys.argv[2], "rb").read()))
assert unit.get("block.level", "damper.level") == [b"flexible", b"fitted"]
print(unit.run(20, first=20).bits())
"""
    file = tmp_path / "state"
    written = script(write, each_fmu, json.dumps(as_parameters(RICHEST)), file)
    assert written.stdout == script(read, each_fmu, file).stdout


REFUSED = [
    ({"crank.level": "beem"}, "'crank.level' is 'beem'; valid: rigid, torsional, beam, solid"),
    ({"bearing.level": "held"}, "locks the axis of a crank that cannot bend, not of crank level 'solid'"),
    ({"crank.level": "torsional", "block.level": "flexible"}, "'held' does not meet a flexible block"),
    ({"block.level": "flexible", "piston.level": "rigid"}, "cannot follow a flexible block"),
    ({"block.level": "flexibel"}, "'block.level' is 'flexibel'; valid: auto, ground, flexible"),
    ({"piston.level": "loose"}, "'piston.level' is 'loose'; valid: auto, rigid, guided"),
    ({"damper.level": "yes"}, "'damper.level' is 'yes'; valid: none, fitted"),
    ({"shaft.boundary": "free"}, "'shaft.boundary' is 'free'; valid: speed, torque"),
    ({"bearing.level": "rollers"}, "'bearing.level' is 'rollers'; valid: auto, held, linear"),
    ({"damper.level": "fitted", "damper.oil_temperature": 550.0}, "150 degC"),
    ({"shaft.load_torque": math.inf}, "'shaft.load_torque' is inf"),
]
NATIVE_WORDS = {
    "150 degC": "the damper's temperature lies outside the range of its law",
    **dict.fromkeys(
        (
            "bearing level 'linear' has no oil",
            "bearing level 'roller' has no oil",
            "needs a start at 20 rev/min or more, got 9.5",
        ),
        "which needs runs before the start",
    ),
}
"""What a native FMU says in place of these words."""
REFUSED_BY_MAINS = {
    "diesel_i6": [
        ({"bearing.level": "roller"}, "needs [main_roller], but the mains of engine 'diesel_i6' are plain"),
        ({"film.temperature": "heat-balance", "bearing.level": "linear"}, "bearing level 'linear' has no oil"),
        ({"film.temperature": "heat-balance", "speed": 1.0}, "needs a start at 20 rev/min or more, got 9.5"),
    ],
    "diesel_v8": [
        ({"film.temperature": "heat-balance"}, "bearing level 'roller' has no oil"),
        *(
            ({"bearing.level": level}, "needs oil films, but the mains of engine 'diesel_v8' are rollers")
            for level in ("impedance", "table", "reynolds", "ehd")
        ),
    ],
}


def test_what_makes_no_sense_is_refused_with_its_reason(whole, each_fmu, script):
    refused = REFUSED + REFUSED_BY_MAINS[whole.engine.name]
    native = is_native(each_fmu)
    if native:
        refused = [(given, NATIVE_WORDS.get(words, words)) for given, words in refused]
    done = script(
        """
import json
folder = None
for parameters, words in json.loads(sys.argv[2]):
    unit = Unit(sys.argv[1], extracted=folder)
    folder = unit.folder
    status, text = unit.refusal(lambda: unit.start(parameters))
    assert status > 2 and words in text and len(text.splitlines()) <= 2, (parameters, status, text)
    # The instance is not lost.
    unit.fmu.reset()
    unit.start().run(1).close()
""",
        each_fmu,
        json.dumps(refused),
    )
    if native:
        return  # it tells the host's log alone
    lines = done.stderr.splitlines()
    assert len(lines) == len(refused)
    assert all(words in line for line, (_, words) in zip(lines, refused, strict=True))


def coarse_table(bearing, tilt):
    return film_table(bearing_settings(bearing, "coarse", tilt))[0]


@pytest.mark.slow
def test_films_with_tilt_run_as_natively(tmp_path, script):
    """Level ehd takes the bore that belongs to its surroundings: on ground one that moves as a whole."""
    model = coarse("diesel_i6")
    engine = model.engine
    moving, fixed = (bore_compliance(engine, SHAPES, with_motion=moves) for moves in (True, False))
    model = model._replace(
        bore=moving,
        block_bore=fixed,
        table=coarse_table(engine.main_bearing, tilt=True),
        big_end_table=coarse_table(engine.big_end_bearing, tilt=False),
        big_end_bore=eye_compliance(engine),
    )
    combinations = [
        {"bearings": bearings, "big_ends": big_ends, "block": block, "damper": "fitted"}
        for bearings, big_ends in (("ehd", "rigid"), ("table", "table"), ("reynolds", "impedance"))
        for block in ("ground", "flexible")
    ]
    # How far elastic films are solved follows the integrator, which may be chosen at the start.
    combinations.append({"bearings": "ehd", "integrator": "sdirk3"})
    combinations += [{"bearings": bearings, "big_ends": "ehd"} for bearings in ("table", "ehd")]
    for platforms in ((), NATIVE):
        fmu = built(model, tmp_path / str(len(platforms)), platforms)
        runs = check_parity(model, fmu, script, combinations)
    assert all(run["bearing[4].tilt"] != 0.0 and run["bearing[4].moment.x"] != 0.0 for run in runs)
