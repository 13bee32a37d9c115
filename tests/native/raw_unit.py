"""An FMU's binary called as it stands, by ctypes alone: any order, any argument."""

from __future__ import annotations

import ctypes
import math
import zlib
from ctypes import byref, c_char, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path

import numpy as np

OK, WARNING, DISCARD, ERROR = range(4)
MODEL_EXCHANGE, CO_SIMULATION = range(2)
STATUS, PENDING, LAST_TIME, TERMINATED = range(4)
C_TYPE = {"Real": c_double, "Integer": c_int, "Boolean": c_int, "String": c_char_p}

LOGGER = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
ALLOCATE = ctypes.CFUNCTYPE(c_void_p, c_size_t, c_size_t)
RELEASE = ctypes.CFUNCTYPE(None, c_void_p)


def summed(words):
    """Bytes of a serialized state whose checksum fits its words, at the places of ``struct ct_snapshot``."""
    words = words.copy()
    words[6:8] = 0
    counts = np.arange(1, words.size + 1, dtype=np.uint64)
    words[6:8] = zlib.crc32(words.tobytes()), (words * counts).sum(dtype=np.uint64)
    return words.tobytes()


class Callbacks(ctypes.Structure):
    _fields_ = [
        *(("logger", LOGGER), ("allocate", ALLOCATE), ("release", RELEASE)),
        *(("finished", c_void_p), ("environment", c_void_p)),
    ]


class Instance:
    """An instance; ``log`` holds status, category and text of each line. ``component`` is None where it is refused."""

    prefix: str
    truth: type

    def call(self, name, *arguments):
        """Status of a call; floats, and where C has them truth values, become C's, all else is given as it is."""
        given = [
            c_double(a) if isinstance(a, float) else self.truth(a) if isinstance(a, bool) else a for a in arguments
        ]
        return getattr(self.library, self.prefix + name)(c_void_p(self.component), *given)

    def must(self, name, *arguments):
        assert self.call(name, *arguments) == OK, (name, self.log[-1:])
        return self

    def refused(self, name, *arguments):
        """Text of the refusal, in one line under the instance's name."""
        n = len(self.log)
        assert self.call(name, *arguments) == ERROR, name
        assert [line[:2] for line in self.log[n:]] == [(ERROR, "logStatusError")], self.log[n:]
        return self.log[-1][2]

    def run(self, steps, first=0, step=1e-4):
        for k in range(first, first + steps):
            assert self.step(k * step, step) == OK, self.log[-1:]
        return self

    def free(self):
        release = getattr(self.library, f"{self.prefix}FreeInstance")
        release.restype = None
        release(c_void_p(self.component))
        self.component = None


class Raw(Instance):
    """An instance of FMI 2.0."""

    prefix, truth = "fmi2", c_int

    def __init__(self, binary, resources, guid, name="unit", kind=CO_SIMULATION, logging=False, memory=(None, None)):
        self.library = ctypes.CDLL(str(binary))
        self.log: list[tuple[int, str, str]] = []
        self.callbacks = Callbacks(LOGGER(self._keep))
        if memory[0]:
            self.callbacks.allocate, self.callbacks.release = ALLOCATE(memory[0]), RELEASE(memory[1])
        instantiate = self.library.fmi2Instantiate
        instantiate.restype = c_void_p
        location = resources.as_uri() if isinstance(resources, Path) else resources
        location = None if location is None else location.encode()
        names = (name and name.encode(), kind, guid and guid.encode(), location)
        self.component = instantiate(*names, byref(self.callbacks), 0, int(logging))

    def _keep(self, environment, name, status, category, text):
        formatted = text.decode().replace("%%", "\0").replace("%", "?").replace("\0", "%")  # as printf would do
        self.log.append((status, category.decode(), formatted))

    def get(self, kind, *references):
        values = (C_TYPE[kind] * len(references))()
        self.must(f"Get{kind}", (c_uint * len(references))(*references), c_size_t(len(references)), values)
        return list(values)

    def one(self, kind, reference):
        return self.get(kind, reference)[0]

    @staticmethod
    def values(kind, pairs):
        """Arguments of a Set call from references and values."""
        n = len(pairs)
        values = [value.encode() if isinstance(value, str) else value for value in pairs.values()]
        return (c_uint * n)(*pairs), c_size_t(n), (C_TYPE[kind] * n)(*values)

    def set(self, kind, pairs):
        return self.must(f"Set{kind}", *self.values(kind, pairs))

    def refused_set(self, kind, pairs):
        return self.refused(f"Set{kind}", *self.values(kind, pairs))

    def rates(self, name, pairs, order=1):
        """Arguments of a call about derivatives."""
        references, n, values = self.values("Real", pairs)
        return references, n, (c_int * len(pairs))(*[order] * len(pairs)), values

    def output_rates(self, *references):
        """First derivatives of outputs by time."""
        given = self.rates("Get", dict.fromkeys(references, math.nan))
        self.must("GetRealOutputDerivatives", *given)
        return list(given[-1])

    def directional(self, unknowns, changes):
        """Derivatives of ``unknowns`` in the direction of ``changes``, a mapping from inputs."""
        outputs, n, results = self.values("Real", dict.fromkeys(unknowns, math.nan))
        inputs, n_inputs, moves = self.values("Real", changes)
        self.must("GetDirectionalDerivative", outputs, n, inputs, n_inputs, moves, results)
        return list(results)

    def setup(self, start=0.0, stop=None):
        return self.must("SetupExperiment", 0, 0.0, float(start), int(stop is not None), float(stop or 0.0))

    def start(self, start=0.0, stop=None):
        return self.setup(start, stop).must("EnterInitializationMode").must("ExitInitializationMode")

    def step(self, time, step=1e-4):
        return self.call("DoStep", float(time), float(step), 1)

    def state(self):
        state = c_void_p()
        self.must("GetFMUstate", byref(state))
        return state

    def serialized(self, state):
        size = c_size_t()
        self.must("SerializedFMUstateSize", state, byref(size))
        data = (c_char * size.value)()
        self.must("SerializeFMUstate", state, data, size)
        return bytes(data)

    def deserialize(self, data):
        """Status and state."""
        state = c_void_p()
        status = self.call("DeSerializeFMUstate", data, c_size_t(len(data)), byref(state))
        return status, state

    def real_status(self, kind=LAST_TIME):
        value = c_double()
        return self.call("GetRealStatus", kind, byref(value)), value.value


def instances(make):
    """A function that makes instances, which are freed behind the test."""
    made = []

    def fresh(*given, **options):
        made.append(make(*given, **options))
        return made[-1]

    yield fresh
    for one in made:
        if one.component is not None:
            one.free()
