"""Values that an engine hardly has cause one line each; engines from a model aircraft to a ship cause none."""

import math
import tomllib
import warnings
from dataclasses import replace
from pathlib import Path

import pytest

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
DEG, MM, RPM = math.pi / 180.0, 1e-3, math.pi / 30.0


def changed(engine, **tables):
    """Engine with values of its tables replaced."""
    return replace(engine, **{name: replace(getattr(engine, name), **values) for name, values in tables.items()})


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
    rows = {
        name: {key: tuple(v) if isinstance(v, list) else v for key, v in row.items()} for name, row in tables.items()
    }
    return changed(bare, crankshaft=shape, **rows)


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
DOUBTS = [
    (SIX, {"crankshaft": {"throw": 120 * MM}}, "crankshaft.throw: the rod's length over the throw is 1.792"),
    (SIX, {"crankshaft": {"throw": 9 * MM}}, "crankshaft.throw: the rod's length over the throw is 23.89"),
    (EIGHT, {"crankshaft": {"throw": 140 * MM}}, "crankshaft.throw: the rod's length over the throw is 1.821"),
    (RIGHT["motorcycle"], {"crankshaft": {"throw": 42.5 * MM}}, "crankshaft.throw: the rod's length over the"),
    (SMALL, {"cylinders": {"piston_mass": 3.8}}, "cylinders.piston_mass: 3.8 kg with a bore of 82 mm is heavier than"),
    (SIX, {"cylinders": {"piston_mass": 1780.0}}, "cylinders.piston_mass: 1780 kg"),
    (SIX, {"rod": {"big_end_mass": 1580.0, "inertia": 20.0}}, "rod.big_end_mass: 1580 kg"),
    (SIX, {"rod": {"inertia": 20853.6}}, "rod.inertia: a radius of gyration"),
    (SIX, {"flywheel": {"polar_inertia": 0.98e6, "diametral_inertia": 0.5e6}}, "flywheel.polar_inertia: a radius of"),
    (SIX, {"cylinders": {"compression_ratio": 60.0}}, "cylinders.compression_ratio: 60, usual 2 to 30"),
    (SIX, {"cylinders": {"pin_offset": 40 * MM}}, "cylinders.pin_offset: offset over bore is 0.381"),
    (SIX, {"cylinders": {"bore": 150 * MM}}, "cylinders.bore: 150 mm, but the cylinders of a bank are 128 mm apart"),
    (SIX, {"cylinders": {"bank_angles": (0.0, 90 * DEG) * 3}}, "cylinders.bank_angles: two banks 90 deg apart"),
    (EIGHT, {"cylinders": {"bank_angles": 4 * (-0.785 * DEG,) + 4 * (0.785 * DEG,)}}, "cylinders.bank_angles: they di"),
    (SIX, {"crankshaft": {"throw_angles": tuple(DEG * a for a in (0, 4.19, 2.09, 2.09, 4.19, 0))}},
     "crankshaft.throw_angles: they differ by 4.19 deg at most; it looks like radians"),
    (SIX, {"cylinders": {"firing_intervals": 6 * (2.09 * DEG,)}}, "cylinders.firing_intervals: the longest is 2.09"),
    (SIX, {"crankshaft": {"counterweight_radius": 140 * MM}}, "crankshaft.counterweight_radius: 140 mm strikes"),
    (SIX, {"crankshaft": {"pin_diameter": 10 * MM}}, "crankshaft.pin_diameter: pin over throw is 0.1667"),
    (SIX, {"crankshaft": {"pin_diameter": 220 * MM}}, "crankshaft.pin_diameter: pin over main bearing pitch is"),
    (SIX, {"crankshaft": {"main_diameter": 300 * MM}}, "crankshaft.main_diameter: journal over pin is 4.082"),
    (SIX, {"crankshaft": {"web_thickness": 2.1 * MM}}, "crankshaft.web_thickness: web over pin is 0.02857"),
    (SIX, {"crankshaft": {"pin_width": 4.8 * MM}}, "crankshaft.pin_width: width over diameter"),
    (SIX, {"crankshaft": {"main_widths": 7 * (4 * MM,)}}, "crankshaft.main_widths: width of a journal"),
    (SIX, {"flywheel": {"offset": 5.0}}, "flywheel.offset: its centre of mass 5000 mm from the crank's end"),
    (SIX, {"pulley": {"offset": -5.0}}, "pulley.offset: its centre of mass 5000 mm from the crank's end"),
    (SIX, {"flywheel": {"diametral_inertia": 20.0}}, "flywheel.diametral_inertia: over polar_inertia it is 20.41"),
    (SIX, {"main_bearing": {"clearance": 400e-6}}, "main_bearing.clearance: diametral clearance"),
    (SIX, {"big_end_bearing": {"clearance": 3.5e-6}}, "big_end_bearing.clearance: diametral clearance"),
    (SIX, {"main_bearing": {"width": 3 * MM}}, "main_bearing.width: width over diameter is 0.0375"),
    (SIX, {"main_bearing": {"supply_pressure": 40e6}}, "main_bearing.supply_pressure: 400 bar"),
    (SIX, {"thrust": {"taper": 0.9 * MM}}, "thrust.taper: 0.9 mm is deeper than the axial play, 0.2 mm"),
    (SIX, {"thrust": {"clearance": 20 * MM}}, "thrust.clearance: axial play over outer_diameter is 0.1695"),
    (SIX, {"thrust": {"outer_diameter": 0.4}}, "thrust.outer_diameter: over the journal it is 5"),
    (SIX, {"oil": {"temperatures": (378.0, 353.0)}}, "oil.temperatures: they fall from 104.9 to 79.85 degC"),
    (SIX, {"oil": {"vogel_a": 1.073e-6}}, "oil.law: vogel gives 0.239 mPa s at 80 degC"),
    (SIX, {"oil": {"temperatures": (253.0, 373.0)}}, "oil.law: vogel gives 9.28e+03 mPa s at -20.15 degC"),
    (SIX, {"oil": {"density": 2000.0}}, "oil.density: 2000 kg/m^3"),
    (SIX, {"oil": {"heat_capacity": 200.0}}, "oil.heat_capacity: 200 J/(kg K)"),
    (SIX, {"oil": {"supply_pressure": 40e6}}, "oil.supply_pressure: 400 bar"),
    (SIX, {"combustion": {"heat": 1e5}}, "combustion.heat: 100 kJ a cycle and cylinder is 34"),
    (SIX, {"combustion": {"best_speed": 16000 * RPM}}, "combustion.best_speed: mean piston speed of 64 m/s"),
    (SIX, {"combustion": {"best_speed": 160 * RPM}}, "combustion.best_speed: 160 rev/min lies far outside"),
    (SIX, {"combustion": {"falloff": 4.0}}, "combustion.falloff: 4, usual 0 to 1"),
    (SIX, {"combustion": {"duration": 1.05 * DEG}}, "combustion.duration: 1.05 deg"),
    (SIX, {"combustion": {"intake_closes": -2.62 * DEG}}, "combustion.intake_closes: -2.62 deg"),
    (SIX, {"combustion": {"intake_temperature": 596.0}}, "combustion.intake_temperature: 596 K"),
    (SIX, {"combustion": {"wall_temperature": 1173.0}}, "combustion.wall_temperature: 1173 K"),
    (SIX, {"combustion": {"exhaust_pressure": 2.3e3}}, "combustion.exhaust_pressure: over intake_pressure it is 0.00"),
    (SIX, {"material": {"youngs_modulus": 210e6}}, "material.youngs_modulus: a speed of sound"),
    (SIX, {"block": {"density": 720.0}}, "block.youngs_modulus: a speed of sound"),
    (SIX, {"damping": {"ratio": 0.9}}, "damping.ratio: 0.9, usual 0 to 0.2"),
    (SIX, {"block": {"damping_ratio": 0.9}}, "block.damping_ratio: 0.9"),
    (SIX, {"mounts": {"x": (-180.0, 180.0, -180.0, 180.0)}}, "mounts: mount 1 lies 1.8e+05 mm away"),
    (SIX, {"piston_guidance": {"lower_height": 30 * MM}}, "piston_guidance.upper_height: 20 mm is not above"),
    (SIX, {"piston_guidance": {"mass_height": 0.5}}, "piston_guidance.mass_height: over the bore it is 4.762"),
    (SIX, {"piston_guidance": {"clearance": 5 * MM}}, "piston_guidance.clearance: radial play"),
    (SIX, {"piston_guidance": {"tilt_inertia": 2600.0}}, "piston_guidance.tilt_inertia: radius of gyration"),
    (SIX, {"cylinders": {"bore": 0.5 * SIX.cylinders.bore}}, "cylinders.bore: 52.5 mm and combustion.heat 3.5 kJ"),
    (EIGHT, {"cylinders": {"bore": 0.5 * EIGHT.cylinders.bore}}, "cylinders.bore: 60 mm and combustion.heat"),
    (SIX, {"flywheel": {"mass": 0.1 * SIX.flywheel.mass}}, "flywheel.mass: "),
    (EIGHT, {"flywheel": {"mass": 0.1 * EIGHT.flywheel.mass}}, "flywheel.mass: "),
    (SIX, {"rod": {"inertia": 10.0 * SIX.rod.inertia}}, "rod.inertia: a radius of gyration"),
    (EIGHT, {"rod": {"inertia": 10.0 * EIGHT.rod.inertia}}, "rod.inertia: a radius of gyration"),
    (SIX, {"pulley": {"offset": -SIX.pulley.offset}}, "pulley.offset: its centre of mass lies 50 mm from the crank's"),
    (SIX, {"flywheel": {"offset": -60 * MM}}, "flywheel.offset: its centre of mass lies 60 mm from the crank's end"),
    (SIX, {"drive_line": {"stiffness": 2e4 / 57.3}}, "drive_line.stiffness: 349 N m/rad twists by 115 deg"),
    (SIX, {"drive_line": {"stiffness": 2e4 * 57.3}}, "drive_line.stiffness: 1.146e+06 N m/rad twists by 0.0351 deg"),
    (SIX, {"drive_line": {"damping": 50 / 57.3}}, "drive_line.damping: a damping ratio of the shaft of 0.00"),
    (SIX, {"drive_line": {"damping": 50 * 57.3}}, "drive_line.damping: a damping ratio of the shaft of 1"),
    (EIGHT, {"drive_line": {"damping": 100 / 57.3}}, "drive_line.damping: a damping ratio of the shaft of 0.00"),
    (SIX, {"oil": {"temperatures": (449.15, 494.15)}}, "oil.temperatures: the warmest is 221 degC, usual 43 to 160"),
    (SIX, {"oil": {"temperatures": (299.82, 313.71)}}, "oil.temperatures: the warmest is 40.56 degC, usual 43 to 160"),
    (SIX, {"main_bearing": {"supply_pressure": 4e4}}, "main_bearing.supply_pressure: 0.4 bar, usual 0.7 to 30 bar"),
    (SIX, {"oil": {"supply_pressure": 4e4}}, "oil.supply_pressure: 0.4 bar, usual 0.7 to 30 bar"),
    (SIX, {"combustion": {"start": 3 * DEG}}, "combustion.start: 3 deg after firing dead centre, usual -60 to 2 deg"),
]  # fmt: skip


@pytest.mark.parametrize(("engine", "change", "says"), DOUBTS, ids=[says.split(" ")[0] for _, _, says in DOUBTS])
def test_an_unlikely_value_causes_its_own_line(engine, change, says):
    said = list(doubts(changed(engine, **change)))
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
