"""Archive (.fmu file) of an FMU: a module's data, its interface and its running code.

Equal inputs give equal bytes: the GUID is a digest of interface, code and data, and the archive has sorted names and
one date.
"""

import hashlib
import html
import importlib
import importlib.metadata
import io
import json
import os
import zipfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import LIBRARIES, OFF, SEAL, WHOLE, code_digest, kind_of, library_name
from cranktrain.fmu.description import Interface, Product, Variable, description2, plain, variable_table
from cranktrain.fmu.model_version import model_version
from cranktrain.fmu.native.link import library
from cranktrain.fmu.running_code import SOURCES, renamed, running_code
from cranktrain.fmu.terminals_and_icons import FOLDER, icons, terminals_and_icons
from cranktrain.store.whole_file import Kind, check_place, marked, whole_file

CARRIED = Path(__file__).parent / "carried"
"""Folder with the parts of the repository that a wheel contains, see setup.py."""
ROOT = CARRIED if CARRIED.is_dir() else SOURCES.parent
DESCRIPTION = ROOT / "modelDescription"
SLAVE = (CARRIED if CARRIED.is_dir() else SOURCES) / "cranktrain_slave.py"
SLAVE_MODULE = """import ctypes

from {0} import CranktrainSlave

ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))  # the loader gives one away at each instantiation
"""
PLATFORMS = ("linux64", "win64")
"""Platforms of pythonfmu's libraries."""
CAPABILITIES = {
    "needsExecutionTool": "true",
    "canHandleVariableCommunicationStepSize": "true",
    "canInterpolateInputs": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "canNotUseMemoryManagementFunctions": "true",
}
CATEGORIES = {
    "logStatusWarning": "Log messages with fmi2Warning status.",
    "logStatusDiscard": "Log messages with fmi2Discard status.",
    "logStatusError": "Log messages with fmi2Error status.",
    "logStatusFatal": "Log messages with fmi2Fatal status.",
    "logAll": "Log all messages.",
}
"""Capabilities and log categories of pythonfmu's libraries."""


def write_fmu(product: Product, folder: str | Path, say: Callable[[str], None] = lambda text: None) -> Path:
    """Write the FMU of a product into ``folder``; returns its path, and reports its size through ``say``.

    The file is written completely or not at all. ``InputError`` if interface or code cannot be put into an FMU.
    """
    contents = _contents(product)
    say(f"{product.title}: {product.model} {contents.guid}")
    path = fmu_path(product, folder)
    contents.resources.update(_libraries(product, contents.package, say))
    files = {f"resources/{name}": data for name, data in contents.resources.items()}
    files |= _wrapping(product.model) | accompanying(product)
    files["resources/slavemodule.txt"] = contents.slave.encode()
    files["documentation/externalDependencies.txt"] = (DESCRIPTION / "externalDependencies.txt").read_bytes()
    files["modelDescription.xml"] = _description(product, contents.guid)
    archive = archived(files)
    write_whole(path, archive, FMU)
    say(f"{path.name}: {1e-6 * len(archive):.2f} MB, model data {1e-6 * len(product.data):.2f} MB")
    return path


def fmu_path(product: Product, folder: str | Path) -> Path:
    """Path of a product's FMU; ``InputError`` for a path that must not be replaced."""
    path = Path(folder) / f"{product.model}.fmu"
    check_place(path, FMU)
    return path


def need_sources() -> None:
    """Raise ``InputError`` if the sources of the FMU are not next to the package."""
    if not (DESCRIPTION / "interface.toml").is_file() or not SLAVE.is_file():
        raise InputError(
            f"an FMU is built from cranktrain's clone or wheel; {ROOT} has no modelDescription or {SLAVE.name}: "
            "install a wheel made by 'make wheel', or pip install -e a clone"
        )


def model_description(product: Product) -> bytes:
    """Model description (XML) of a product's FMU."""
    return _description(product, _contents(product).guid)


def _description(product: Product, guid: str) -> bytes:
    tool = f"PythonFMU {importlib.metadata.version('pythonfmu')}"
    return xml_bytes(description2(product, guid, tool, CAPABILITIES | {"modelIdentifier": product.model}, CATEGORIES))


def write_reference(path: Path, interface: Interface, say: Callable[[str], None]) -> None:
    """Write NAME_in.csv, NAME_ref.csv and NAME_ref.opt next to an FMU: reference run of its default experiment."""
    from fmpy import read_csv, read_model_description, simulate_fmu

    say(f"{path.stem}: reference results of the default experiment")
    description = read_model_description(str(path))
    experiment = description.defaultExperiment
    start, stop, step = (float(getattr(experiment, name)) for name in ("startTime", "stopTime", "stepSize"))
    starts = {v.name: v.start for v in description.modelVariables}
    ends = {name: [repr(v) for v in values] or 2 * [starts[name]] for name, values in interface.reference.items()}
    rows = [
        ["time", *ends],
        [repr(start), *(e[0] for e in ends.values())],
        [repr(stop), *(e[1] for e in ends.values())],
    ]
    given = path.with_name(path.stem + "_in.csv")
    _write_reference(given, _csv(rows), ",".join(rows[0]) + "\n")
    with redirect_stdout(io.StringIO()):  # hides FMPy's messages on inputs that the file of inputs lacks
        result = simulate_fmu(str(path), output_interval=step, input=read_csv(str(given)))
    options = f"StartTime, {start!r}\nStopTime, {stop!r}\nStepSize, {step!r}\nRelTol, 0.0001\n"
    columns = {name: result[name].reshape(len(result), -1).T for name in result.dtype.names or ()}
    heads = [
        head
        for name, found in columns.items()
        for head in ([name] if result[name].ndim == 1 else [f"{name}[{k + 1}]" for k in range(len(found))])
    ]
    rows_of = zip(*(column.tolist() for found in columns.values() for column in found), strict=True)
    table = [heads] + [[repr(value) for value in row] for row in rows_of]
    _write_reference(path.with_name(path.stem + "_ref.csv"), _csv(table), ",".join(table[0][:2]))
    _write_reference(path.with_name(path.stem + "_ref.opt"), options.encode(), "StartTime, ")


def _write_reference(path: Path, data: bytes, mark: str) -> None:
    """Write a file of a reference run; an existing file is replaced only if it contains ``mark``."""
    ending = next(ending for ending in REFERENCE if path.name.endswith(ending))
    write_whole(path, data, marked(REFERENCE[ending], mark))


def _csv(rows: list[list[str]]) -> bytes:
    return "\n".join(",".join(row) for row in rows).encode()


@dataclass(frozen=True)
class Contents:
    """Contents of the FMU's folder resources/: names of package and slave, and files by name."""

    guid: str
    package: str
    slave: str
    resources: dict[str, bytes]


def _contents(product: Product) -> Contents:
    code = running_code(product.running)
    package = f"cranktrain_{_digest(code)[:12]}"
    files = {f"{package}/{name}": renamed(text, package) for name, text in code.items()}
    interface, variables = product.interface, product.variables
    slave = SLAVE.read_bytes()
    about = {
        "model": product.model,
        "package": package,
        "running": product.running.partition(".")[2],
        "author": "Cranktrain contributors",
        "license": "BSD-3-Clause",
        "version": model_version(),
        "reals": sum(v.type == "Real" for v in variables),
        "speed": next(v.reference for v in variables if v.name == interface.speed),
        "variables": [plain(v) for v in variables],
        "fixed": dict(product.fixed),
    }
    table = json.dumps(about, sort_keys=True).encode()
    units = json.dumps([interface.units, [repr(v) for v in variables]], sort_keys=True).encode()
    digest = _digest({**files, "slave": slave, "variables": table, "units": units, "model": product.data})
    about["digest"] = digest
    files["variables.json"] = json.dumps(about, sort_keys=True, indent=1).encode()
    files["model.bin"] = product.data
    name = f"cranktrain_slave_{digest[:12]}"
    files[f"{name}_class.py"] = slave
    files[f"{name}.py"] = SLAVE_MODULE.format(f"{name}_class").encode()
    guid = "{" + "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])) + "}"
    return Contents(guid, package, name, files)


def _libraries(product: Product, package: str, say: Callable[[str], None]) -> dict[str, bytes]:
    """Machine code of the product's kernels for the platforms in this installation, by file name in resources/.

    It does not enter the GUID, because without it the same code runs, compiled at the first start.
    """
    if os.environ.get(OFF):
        return {}
    kind, files = kind_of(product.running), {}
    kind = WHOLE if kind in WHOLE.split("+") else kind
    for platform in PLATFORMS:
        try:
            made = library(kind, platform, say, emit=False)
        except (InputError, OSError) as error:
            say(f"no machine code for {platform}, so that kernels are compiled at the first start there: {error}")
        else:
            files[f"{platform}/{library_name(kind, made.suffix)}"] = made.read_bytes()
    if files:
        files[SEAL] = "".join(f"{part} {code_digest(part)}\n" for part in kind.split("+")).encode()
    place = LIBRARIES.relative_to(SOURCES / "cranktrain").as_posix()
    return {f"{package}/{place}/{name}": content for name, content in files.items()}


def _digest(files: dict[str, bytes]) -> str:
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(f"{name}\0{len(files[name])}\0".encode() + files[name])
    return digest.hexdigest()


def _wrapping(model: str) -> dict[str, bytes]:
    """Files of pythonfmu in a Python FMU, by name in the archive: its modules, its libraries, and its licence."""
    files = {}
    for file in importlib.metadata.files("pythonfmu") or ():
        if file.parent.name == "pythonfmu" and file.suffix == ".py":
            files[f"resources/pythonfmu/{file.name}"] = file.read_binary()
        elif file.parent.name in PLATFORMS:
            files[f"binaries/{file.parent.name}/{model}{file.suffix}"] = file.read_binary()
        elif file.name == "LICENSE":
            files["documentation/licenses/pythonfmu.txt"] = file.read_binary()
    return files


def accompanying(product: Product, arrays: Sequence[Variable] | None = None) -> dict[str, bytes]:
    """Documentation, licence, terminals and icons, by name in the archive.

    ``arrays`` are the variables of an FMU of FMI 3.0, in which families are arrays.
    """
    frame, page = (
        (folder / "documentation" / name).read_text(encoding="utf-8")
        for folder, name in ((DESCRIPTION, "frame.html"), (product.pages, "index.html"))
    )
    page = frame.replace("<!-- page -->", page.strip())
    page = page.replace("<!-- title -->", html.escape(product.title))
    page = page.replace("<!-- variables -->", variable_table(product.interface, product.counts, arrays is not None))
    picture = (product.pages / "model.png").read_bytes()
    variables = product.variables if arrays is None else arrays
    files = {"documentation/index.html": page.encode()} | ({"model.png": picture} if arrays is None else {})
    files |= icons(variables, picture, DESCRIPTION / FOLDER)
    files[f"{FOLDER}/{FOLDER}.xml"] = xml_bytes(terminals_and_icons(variables))
    files["documentation/licenses/license.txt"] = (ROOT / "LICENSE").read_bytes()
    return files


def _is_ours(path: Path) -> bool:
    """True if a file is an FMU that cranktrain built."""
    if not zipfile.is_zipfile(path):
        return False
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    return "resources/native.bin" in names or any(name.startswith("resources/cranktrain_slave_") for name in names)


FMU = Kind("FMU of cranktrain", _is_ours)
REFERENCE = {
    "_in.csv": "input of an FMU of cranktrain",
    "_ref.csv": "reference of an FMU of cranktrain",
    "_ref.opt": "options of a reference of cranktrain",
}
"""File name endings of a reference run, and their contents."""
XML = marked("model description of cranktrain", 'author="Cranktrain')


def write_whole(path: Path, data: bytes, kind: Kind) -> None:
    """Write a file completely or not at all; replaces only a file of its kind."""
    with whole_file(path, kind) as temporary:
        temporary.write_bytes(data)


def xml_bytes(root: ElementTree.Element) -> bytes:
    """XML document as bytes, with uniform indentation."""
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def archived(files: Mapping[str, bytes]) -> bytes:
    """Bytes of a ZIP archive of named files; equal files give equal bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, files[name])
    return buffer.getvalue()
