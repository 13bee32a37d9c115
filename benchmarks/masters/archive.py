"""What an SSP holds, for masters that read less of it than there is."""

from __future__ import annotations

import zipfile
from typing import NamedTuple
from xml.etree import ElementTree

from cranktrain_lab.coupling.ssp import SSD, SSV


class System(NamedTuple):
    """Sources of units by name, links ``(unit, output, unit, input)`` and values ``(unit, variable, type, value)``."""

    units: dict[str, str]
    links: list[tuple[str, str, str, str]]
    values: list[tuple[str, str, str, str]]


def read_archive(path: str) -> System:
    """Read one that ``cranktrain couple --export-ssp`` wrote."""
    with zipfile.ZipFile(path) as archive:
        root = ElementTree.fromstring(archive.read("SystemStructure.ssd"))
        units, values = {}, []
        for component in root.iter(f"{{{SSD}}}Component"):
            units[component.attrib["name"]] = component.attrib["source"]
            for binding in component.iter(f"{{{SSD}}}ParameterBinding"):
                parameters = ElementTree.fromstring(archive.read(binding.attrib["source"]))
                for row in parameters.iter(f"{{{SSV}}}Parameter"):
                    kind = row[0].tag.partition("}")[2]
                    values.append((component.attrib["name"], row.attrib["name"], kind, row[0].attrib["value"]))
    ends = "startElement", "startConnector", "endElement", "endConnector"
    links = [tuple(link.attrib[end] for end in ends) for link in root.iter(f"{{{SSD}}}Connection")]
    return System(units, links, values)  # type: ignore[arg-type]
