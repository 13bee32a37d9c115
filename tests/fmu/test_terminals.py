"""Terminals of the FMUs: valid by FMI 3.0's schema, made of variables that are there, fitting their partners'."""

import zipfile
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import pytest
from fmpy import read_model_description
from lxml import etree
from PIL import Image

from cranktrain.engine.file import load_engine
from cranktrain.fmu import engine_fmu, module_fmu
from cranktrain.fmu.terminals_and_icons import TERMINALS, terminals_and_icons
from cranktrain.modules.register import module_files

SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"


def products():
    """Every FMU of a shipped file, as it will be built, by the engine it is of."""
    found = {"i6": [], "v8": []}
    for name in ("diesel_i6", "diesel_v8"):
        found[name[-2:]].append(engine_fmu.product(load_engine(name), engine_fmu.full_interface()))
    for name, path in module_files().items():
        if name[-2:] in found:
            found[name[-2:]].append(module_fmu.module_product(path))
    return found


def members(product):
    """Members of each terminal by name, with their variables."""
    variables = {variable.name: variable for variable in product.variables}
    root = terminals_and_icons(product.variables)
    return {
        terminal.get("name"): {m.get("memberName"): variables[m.get("variableName")] for m in terminal.iter(MEMBER)}
        for terminal in root.iter("Terminal")
    }


MEMBER = "TerminalMemberVariable"


@pytest.mark.parametrize("kind", ["i6", "v8"])
def test_terminals_are_valid_and_fit_each_other(kind):
    """By the rule ``plug``: equal members; and what one gives the other takes, in the same unit."""
    schema = etree.XMLSchema(etree.parse(str(SCHEMA)))
    there = products()[kind]
    for product in there:
        schema.assertValid(etree.fromstring(ElementTree.tostring(terminals_and_icons(product.variables))))
    paired = set()
    for one, other in combinations(map(members, there), 2):
        for name in set(one) & set(other):
            paired.add(name)
            if TERMINALS[name].rule == "plug":
                assert set(one[name]) == set(other[name]), name
            for member in set(one[name]) & set(other[name]):
                ends = one[name][member], other[name][member]
                assert {v.causality for v in ends} in ({"input", "output"}, {"parameter"}, {"input"}), member
                assert ends[0].unit == ends[1].unit, member
    assert paired == set(TERMINALS)


def test_every_input_that_a_partner_gives_is_in_one_terminal():
    """``gas`` connects what the virtual engine connects."""
    cranktrain, combustion, *_ = products()["i6"]
    gas = members(cranktrain)["gas"]
    given = {v.name for v in combustion.variables if v.causality == "output"} & {
        v.name for v in cranktrain.variables if v.causality == "input"
    }
    assert given <= set(gas) and {"crank.angle", "crank.speed"} <= set(gas)
    assert len(gas) == 6 * (1 + 3) + 1 + 2


def test_dimensions_of_one_engine_agree():
    """``geometry``: modules of one engine start from equal dimensions."""
    for there in products().values():
        starts = [{name: v.start for name, v in members(product)["geometry"].items()} for product in there]
        for one, other in combinations(starts, 2):
            for name in set(one) & set(other):
                assert one[name] == other[name], name
    cranktrain = members(products()["i6"][0])["geometry"]
    assert cranktrain["geometry.bore"].start == 0.105 and len(cranktrain) == 5 + 6


def test_the_archive_holds_terminals_and_their_icons(fmu):
    with zipfile.ZipFile(fmu) as opened:
        names = [name for name in opened.namelist() if name.startswith("terminalsAndIcons/")]
        root = ElementTree.fromstring(opened.read("terminalsAndIcons/terminalsAndIcons.xml"))
        pictures = {name: Image.open(opened.open(name)).size for name in names if name.endswith(".png")}
    icons = {f"terminalsAndIcons/{drawn.get('iconBaseName')}.png" for drawn in root.iter() if drawn.get("iconBaseName")}
    assert set(pictures) == icons | {"terminalsAndIcons/icon.png"} and len(icons) == 3
    assert all(min(size) >= 32 for size in pictures.values())
    variables = {v.name for v in read_model_description(str(fmu)).modelVariables}
    assert {m.get("variableName") for m in root.iter(MEMBER)} <= variables
