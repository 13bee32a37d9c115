"""The verb ``harness``: this project's own system tests, what it writes, and what it refuses."""

import json
import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest
from refusals import refused_files
from small_fmus import MASS, edited, small_fmu

from cranktrain.fmu.build import describe_fmu
from cranktrain.store.hdf5 import read_result
from cranktrain_lab.harness.file import load_harness
from cranktrain_lab.harness.running import checked_ports

ROOT = Path(__file__).parents[2]
SYSTEM, SOURCES, EXAMPLE = ROOT / "tests" / "system", ROOT / "fmu_src", ROOT / "examples" / "harness.toml"


MASSES = (SYSTEM / "masses.toml").read_text("utf-8")


def test_masses(harness):
    """All kinds of scenarios, and the files."""
    code, found, _ = harness(MASSES, "--junit", "out.xml", "--html", "out.html")
    failed = [(one["name"], a) for one in found["scenarios"] for a in one["assertions"] if not a["passed"]]
    assert (code, failed) == (0, [])
    assert [one["name"] for one in found["scenarios"]][-3:] == ["spring dies", "spring hangs", "no number"]
    data, attributes = read_result("harness_results/spring_dies.h5")
    assert data["time"][0][-1] == pytest.approx(1.0) and "SIGSEGV" in attributes["ended"]
    suites = ElementTree.parse("out.xml").getroot()
    assert suites.get("tests") == str(sum(len(one["assertions"]) for one in found["scenarios"]))
    assert suites.get("failures") == suites.get("errors") == "0"
    page = Path("out.html").read_text("utf-8")
    assert "mass.place over the time" in page and page.count("<svg") >= 6 and "://" not in page


def test_the_virtual_engine(fmu, partner, ran, tmp_path):
    shutil.copy(fmu, tmp_path / "cranktrain.fmu")
    shutil.copy(partner, tmp_path / "combustion.fmu")
    shutil.copy(SYSTEM / "virtual_engine.toml", tmp_path)
    done = ran("-m", "cranktrain.cli.main", "harness", "virtual_engine.toml", "--json", cwd=tmp_path)
    found = json.loads(done.stdout)
    failed = [(one["name"], a) for one in found.get("scenarios", [found]) for a in one["assertions"] if not a["passed"]]
    assert (done.returncode, failed) == (0, []), done.stderr


def test_the_example_is_possible_and_in_the_docs(tmp_path):
    """As far as descriptions of its FMUs tell; a slow test runs it."""
    harness = load_harness(EXAMPLE)
    fmus = {name: tmp_path / f"{name}.xml" for name in harness.units}
    for name, path in fmus.items():
        path.write_bytes(describe_fmu(harness.units[name].build))
    assert checked_ports(harness, fmus)["cranktrain.pulley.torsion"].unit == "rad"
    assert EXAMPLE.read_text("utf-8") in (ROOT / "docs" / "how-to" / "harness.md").read_text("utf-8")


ENGINE = 'engine = "diesel_i6"\nspeed_rpm = 2000\ncycles = 2\nstep_deg = 1\n{}\n[[scenario]]\nname = "normal"\n'


def test_an_engine_has_its_valve_train_or_not(tmp_path):
    """As ``cranktrain couple``: three units, two without; none for an engine that none ships for."""
    path = tmp_path / "harness.toml"
    path.write_text(ENGINE.format(""), "utf-8")
    builds = {name: unit.build for name, unit in load_harness(path).units.items()}
    assert builds == {"valvetrain": "valvetrain_i6", "combustion": "combustion_i6", "cranktrain": "diesel_i6"}
    path.write_text(ENGINE.format("valvetrain = false"), "utf-8")
    assert set(load_harness(path).units) == {"combustion", "cranktrain"}
    six = (SOURCES / "cranktrain" / "engine" / "data" / "diesel_i6.toml").read_text("utf-8")
    (tmp_path / "own.toml").write_text(six.replace('name = "diesel_i6"', 'name = "own"', 1), "utf-8")
    own = ENGINE.replace("diesel_i6", "own.toml").format('[units.combustion]\nbuild = "combustion_i6"')
    path.write_text(own, "utf-8")
    assert set(load_harness(path).units) == {"combustion", "cranktrain"}


def test_what_fails_is_told(harness):
    """Exit code 1, the number that was found, a failure in JUnit's file; an end that nobody expected is an error."""
    text = MASSES.replace("expected = -0.8668", "expected = 0.5") + "\n[[scenario]]\nname = 'unexpected'\n"
    text += "fault = [{ of = 'spring', kind = 'fails', at_s = 1.5 }]\n"
    text += "assert = [{ output = 'mass.place', what = 'mean', from_s = 1.8, least = 0 }]\n"
    code, found, _ = harness(text, "--only", "free", "unexpected", "--junit", "out.xml")
    first, last = found["scenarios"]
    assert code == 1 and not first["passed"] and not last["passed"]
    assert first["assertions"][1]["found"] == pytest.approx(-0.8668, abs=0.02)
    assert first["assertions"][1]["expected"] == {"expected": 0.5, "absolute": 0.02}
    assert last["assertions"][0]["found"].startswith("spring, step from 1.5 s")
    assert last["assertions"][1]["found"] is None and "the run ended at 1.5 s" in last["assertions"][1]["remark"]
    suites = ElementTree.parse("out.xml").getroot()
    assert (suites.get("failures"), suites.get("errors")) == ("2", "1")
    assert suites.find(".//error").get("message").startswith("expected runs to the end")


def test_what_a_unit_says_is_told_though_another_was_loaded_later(harness, tmp_path):
    _, text, variables, step = MASS
    small_fmu(tmp_path, "Seizes", text, variables, ["if time > 0.5:", "    raise ValueError('bearing seized')", *step])
    told = MASSES.split("[[scenario]]")[0].replace("Mass.fmu", "Seizes.fmu") + "[[scenario]]\nname = 'one'\n"
    _, found, _ = harness(told + "ends = [{ of = 'mass', says = 'bearing seized' }]\n")
    assert found["passed"], found


def test_only_takes_what_it_is_compared_with(harness):
    _, found, _ = harness(MASSES, "--only", "spring let go")
    assert [one["name"] for one in found["scenarios"]] == ["free", "spring let go"]


def test_equal_seeds_give_equal_runs(harness):
    texts = MASSES, MASSES, MASSES.replace("seed = 3", "seed = 4")
    runs = [harness(text, "--only", "ramp and noise")[1]["scenarios"][0] for text in texts]
    one, same, other = (run["assertions"][1]["found"] for run in runs)
    assert one == same != other


@pytest.mark.parametrize(("text", "wrong", "said"), refused_files()["masses"]["with_fmus"])
def test_wrong_entries_are_one_line_before_anything_is_run(harness, text, wrong, said):
    assert text in MASSES
    code, found, err = harness(MASSES.replace(text, wrong, 1), "--junit", "out.xml")
    assert code == 2 and set(found) == {"error"} and len(err.strip().splitlines()) == 1, err
    assert said in err and "harness.toml" in err
    assert not Path("out.xml").exists() and not Path("harness_results").exists()


FOREIGN = [
    (
        {"changes": [('fmiVersion="2.0"', 'fmiVersion="1.0"')]},
        "Foreign.fmu: FMI 1.0; give an FMI 2.0 or 3.0 co-simulation FMU",
    ),
    ({"changes": [('fmiVersion="2.0"', "")]}, "Foreign.fmu: FMI of no version; give an FMI 2.0 or 3.0"),
    ({"changes": [("CoSimulation", "ModelExchange")]}, "Foreign.fmu: "),
    ({"leave_out": "binaries/"}, "Foreign.fmu: has binaries for no platform"),
]


@pytest.mark.parametrize(("change", "said"), FOREIGN)
def test_fmus_that_cannot_be_used_here_are_named(harness, small, tmp_path, change, said):
    """Another FMI version, no binary for this platform."""
    foreign = edited(small / "Mass.fmu", tmp_path / "Foreign.fmu", **change)
    code, _, err = harness(MASSES.replace("Mass.fmu", foreign.name))
    assert code == 2 and said in err and len(err.strip().splitlines()) == 1, err


def test_numbers_as_texts_with_units_are_the_same_run(harness):
    text = MASSES.replace("stop_s = 2.0\n", 'stop_s = "2000 ms"\n', 1).replace("step_s = 0.01", 'step_s = "10 ms"')
    text = text.replace("step_limit_s = 2", 'step_limit_s = "2 s"').replace(
        "tolerance = 1e-12", 'tolerance = "1e-10 %"'
    )
    text = text.replace('residual = "spring", most = 0.1', 'residual = "spring", most = "1e-4 kW"')
    runs = [harness(one, "--only", "free")[1]["scenarios"][0]["assertions"] for one in (MASSES, text)]
    assert [one["found"] for one in runs[0][1:3]] == [one["found"] for one in runs[1][1:3]]
    assert runs[1][3]["found"] == pytest.approx(1e-3 * runs[0][3]["found"]) and runs[1][3]["unit"] == "kW"
    assert all(one["passed"] for one in runs[1])


UNIT = '<UnitDefinitions><Unit name="{}"><BaseUnit {}/></Unit></UnitDefinitions>\n\t<LogCategories>'


def in_unit(fmu, target, cause, unit, base):
    """A copy of an FMU whose place has a unit of measurement."""
    place = f'name="place" valueReference="{int(cause == "output")}" causality="{cause}">\n\t\t\t<Real'
    return edited(fmu, target, [("<LogCategories>", UNIT.format(unit, base)), (place, f'{place} unit="{unit}"')])


def test_units_of_measurement_are_converted_or_refused(harness, small, tmp_path):
    """A place in millimetres feeds one in metres; one in seconds does not."""
    in_unit(small / "Mass.fmu", tmp_path / "Mass_mm.fmu", "output", "mm", 'm="1" factor="0.001"')
    in_unit(small / "Mass.fmu", tmp_path / "Mass_s.fmu", "output", "s", 's="1"')
    in_unit(small / "Spring.fmu", tmp_path / "Spring_m.fmu", "input", "m", 'm="1"')
    text = MASSES.replace("Spring.fmu", "Spring_m.fmu")
    code, found, err = harness(text.replace("Mass.fmu", "Mass_mm.fmu"), "--only", "free")
    # A thousandth of the place in the spring: the mass swings as if it were alone.
    assert found["scenarios"][0]["assertions"][1]["found"] == pytest.approx(-0.333, abs=0.02), err
    # A bound in another unit, by a key or in a text.
    metres = text.replace("Mass.fmu", "Mass_mm.fmu").replace("expected = -0.8668", "expected = '-0.00033 m'")
    told = harness(metres.replace("absolute = 0.02", "absolute = '20 um'", 1), "--only", "free")[1]["scenarios"][0]
    assert told["assertions"][1]["passed"] and told["assertions"][1]["unit"] == "m"
    code, _, err = harness(text.replace("Mass.fmu", "Mass_s.fmu"))
    assert code == 2 and "mass.place -> spring.place: from unit 's' to 'm', which cannot be converted" in err
