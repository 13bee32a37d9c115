"""Native FMUs of both versions as the plain hosts and Python run them: the mock, a module, an engine."""

from __future__ import annotations

import math
import subprocess

import mock_unit
import pytest
import real_unit
from fmpy import read_model_description
from mock_unit import REFERENCE
from plain_host import hosted, hosted3
from raw3_unit import Raw3
from raw_unit import Raw
from real_unit import STEP, TURNING

VERSIONS = ("2.0", "3.0")
HOSTS = {"2.0": "host", "3.0": "host3"}
"""Hosts by the version that they call."""


class Mock:
    """The mock of FMI 2.0, in its folder; of 100,000 calls at random each kind has more than ``rare``."""

    fmi, rare = "2.0", 1000

    def __init__(self, folder):
        self.folder = folder
        self.binary = folder / "binaries" / "linux64" / f"{mock_unit.MODEL}.so"

    def hosted(self, host, *what, binary=None, before=()):
        return hosted(host, self.folder, *what, binary=binary, before=before)

    def from_python(self, steps):
        one = Raw(self.binary, self.folder / "resources", mock_unit.GUID).start().run(steps)
        return bits(one, one.get("Real", *range(REFERENCE["position"], REFERENCE["energy"] + 1)))

    def watched(self, folder, options):
        return mock_unit.library(folder, *options)


class Mock3(Mock):
    """The mock of FMI 3.0, with position, velocity and energy as one array."""

    fmi, rare = "3.0", 500

    def __init__(self, binary, folder):
        (folder / "native.bin").write_bytes(mock_unit.native_bin(arrays=f"{REFERENCE['position']}*3"))
        self.binary, self.folder = binary, folder

    def hosted(self, host, *what, binary=None, before=()):
        given = binary or self.binary, mock_unit.GUID, self.folder, len(REFERENCE) + 1, [(REFERENCE["position"], 3)]
        return hosted3(host, *given, what, before=before)

    def from_python(self, steps):
        one = Raw3(self.binary, self.folder, mock_unit.GUID).start().run(steps)
        return bits(one, one.get("Float64", REFERENCE["position"], n=3))


class Real:
    """A module's or an engine's FMU of FMI 2.0, in its folder."""

    fmi = "2.0"

    def __init__(self, unit):
        self.unit = unit

    def hosted(self, host, *what, binary=None, before=()):
        texts = [f"{reference}={text}" for reference, text in self.unit.texts().items()]
        return hosted(host, self.unit.folder, *what, binary=binary, before=before, texts=texts, step=STEP)

    def from_python(self, steps):
        one = self.unit.fresh().run(steps, step=STEP)
        return bits(one, one.get("Real", *self.unit.outputs()))

    def watched(self, folder, options):
        return real_unit.watched_library(self.unit, folder, options)


class Real3(Real):
    """Likewise of FMI 3.0."""

    fmi = "3.0"

    def __init__(self, unit):
        super().__init__(unit)
        about = read_model_description(str(unit.folder))
        self.token, self.resources = about.instantiationToken, unit.folder / "resources"
        self.binary = unit.binary("x86_64-linux")
        floats = [v for v in about.modelVariables if v.causality == "output" and v.type == "Float64"]
        self.outputs = [(v.valueReference, math.prod(v.shape)) for v in floats]
        self.references = 1 + max(v.valueReference for v in about.modelVariables)
        chosen = {v.name: v for v in about.modelVariables if v.name in TURNING}
        self.items = [(v.valueReference, item(v, TURNING[name])) for name, v in chosen.items()]

    def hosted(self, host, *what, binary=None, before=()):
        given = binary or self.binary, self.token, self.resources, self.references, self.outputs
        return hosted3(host, *given, what, items=self.items, before=before, step=STEP)

    def from_python(self, steps):
        one = Raw3(self.binary, self.resources, self.token)
        for reference, number in self.items:
            one.set("Int64", [reference], [number])
        one.start().run(steps, step=STEP)
        return bits(one, one.get("Float64", *(reference for reference, _ in self.outputs), n=self.size()))

    def size(self):
        return sum(n for _, n in self.outputs)


REALS = {"2.0": Real, "3.0": Real3}


def bits(one, values):
    """Values as the hosts print them; the instance ends."""
    one.free()
    return [value.hex() for value in values]


def item(variable, name):
    """Number of an enumeration's item."""
    return next(int(one.value) for one in variable.declaredType.items if one.name == name)


def watched_pair(unit, host, folder, sanitizer):
    """Host and library, both compiled with a sanitizer; skips where that cannot be."""
    options = "-g", f"-fsanitize={sanitizer}", "-fno-sanitize-recover=all"
    try:
        return host(unit, *options), unit.watched(folder, options)
    except subprocess.CalledProcessError:
        pytest.skip(f"the compiler has no -fsanitize={sanitizer}, or the library came without its objects")
