"""Archive of a native FMU: libraries for the platforms, one file of data, model description, documentation."""

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cranktrain.core.machine_code import code_digest
from cranktrain.fmu.archive import FMU, accompanying, archived, fmu_path, write_whole, xml_bytes
from cranktrain.fmu.arrays import Group, array_table, grouped, scalars
from cranktrain.fmu.description import Product, Variable, description2
from cranktrain.fmu.description3 import LOG_CATEGORIES, clock_table, description3
from cranktrain.fmu.model_version import model_version
from cranktrain.fmu.native.file_format import NativeFile, Texts, table, to_bytes
from cranktrain.fmu.native.interface import NativeModel, interface_tables
from cranktrain.fmu.native.link import library
from cranktrain.fmu.native.platforms import PLATFORMS

DATA = "resources/native.bin"
FMI3 = "3.0"
PRESSURES, SOURCE = "cylinder.pressure", "gas.source"
"""Names in FMI 3.0 of the array of an engine's pressure inputs, and of the parameter for the source of the gas."""
VERSIONS = ("2.0", FMI3)
"""Versions of FMI for which FMUs are built."""
FOLDERS3 = {"linux64": "x86_64-linux", "win64": "x86_64-windows", "aarch64-linux": "aarch64-linux"}
"""Folder names of binaries in FMI 3.0, each by the folder name in FMI 2.0."""
NO_GUID = "{00000000-0000-0000-0000-000000000000}"


def write_native_fmu(
    product: Product,
    model: NativeModel,
    folder: str | Path,
    platforms: Sequence[str] = ("linux64",),
    say: Callable[[str], None] = lambda text: None,
    fmi: str = "2.0",
) -> Path:
    """Write a product's native FMU, of version ``fmi``, into ``folder``; returns its path, and reports its size.

    The file is written completely or not at all. ``InputError`` if a platform's library or the clocks cannot be made.
    """
    path = fmu_path(product, folder)
    groups = grouped(product.variables) if fmi == FMI3 else ()
    variables = scalars(groups) if groups else product.variables
    data = native_data(product, model, variables, groups)
    # Equal models have equal GUIDs.
    interface = json.dumps([product.interface.units, [repr(v) for v in variables]], sort_keys=True)
    digest = hashlib.sha256(data(NO_GUID) + interface.encode()).hexdigest()
    guid = "{" + "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])) + "}"
    say(f"{product.title}: {product.model} {guid}")
    files = {DATA: data(guid)}
    for platform in platforms:
        row = PLATFORMS[platform]
        place = FOLDERS3[platform] if fmi == FMI3 else row.folder
        files[f"binaries/{place}/{product.model}{row.suffix}"] = library(model.kind(), platform, say).read_bytes()
    if fmi == FMI3:
        root = description3(product, groups, guid)
        files |= accompanying(product, arrays=[group.variable for group in groups])
    else:
        rates = {"canInterpolateInputs": "true"} if "input_rates" in model.leaves() else {}
        capabilities = {"modelIdentifier": product.model, **CAPABILITIES, **rates}
        root = description2(product, guid, "cranktrain", capabilities, LOG_CATEGORIES)
        files |= accompanying(product)
    files["modelDescription.xml"] = xml_bytes(root)
    contents = archived(files)
    write_whole(path, contents, FMU)
    say(f"{path.name}: {1e-6 * len(contents):.2f} MB, model data {1e-6 * len(files[DATA]):.2f} MB")
    return path


def native_data(
    product: Product, model: NativeModel, variables: Sequence[Variable], groups: Sequence[Group] = ()
) -> Callable[[str], bytes]:
    """Function that makes native.bin, the file of data, for a GUID; ``groups`` are the variables of FMI 3.0."""
    texts = Texts()
    names = {v.name: name for group in groups for v, name in zip(group.members, group.element_names, strict=True)}
    rows: dict[str, Any] = interface_tables(model, variables, texts, names)
    rows |= model.tables()
    about = {"model": product.model, "version": model_version(), "speed": product.interface.speed, **model.about}
    about |= {"arrays": array_table(groups)} if groups else {}
    about |= {"clocks": clock_table(product, variables)} if groups and product.interface.clock else {}
    # Entry gas of native.bin, read by fmi3_values.c: references of the pressures' array and of gas.source.
    places = {group.name: group.members[0].reference for group in groups}
    about |= {"gas": f"{places[PRESSURES]} {places[SOURCE]}"} if {PRESSURES, SOURCE} <= set(places) else {}
    digest, *films = map(code_digest, model.kind().split("+"))
    about |= {"films": films[0]} if films else {}
    rows["INFO"] = [{"name": texts.at(name), "text": texts.at(text)} for name, text in about.items()]
    tables = {name: table(name, listed) if isinstance(listed, list) else listed for name, listed in rows.items()}
    tables["TEXT"] = texts.table()
    return lambda guid: to_bytes(NativeFile(digest, guid, tables))


CAPABILITIES = {
    "needsExecutionTool": "false",
    "canHandleVariableCommunicationStepSize": "true",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canNotUseMemoryManagementFunctions": "false",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "maxOutputDerivativeOrder": "1",
    "providesDirectionalDerivative": "true",
}
