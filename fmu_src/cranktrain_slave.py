"""FMI on one side, a module of the virtual engine on the other; no physics.

Cranktrain and the modules beside it have this one slave. It asks the module that ``running`` of ``variables.json``
names for ``read_model``, ``simulation`` and ``announced_compilation``, and of the simulation for ``inputs``,
``output_names``, ``read``, ``state``, ``time``, ``initialize`` and ``step``.

Lives in an FMU's resources folder beside ``variables.json`` (the interface, expanded), ``model.bin`` (the module's
data) and a copy of the package under a name that carries a digest of its code. What the wrapping library
would get wrong, and what is done here about it:

* modules are imported by bare name: slave and package carry digests in their names, so FMUs share nothing by chance;
* the extraction folder is new each time, and numba's cache goes by the place of the sources: the package is imported
  from a folder of the user's cache (``cranktrain/core/cache.py`` says where), written once and verified at each start,
  its library of machine code as well;
* the slave's module is executed at every instantiation, which drops a reference on its globals and keeps each class
  that the code defines: it is a few lines that import this one, ``SLAVE_MODULE`` of cranktrain/fmu/archive.py;
* an exception costs instance, class and message list a reference each: they are given one more beforehand, so the
  instance outlives its error with its state at the last good time;
* the Linux library releases its interpreter state twice when the process ends (once as a static object, once as it
  unloads), which corrupts the heap: in a host that is Python the state is released before, and once;
* a returned False would end a simulation early without a word: every failure is raised, and printed on stderr as well,
  since FMI loggers are often off.
"""

import atexit
import ctypes
import importlib
import importlib.util
import json
import math
import os
import runpy
import struct
import sys
import tempfile
import traceback
import zlib
from pathlib import Path

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real, String

_LARGEST = 1e15  # of a number in a state: pressures of films, in Pa, come to 1e10
COARSE_STEP = 3.0  # degrees of crank angle; pressures change by bars within it
_STATE = struct.Struct("<8sI64sIdII")
_STATE_MAGIC = b"CRNKSTA\0"
_STATE_VERSION = 3
_INSTANTIATED, _INITIALIZING, _STEPPING, _TERMINATED = range(4)
_PHASES = "only instantiated", "in initialization mode", "initialized", "terminated"
_READINGS = 64  # sets of outputs remembered that a master reads
_NEEDED = "numpy", "numba", "llvmlite"  # the last comes with numba
_LATEST = 1e6  # s, of a start: beyond it a time has no room for the digits of a step

_descriptions: dict = {}
_models: dict = {}
_libraries: dict = {}


def _cached_copy(source: Path) -> Path:
    """Copy of the package in the user's cache; ``source`` itself where it cannot be written, or others may do so."""
    private_folder = runpy.run_path(str(source / "core" / "cache.py"))["private_folder"]
    try:
        target = private_folder("fmu", source.name)
        for file in sorted(source.rglob("*")):
            if not file.is_file() or file.parent.name == "__pycache__":
                continue
            content, copy = file.read_bytes(), target / file.relative_to(source)
            if copy.is_file() and copy.read_bytes() == content:
                continue
            copy.parent.mkdir(parents=True, exist_ok=True)
            handle, temporary = tempfile.mkstemp(prefix=copy.name, dir=copy.parent)
            with os.fdopen(handle, "wb") as stream:
                stream.write(content)
            os.replace(temporary, copy)
    except OSError:
        return source
    return target


def _package(resources: Path, name: str):
    """Import the packaged cranktrain under its own name, once per process."""
    if name not in sys.modules:
        folder = _cached_copy(resources / name)
        spec = importlib.util.spec_from_file_location(
            name, folder / "__init__.py", submodule_search_locations=[str(folder)]
        )
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise
    return sys.modules[name]


def _lacking():
    """Packages that the model needs and this Python has not, in words; empty where there are none."""
    missing = []
    for name in _NEEDED:
        try:
            found = importlib.util.find_spec(name)
        except ImportError:
            found = None
        if found is None:
            missing.append(name)
    return " and ".join(missing)


def _release_once(library: Path) -> None:
    """Release the library's interpreter state when Python ends; later it would be released twice."""
    if not sys.platform.startswith("linux") or not sys.orig_argv or str(library) in _libraries:
        return  # a host that is not Python: the library owns the interpreter and ends it itself
    try:
        loaded = ctypes.CDLL(str(library), mode=os.RTLD_LAZY | os.RTLD_NOLOAD)
        atexit.register(loaded.finalizePythonInterpreter)
    except (OSError, AttributeError):
        loaded = None  # another binary than the one of pythonfmu 0.7: nothing known to be wrong with it
    _libraries[str(library)] = loaded


def _within(variable, value):
    """Whether a variable may have a value: a finite number within its bounds, or one of its words."""
    if isinstance(value, str):
        return not variable["choices"] or value in variable["choices"]
    low = -math.inf if variable["min"] is None else variable["min"]
    high = math.inf if variable["max"] is None else variable["max"]
    return math.isfinite(value) and low <= value <= high


class CranktrainSlave(Fmi2Slave):
    """One instance: a list of values per type, and a simulation from initialization on."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self._resources = Path(self.resources)
        about = _descriptions.get("about")
        if about is None:
            about = json.loads((self._resources / "variables.json").read_text(encoding="utf-8"))
            _descriptions["about"] = about
        self._about = about
        self.modelName = about["model"]
        self.author, self.license, self.version = about["author"], about["license"], about["version"]
        self._variables = sorted(about["variables"], key=lambda v: v["reference"])
        starts = [math.nan if v["start"] is None else v["start"] for v in self._variables]
        self._n_real = about["reals"]
        self._real = [float(value) for value in starts[: self._n_real]]
        self._string = starts[self._n_real :]
        # reals come first and inputs before outputs: the inputs' references are 0 .. n-1
        self._n_inputs = sum(v["causality"] == "input" for v in self._variables)
        inputs = self._variables[: self._n_inputs]
        self._lowest = [-sys.float_info.max if v["min"] is None else v["min"] for v in inputs]
        self._highest = [sys.float_info.max if v["max"] is None else v["max"] for v in inputs]
        self._layout = f"<{self._n_real + self._n_inputs}d"
        self._phase = _INSTANTIATED
        self._pending = False
        self._simulation = None
        self._origin = None
        self._places = []
        self._readings = {}
        self._start_time = 0.0
        self._warned = self._told_limit = False
        while sys.path.count(self.resources) > 1:  # one more is put there at every instantiation
            sys.path.remove(self.resources)
        _release_once(self._resources.parent / "binaries" / "linux64" / f"{self.modelName}.so")
        lacking = _lacking()
        if lacking:
            raise self._failure(
                f"this FMU runs Python code that needs {lacking}, which the Python at {sys.executable or sys.prefix} "
                f"lacks; install: {sys.executable or 'python'} -m pip install numpy numba"
            )

    # ------------------------------------------------------------------ life cycle

    def setup_experiment(self, start_time, stop_time, tolerance):
        """Take the start time; steps are controlled by ``solver.step``, not by a tolerance."""
        self._expect("setupExperiment", _INSTANTIATED)
        if not abs(start_time) <= _LATEST:
            raise self._failure(
                f"the start time is {start_time}; it must be a finite time in seconds, at most {_LATEST:g}"
            )
        self._start_time = float(start_time)

    def enter_initialization_mode(self):
        """From here outputs can be asked for."""
        self._expect("enterInitializationMode", _INSTANTIATED)
        self._phase, self._pending = _INITIALIZING, True

    def exit_initialization_mode(self):
        """Load the model, compile or load its kernels, and find the static equilibrium."""
        self._expect("exitInitializationMode", _INITIALIZING)
        if self._pending or self._simulation is None:
            self._initialize()
        self._phase = _STEPPING

    def terminate(self):
        """Nothing to release, the instance holds memory only; no step follows but after a reset or another state."""
        self._expect("terminate", _INITIALIZING, _STEPPING)
        self._phase = _TERMINATED

    def _expect(self, call, *phases):
        """Refuse a call that FMI's state machine does not allow here."""
        if self._phase not in phases:
            allowed = " or ".join(_PHASES[phase] for phase in phases)
            raise self._failure(f"{call} on an instance that is {_PHASES[self._phase]}; it must be {allowed}")

    def do_step(self, current_time, step_size):
        """Advance to ``current_time + step_size``; every failure is raised with its explanation."""
        if not step_size > 0.0:
            raise self._failure(
                f"communication step of {step_size} s at time {current_time} s; it must be positive, in seconds"
            )
        simulation = self._simulation
        if self._phase == _TERMINATED:
            raise self._failure("doStep on an instance that is terminated; reset it, or set a state")
        if self._phase != _STEPPING or simulation is None:
            raise self._failure("doStep before the initialization is complete; call exitInitializationMode first")
        # The model lags by what slivers of time it has left to the next step.
        if not abs(current_time - simulation.time) <= 2e-9 + 1e-6 * abs(current_time) + 1e-3 * step_size:
            raise self._failure(
                f"the master steps from {current_time} s but the model stands at {simulation.time} s; "
                "set a state of that time or step on from there"
            )
        if not self._warned:
            self._warn_if_coarse(step_size)
        try:
            simulation.inputs[:] = self._real[: self._n_inputs]
            if current_time + step_size > simulation.time:  # else the master's rounding has made nothing of the step
                simulation.step(current_time + step_size)
                if simulation.limited and not self._told_limit:
                    self._tell_limit(current_time)
        except Exception as error:
            raise self._failure(error) from None
        return True

    def _initialize(self):
        try:
            self._new_simulation(self._chosen(), self._real[: self._n_inputs], self._start_time)
            self._pending = False
        except Exception as error:
            raise self._failure(error) from None

    def _chosen(self):
        """Settings: those that the build fixed, and the parameters'."""
        values = self._real + self._string
        chosen = {v["setting"]: values[v["reference"]] for v in self._variables if v["causality"] == "parameter"}
        return {**self._about["fixed"], **chosen}

    def _new_simulation(self, settings, inputs, time):
        """Simulation at its static equilibrium under ``inputs``, which also set what stays constant in a run."""
        name, digest = self._about["package"], self._about["digest"]
        _package(self._resources, name)
        running = importlib.import_module(f"{name}.{self._about['running']}")
        if digest not in _models:
            _models[digest] = running.read_model(self._resources / "model.bin")
        names = {v["setting"]: v["name"] for v in self._variables if v["setting"]}
        simulation = running.simulation(_models[digest], settings, names)
        places = self._output_places(simulation)
        simulation.inputs[:] = inputs
        with running.announced_compilation(self.instance_name):
            simulation.initialize(time)
        self._simulation, self._places, self._origin = simulation, places, (settings, inputs)
        self._readings.clear()

    def _output_places(self, simulation):
        """Where each output of the interface stands in the simulation's outputs."""
        names = {name: i for i, name in enumerate(simulation.output_names)}
        outputs = [v for v in self._variables if v["causality"] == "output"]
        missing = [v["name"] for v in outputs if v["name"] not in names]
        if missing:
            raise RuntimeError(f"the model computes no '{missing[0]}'; the FMU was built from files that do not match")
        return [names[v["name"]] for v in outputs]

    def _warn_if_coarse(self, step_size):
        speed = self._real[self._about["speed"]]
        degrees = math.degrees(speed * step_size)
        if degrees > COARSE_STEP * (1.0 + 1e-6):
            self._warned = True
            advice = math.radians(1.0) / speed
            print(
                f"cranktrain: {self.instance_name}: warning: a communication step of {step_size:.3g} s is "
                f"{degrees:.1f} degrees of crank angle; the model sub-steps inside, but inputs and outputs are sampled "
                f"that coarsely. For 1 degree use {advice:.2g} s (fmpy: --output-interval {advice:.2g})",
                file=sys.stderr,
                flush=True,
            )

    def _tell_limit(self, time):
        self._told_limit = True
        print(
            f"cranktrain: {self.instance_name}: warning: the step from {time:.9g} s {self._simulation.told}",
            file=sys.stderr,
            flush=True,
        )

    # ------------------------------------------------------------------ values

    def get_real(self, vrs):
        """Reals by value reference."""
        if self._pending:
            self._answer_in_initialization(vrs)
        key = tuple(vrs)
        places = self._readings.get(key)
        if places is None:
            places = self._reading(key)
        if places:
            return self._simulation.read(places)
        return [self._real_of(vr) for vr in key]

    def _reading(self, vrs):
        """Places of outputs alone, remembered for masters that read the same again and again; else empty."""
        if any(not 0 <= vr < self._n_real for vr in vrs):
            raise self._foreign(vrs, 0, self._n_real, "Real")
        places = [self._places[vr - self._n_inputs] for vr in vrs] if all(map(self._computed, vrs)) else []
        if len(self._readings) == _READINGS:
            self._readings.clear()
        self._readings[vrs] = places
        return places

    def _computed(self, vr):
        """Whether it is an output that the simulation knows."""
        return self._simulation is not None and 0 <= vr - self._n_inputs < len(self._places)

    def _real_of(self, vr):
        if self._computed(vr):
            return self._simulation.read([self._places[vr - self._n_inputs]])[0]
        return self._real[vr]

    def set_real(self, vrs, values):
        """Inputs at any time; parameters before initialization."""
        real, n_inputs, lowest, highest = self._real, self._n_inputs, self._lowest, self._highest
        for vr, value in zip(vrs, values, strict=True):
            if vr < n_inputs and lowest[vr] <= value <= highest[vr]:
                real[vr] = value
            else:
                self._set(real, 0, self._n_real, vr, value, "Real")
        if self._phase == _INITIALIZING:
            self._pending = True

    def get_integer(self, vrs):
        """No variable is an integer."""
        return [] if not vrs else self._get([], len(self._variables), vrs, "Integer")

    def set_integer(self, vrs, values):
        """No variable is an integer."""
        self.get_integer(vrs)

    def get_string(self, vrs):
        """Strings by value reference."""
        return self._get(self._string, self._n_real, vrs, "String")

    def set_string(self, vrs, values):
        """Parameters, before initialization."""
        for vr, value in zip(vrs, values, strict=True):
            self._set(self._string, self._n_real, len(self._variables), vr, value, "String")

    def get_boolean(self, vrs):
        """No variable is a boolean."""
        return [] if not vrs else self._get([], len(self._variables), vrs, "Boolean")

    def set_boolean(self, vrs, values):
        """No variable is a boolean."""
        self.get_boolean(vrs)

    def _get(self, values, first, vrs, kind):
        if any(not first <= vr < first + len(values) for vr in vrs):
            raise self._foreign(vrs, first, first + len(values), kind)
        return [values[vr - first] for vr in vrs]

    def _answer_in_initialization(self, vrs):
        if any(vr < len(self._variables) and self._variables[vr]["causality"] == "output" for vr in vrs):
            self._initialize()

    def _foreign(self, vrs, first, end, kind):
        vr = next(vr for vr in vrs if not first <= vr < end)
        known = f"is '{self._variables[vr]['name']}', " if 0 <= vr < len(self._variables) else ""
        return self._failure(f"value reference {vr} {known or 'is unknown, '}no {kind}; see modelDescription.xml")

    def _set(self, values, first, end, vr, value, kind):
        if not first <= vr < end:
            raise self._foreign([vr], first, end, kind)
        variable = self._variables[vr]
        name = variable["name"]
        if variable["causality"] == "output":
            raise self._failure(f"'{name}' is an output and cannot be set")
        if variable["causality"] == "parameter" and self._phase >= _STEPPING:
            raise self._failure(f"parameter '{name}' is fixed after initialization; reset the instance, then set it")
        if kind == "String" and variable["choices"] and value not in variable["choices"]:
            raise self._failure(f"'{name}' is '{value}'; valid: " + ", ".join(variable["choices"]))
        if kind == "Real":
            low = -math.inf if variable["min"] is None else variable["min"]
            high = math.inf if variable["max"] is None else variable["max"]
            if not (math.isfinite(value) and low <= value <= high):
                span = f"at least {low:g}" if high == math.inf else f"between {low:g} and {high:g}"
                raise self._failure(
                    f"'{name}' is {value} at time {self._time():.9g} s; it must be a finite number, {span}"
                )
        values[vr - first] = value
        if self._phase == _INITIALIZING:
            self._pending = True

    # ------------------------------------------------------------------ state

    def _get_fmu_state(self):
        running = self._phase >= _STEPPING and self._simulation is not None
        vector = self._simulation.state.tobytes() if running else b""
        origin = self._origin[1] if running else self._real[: self._n_inputs]
        strings = "\0".join(self._string).encode()
        head = _STATE.pack(
            _STATE_MAGIC,
            _STATE_VERSION,
            self._about["digest"].encode(),
            self._phase,
            self._time(),
            len(strings),
            len(vector) // 8,
        )
        body = struct.pack(self._layout, *self._real, *origin) + strings + vector
        return head + body + struct.pack("<I", zlib.crc32(head + body))

    def _set_fmu_state(self, state):
        try:
            self._restore(bytes(state))
        except Exception as error:
            raise self._failure(error) from None

    def _restore(self, state):
        if len(state) < _STATE.size + 4 or state[:8] != _STATE_MAGIC:
            raise ValueError("the FMU state is not one of cranktrain; serialize it from an instance of this FMU")
        _, version, digest, phase, time, n_string, n_vector = _STATE.unpack_from(state)
        if version != _STATE_VERSION or digest.decode(errors="replace") != self._about["digest"]:
            raise ValueError("the FMU state comes from another build of the FMU; serialize it from this one")
        if zlib.crc32(state[:-4]) != struct.unpack("<I", state[-4:])[0]:
            raise ValueError("the FMU state is damaged (checksum differs); serialize it again")
        if len(state) != _STATE.size + struct.calcsize(self._layout) + n_string + 8 * n_vector + 4:
            raise ValueError("the FMU state has another length than it states; serialize it again")
        numbers = struct.unpack_from(self._layout, state, _STATE.size)
        at = _STATE.size + struct.calcsize(self._layout)
        strings = state[at : at + n_string].decode().split("\0") if n_string else []
        self._check_state(phase, time, numbers, strings, memoryview(state)[at + n_string : -4])
        kept = self._real, self._string
        self._real, self._string = list(numbers[: self._n_real]), strings
        try:
            if n_vector:
                origin = list(numbers[self._n_real :])
                self._resume(time, origin, state[at + n_string : at + n_string + 8 * n_vector])
        except BaseException:
            self._real, self._string = kept
            raise
        self._phase, self._pending = phase, phase == _INITIALIZING
        if not n_vector:
            self._start_time, self._simulation = time, None
            self._readings.clear()

    def _check_state(self, phase, time, numbers, strings, vector):
        """Refuse what no instance can have come to: anybody may make a checksum that is right."""
        fits = phase < len(_PHASES) and abs(time) <= 10.0 * _LATEST and len(strings) == len(self._string)
        values = [*numbers[: self._n_real], *strings]
        own = (variable for variable in self._variables if variable["causality"] != "output")
        wrong = "" if fits else "its phase or its time"
        for variable in own if fits else ():
            value = values[variable["reference"]]
            wrong = wrong or ("" if _within(variable, value) else f"'{variable['name']}' = {value}")
        origin = numbers[self._n_real :]
        wrong = wrong or next(
            (f"'{v['name']}' at its start = {x}" for v, x in zip(self._variables, origin, strict=False)
             if not _within(v, x)), ""
        )  # fmt: skip
        if not wrong and not all(abs(x) <= _LARGEST for (x,) in struct.iter_unpack("<d", vector)):
            wrong = "its motion"
        if wrong:
            raise ValueError(f"the FMU state is not one of a run: {wrong} cannot be; serialize it from a run")

    def _resume(self, time, origin, vector):
        """Continue from a state vector, in this instance or in a fresh one."""
        import numpy  # loaded with the model; instantiating does not need it

        settings = self._chosen()
        if self._simulation is None or self._origin != (settings, origin):
            self._new_simulation(settings, origin, time)
        self._simulation.inputs[:] = self._real[: self._n_inputs]
        self._simulation.state = numpy.frombuffer(vector, dtype="<f8")

    @staticmethod
    def _fmu_state_to_bytes(state):
        return state

    @staticmethod
    def _fmu_state_from_bytes(state):
        return state  # checked where it is set: an exception here could not be survived

    # ------------------------------------------------------------------ errors

    def _time(self):
        return self._start_time if self._simulation is None else float(self._simulation.time)

    def _failure(self, error):
        """Exception to raise: the whole explanation in one line, which is printed as well."""
        if isinstance(error, Exception):
            expected = type(error).__module__.startswith(self._about["package"]) or isinstance(error, ValueError)
            text = str(error) if expected else f"{type(error).__name__}: {error}"
            if not expected:
                traceback.print_exception(error, file=sys.stderr)
        else:
            text = error
        text = f"{self.instance_name}: " + " ".join(text.split())
        print(f"cranktrain: {text}", file=sys.stderr, flush=True)
        for held in (self, type(self), self.log_queue):  # the wrapping library gives these away on an exception
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(held))
        return RuntimeError(text.replace("%", "%%"))  # FMI loggers take the text for a printf format

    # ------------------------------------------------------------------ model description

    def to_xml(self, model_options=None):
        """Register the variables and describe them; the build adds what the wrapping library leaves out."""
        kinds = {
            "Real": (Real, self.get_real),
            "String": (String, self.get_string),
        }
        for v in self._variables:
            kind, getter = kinds[v["type"]]
            fixed = v["causality"] == "parameter"
            initial = {"parameter": Fmi2Initial.exact, "output": Fmi2Initial.calculated}.get(v["causality"])
            self.register_variable(
                kind(
                    v["name"],
                    causality=Fmi2Causality[v["causality"]],
                    variability=Fmi2Variability.fixed if fixed else Fmi2Variability.continuous,
                    initial=initial,
                    getter=lambda vr=v["reference"], getter=getter: getter([vr])[0],
                )
            )
        return super().to_xml(model_options or {})
