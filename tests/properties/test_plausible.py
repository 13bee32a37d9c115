"""Values that an engine hardly has cause one line each; engines from a model aircraft to a ship cause none."""

import math
import tomllib
import warnings
from dataclasses import replace
from pathlib import Path

import pytest
from refusals import refused_files

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.engine.checks.engine import check_engine
from cranktrain.engine.checks.plausible import COMPRESSOR, doubts, heat_of_air
from cranktrain.engine.file import engine_names, load_engine
from cranktrain.engine.parts import BalanceWeights
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.trace_doubts import trace_doubts
from cranktrain.studies.design.layouts import LAYOUTS

SIX, EIGHT = load_engine("diesel_i6"), load_engine("diesel_v8")
DATA = Path(__file__).parents[1] / "data"
OWN, KINDS = sorted((DATA / "engines").glob("*.toml")), DATA / "kinds_of_engines.toml"
DEG, MM = math.pi / 180.0, 1e-3


def changed(engine, **tables):
    """Engine with values of its tables replaced."""
    rows = {
        name: {key: tuple(v) if isinstance(v, list) else v for key, v in row.items()} for name, row in tables.items()
    }
    return replace(engine, **{name: replace(getattr(engine, name), **values) for name, values in rows.items()})


def kind(throws, crankshaft, **tables):
    """Engine without the parts that only some levels need, with one cylinder for each throw (degrees)."""
    bare = replace(SIX, block=None, mounts=None, damper=None, axial_path=None, piston_guidance=None)
    n = len(throws)
    shape = {
        "throw_angles": tuple(DEG * a for a in throws), "main_widths": (n + 1) * (crankshaft.pop("main_width"),),
        "counterweights": 2 * n * (True,), "oil_holes": False, **crankshaft,
    }  # fmt: skip
    tables["cylinders"] |= {"pins": tuple(range(1, n + 1)), "bank_angles": n * (0.0,), "rod_offsets": ()}
    tables["main_bearing"] |= {"diameter": shape["main_diameter"]}
    tables["big_end_bearing"] |= {"diameter": shape["pin_diameter"]}
    return changed(bare, crankshaft=shape, **tables)


RIGHT = {name: kind(**tables) for name, tables in tomllib.loads(KINDS.read_text("utf-8")).items()}
RIGHT |= {"diesel_i6": SIX, "diesel_v8": EIGHT}


@pytest.mark.parametrize("kind", RIGHT)
def test_engines_of_every_kind_cause_no_doubt_and_pass_every_check(kind):
    assert list(doubts(RIGHT[kind])) == []
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*uneven intervals")  # a matter of the order, not of a value
        warnings.simplefilter("error", append=True)
        check_engine(RIGHT[kind])


@pytest.mark.parametrize(("fuel", "bore", "stroke"), [("petrol", 67.0, 42.5), ("petrol", 86.0, 86.0),
                                                      ("diesel", 83.0, 92.0), ("diesel", 170.0, 190.0)])  # fmt: skip
@pytest.mark.parametrize("layout", LAYOUTS)
def test_engines_of_every_layout_cause_no_doubt(layout, fuel, bore, stroke, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        engine = ct.new_engine("made", layout=layout, fuel=fuel, bore_mm=bore, stroke_mm=stroke)
        gas = GasTrace.from_engine(engine)
    assert list(doubts(engine)) == []
    for load in (0.2, 1.0):
        assert list(trace_doubts(engine, gas.motored + load * (gas.fired - gas.motored))) == []


@pytest.mark.parametrize("name", [*engine_names(), *OWN], ids=lambda name: Path(name).stem)
def test_shipped_engines_and_those_of_the_tests_cause_no_doubt(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        engine = load_engine(name)
    assert list(doubts(engine)) == []
    gas = GasTrace.from_engine(engine)
    for load in (0.0, 0.1, 0.4, 1.0):
        assert list(trace_doubts(engine, gas.motored + load * (gas.fired - gas.motored))) == []


def test_only_the_compressor_burns_nothing():
    assert [kind for kind, engine in RIGHT.items() if heat_of_air(engine) < COMPRESSOR] == ["compressor"]


SMALL = changed(  # petrol four of 82 mm bore, after the six's throws
    SIX,
    cylinders={"bore": 82 * MM, "piston_mass": 0.4},
    rod={"big_end_mass": 0.5, "small_end_mass": 0.2, "length": 150 * MM, "inertia": 2.8e-3},
    crankshaft={"throw": 45 * MM},
    combustion={"heat": 1.6e3},
)
DOUBTED = RIGHT | {"small four": SMALL}


@pytest.mark.parametrize(("engine", "change", "says"), refused_files()["doubts"]["values"])
def test_an_unlikely_value_causes_its_own_line(engine, change, says):
    said = list(doubts(changed(DOUBTED[engine], **change)))
    (own,) = [text for text in said if text.startswith(says)]
    assert "\n" not in own and len(own) < 230
    assert ("usual" in own and ";" in own) or "check" in own or "give" in own or "two rods" in own or "count" in own


def test_a_doubt_is_a_warning_that_names_the_engine():
    with pytest.warns(UserWarning, match=r"^diesel_i6: combustion\.falloff: 4, usual 0 to 1; it is the fraction"):
        check_engine(changed(SIX, combustion={"falloff": 4.0}))


def test_balance_weights_far_out_are_doubted():
    heavy = BalanceWeights((1, 2), (2.0, 2000.0), (0.6, 0.05), (0.0, 0.0), (0.0, 0.0))
    said = list(doubts(replace(SIX, balance_weights=heavy)))
    assert [text.split(":")[0] for text in said] == ["balance_weights.radii[1]", "balance_weights.masses[2]"]


def test_counterweights_that_reach_the_piston_pin_are_refused():
    with pytest.raises(InputError, match=r"counterweight_radius: 250 mm reaches the piston's pin, .* within 155 mm"):
        check_engine(changed(SIX, crankshaft={"counterweight_radius": 0.25}))
    # A pin wider than the bore carries its webs beside the piston.
    wide = changed(SIX, crankshaft={"counterweight_radius": 0.25, "pin_width": 0.11})
    assert not [text for text in doubts(wide) if "counterweight" in text]
    check_engine(replace(wide, block=None, mounts=None))
