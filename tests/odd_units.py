"""A foreign FMU in C that misbehaves as the environment says, and archives that are hostile."""

from __future__ import annotations

import io
import shutil
import struct
import subprocess
import warnings
import zipfile
from pathlib import Path
from typing import NamedTuple

from cranktrain_lab.coupling.master import Exchange


class System(NamedTuple):
    """What a supervised run is of."""

    units: dict
    connections: list
    exchange: Exchange
    outputs: dict
    bonds: list | tuple = ()


SOURCE = Path(__file__).parent / "data" / "native" / "odd_unit.c"
XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Odd" guid="{{odd}}">{more}
<CoSimulation modelIdentifier="{identifier}" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<ScalarVariable name="in" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
<ScalarVariable name="out" valueReference="1" causality="output"><Real/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="2" dependencies="1"/></Outputs></ModelStructure>
</fmiModelDescription>
"""
XML_3 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Odd" instantiationToken="{odd}">
<CoSimulation modelIdentifier="Odd" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<Float64 name="time" valueReference="4" causality="independent" variability="continuous"/>
<Float64 name="in" valueReference="0" causality="input" start="0"/>
<Float64 name="out" valueReference="1" causality="output"/>
<Float64 name="row" valueReference="2" causality="input" start="0.1 0.2 0.3"><Dimension start="3"/></Float64>
<Float64 name="sums" valueReference="3" causality="output"><Dimension start="3"/></Float64>
</ModelVariables>
<ModelStructure>
<Output valueReference="1" dependencies=""/><Output valueReference="3" dependencies=""/>
</ModelStructure>
</fmiModelDescription>
"""
PLAIN = XML.format(more="", identifier="Odd")
LIBRARY = "binaries/linux64/Odd.so"
DESCRIBED = {"2.0": (PLAIN, LIBRARY), "3.0": (XML_3, "binaries/x86_64-linux/Odd.so")}
"""By version the model description, and where the library is, which has the functions of both."""


def odd_unit(folder: Path, fmi: str = "2.0") -> Path:
    """The FMU of a version of FMI, compiled."""
    text, place = DESCRIBED[fmi]
    library = folder / "Odd.so"
    command = [str(shutil.which("cc")), "-std=gnu11", "-O1", "-shared", "-fPIC", "-w", str(SOURCE), "-o", str(library)]
    subprocess.run([*command, "-lpthread"], check=True)
    return packed(folder / "Odd.fmu", {"modelDescription.xml": text, place: library.read_bytes()})


def packed(path: Path, entries: dict[str, str | bytes]) -> Path:
    """An archive of some entries."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return path


def _with(**more: str | bytes) -> dict[str, str | bytes]:
    return {"modelDescription.xml": PLAIN, LIBRARY: b"\x7fELF", **{k.replace("__", "/"): v for k, v in more.items()}}


def _named(name: str) -> dict[str, str | bytes]:
    return {**_with(), name: "x"}


ENTRIES: dict[str, dict[str, str | bytes]] = {
    "leads up": _named("../../escaped"),
    "leads up within": _named("resources/../../escaped"),
    "absolute": _named("/escaped"),
    "drive": _named("C:/escaped"),
    "backslash": _named("resources\\..\\..\\escaped"),
    "here": _named("./x"),
    "nameless": _named("resources//x"),
    "long name": _named(f"resources/{'n' * 300}"),
    "control characters": _named("resources/\x1b[2J"),
    "two capitals": _with(resources__a="1", resources__A="2"),
    "file and folder": {**_with(), "resources/a": "1", "resources/a/b": "2"},
    "no description": {LIBRARY: b"x"},
    "empty description": {"modelDescription.xml": "", LIBRARY: b"x"},
    "not XML": {"modelDescription.xml": b"\x00\xff\xfe", LIBRARY: b"x"},
    "deep XML": {"modelDescription.xml": "<a>" * 100_000, LIBRARY: b"x"},
    "billion laughs": {
        "modelDescription.xml": '<!DOCTYPE l [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;">]><l>&b;</l>', LIBRARY: b"x",
    },
    "file of this machine": {
        "modelDescription.xml": PLAIN.replace("?>\n", '?>\n<!DOCTYPE f [<!ENTITY x SYSTEM "file:///etc/passwd">]>')
        .replace('modelName="Odd"', 'modelName="&x;"'), LIBRARY: b"x",
    },
    "another library": {**_with(), "modelDescription.xml": XML.format(more="", identifier="../../../../elsewhere/x")},
    "no library": {**_with(), "modelDescription.xml": XML.format(more="", identifier="Other")},
    "no ELF": _with(),
    "bomb": {**_with(), "resources/zeros": bytes(200 << 20)},
    "large description": {"modelDescription.xml": PLAIN + " " * (65 << 20), LIBRARY: b"x"},
    "many entries": {**_with(), **{f"resources/{k}": "" for k in range(20_001)}},
}  # fmt: skip
"""Entries of hostile archives, by what is wrong with them."""


def _doubled(path: Path) -> None:
    """The same name twice."""
    packed(path, _with())
    with warnings.catch_warnings(), zipfile.ZipFile(path, "a") as archive:
        warnings.simplefilter("ignore")
        archive.writestr("modelDescription.xml", PLAIN)


def _linked(path: Path) -> None:
    """A library that is a link to one of the machine."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", PLAIN)
        link = zipfile.ZipInfo(LIBRARY)
        link.external_attr = 0o120777 << 16
        archive.writestr(link, "/usr/lib/libc.so.6")


def _encrypted(path: Path) -> None:
    """Entries that are said to be encrypted."""
    content = bytearray(packed(path, _with()).read_bytes())
    for mark, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        at = content.find(mark)
        while at >= 0:
            content[at + place] |= 1
            at = content.find(mark, at + 4)
    path.write_bytes(content)


def _shared(path: Path) -> None:
    """Entries that share their bytes: each becomes 10 MB, of 10 kB in all."""
    packed(path, {**_with(), "resources/0": bytes(10 << 20)})
    content = path.read_bytes()
    end = content.rfind(b"PK\x05\x06")
    count, _, _, begin = struct.unpack_from("<HHII", content, end + 8)
    rows, at = [], begin
    for _ in range(count):
        n, extra, remark = struct.unpack_from("<HHH", content, at + 28)
        rows.append(content[at : at + 46 + n + extra + remark])
        at += len(rows[-1])
    more = [rows[-1][:46] + f"resources/{k:01d}".encode() + rows[-1][46 + 11 :] for k in range(1, 10)] * 20
    table = b"".join(rows + more)
    path.write_bytes(content[:begin] + table + b"PK\x05\x06" + struct.pack(
        "<HHHHIIH", 0, 0, count + len(more), count + len(more), len(table), begin, 0
    ))  # fmt: skip


def _cut(path: Path) -> None:
    content = packed(path, _with()).read_bytes()
    path.write_bytes(content[: len(content) // 2])


def _understated(path: Path) -> None:
    """A bomb that states a small size."""
    content = bytearray(packed(path, {**_with(), "resources/zeros": bytes(100 << 20)}).read_bytes())
    for mark, place in ((b"PK\x03\x04", 22), (b"PK\x01\x02", 24)):
        struct.pack_into("<I", content, content.rfind(mark) + place, 1000)
    path.write_bytes(content)


def _packed_otherwise(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as archive:
        for name, text in _with().items():
            archive.writestr(name, text)


def _nested(path: Path) -> None:
    """An archive in an archive in place of an FMU."""
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as archive:
        archive.writestr("modelDescription.xml", PLAIN)
    packed(path, {"inner.fmu": inner.getvalue()})


def _empty(path: Path) -> None:
    path.write_bytes(b"")


MADE = {
    "one name twice": _doubled, "a link": _linked, "encrypted": _encrypted, "shared bytes": _shared, "cut": _cut,
    "understated": _understated, "packed otherwise": _packed_otherwise, "nested": _nested, "empty": _empty,
}  # fmt: skip
"""Further hostile archives, each a function of its path."""


def hostile(name: str, path: Path) -> Path:
    """A hostile archive."""
    if name in ENTRIES:
        return packed(path, ENTRIES[name])
    MADE[name](path)
    return path
