"""Libraries of machine code under Python: numba is not loaded, results are its own to the bit; in doubt numba."""

import ctypes
import importlib.util
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

import cranktrain
from cranktrain.cli.main import main
from cranktrain.core import machine_code, run_entries
from cranktrain.core.errors import InputError
from cranktrain.core.kernel import Kernel, kernel, kernel_name
from cranktrain.core.machine_code import OFF, WHOLE, code_digest, is_whole, this_platform
from cranktrain.core.records import layout
from cranktrain.core.run_entries import RunEntries
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.fmu.native import __main__ as command
from cranktrain.fmu.native import link
from cranktrain.fmu.native.emit import Emission
from cranktrain.fmu.native.objects import object_code
from cranktrain.fmu.native.platforms import PLATFORMS
from cranktrain.modules.register import MODULES
from cranktrain.modules.valve_train import run_record
from cranktrain.modules.valve_train.file import load
from cranktrain.modules.valve_train.settings import make_run
from cranktrain.structure.assembly import running_crank

PACKAGE = Path(cranktrain.__file__).parent


def made(kind):
    """The library of a kind for this machine; skips where none can be made, or would take a minute."""
    try:
        return link.library(kind, this_platform(), emit=kind in MODULES)
    except InputError as error:
        pytest.skip(str(error))


def python(text, *arguments, package=PACKAGE, **environment):
    given = {**os.environ, "PYTHONPATH": str(package.parent), **environment}
    given = {name: value for name, value in given.items() if value}
    run = [sys.executable, "-W", "always", "-c", text, *arguments]
    done = subprocess.run(run, capture_output=True, text=True, env=given, timeout=3600)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout, done.stderr


@pytest.fixture
def install(tmp_path):
    """A copy of the package of its own, with the library of the valve train."""
    path = made("valvetrain")
    shutil.copytree(PACKAGE, tmp_path / "cranktrain", ignore=shutil.ignore_patterns("__pycache__", "lib"))
    place = tmp_path / "cranktrain/fmu/native/lib" / this_platform()
    place /= machine_code.library_name("valvetrain", path.suffix)
    place.parent.mkdir(parents=True)
    shutil.copyfile(path, place)
    return place


def found(install, tmp_path):
    """Whether that copy lacks its library, asked twice, and what it says."""
    text = "from cranktrain.core.machine_code import library as of\nprint(of('valvetrain') is of('valvetrain') is None)"
    package = install.parents[4]
    out, said = python(text, package=package, CRANKTRAIN_CACHE=str(tmp_path / "cache"), **{OFF: ""})
    return out.strip(), said


def test_an_edit_of_the_sources_leaves_the_library_alone(install, tmp_path):
    assert found(install, tmp_path) == ("False", "")
    source = install.parents[4] / "modules" / "valve_train" / "stage.py"
    for more, stale in (("# a remark\n", "False"), ("ANOTHER_STATE = True\n", "True")):
        source.write_text(source.read_text("utf-8") + more, "utf-8")
        assert found(install, tmp_path) == (stale, "")


FIRST_USE = """
from cranktrain.core.machine_code import library
from cranktrain.fmu.native.first_use import made_at_first_use
with made_at_first_use():
    print(library("valvetrain") is not None)
"""


def test_a_library_that_lacks_is_made_at_first_use_and_found_by_the_next(install, tmp_path):
    install.unlink()
    package, cache = install.parents[4], str(tmp_path / "cache")
    nobody = python(FIRST_USE, package=package, CRANKTRAIN_CACHE=cache, PATH=str(tmp_path), **{OFF: ""})
    if importlib.util.find_spec("ziglang") is None:
        assert nobody == ("False\n", "")
    answer, said = python(FIRST_USE, package=package, CRANKTRAIN_CACHE=cache, **{OFF: ""})
    assert answer == "True\n" and said.count("machine code of the kernels is made") == 1
    assert found(install, tmp_path) == ("False", "")
    assert python(FIRST_USE, package=package, CRANKTRAIN_CACHE=cache, **{OFF: "1"}) == ("False\n", "")


@pytest.mark.parametrize("cut", [True, False], ids=["cut short", "one byte changed"])
def test_a_damaged_library_is_told_once_and_not_loaded(install, tmp_path, cut):
    content = bytearray(install.read_bytes())
    content[len(content) // 2] ^= 1
    install.write_bytes(content[: len(content) // 2] if cut else content)
    answer, said = found(install, tmp_path)
    assert answer == "True"
    assert said.count("cannot be used (its checksum differs)") == 1 and str(install) in said


def test_a_sound_file_that_no_loader_takes_is_told(install, tmp_path):
    text = f"no library, but {code_digest('valvetrain')}".encode()
    install.write_bytes(text + machine_code.checksum(text))
    answer, said = found(install, tmp_path)
    assert answer == "True" and said.count("this library of machine code cannot be used") == 1


def test_a_run_of_other_arrays_than_the_library_knows_is_compiled():
    made("valvetrain")
    run = make_run(load(MODULES["valvetrain"].folder / "data" / "valvetrain_i6.toml"))
    other = run._replace(outputs=np.zeros(2 * run.outputs.size)[::2])
    assert layout(other) != layout(run)
    known, compiled = (RunEntries("valvetrain", r, run_record) for r in (run, other))
    for entries in (known, compiled):
        assert entries.prepare() == entries.start(0.0) == entries.observe() == 0
    assert np.array_equal(run.outputs, other.outputs) and run.outputs.any()
    assert not hasattr(compiled, "_image")


def test_threads_that_want_a_library_make_it_once(tmp_path, monkeypatch):
    """As two processes do: each opens the lock file for itself."""
    monkeypatch.setenv("CRANKTRAIN_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(link, "LIBRARIES", tmp_path / "none")
    monkeypatch.setattr(link, "compiler", lambda platform: ["cc"])
    count, made_at_last = [], []

    def linked(command, kind, platform, programs, target):
        count.append(kind)
        content = code_digest(kind).encode() + link._shim_digest().encode()
        target.write_bytes(content + machine_code.checksum(content))

    monkeypatch.setattr(link, "_all_programs", lambda kinds, say, emit: threading.Event().wait(0.3) or [tmp_path])
    monkeypatch.setattr(link, "_link", linked)
    threads = [threading.Thread(target=lambda: made_at_last.append(link.library("valvetrain"))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert count == ["valvetrain"]
    assert len(set(made_at_last)) == 1 and is_whole(made_at_last[0], code_digest("valvetrain"))


def test_a_library_that_is_there_is_taken_and_not_linked_again(monkeypatch, tmp_path):
    """Whatever the linker leaves out of it: one that goes without a text that nothing reads was taken for another."""
    monkeypatch.setattr(link, "LIBRARIES", tmp_path / "none")
    first = made("valvetrain")
    monkeypatch.setattr(link, "_link", lambda *given: pytest.fail("linked again"))
    assert made("valvetrain") == first


def test_without_a_c_compiler_an_installation_goes_on(monkeypatch, capsys):
    def none(platform):
        raise InputError("no C compiler was found")

    monkeypatch.setattr(command, "compiler", none)
    assert command.main([]) == 0
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "kernels are compiled when they are first called: no C compiler was found" in said
    assert command.main(["linux64"]) == 2
    assert command.main(["toaster"]) == 2 and "platform 'toaster' is not known" in capsys.readouterr().err


MADE = """
import signal, sys
from pathlib import Path
from cranktrain.fmu.native import link, __main__ as command
signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
link.LIBRARIES = Path(sys.argv[1])
sys.exit(command.main(["--kind", "cranktrain"]))
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("whole", [False, True], ids=["the command", "a terminal's group"])
def test_an_interrupt_ends_what_emits_and_keeps_nothing_half_made(tmp_path, whole):
    """A signal for the command alone, or one for all processes of its session, as a terminal sends it."""
    if shutil.which("cc") is None:
        pytest.skip("no C compiler here")
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent), "CRANKTRAIN_CACHE": str(tmp_path / "cache")}
    given = [sys.executable, "-c", MADE, str(tmp_path / "none")]
    own = {"start_new_session": True, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(given, env=environment, **own) as command_line:
        assert "machine code of the kernels is made" in command_line.stderr.readline()
        time.sleep(2.0 * whole)  # its processes have begun
        (os.killpg if whole else os.kill)(command_line.pid, signal.SIGINT)
        said = command_line.stderr.read()
    assert command_line.returncode == 130
    assert said.count("\n") == 1 and "interrupted; finished parts are kept" in said
    assert {path.name for path in (tmp_path / "cache").rglob("*") if path.is_file()} <= {"lock"}


def test_who_waits_for_another_process_says_so(tmp_path):
    said, inside = [], threading.Event()

    def second():
        with link._alone(tmp_path, said.append):
            inside.set()

    with link._alone(tmp_path, said.append):
        other = threading.Thread(target=second)
        other.start()
        while not said and not inside.is_set():
            time.sleep(0.01)
        assert not inside.is_set() and said == ["waiting for another process that makes the same machine code"]
    other.join(10.0)
    assert inside.is_set() and len(said) == 1


def test_a_compiler_of_another_platform_is_not_taken(monkeypatch):
    """Debian's gcc for Linux is called x86_64-linux-gnu-gcc as well: it makes nothing for Windows."""
    monkeypatch.setattr(link.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(link.shutil, "which", lambda name: f"/usr/bin/{name}" if "linux-gnu" in name else None)
    assert link.compiler(PLATFORMS["linux64"]) == ["/usr/bin/x86_64-linux-gnu-gcc"]
    assert link.compiler(PLATFORMS["aarch64-linux"]) == ["/usr/bin/aarch64-linux-gnu-gcc"]
    with pytest.raises(InputError, match=r"no C compiler for win64 was found; .* pip install ziglang"):
        link.compiler(PLATFORMS["win64"])


def test_the_package_s_libraries_appear_whole(tmp_path, monkeypatch):
    made("valvetrain")
    monkeypatch.setattr(command, "LIBRARIES", tmp_path)
    assert command.main(["--package", "--kind", "valvetrain"]) == 0
    (path,) = tmp_path.rglob("*.*")
    assert path.parent.name == this_platform() and is_whole(path, code_digest("valvetrain"))


@kernel
def several(values, factor, count):
    for k in range(values.shape[0]):
        values[k] *= factor
    return values[0], count + 1, factor > 1.0


@pytest.fixture(params=["portable", "fast"])
def of_variant(request, monkeypatch):
    """Runs from one of the two codes of the cranktrain's library."""
    code = machine_code.Library(made(WHOLE), portable=request.param == "portable")
    for module in (machine_code, run_entries):
        monkeypatch.setattr(module, "library", lambda kind: code)
    return request.param


OUTPUTS = {}


@pytest.mark.parametrize(
    "levels", [{"bearings": "impedance"}, {"bearings": "reynolds", "big_ends": "impedance"}], ids=str
)
def test_both_codes_give_the_same_bits(levels, of_variant):
    """For all processors, and for those with 256-bit vectors; where this one has none, both are the first."""
    engine = load_engine("diesel_i6")
    run = Simulation(engine, running_crank(engine, "rigid"), Settings(crank="rigid", **levels))
    run.inputs[0] = 200.0
    run.initialize()
    for k in range(12):
        run.step(2e-4 * (k + 1))
    assert np.ptp(run.outputs) > 0.0
    assert np.array_equal(OUTPUTS.setdefault(str(levels), run.outputs.copy()), run.outputs)


@kernel
def single(values):
    return values[1]


@kernel
def nothing(values):
    values[0] = 0.0


@pytest.mark.parametrize("called", [several, single, nothing], ids=lambda k: k.__name__)
def test_a_call_gives_what_numba_gives(called, tmp_path):
    """Numbers, tuples of them, or nothing; arrays are changed in place."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler here")
    arguments = (np.arange(1.0, 4.0), 2.5, 3)[: called.py_func.__code__.co_argcount]
    with Emission() as emission:
        called(*(a.copy() if isinstance(a, np.ndarray) else a for a in arguments))
        program = emission.program()
    name, _, kinds = emission.called["ct_call_0"].split("|")
    assert name == kernel_name(called)
    (tmp_path / "call.o").write_bytes(object_code(program, PLATFORMS["linux64"]))
    (tmp_path / "at.c").write_text("extern int ct_call_0(); void *at(void); void *at(void) { return ct_call_0; }\n")
    files = [tmp_path / "call.o", tmp_path / "at.c"]
    subprocess.run([compiler, "-shared", "-fPIC", "-o", tmp_path / "call.so", *files, "-lm"], check=True)
    loaded = ctypes.CDLL(str(tmp_path / "call.so"))
    loaded.at.restype = ctypes.c_void_p
    call = machine_code.Call(loaded.at(), kinds)
    mine = tuple(a.copy() if isinstance(a, np.ndarray) else a for a in arguments)
    theirs = tuple(a.copy() if isinstance(a, np.ndarray) else a for a in arguments)
    expected = called.dispatcher(*theirs)
    result = call(mine)
    assert result == expected and type(result) is type(expected)
    assert np.array_equal(mine[0], theirs[0])


def test_what_a_library_lacks_is_compiled():
    assert isinstance(single, Kernel) and single(np.arange(3.0)) == 1.0


SIMULATE = """
import sys
from cranktrain.cli.main import main
code = main(["simulate", *sys.argv[2:], "--output", sys.argv[1]])
print(code, "numba" in sys.modules)
"""
ONE_CYCLE = "--speed", "2000", "--cycles", "1"
LEVELS = {
    "rigid": "diesel_i6 --crank rigid --bearings linear",
    "films": "diesel_i6 --crank rigid --bearings impedance --big-ends impedance --integrator sdirk2",
    "torsional": "diesel_i6 --crank torsional --no-inherit",
    "free, with a damper": "diesel_i6 --crank torsional --no-inherit --damper --load-torque-nm 500 --tolerance 1e-3",
    "beams": "diesel_i6 --crank beam",
    "rollers": "diesel_v8 --crank rigid",
    "solved online": "diesel_i6 --crank rigid --bearings reynolds --step-deg 10",
}


def simulated(levels, path, **environment):
    """Outputs of a run from the command line, and whether numba was loaded for it."""
    code, numba = python(SIMULATE, str(path), *levels.split(), *ONE_CYCLE, **environment)[0].split()[-2:]
    assert code == "0"
    with h5py.File(path) as file:
        return {name: file["data"][name][()] for name in file["data"]}, numba


@pytest.mark.parametrize("levels", LEVELS.values(), ids=list(LEVELS))
def test_a_simulation_loads_no_numba(levels, tmp_path):
    made(WHOLE)
    # Makes the bodies, which the run in a process of its own finds in the cache.
    assert main(["simulate", *levels.split(), *ONE_CYCLE, "--output", str(tmp_path / "before.h5")]) == 0
    outputs, numba = simulated(levels, tmp_path / "run.h5", **{OFF: ""})
    assert outputs and numba == "False"


ENDS = """
import sys
from cranktrain.film.table.database import TableSettings, table_axes
print(*table_axes(TableSettings(0.5)).tolist(), "numba" in sys.modules)
"""


def test_what_checks_a_film_table_loads_no_numba():
    """A table that lies in the cache is read by every FMU build and by each run of level ``table``."""
    made(WHOLE)
    *axes, numba = python(ENDS, **{OFF: ""})[0].split()
    *others, compiled = python(ENDS, **{OFF: "1"})[0].split()
    assert (numba, compiled) == ("False", "True") and axes == others


@pytest.mark.slow
@pytest.mark.parametrize("levels", LEVELS.values(), ids=list(LEVELS))
def test_a_simulation_gives_numba_s_bits(levels, tmp_path):
    made(WHOLE)
    outputs, _ = simulated(levels, tmp_path / "one.h5", **{OFF: ""})
    others, numba = simulated(levels, tmp_path / "other.h5", **{OFF: "1"})
    assert numba == "True" and outputs.keys() == others.keys()
    assert [name for name in outputs if not np.array_equal(outputs[name], others[name])] == []


BOUNDS = """
from cranktrain.fmu.native import emit
from cranktrain.fmu.native.exports import exports

class Checked(emit.Call):
    def __init__(self, address, results):
        super().__init__(address, results)
        entry = self._entry
        self._entry = lambda image, x: statuses.append(entry(image, x))

statuses = []
emit.Call = Checked
with emit.Emission() as emission:
    for share in ("parts", "stages"):
        for call in exports(share).calls:
            emission.call(*call, {})
print(len(emission.called), statuses.count(0), len(statuses))
"""


def test_an_emission_stays_within_its_arrays():
    """What Python calls in the emitting process; one write beyond an array made LLVM end it, minutes later, or not."""
    environment = os.environ | link.emitting() | {"NUMBA_BOUNDSCHECK": "1"}
    done = subprocess.run([sys.executable, "-c", BOUNDS], env=environment, check=True, capture_output=True, text=True)
    kernels, good, calls = map(int, done.stdout.split())
    assert kernels > 10 and good == calls > 20
