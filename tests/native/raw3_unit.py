"""An FMU's binary called by the functions of FMI 3.0, by ctypes alone: any order, any argument."""

from __future__ import annotations

import ctypes
from ctypes import byref, c_bool, c_char_p, c_double, c_int, c_int32, c_int64, c_size_t, c_uint32, c_void_p

from raw_unit import Instance

C_TYPE = {"Float64": c_double, "Int32": c_int32, "Int64": c_int64, "Boolean": c_bool, "String": c_char_p}
LOGGER = ctypes.CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)
UPDATE = ctypes.CFUNCTYPE(
    None, c_void_p, c_double, c_bool, c_bool, c_bool, c_bool, ctypes.POINTER(c_bool), ctypes.POINTER(c_double)
)


class Raw3(Instance):
    """An instance; ``update`` is called inside steps with it and the time, and returns None or the time of an end."""

    prefix, truth = "fmi3", c_bool

    def __init__(self, binary, resources, token, name="unit", update=None, early=False, events=False):
        self.library = ctypes.CDLL(str(binary))
        self.log: list[tuple[int, str, str]] = []
        self.logger = LOGGER(
            lambda _, status, category, text: self.log.append((status, category.decode(), text.decode()))
        )
        self.inside = update
        self.update = UPDATE(self._updated) if update else UPDATE()
        instantiate = self.library.fmi3InstantiateCoSimulation
        instantiate.restype = c_void_p
        texts = [text if text is None else str(text).encode() for text in (name, token, resources)]
        flags = [c_bool(flag) for flag in (False, False, events, early)]
        given = *texts, *flags, None, c_size_t(0), None, self.logger, self.update
        self.component = instantiate(*given)
        self.told = None

    def _updated(self, environment, time, may_set, may_get, finished, may_return, early, early_time):
        end = self.inside(self, time)
        if end is not None:
            early[0], early_time[0] = True, end

    @staticmethod
    def values(kind, references, values):
        """Arguments of a call for values of variables."""
        n, m = len(references), len(values)
        given = [value.encode() if isinstance(value, str) else value for value in values]
        return (c_uint32 * n)(*references), c_size_t(n), (C_TYPE[kind] * m)(*given), c_size_t(m)

    def get(self, kind, *references, n=None):
        given = self.values(kind, references, [None if kind == "String" else 0] * (n or len(references)))
        self.must(f"Get{kind}", *given)
        return list(given[2])

    def set(self, kind, references, values):
        return self.must(f"Set{kind}", *self.values(kind, references, values))

    def start(self, start=0.0):
        self.must("EnterInitializationMode", False, 0.0, start, False, 0.0)
        return self.must("ExitInitializationMode")

    def step(self, time, step=1e-4):
        """Status; ``told`` are then eventHandlingNeeded, terminateSimulation, earlyReturn and lastSuccessfulTime."""
        flags, last = [c_bool(True) for _ in range(3)], c_double()
        status = self.call("DoStep", float(time), float(step), True, *map(byref, flags), byref(last))
        self.told = (*(flag.value for flag in flags), last.value)
        return status

    def derivative(self, way, unknowns, knowns, seed, n):
        """Directional or adjoint derivatives."""
        found = (c_double * n)()
        sides = [((c_uint32 * len(side))(*side), c_size_t(len(side))) for side in (unknowns, knowns)]
        seeds = (c_double * len(seed))(*seed), c_size_t(len(seed))
        self.must(f"Get{way}Derivative", *sides[0], *sides[1], *seeds, found, c_size_t(n))
        return list(found)
