"""SSP 2.0 of FMUs of FMI 3.0: whole arrays as connectors, connections and parameters; valid by the standard's schema.

``tests/data/ssp2`` holds the schema of SSP 2.0 (github.com/modelica/ssp-standard, tag v2.0), under the BSD 2-clause
licence that stands in each file.
"""

import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest
from fmus_by_version import torsional_fmu
from lxml import etree

from cranktrain.core.errors import InputError
from cranktrain.fmu.build import build_fmu
from cranktrain_lab.coupling.connections import Connection
from cranktrain_lab.coupling.fmu3_unit import open_fmu
from cranktrain_lab.coupling.modules import COMBUSTION, CRANKTRAIN, VALVETRAIN
from cranktrain_lab.coupling.ssp import write_ssp
from cranktrain_lab.coupling.virtual_engine import Partners, virtual_engine

SCHEMAS = Path(__file__).resolve().parents[1] / "data" / "ssp2"
SPACES = {
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
}
SPEED = 209.4


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    """Paths of the six's modules, of FMI 3.0, and of the combustion of FMI 2.0."""
    folder = tmp_path_factory.mktemp("fmus")
    try:
        return {
            COMBUSTION: build_fmu("combustion_i6", folder, platforms=("linux64",), fmi="3.0"),
            VALVETRAIN: build_fmu("valvetrain_i6", folder, platforms=("linux64",), fmi="3.0"),
            CRANKTRAIN: torsional_fmu("diesel_i6", folder, "3.0"),
            "scalars": build_fmu("combustion_i6", folder / "two", platforms=("linux64",)),
        }
    except InputError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def files(fmus, tmp_path_factory):
    """Files of the virtual engine's SSP, with start values of elements, enumerations and reals."""
    values = {
        CRANKTRAIN: {"crank.level": "torsional", "cylinder[2].firing_angle": 8.377580409572783, "gas.delay": 1.0},
        COMBUSTION: {"angle.source": "input"},
    }
    system = virtual_engine(
        Partners(fmus[CRANKTRAIN], fmus[COMBUSTION], values, fmus[VALVETRAIN]), SPEED, "jacobi", "own"
    )
    units = {name: (unit, Path(unit.path)) for name, unit in system.units.items()}
    path = tmp_path_factory.mktemp("ssp") / "made.ssp"
    write_ssp(path, "made", units, system.connections, system.values, system.outputs, 0.1)
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}, system


def validated(name, content):
    """Root of a document that is valid by the schema of a name."""
    etree.XMLSchema(etree.parse(str(SCHEMAS / f"SystemStructure{name}.xsd"))).assertValid(etree.fromstring(content))
    return ElementTree.fromstring(content)


def test_the_structure_is_valid_and_connects_whole_arrays(files):
    """Six pressures and twelve lifts are one connection each of three; scalars are connected as before."""
    contents, system = files
    root = validated("Description", contents["SystemStructure.ssd"])
    assert root.attrib["version"] == "2.0"
    links = [dict(link.attrib) for link in root.iterfind(".//ssd:Connection", SPACES)]
    pressures = {
        "startElement": COMBUSTION, "startConnector": "cylinder.pressure", "endElement": CRANKTRAIN,
        "endConnector": "cylinder.pressure",
    }  # fmt: skip
    assert links.count(pressures) == 1 and not any("[" in text for link in links for text in link.values())
    sizes = {}
    for component in root.iterfind(".//ssd:Component", SPACES):
        for connector in component.iterfind(".//ssd:Connector", SPACES):
            [kind] = [child for child in connector if child.tag != f"{{{SPACES['ssc']}}}Dimension"]
            assert kind.tag == f"{{{SPACES['ssc']}}}Float64"
            shape = [int(d.attrib["size"]) for d in connector.iterfind("ssc:Dimension", SPACES)]
            sizes[component.attrib["name"], connector.attrib["name"]] = shape
    assert sizes[CRANKTRAIN, "cylinder.pressure"] == [6] and sizes[CRANKTRAIN, "crank.angle"] == []
    elements = 0
    for link in links:
        start = sizes[link["startElement"], link["startConnector"]]
        assert start == sizes[link["endElement"], link["endConnector"]]
        elements += start[0] if start else 1
    assert elements == len(system.connections) == 24 + 6 * 3


def test_every_element_is_connected_as_in_the_system(files):
    """Read back: the connections of elements that whole arrays stand for, in order, are those of the system."""
    contents, system = files
    root = ElementTree.fromstring(contents["SystemStructure.ssd"])
    found = set()
    for link in root.iterfind(".//ssd:Connection", SPACES):
        a, b = ((link.attrib[f"{end}Element"], link.attrib[f"{end}Connector"]) for end in ("start", "end"))
        sides = [sorted_elements(system.units[unit], variable) for unit, variable in (a, b)]
        found |= {((a[0], x), (b[0], y)) for x, y in zip(*sides, strict=True)}
    own = {
        tuple((unit, system.units[unit].places.own(name)) for unit, name in (link.source, link.target))
        for link in system.connections
    }
    assert found == own


def sorted_elements(unit, variable):
    places = {name: place for name, place in unit.places.items() if place.variable == variable}
    return sorted(places, key=lambda name: places[name].number)


def test_parameters_have_the_types_of_the_fmu_and_arrays_are_whole(files):
    contents, _ = files
    root = validated("ParameterValues", contents[f"resources/{CRANKTRAIN}.ssv"])
    assert root.attrib["version"] == "2.0"
    given = {one.attrib["name"]: one for one in root.iterfind(".//ssv:Parameter", SPACES)}
    assert given["crank.level"].find("ssv:Enumeration", SPACES).attrib["value"] == "torsional"
    assert given["gas.delay"].find("ssv:Float64", SPACES).attrib["value"] == "1.0"
    angles = given["cylinder.firing_angle"]
    texts = angles.find("ssv:Float64", SPACES).attrib["value"].split()
    assert len(texts) == 6 and float(texts[1]) == 8.377580409572783 and float(texts[4]) == pytest.approx(2.0943951)
    assert [d.attrib["size"] for d in angles.iterfind("ssc:Dimension", SPACES)] == ["6"]
    for name in (COMBUSTION, VALVETRAIN):
        validated("ParameterValues", contents[f"resources/{name}.ssv"])


@pytest.mark.parametrize(
    ("source", "numbers"),
    [
        (COMBUSTION, [(1, 1)]),
        (COMBUSTION, [(1, 2), (2, 1), (3, 3), (4, 4), (5, 5), (6, 6)]),
        ("scalars", [(k, k) for k in range(1, 7)]),
    ],
)
def test_arrays_that_are_not_connected_whole_are_refused(fmus, tmp_path, source, numbers):
    """An element alone, elements in another order, scalars of FMI 2.0: SSP 2.0 does not tell where indices begin."""
    units = {name: (open_fmu(fmus[name], name), fmus[name]) for name in (CRANKTRAIN, source)}
    links = [
        Connection((source, f"cylinder[{a}].pressure"), (CRANKTRAIN, f"cylinder[{b}].pressure")) for a, b in numbers
    ]
    with pytest.raises(InputError, match=r"an SSP connects arrays of FMI 3\.0 whole, element by element"):
        write_ssp(tmp_path / "made.ssp", "made", units, links, {}, {}, 0.1)
    assert not (tmp_path / "made.ssp").exists()


def test_scalars_of_both_versions_are_connected(fmus, tmp_path):
    """Each with the type of its FMU."""
    units = {name: (open_fmu(fmus[name], name), fmus[name]) for name in (CRANKTRAIN, "scalars")}
    link = Connection((CRANKTRAIN, "crank.angle"), ("scalars", "crank.angle"))
    write_ssp(tmp_path / "made.ssp", "made", units, [link], {"scalars": {"angle.source": "input"}}, {}, 0.1)
    with zipfile.ZipFile(tmp_path / "made.ssp") as archive:
        root = validated("Description", archive.read("SystemStructure.ssd"))
        validated("ParameterValues", archive.read("resources/scalars.ssv"))
    kinds = [next(iter(one)).tag.rpartition("}")[2] for one in root.iterfind(".//ssd:Connector", SPACES)]
    assert kinds == ["Float64", "Real"]
