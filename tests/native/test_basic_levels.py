"""Kernels of two kinds: an FMU of the levels ``basic`` needs none of solved films, nor does a run without them."""

import numpy as np
import pytest
from raw_unit import Raw
from real_unit import opened

from cranktrain.core import machine_code
from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import ROOT, WHOLE, code_digest, kind_of, this_platform
from cranktrain.engine.file import load_engine
from cranktrain.fmu.carried import film_levels, without_films
from cranktrain.fmu.engine_fmu import build, engine_interface, product, with_starts
from cranktrain.fmu.flat import FlatModel
from cranktrain.fmu.native import link
from cranktrain.fmu.native.archive import native_data
from cranktrain.fmu.native.engine_model import engine_model
from cranktrain.fmu.native.exports import functions
from cranktrain.structure.assembly import running_crank


@pytest.fixture(scope="module")
def model():
    """The six with a rigid crank alone."""
    engine = load_engine("diesel_i6")
    return FlatModel(engine, {"rigid": running_crank(engine, "rigid")})


def starting(interface):
    return with_starts(interface, {"crank.level": "rigid"})


def test_films_are_levels_of_tables_and_of_solved_films():
    assert film_levels() == {"table", "reynolds", "ehd", "ehd:fine"}
    assert {kind_of(name) for name in functions(WHOLE)} == set(WHOLE.split("+"))
    assert list(functions(WHOLE)) == [*functions("cranktrain"), *functions("films")]


def test_an_edit_of_a_solved_film_leaves_the_other_kernels():
    kinds = WHOLE.split("+")
    files = {kind: {path.relative_to(ROOT).as_posix() for path in machine_code._sources(kind)} for kind in kinds}
    assert "film/elastic/film.py" in files["films"] - files["cranktrain"]
    assert "film/laws/impedance.py" in files["films"] & files["cranktrain"]
    assert code_digest("films") != code_digest("cranktrain")


def test_data_name_the_films_only_where_a_level_calls_them(model):
    whole = starting(engine_interface(model.engine))
    kinds = {}
    for name, interface in (("usual", whole), ("basic", without_films(whole))):
        made = product(model.engine, interface, b"")
        native = engine_model(model, made)
        data = native_data(made, native, made.variables)("{%s}" % ("0" * 36))
        kinds[name] = native.kind()
        assert (code_digest("films").encode() in data) == (name == "usual")
        assert code_digest("cranktrain").encode() in data
    assert kinds == {"usual": WHOLE, "basic": "cranktrain"}


def test_an_fmu_that_starts_at_a_film_s_level_cannot_lack_it(model):
    interface = with_starts(engine_interface(model.engine), {"crank.level": "rigid", "bearing.level": "reynolds"})
    with pytest.raises(InputError, match=r"'basic' lack bearing\.level reynolds"):
        without_films(interface)


def bits(unit, levels):
    one = unit.fresh(start=False)
    one.set("String", {unit.references[name]: level for name, level in levels.items()})
    one.start()
    one.set("Real", {unit.references["speed"]: 200.0})
    outputs = unit.outputs()
    return np.array([one.run(1, k, 2e-4).get("Real", *outputs) for k in range(20)])


@pytest.fixture(scope="module")
def units(model, tmp_path_factory):
    """The usual FMU and the basic one, whose library has no kernels of films."""
    folder = tmp_path_factory.mktemp("basic")
    whole = starting(engine_interface(model.engine))
    made = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(link, "LIBRARIES", folder / "none")
        for name, interface in (("usual", whole), ("basic", without_films(whole))):
            try:
                link.library(WHOLE, this_platform(), emit=False)
            except InputError as error:
                pytest.skip(str(error))
            made[name] = opened(build(model, folder / name, interface=interface, platforms=(this_platform(),)))
    return made


def test_a_basic_fmu_gives_the_bits_of_the_usual_one_and_refuses_films(units):
    levels = {"crank.level": "rigid", "bearing.level": "impedance"}
    usual, basic = (bits(unit, levels) for unit in units.values())
    assert np.ptp(usual) > 0.0 and np.array_equal(usual, basic)
    unit = units["basic"]
    refused = unit.fresh(start=False).refused_set("String", {unit.references["bearing.level"]: "reynolds"})
    assert refused.endswith("'bearing.level' is 'reynolds'; valid: auto, held, linear, impedance, roller")


def test_a_library_without_films_is_less_and_no_other_model_s(units):
    usual, basic = (unit.binary() for unit in units.values())
    assert basic.stat().st_size < 0.8 * usual.stat().st_size
    names = {kind_of(name) for name, _ in machine_code.Library(basic).functions}
    assert names == {"cranktrain"} and machine_code.is_whole(basic, code_digest("cranktrain"))
    assert not machine_code.is_whole(basic, code_digest("films"))
    one = units["usual"]
    mixed = Raw(basic, one.folder / "resources", one.about.guid)
    assert mixed.component is None and "is for other machine code than this binary" in mixed.log[-1][2]
