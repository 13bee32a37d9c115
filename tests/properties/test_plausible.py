"""Values that an engine hardly has cause one line each; engines from a model aircraft to a ship cause none.

Data of the four engines are typical of their kind, not those of a product: a model diesel of 5.7 cm³; a motorcycle's
four that runs to 15 000 rev/min; a low-speed two-stroke with crossheads, whose proportions (stroke/bore 4, rod of two
throws, piston and crosshead of several tonnes) are those of the makers' project guides; a double-acting compressor.
"""

import math
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
OWN = sorted((Path(__file__).parents[1] / "data" / "engines").glob("*.toml"))
DEG, MM, RPM = math.pi / 180.0, 1e-3, math.pi / 30.0


def changed(engine, **tables):
    """Engine with values of its tables replaced."""
    return replace(engine, **{name: replace(getattr(engine, name), **values) for name, values in tables.items()})


def sized(throws, size, tables):
    """Engine without the parts that only some levels need, with one cylinder for each throw."""
    bare = replace(SIX, block=None, mounts=None, damper=None, axial_path=None, piston_guidance=None)
    n = len(throws)
    shape = {
        "throw_angles": tuple(DEG * a for a in throws), "main_widths": (n + 1) * (size.pop("main_width"),),
        "counterweights": 2 * n * (True,), "oil_holes": False, **size,
    }  # fmt: skip
    tables["cylinders"] |= {"pins": tuple(range(1, n + 1)), "bank_angles": n * (0.0,), "rod_offsets": ()}
    tables["main_bearing"] |= {"diameter": shape["main_diameter"]}
    tables["big_end_bearing"] |= {"diameter": shape["pin_diameter"]}
    return changed(bare, crankshaft=shape, **tables)


def model_aircraft():
    """Compression-ignition single of 20 mm bore, 15000 rev/min, castor oil, with its propeller as flywheel."""
    return sized(
        [0.0],
        {
            "throw": 9 * MM, "main_diameter": 9 * MM, "main_width": 8 * MM, "pin_diameter": 5 * MM,
            "pin_width": 6 * MM, "web_thickness": 4 * MM, "web_main_radius": 7 * MM, "web_pin_radius": 5 * MM,
            "counterweight_radius": 11 * MM, "counterweight_half_width": 8 * MM, "nose_diameter": 6 * MM,
            "nose_length": 20 * MM, "flange_diameter": 16 * MM, "flange_length": 4 * MM, "fillet": 0.5 * MM,
            "mesh_size": 2 * MM,
        },
        {
            "cylinders": {
                "bore": 20 * MM, "firing_order": (1,), "cycle": 2.0 * math.pi, "piston_mass": 0.008,
                "compression_ratio": 20.0,
            },
            "rod": {"length": 34 * MM, "big_end_mass": 0.003, "small_end_mass": 0.0015, "inertia": 8e-7},
            "flywheel": {"mass": 0.03, "polar_inertia": 1.2e-4, "diametral_inertia": 1.1e-4, "offset": 0.0},
            "pulley": {"mass": 0.01, "polar_inertia": 1e-6, "diametral_inertia": 6e-7, "offset": 0.0},
            "main_bearing": {"width": 7 * MM, "clearance": 12e-6},
            "big_end_bearing": {"width": 5 * MM, "clearance": 10e-6},
            "thrust": {"main": 1, "inner_diameter": 9.5 * MM, "outer_diameter": 15 * MM},
            "oil": {"temperature_speeds": (3000 * RPM, 15000 * RPM), "temperatures": (343.0, 373.0)},
            "combustion": {
                "heat": 14.0, "intake_pressure": 1e5, "exhaust_pressure": 1.1e5, "intake_closes": -115 * DEG,
                "exhaust_opens": 115 * DEG, "best_speed": 12000 * RPM,
            },
            "drive_line": {"stiffness": 20.0, "damping": 0.02, "dynamometer_inertia": 1e-3},
        },
    )  # fmt: skip


def motorcycle():
    """Four of 67 x 42.5 mm."""
    return sized(
        [0.0, 180.0, 180.0, 0.0],
        {
            "throw": 21.25 * MM, "main_diameter": 32 * MM, "main_width": 20 * MM, "pin_diameter": 30 * MM,
            "pin_width": 19 * MM, "web_thickness": 15 * MM, "web_main_radius": 27 * MM, "web_pin_radius": 21 * MM,
            "counterweight_radius": 43 * MM, "counterweight_half_width": 27 * MM, "nose_diameter": 25 * MM,
            "nose_length": 25 * MM, "flange_diameter": 44 * MM, "flange_length": 12 * MM, "fillet": 2 * MM,
            "mesh_size": 10 * MM,
        },
        {
            "cylinders": {
                "bore": 67 * MM, "firing_order": (1, 2, 4, 3), "piston_mass": 0.16, "compression_ratio": 13.0,
            },
            "rod": {"length": 91 * MM, "big_end_mass": 0.19, "small_end_mass": 0.07, "inertia": 4.6e-4},
            "flywheel": {"mass": 0.6, "polar_inertia": 4e-4, "diametral_inertia": 2.2e-4, "offset": -20 * MM},
            "pulley": {"mass": 0.15, "polar_inertia": 3e-5, "diametral_inertia": 2e-5, "offset": -20 * MM},
            "main_bearing": {"width": 16 * MM, "clearance": 18e-6},
            "big_end_bearing": {"width": 16 * MM, "clearance": 17e-6},
            "thrust": {"main": 3, "inner_diameter": 36 * MM, "outer_diameter": 48 * MM},
            "oil": {"temperature_speeds": (1500 * RPM, 15000 * RPM), "temperatures": (353.0, 393.0)},
            "combustion": {
                "heat": 420.0, "intake_pressure": 1.05e5, "exhaust_pressure": 1.1e5, "start": -25 * DEG,
                "best_speed": 11500 * RPM,
            },
            "drive_line": {"stiffness": 1200.0, "damping": 0.4, "dynamometer_inertia": 0.1},
        },
    )  # fmt: skip


def ship(bore):
    """Low-speed two-stroke with crossheads: stroke four times the bore, rod twice the throw."""
    s = bore / 0.6
    return sized(
        [0.0, 120.0, 240.0, 180.0, 300.0, 60.0],
        {
            "throw": 2.0 * bore, "main_diameter": 1.15 * bore, "main_width": 0.55 * bore, "pin_diameter": 1.15 * bore,
            "pin_width": 0.7 * bore, "web_thickness": 0.42 * bore, "web_main_radius": 0.95 * bore,
            "web_pin_radius": 0.95 * bore, "counterweight_radius": 1.6 * bore, "counterweight_half_width": bore,
            "nose_diameter": 0.8 * bore, "nose_length": 0.8 * bore, "flange_diameter": 1.8 * bore,
            "flange_length": 0.3 * bore, "fillet": 0.05 * bore, "mesh_size": 0.4 * bore,
        },
        {
            "cylinders": {
                "bore": bore, "firing_order": (1, 5, 3, 4, 2, 6), "piston_mass": 4000.0 * s**3,
                "compression_ratio": 20.0, "cycle": 2.0 * math.pi,
            },
            "rod": {
                "length": 4.05 * bore, "big_end_mass": 1500.0 * s**3, "small_end_mass": 1000.0 * s**3,
                "inertia": 2400.0 * s**5,
            },
            "flywheel": {
                "mass": 9000.0 * s**3, "polar_inertia": 8000.0 * s**5, "diametral_inertia": 4100.0 * s**5,
                "offset": -0.2 * bore,
            },
            "pulley": {
                "mass": 2000.0 * s**3, "polar_inertia": 500.0 * s**5, "diametral_inertia": 260.0 * s**5, "offset": 0.0,
            },
            "main_bearing": {"width": 0.45 * bore, "clearance": 4.5e-4 * bore},
            "big_end_bearing": {"width": 0.45 * bore, "clearance": 4.5e-4 * bore},
            "thrust": {
                "main": 4, "inner_diameter": 1.3 * bore, "outer_diameter": 2.2 * bore, "clearance": 1e-3,
                "taper": 0.15e-3,
            },
            "oil": {"temperature_speeds": (25 * RPM, 105 * RPM), "temperatures": (318.0, 325.0)},
            "combustion": {
                "heat": 1.4e6 * s**3, "intake_pressure": 4e5, "intake_temperature": 310.0, "exhaust_pressure": 3.7e5,
                "intake_closes": -100 * DEG, "exhaust_opens": 110 * DEG, "best_speed": 80 * RPM / s,
            },
        },
    )  # fmt: skip


def compressor():
    """Two throws at 180 degrees, 200 x 150 mm, crossheads, 1000 rev/min; nothing burns."""
    return sized(
        [0.0, 180.0],
        {
            "throw": 75 * MM, "main_diameter": 165 * MM, "main_width": 90 * MM, "pin_diameter": 150 * MM,
            "pin_width": 100 * MM, "web_thickness": 60 * MM, "web_main_radius": 110 * MM, "web_pin_radius": 100 * MM,
            "counterweight_radius": 170 * MM, "counterweight_half_width": 110 * MM, "nose_diameter": 120 * MM,
            "nose_length": 120 * MM, "flange_diameter": 260 * MM, "flange_length": 40 * MM, "fillet": 8 * MM,
            "mesh_size": 60 * MM,
        },
        {
            "cylinders": {
                "bore": 200 * MM, "firing_order": (1, 2), "piston_mass": 95.0, "compression_ratio": 8.0,
                "firing_angles": (0.0, 180 * DEG),
            },
            "rod": {"length": 400 * MM, "big_end_mass": 30.0, "small_end_mass": 14.0, "inertia": 1.6},
            "flywheel": {"mass": 400.0, "polar_inertia": 20.0, "diametral_inertia": 10.5, "offset": -80 * MM},
            "pulley": {"mass": 40.0, "polar_inertia": 0.5, "diametral_inertia": 0.3, "offset": 0.0},
            "main_bearing": {"width": 80 * MM, "clearance": 80e-6},
            "big_end_bearing": {"width": 85 * MM, "clearance": 75e-6},
            "thrust": {"main": 1, "inner_diameter": 175 * MM, "outer_diameter": 230 * MM},
            "oil": {"temperature_speeds": (300 * RPM, 1000 * RPM), "temperatures": (333.0, 343.0)},
            "combustion": {
                "heat": 1.0, "intake_pressure": 1.3e6, "intake_temperature": 303.0, "exhaust_pressure": 4e6,
                "wall_temperature": 350.0, "best_speed": 1000 * RPM, "falloff": 0.0,
            },
        },
    )  # fmt: skip


RIGHT = {
    "model aircraft": model_aircraft(), "motorcycle": motorcycle(), "ship 600": ship(0.6), "ship 960": ship(0.96),
    "compressor": compressor(), "diesel_i6": SIX, "diesel_v8": EIGHT,
}  # fmt: skip


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


@pytest.mark.parametrize("name", engine_names())
def test_shipped_engines_cause_no_doubt(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        engine = load_engine(name)
    assert list(doubts(engine)) == []
    gas = GasTrace.from_engine(engine)
    for load in (0.0, 0.1, 0.4, 1.0):
        assert list(trace_doubts(engine, gas.motored + load * (gas.fired - gas.motored))) == []


@pytest.mark.parametrize("path", OWN, ids=[path.stem for path in OWN])
def test_engine_files_of_the_tests_cause_no_doubt(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        engine = load_engine(path)
    assert list(doubts(engine)) == []


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
    (motorcycle(), {"crankshaft": {"throw": 42.5 * MM}}, "crankshaft.throw: the rod's length over the throw is 2.141"),
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
