"""Low-level access to an FMU for scripts that tests run in processes of their own."""

import ctypes
import gc
import math
import sys

from fmpy import calloc, extract, free, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.logging import addLoggerProxy

_LOGGERS = []
"""FMPy's proxy calls the logger given last, also after its unit is gone: none is freed."""


class Unit:
    """One instance of an FMU with its variables by name and its log kept."""

    def __init__(self, path, name="unit", extracted=None):
        self.description = read_model_description(path)
        self.folder = extracted or extract(path)
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        self.kind = {v.name: v.type for v in self.description.modelVariables}
        self.outputs = [v.name for v in self.description.modelVariables if v.causality == "output"]
        self.log = []
        self.callbacks = fmi2CallbackFunctions()
        self.callbacks.logger = fmi2CallbackLoggerTYPE(lambda *a, log=self.log: log.append(a[4].decode()))
        _LOGGERS.append(self.callbacks.logger)
        self.callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        self.callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        addLoggerProxy(ctypes.byref(self.callbacks))
        self.fmu = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.fmu.instantiate(callbacks=self.callbacks, loggingOn=True)

    def set(self, **values):
        for name, value in values.items():
            self.set_named(name, value)

    def set_named(self, name, value):
        getattr(self.fmu, "set" + self.kind[name])([self.reference[name]], [value])

    def get(self, *names):
        return [getattr(self.fmu, "get" + self.kind[name])([self.reference[name]])[0] for name in names]

    def start(self, parameters=None, time=0.0):
        for name, value in (parameters or {}).items():
            self.set_named(name, value)
        self.fmu.setupExperiment(startTime=time)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        return self

    def run(self, steps, h=1e-4, first=0):
        for i in range(first, first + steps):
            self.fmu.doStep(i * h, h)
        return self

    def bits(self):
        """All outputs, exactly."""
        return [value.hex() for value in self.fmu.getReal([self.reference[name] for name in self.outputs])]

    def refusal(self, action):
        """Status and log of a call that must fail."""
        del self.log[:]
        try:
            action()
        except FMICallException as error:
            return error.status, " ".join(self.log)
        sys.exit("the call was accepted")

    def refuses(self, action, *words):
        """Check that a call fails as an error, 3 or 4, in at most two lines of the log, which hold these words."""
        status, text = self.refusal(action)
        assert status > 2 and len(text.splitlines()) <= 2 and all(word in text for word in words), (status, text)

    def close(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


def blocked(*names):
    """Make imports of these packages fail, as on a machine that lacks them."""

    class Blocker:
        def find_spec(self, name, path=None, target=None):
            if name.split(".")[0] in names:
                raise ModuleNotFoundError(f"blocked: {name}")

    sys.meta_path.insert(0, Blocker())


class Heap(ctypes.Structure):
    """What glibc says of memory that was given out."""

    names = "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost"
    _fields_ = [(name, ctypes.c_size_t) for name in names.split()]


def in_use():
    """Bytes that the C library has given out."""
    gc.collect()
    heap = ctypes.CDLL(None).mallinfo2
    heap.restype = Heap
    now = heap()
    return now.uordblks + now.hblkhd


NAN = math.nan
