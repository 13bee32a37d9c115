"""A small native FMU: kernels in C in place of numba's, and data for them."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from functools import cache
from pathlib import Path

import numpy as np

from cranktrain.fmu import native
from cranktrain.fmu.native import file_format as ff

SOURCES = Path(native.__file__).parent / "c"
DATA = Path(__file__).resolve().parents[1] / "data" / "native"
MODEL = "MockUnit"
DIGEST, GUID = "0123456789abcdef", "{8c4e810f-3df3-4a00-8276-176fa3c9f9e0}"
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
FLAGS = ("-std=c11", "-O2", "-ffp-contract=off", "-fvisibility=hidden")
LINEAR, CUBIC, MOTION, REST = range(4)
"""Functions of the mock's kernels."""


@cache
def compiler() -> str | None:
    """A C compiler of this machine."""
    return next((found for name in ("gcc", "clang", "cc") if (found := shutil.which(name))), None)


def sources() -> list[str]:
    """C files of a mock's library."""
    return [*map(str, sorted(SOURCES.glob("*.c"))), str(DATA / "mock_kernels.c")]


def library(folder: Path, *options: str, command: tuple[str, ...] = (), suffix: str = ".so") -> Path:
    """The library, compiled with further ``options``."""
    path = folder / f"{MODEL}{suffix}"
    command = command or (str(compiler()),)
    shared = (*command, *FLAGS, *WARNINGS, *options, "-shared", "-fPIC", "-I", str(SOURCES), *sources())
    subprocess.run([*shared, "-o", str(path), "-lm"], check=True)
    return path


VARIABLES = (
    ("speed", ff.REAL, ff.INPUT, 0, 100.0, (0.0, 2000.0), ()),
    ("force", ff.REAL, ff.INPUT, 1, 10.0, (-ff.LARGEST, ff.LARGEST), ()),
    ("position", ff.REAL, ff.OUTPUT, 0, 0.0, (-ff.LARGEST, ff.LARGEST), (0,)),
    ("velocity", ff.REAL, ff.OUTPUT, 1, 0.0, (-ff.LARGEST, ff.LARGEST), (0,)),
    ("energy", ff.REAL, ff.OUTPUT, 2, 0.0, (-ff.LARGEST, ff.LARGEST), (1,)),
    ("damping", ff.REAL, ff.PARAMETER, 0, 0.5, (0.0, ff.LARGEST), ()),
    ("length", ff.REAL, ff.PARAMETER, ff.NONE, 0.35, (-ff.LARGEST, ff.LARGEST), ()),
    ("observed", ff.INTEGER, ff.OUTPUT, 3, 0.0, (-ff.LARGEST, ff.LARGEST), (1,)),
    ("repeats", ff.INTEGER, ff.PARAMETER, 3, 1.0, (1.0, 10.0), ()),
    ("moving", ff.BOOLEAN, ff.OUTPUT, 4, 0.0, (-ff.LARGEST, ff.LARGEST), (1,)),
    ("reversed", ff.BOOLEAN, ff.PARAMETER, 4, 0.0, (-ff.LARGEST, ff.LARGEST), ()),
    ("spring.level", ff.STRING, ff.PARAMETER, 0, "soft", None, ()),
    ("mount.level", ff.STRING, ff.PARAMETER, 1, "ground", None, ()),
    ("solver.method", ff.STRING, ff.PARAMETER, 2, "coarse", None, ()),
    ("author", ff.STRING, ff.PARAMETER, ff.NONE, "nobody", None, ()),
    ("solver.scheme", ff.ENUMERATION, ff.PARAMETER, 3, "second", None, ()),
)
"""Name, type, causality, index, start, bounds, families; in the order of value references."""
NOMINAL = {"speed": 100.0}
REFERENCE = {row[0]: i for i, row in enumerate(VARIABLES)}
CHOICES = (
    ("spring.level", ff.LEVEL, 0, (("soft", 0, 0.0), ("stiff", 1, 0.0))),
    ("mount.level", ff.LEVEL, 0, (("ground", 0, 0.0), ("free", 1, 0.0))),
    ("solver.method", ff.NUMBER, 1, (("coarse", 0, 1.0), ("fine", 0, 4.0))),
    ("solver.scheme", ff.NUMBER, 5, (("first", 0, 11.0), ("second", 0, 12.0), ("third", 0, 13.0))),
)
STATUSES = (
    (7, "the spring broke; push less", ff.DISCARD),
    (8, "the force pulls 100% too much", ff.ERROR),
    (9, "no static equilibrium; push less", ff.ERROR),
    (10, "damping is above 90; lower it", ff.ERROR),
    (11, "the mass has left", ff.ERROR),
)


class _Arrays:
    """Rows of ARRY, FIXU and SLOT in the making."""

    def __init__(self, blob: ff.Blob) -> None:
        self.blob, self.rows, self.fixups, self.slots = blob, [], [], []

    def slot(self, array, kind=ff.COPIED, fixups=()):
        """A piece of memory, whose row in SLOT is the next one; ``fixups`` are (element, kind, index)."""
        array = np.ascontiguousarray(array)
        kept = array.T if kind == ff.TRANSPOSED else array
        offset, size = (0, array.nbytes) if kind == ff.ZEROS else self.blob.put(kept)
        shape = (*array.shape, 0, 0, 0, 0)[:4]
        about = {"ndim": array.ndim, "itemsize": array.itemsize, "kind": kind, "first_fixup": len(self.fixups)}
        self.rows.append({"offset": offset, "bytes": size, "shape": shape, "n_fixups": len(fixups), **about})
        self.fixups += [{"byte_offset": 8 * at, "kind": what, "index": index} for at, what, index in fixups]
        self.slots.append(len(self.rows) - 1)
        return len(self.slots) - 1


def _variant(arrays: _Arrays, leaves: list, records: list, law: int, free: bool) -> dict:
    """A variant with its leaves, slots and record: laws of stiffness 100 N/m."""
    base, first_leaf = len(arrays.slots), len(leaves)
    table = np.array([[MOTION, 0, 2, 0, 0, 0], [REST, 2, 5, 0, 0, 0]], dtype=np.int64)
    functions = [(6 * k, ff.FUNCTION, row[0]) for k, row in enumerate(table.tolist())]
    address = [(0, ff.FUNCTION, law), (1, ff.RECORD, 0)]
    numbers = np.zeros(6)
    run = (
        arrays.slot(np.zeros(6 if free else 3), ff.ZEROS),
        arrays.slot(np.zeros(2), ff.ZEROS),
        arrays.slot(table, fixups=functions),
        arrays.slot(np.zeros(5), ff.ZEROS),
        arrays.slot(numbers),
        arrays.slot(np.zeros(2)),
        arrays.slot(np.zeros(2, dtype=np.int64), fixups=address),
        arrays.slot(np.array([[3.0, 4.0, 5.0], [6.0, 7.0, 8.0]]), ff.TRANSPOSED if law == CUBIC else ff.SHARED),
    )
    leaves += [{"slot": slot - base} for slot in run]
    leaves.append({"slot": ff.NONE, "value": int(free)})
    leaves.append({"slot": ff.NONE, "kind": ff.FUNCTION_LEAF, "value": MOTION})
    leaves += [{"slot": arrays.slot(np.zeros(n), ff.ZEROS) - base} for n in (1, 2)]
    n_leaves = len(leaves) - first_leaf
    records.append({"first_leaf": len(leaves), "n_leaves": 2})
    leaves.append({"slot": arrays.slot(np.array([100.0, 10.0])) - base})
    leaves.append({"slot": ff.NONE, "value": int(np.float64(1.0).view(np.uint64))})
    places = {"first_leaf": first_leaf, "n_leaves": n_leaves, "first_slot": base, "n_slots": len(arrays.slots) - base}
    return {**places, "first_record": len(records) - 1, "n_records": 1, "first_number": 0, "n_numbers": 1}


def tables(**about: str) -> dict[str, np.ndarray]:
    """All sections; ``about``: further entries of INFO."""
    texts, blob = ff.Texts(), ff.Blob()
    arrays, leaves, records = _Arrays(blob), [], []
    forms = ((LINEAR, False), (CUBIC, False), (LINEAR, True))
    variants = [_variant(arrays, leaves, records, law, free) for law, free in forms]
    variables, families, choices, options = [], [], [], []
    for name, kind, causality, index, start, bounds, needed in VARIABLES:
        row = {"name": texts.at(name), "type": kind, "causality": causality, "index": index}
        row |= {"first_family": len(families), "n_families": len(needed)}
        families += needed
        if bounds is None:
            row["start_text"] = texts.at(start)
        else:
            row |= {"start": start, "min": bounds[0], "max": bounds[1], "nominal": NOMINAL.get(name, 0.0)}
        variables.append(row)
    for name, kind, index, listed in CHOICES:
        first = {"first_option": len(options), "n_options": len(listed)}
        choices.append({"name": texts.at(name), "kind": kind, "index": index, **first})
        options += [{"text": texts.at(text), "value": value, "number": number} for text, value, number in listed]
    refusal = ff.REFUSED | texts.at("a stiff spring needs mount.level ground; choose it")
    leaf = {"state": 0, "inputs": 1, "families": 2, "outputs": 3, "numbers": 4, "input_rates": 11}
    about = {"model": MODEL, "speed": "speed", **about}
    made = {
        "VARS": variables,
        "FAMS": families,
        "CHOI": choices,
        "OPTN": options,
        "LEVL": [0, 2, 1, refusal],
        "VARI": variants,
        "NUMB": [{"slot": 2, "value": 2.0}],
        "SLOT": arrays.slots,
        "LEAF": leaves,
        "RECS": records,
        "ARRY": arrays.rows,
        "FIXU": arrays.fixups,
        "NAME": [{"name": texts.at(name), "leaf": place} for name, place in leaf.items()],
        "STAT": [{"code": code, "text": texts.at(text), "kind": kind} for code, text, kind in STATUSES],
        "INFO": [{"name": texts.at(k), "text": texts.at(v)} for k, v in about.items()],
    }
    whole = {section: ff.table(section, rows) for section, rows in made.items()}
    return {**whole, "TEXT": texts.table(), "BLOB": blob.table()}


def native_bin(**about: str) -> bytes:
    """The file."""
    return ff.to_bytes(ff.NativeFile(DIGEST, GUID, tables(**about)))


def description() -> str:
    """A model description of the mock."""
    tags = {ff.REAL: "Real", ff.INTEGER: "Integer", ff.BOOLEAN: "Boolean", ff.STRING: "String"}
    causes = {ff.INPUT: "input", ff.OUTPUT: "output", ff.PARAMETER: "parameter"}
    lines, outputs = [], []
    for i, (name, kind, causality, _, start, _, _) in enumerate(VARIABLES):
        fixed, output = causality == ff.PARAMETER, causality == ff.OUTPUT
        continuous = "continuous" if kind == ff.REAL else "discrete"
        text = str(start).lower() if kind == ff.BOOLEAN else start
        text = int(start) if kind in (ff.INTEGER, ff.BOOLEAN) else 2 if kind == ff.ENUMERATION else text
        value = "" if output else f' start="{text}"'
        inner = f'<Enumeration declaredType="Scheme"{value}/>' if kind == ff.ENUMERATION else f"<{tags[kind]}{value}/>"
        initial = ' initial="calculated"' if output else ' initial="exact"' if fixed else ""
        about = f'causality="{causes[causality]}" variability="{"fixed" if fixed else continuous}"{initial}'
        lines.append(f'<ScalarVariable name="{name}" valueReference="{i}" {about}>{inner}</ScalarVariable>')
        outputs += [i + 1] * output
    unknowns = "".join(f'<Unknown index="{i}"/>' for i in outputs)
    items = "".join(f'<Item name="{name}" value="{i}"/>' for i, name in enumerate(("first", "second", "third"), 1))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{MODEL}" guid="{GUID}">
<CoSimulation modelIdentifier="{MODEL}" canHandleVariableCommunicationStepSize="true" canInterpolateInputs="true"
 maxOutputDerivativeOrder="1" providesDirectionalDerivative="true" canGetAndSetFMUstate="true"
 canSerializeFMUstate="true"/>
<TypeDefinitions><SimpleType name="Scheme"><Enumeration>{items}</Enumeration></SimpleType></TypeDefinitions>
<DefaultExperiment startTime="0" stopTime="0.1" stepSize="1e-3"/>
<ModelVariables>{"".join(lines)}</ModelVariables>
<ModelStructure><Outputs>{unknowns}</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""


def pack(folder: Path, binary: Path) -> Path:
    """The FMU."""
    path = folder / f"{MODEL}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description())
        archive.writestr("resources/native.bin", native_bin())
        archive.write(binary, f"binaries/linux64/{MODEL}.so")
    return path
