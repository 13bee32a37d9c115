"""The archive: engine, reduced bodies, interface and running code in one FMU.

Equal inputs give equal bytes: the GUID is a digest of interface, code and data, the archive has sorted names and one
date.
"""

from __future__ import annotations

import hashlib
import html
import importlib.metadata
import io
import json
import sys
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from cranktrain import __version__
from cranktrain.core.errors import InputError
from cranktrain.engine.model import Engine
from cranktrain.fmu.description import Interface, Variable, complete, expand, plain, read_interface, variable_table
from cranktrain.fmu.flat import FlatModel, to_bytes
from cranktrain.fmu.running_code import SOURCES, renamed, running_code
from cranktrain.store.whole_file import Kind, check_place, marked, whole_file

ROOT = SOURCES.parent
DESCRIPTION = ROOT / "modelDescription"
SLAVE = "cranktrain_slave.py"
SLAVE_MODULE = """import ctypes

from {0} import CranktrainSlave

ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))  # the loader gives one away at each instantiation
"""
PLATFORMS = ("linux64", "win64")


def build(
    model: FlatModel,
    folder: str | Path,
    say: Callable[[str], None] = lambda text: None,
    interface: Interface | None = None,
    fixed: Mapping[str, Any] | None = None,
    suffix: str = "",
) -> Path:
    """Write the FMU of a model into ``folder``; returns its path and says how large it is.

    ``interface`` defaults to the full one, ``fixed`` are settings that no variable of it changes, ``suffix`` ends the
    model's name. The file appears whole or not at all. ``InputError`` where the interface or the code cannot go into an
    FMU.
    """
    interface = interface or full_interface()
    engine, folder = model.engine, Path(folder)
    contents = _contents(engine, interface, to_bytes(model), fixed or {}, suffix)
    say(f"{engine.name}: {contents.model} {contents.guid}")
    path = folder / f"{contents.model}.fmu"
    files = _wrapped(contents)
    root = ElementTree.fromstring(files["modelDescription.xml"])
    complete(root, interface, contents.variables, contents.guid)
    files["modelDescription.xml"] = _xml(root)
    files.update(_accompanying(interface, engine))
    archive = _archive(files)
    write_whole(path, archive, FMU)
    say(f"{path.name}: {1e-6 * len(archive):.2f} MB, model data {1e-6 * len(contents.resources['model.bin']):.2f} MB")
    return path


def full_interface() -> Interface:
    """The interface with all variables; ``InputError`` where the sources of the FMU do not lie beside the package."""
    if not (DESCRIPTION / "interface.toml").is_file() or not (SOURCES / SLAVE).is_file():
        raise InputError(
            f"an FMU is built from cranktrain's repository; {ROOT} has no modelDescription or {SLAVE}: "
            "install with pip install -e from a clone"
        )
    return read_interface(DESCRIPTION)


def model_description(engine: Engine) -> bytes:
    """The model description of an engine's FMU; the GUID is that of an FMU without data, there being no FE model."""
    interface = full_interface()
    contents = _contents(engine, interface, b"")
    root = ElementTree.fromstring(_wrapped(contents)["modelDescription.xml"])
    complete(root, interface, contents.variables, contents.guid)
    return _xml(root)


def write_reference(path: Path, say: Callable[[str], None]) -> None:
    """Write NAME_in.csv, NAME_ref.csv and NAME_ref.opt beside an FMU: the default experiment at its start values."""
    from fmpy import read_model_description, simulate_fmu

    say(f"{path.stem}: reference results of the default experiment")
    description = read_model_description(str(path))
    experiment = description.defaultExperiment
    start, stop, step = (float(getattr(experiment, name)) for name in ("startTime", "stopTime", "stepSize"))
    speed = next(v.start for v in description.modelVariables if v.name == "speed")
    rows = [["time", "speed"], [repr(start), speed], [repr(stop), speed]]  # no pressures: the gas stays built in
    result = simulate_fmu(str(path), output_interval=step)
    options = f"StartTime, {start!r}\nStopTime, {stop!r}\nStepSize, {step!r}\nRelTol, 0.0001\n"
    table = [list(result.dtype.names or ())] + [[repr(value) for value in row.tolist()] for row in result]
    for (ending, kind), data in zip(REFERENCE.items(), (_csv(rows), _csv(table), options.encode()), strict=True):
        write_whole(path.with_name(path.stem + ending), data, kind)


def _csv(rows: list[list[str]]) -> bytes:
    return "\n".join(",".join(row) for row in rows).encode()


@dataclass(frozen=True)
class Contents:
    """What goes into resources/: names, and bytes by name."""

    model: str
    guid: str
    slave: str
    variables: tuple[Variable, ...]
    resources: dict[str, bytes]


def _contents(
    engine: Engine, interface: Interface, data: bytes, fixed: Mapping[str, Any] | None = None, suffix: str = ""
) -> Contents:
    code = running_code()
    package = f"cranktrain_{_digest(code)[:12]}"
    files = {f"{package}/{name}": renamed(text, package) for name, text in code.items()}
    variables = expand(interface.variables, family_counts(engine))
    slave = (SOURCES / SLAVE).read_bytes()
    about = {
        "model": model_name(engine, interface, suffix),
        "package": package,
        "author": "Cranktrain contributors",
        "license": "BSD-3-Clause",
        "version": __version__,
        "reals": sum(v.type == "Real" for v in variables),
        "variables": [plain(v) for v in variables],
        "fixed": dict(fixed or {}),
    }
    table = json.dumps(about, sort_keys=True).encode()
    units = json.dumps([interface.units, [repr(v) for v in variables]], sort_keys=True).encode()
    digest = _digest({**files, "slave": slave, "variables": table, "units": units, "model": data})
    about["digest"] = digest
    files["variables.json"] = json.dumps(about, sort_keys=True, indent=1).encode()
    files["model.bin"] = data
    name = f"cranktrain_slave_{digest[:12]}"
    files[f"{name}_class.py"] = slave
    files[f"{name}.py"] = SLAVE_MODULE.format(f"{name}_class").encode()
    guid = "{" + "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])) + "}"
    return Contents(str(about["model"]), guid, name, variables, files)


def model_name(engine: Engine, interface: Interface, suffix: str = "") -> str:
    """Name of an FMU, and of its file without the ending."""
    return interface.prefix + "".join(part.capitalize() for part in engine.name.split("_")) + suffix


def check_target(folder: Path, engine: Engine) -> None:
    """Refuse, before the work, a folder or file that the FMU of an engine must not take; ``InputError``."""
    check_place(folder / f"{model_name(engine, full_interface())}.fmu", FMU)


def family_counts(engine: Engine) -> dict[str, int]:
    """How many members each family of interface.toml has for an engine."""
    mounts = len(engine.mounts.x) if engine.mounts is not None else 0
    return {"cylinders": engine.n_cylinders, "main_bearings": len(engine.crankshaft.main_widths), "mounts": mounts}


def _digest(files: dict[str, bytes]) -> str:
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(f"{name}\0{len(files[name])}\0".encode() + files[name])
    return digest.hexdigest()


def _wrapped(contents: Contents) -> dict[str, bytes]:
    """Files of the FMU as the wrapping library builds it, by name in the archive."""
    from pythonfmu import FmuBuilder

    with tempfile.TemporaryDirectory(prefix="cranktrain_fmu_") as temporary:
        source, built = Path(temporary) / "resources", Path(temporary) / "built"
        for name, data in contents.resources.items():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes(data)
        path, modules = list(sys.path), set(sys.modules)
        sys.path.insert(0, str(source))
        try:
            fmu = FmuBuilder.build_FMU(
                source / f"{contents.slave}.py",
                dest=built,
                project_files=[p for p in source.iterdir() if p.name != f"{contents.slave}.py" and p.name[0] != "_"],
                canGetAndSetFMUstate=True,
                canSerializeFMUstate=True,
            )
        finally:
            sys.path[:] = path
            for name in set(sys.modules) - modules:
                if name.startswith("cranktrain_slave_"):
                    del sys.modules[name]
        with zipfile.ZipFile(fmu) as archive:
            return {
                name: archive.read(name)
                for name in archive.namelist()
                if not name.startswith("binaries/") or name.split("/")[1] in PLATFORMS
            }


def _accompanying(interface: Interface, engine: Engine) -> dict[str, bytes]:
    """Documentation, licences and icon."""
    page = (DESCRIPTION / "documentation" / "index.html").read_text(encoding="utf-8")
    page = page.replace("<!-- title -->", html.escape(engine.title))
    page = page.replace("<!-- variables -->", variable_table(interface, family_counts(engine)))
    files = {"documentation/index.html": page.encode(), "model.png": (DESCRIPTION / "model.png").read_bytes()}
    files["documentation/externalDependencies.txt"] = (DESCRIPTION / "externalDependencies.txt").read_bytes()
    files["documentation/licenses/license.txt"] = (ROOT / "LICENSE").read_bytes()
    for file in importlib.metadata.files("pythonfmu") or ():
        if file.name == "LICENSE":
            files["documentation/licenses/pythonfmu.txt"] = file.read_binary()
    return files


def _is_ours(path: Path) -> bool:
    """Whether a file is an FMU that was built here."""
    if not zipfile.is_zipfile(path):
        return False
    with zipfile.ZipFile(path) as archive:
        return any(name.startswith("resources/cranktrain_slave_") for name in archive.namelist())


FMU = Kind("FMU of cranktrain", _is_ours)
REFERENCE = {
    "_in.csv": marked("input of an FMU of cranktrain", "time,speed\n"),
    "_ref.csv": marked("reference of an FMU of cranktrain", "crank.angle"),
    "_ref.opt": marked("options of a reference of cranktrain", "StartTime, "),
}
XML = marked("model description of cranktrain", 'modelName="Cranktrain')


def write_whole(path: Path, data: bytes, kind: Kind) -> None:
    """Write a file that appears whole or not at all, in place of one of its kind only."""
    with whole_file(path, kind) as temporary:
        temporary.write_bytes(data)


def _xml(root: ElementTree.Element) -> bytes:
    for element in root.iter():  # the library's line breaks, to be set anew
        element.tail = None
        if element.text is not None and not element.text.strip():
            element.text = None
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _archive(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, files[name])
    return buffer.getvalue()
