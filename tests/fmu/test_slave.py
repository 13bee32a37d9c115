"""What a host meets: the built FMU, driven in a process of its own. One test per trap of the wrapping library."""

import math
import shutil

import pytest

from cranktrain.core.machine_code import OFF
from cranktrain.fmu import engine_fmu, running_code

FOREIGN = ("h5py", "scipy", "skfem", "matplotlib", "netgen", "meshio", "rich", "cranktrain")


def test_runs_with_numpy_and_numba_only(whole_fmu, script):
    run = "unit = Unit(sys.argv[1]).start().run(50)\nprint(unit.get('crank.angle')[0])\nunit.close()"
    done = script(f"blocked(*{FOREIGN})\n{run}", whole_fmu)
    # the frame's angle follows the crank's mean wind-up, some milliradians
    assert float(done.stdout) == pytest.approx(50e-4 * 2000 / 60 * 2 * math.pi, abs=5e-3)


def test_two_fmus_in_one_process_run_their_own_code(fmu, model, script, tmp_path, monkeypatch):
    sources = tmp_path / "fmu_src"
    shutil.copytree(running_code.SOURCES, sources, ignore=shutil.ignore_patterns("__pycache__"))
    errors = sources / "cranktrain" / "core" / "errors.py"
    errors.write_text(errors.read_text().replace("did you mean", "did the author mean"))
    monkeypatch.setattr(running_code, "SOURCES", sources)
    other = engine_fmu.build(model, tmp_path / "dist", print)
    script(
        """
for i, words in ((1, "did you mean"), (2, "did the author mean"), (1, "did you mean")):
    unit = Unit(sys.argv[i])
    unit.refuses(lambda: unit.start({"solver.integrator": "sdirk44"}), words)
""",
        fmu,
        other,
    )


@pytest.mark.slow
def test_second_start_compiles_nothing(fmu, script, cache):
    """Where no machine code came with the FMU, which else compiles nothing at all."""
    run = "Unit(sys.argv[1]).start({'crank.level': 'rigid', 'bearing.level': 'linear'}).run(1).close()"
    script(run, fmu, **{OFF: "1"})
    compiled = {path: path.stat().st_mtime_ns for path in cache.rglob("*.nb?")}
    assert compiled
    script(run, fmu, **{OFF: "1"})
    assert {path: path.stat().st_mtime_ns for path in cache.rglob("*.nb?")} == compiled


def test_changed_copy_in_the_cache_is_repaired(fmu, script, tmp_path):
    # a refused parameter loads the package and compiles nothing
    run = """
unit = Unit(sys.argv[1])
unit.refuses(lambda: unit.start({"solver.integrator": "sdirk44"}), "did you mean")
"""
    script(run, fmu, cache=tmp_path)
    copy = next(tmp_path.glob("fmu/cranktrain_*/core/errors.py"))
    whole, stamp = copy.read_bytes(), copy.with_name("kernel.py").stat().st_mtime_ns
    copy.write_bytes(b"raise SystemExit")
    script(run, fmu, cache=tmp_path)
    assert copy.read_bytes() == whole
    assert copy.with_name("kernel.py").stat().st_mtime_ns == stamp  # what is whole is left alone


@pytest.mark.slow
def test_runs_without_a_cache(fmu, script, tmp_path):
    """As in a read-only account: code runs from the extraction folder, kernels are compiled and not kept."""
    occupied = tmp_path / "file"
    occupied.write_text("")
    script("Unit(sys.argv[1]).start().run(1).close()", fmu, cache=occupied)


def test_foreign_and_damaged_states_are_refused(fmu, script):
    script(
        """
unit = Unit(sys.argv[1]).start().run(3)
whole = unit.fmu.serializeFMUstate(unit.fmu.getFMUstate())
before = unit.bits()
for data, word in ((b"x" * 500, "not one of cranktrain"),
                   (whole[:12] + b"0" * 64 + whole[76:], "another build"),
                   (whole[:-9] + b"?" + whole[-8:], "damaged")):
    state = unit.fmu.deSerializeFMUstate(data)
    unit.refuses(lambda: unit.fmu.setFMUstate(state), word)
assert unit.bits() == before

# A checksum that is right tells nothing of the numbers: reals come behind the head, the motion at the end.
import struct, zlib
HEAD = struct.calcsize("<8sI64sIdII")
def mended(place, value):
    packed = struct.pack("<I" if isinstance(value, int) else "<d", value)
    content = whole[:place] + packed + whole[place + len(packed) : -4]
    return content + struct.pack("<I", zlib.crc32(content))
LAST, PHASE, TIME = len(whole) - 12, 76, 80
wrong = (math.nan, LAST), (1.01e15, LAST), (math.inf, LAST - 8), (4, PHASE), (1.01e7, TIME), (-1.01e7, TIME)
for value, place in wrong:
    state = unit.fmu.deSerializeFMUstate(mended(place, value))
    status, text = unit.refusal(lambda: unit.fmu.setFMUstate(state))
    words = "its motion" if place >= LAST - 8 else "its phase or its time"
    assert status > 2 and f"not one of a run: {words} cannot be" in text, (status, text)
for state in (mended(LAST, 1e10), mended(TIME, 9.9e6), whole):  # the pressure of a film, and after the latest start
    unit.fmu.setFMUstate(unit.fmu.deSerializeFMUstate(state))
state = unit.fmu.deSerializeFMUstate(mended(HEAD, 1e9))
unit.refuses(lambda: unit.fmu.setFMUstate(state), "cannot be", "= 1000000000.0")
assert unit.bits() == before
unit.run(1, first=3)
""",
        fmu,
    )


LIVES = {
    "a reset starts it anew": """
unit = Unit(sys.argv[1]).start()
first = unit.run(20).bits()
unit.set(speed=100.0)
unit.run(20, first=20)
unit.fmu.reset()
assert unit.start().run(20).bits() == first
""",
    "many refusals cost no references": """
unit = Unit(sys.argv[1]).start().run(1)
for i in range(300):
    unit.refusal(lambda: unit.set(speed=NAN))
unit.run(1, first=1)
unit.fmu.reset()
unit.start().run(1)
unit.close()
""",
    # The frame turns by the input; the crank's own speed swings about it, the less the faster it is.
    "outputs can be asked for in initialization mode": """
unit = Unit(sys.argv[1])
names = "frame.speed", "crank.speed"
unit.fmu.setupExperiment(startTime=0.0)
unit.fmu.enterInitializationMode()
unit.set(speed=100.0)
slow = unit.get(*names)
unit.set(speed=200.0)
fast = unit.get(*names)
unit.fmu.exitInitializationMode()
assert (slow[0], fast[0]) == (100.0, 200.0) and unit.get(*names) == fast
assert 0.0 < abs(fast[1] / 200.0 - 1.0) < abs(slow[1] / 100.0 - 1.0) < 0.1
""",
    "its clock may be that of single numbers, or differ by a thousandth of a step": """
for start, off in ((0.0, 1e-7), (1000.0, 1e-3)):
    unit = Unit(sys.argv[1]).start({'crank.level': 'rigid', 'bearing.level': 'linear'}, time=start)
    now = start + 0.9 * off
    unit.fmu.doStep(now, 1e-4)
    for away in (-1.2 * off, 1.2 * off):
        unit.refuses(lambda: unit.fmu.doStep(now + 1e-4 + away, 1e-4), "but the model stands at")
    unit.close()
""",
    "a start may be twelve days early or late": """
for time in (1e6, -1e6):
    unit = Unit(sys.argv[1])
    unit.refuses(lambda: unit.fmu.setupExperiment(startTime=1.01 * time), "at most 1e+06")
    unit.fmu.setupExperiment(startTime=time)
""",
    # The empty dependencies are the truth: between steps no output answers to an input.
    "outputs follow inputs only from the next step": """
unit = Unit(sys.argv[1]).start().run(3)
before = unit.bits()
unit.set(speed=50.0)
unit.set_named("cylinder[1].pressure", 5e6)
assert unit.bits() == before
assert unit.run(1, first=3).bits() != before
""",
}


@pytest.mark.parametrize("life", LIVES.values(), ids=list(LIVES))
def test_what_a_host_may_rely_on(fmu, script, life):
    script(life, fmu)


ACTIONS = [
    ("unit.set(speed=NAN)", "'speed' is nan"),
    ("unit.set(speed=-1.0)", "'speed' is -1"),
    ("unit.set(speed=math.inf)", "'speed' is inf"),
    ("unit.set(speed=1e6)", "between 0 and 2000"),
    ("unit.set_named('cylinder[2].pressure', NAN)", "'cylinder[2].pressure' is nan"),
    ("unit.set_named('cylinder[6].pressure', -5.0)", "'cylinder[6].pressure' is -5"),
    ("unit.fmu.doStep(3e-4, 0.0)", "communication step of 0.0 s"),
    ("unit.fmu.doStep(3e-4, -1e-4)", "communication step of -0.0001 s"),
    ("unit.fmu.doStep(3e-4, NAN)", "communication step of nan s"),
    ("unit.fmu.doStep(3e-4, 1e4)", "communication step of 10000 s"),
    ("unit.set_named('gas.load', 0.5)", "'gas.load' is fixed after initialization"),
    ("unit.set_named('gas.source', 'builtin')", "'gas.source' is fixed after initialization"),
    ("unit.set_named('crank.angle', 0.5)", "'crank.angle' is an output"),
    ("unit.fmu.getReal([100000])", "value reference 100000 is unknown"),
    ("unit.fmu.getInteger([0])", "value reference 0 is 'speed', no Integer"),
    ("unit.fmu.setBoolean([0], [True])", "no Boolean"),
]


def test_every_refusal_explains_itself_and_keeps_the_state(fmu, script):
    done = script(
        f"""
unit = Unit(sys.argv[1], "crank 100%").start().run(3)
before = unit.bits()
for action, words in {ACTIONS!r}:
    status, text = unit.refusal(lambda: eval(action))
    assert status > 2, (action, status)  # 2 is Discard, which fmpy takes for an early end
    assert words in text and "crank 100%" in text and "%%" not in text, (action, text)
    assert unit.bits() == before, action
assert float.fromhex(unit.run(1, first=3).bits()[0]) > float.fromhex(before[0])
unit.close()
""",
        fmu,
    )
    for action, words in ACTIONS:
        assert words in done.stderr, action  # the log is often off: the text is on stderr too
    assert all(line.startswith("cranktrain: crank 100%: ") for line in done.stderr.splitlines())


def test_lost_film_is_reported_and_the_state_stays_at_the_last_good_time(fmu, script):
    done = script(
        """
unit = Unit(sys.argv[1]).start().run(3)
before, state = unit.bits(), unit.fmu.serializeFMUstate(unit.fmu.getFMUstate())
unit.set_named("cylinder[3].pressure", 1e12)
unit.refuses(lambda: unit.fmu.doStep(3e-4, 1e-4), "film of main[", "solver.step")
assert unit.bits() == before
unit.set_named("cylinder[3].pressure", 101325.0)
assert unit.fmu.serializeFMUstate(unit.fmu.getFMUstate()) == state
unit.run(1, first=3)
""",
        fmu,
    )
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("parameter", "value", "words"),
    [
        ("bearing.level", "'ehs'", "valid: auto, held, linear, impedance"),
        ("bearing.level", "'ehd'", "built without the elastic bore"),
        ("bearing.level", "'table'", "built without the film table of the main bearings"),
        ("big_end.level", "'table'", "built without the film table of the big ends"),
        ("block.level", "'flexible'", "built without the reduced block"),
        ("damper.level", "'fitted'", "built without the crankshaft with the damper's housing"),
        ("solver.integrator", "'euler'", "euler"),
        ("gas.load", "-1.0", "'gas.load' is -1"),
    ],
)
def test_wrong_parameters_are_refused_at_initialization(fmu, script, parameter, value, words):
    script(
        f"""
unit = Unit(sys.argv[1])
unit.refuses(lambda: unit.start({{{parameter!r}: {value}}}), {words!r})
""",
        fmu,
    )


def test_coarse_steps_are_warned_of_once(fmu, script):
    done = script("Unit(sys.argv[1]).start().run(3, h=5e-4).close()", fmu)
    assert done.stderr.count("warning") == 1
    assert "6.0 degrees" in done.stderr and "--output-interval 8.3e-05" in done.stderr
    for step, count in (("2.5e-4", 0), ("2.53e-4", 1)):  # from three degrees on
        assert script(f"Unit(sys.argv[1]).start().run(3, h={step}).close()", fmu).stderr.count("warning") == count


def test_pressures_that_stay_at_their_start_leave_the_gas_built_in(fmu, script, tmp_path):
    """A file with the start value, even rounded by a master's interpolation, is no pressure signal to ``auto``."""
    header = ",".join(["time", "speed", *(f"cylinder[{i}].pressure" for i in range(1, 7))])
    for name, pressure in (("constant", 101325.0), ("rounded", 101325.0 + 1e-10), ("given", 101326.0)):
        rows = [",".join([repr(t), "200.0", *([repr(pressure)] * 6)]) for t in (0.0, 0.0037, 0.01)]
        (tmp_path / f"{name}.csv").write_text("\n".join([header, *rows]))
    done = script(
        """
import numpy as np
from fmpy import read_csv, simulate_fmu
def run(signals, start):
    return simulate_fmu(sys.argv[1], stop_time=0.01, output_interval=1e-4, input=signals, start_values=start)
names = sys.argv[2:]
free = run(None, {"speed": 200.0})
ran = [run(read_csv(name), {}) for name in names]
torsion = [np.ptp(result["pulley.torsion"] - free["pulley.torsion"]) for result in ran]
print(*torsion, np.ptp(free["pulley.torsion"]))
""",
        fmu,
        *(tmp_path / f"{name}.csv" for name in ("constant", "rounded", "given")),
    )
    constant, rounded, given, swing = map(float, done.stdout.splitlines()[-1].split())
    assert max(constant, rounded) < 1e-9 * swing  # the master's interpolation rounds the speed as well
    assert given > 0.1 * swing
