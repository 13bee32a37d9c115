"""Harness files that would run for long and then tell nothing, or the wrong thing: refused or mended before."""

from pathlib import Path
from xml.etree import ElementTree

import pytest
from one_line import one_line
from refusals import refused_files
from small_fmus import MASS, edited, small_fmu

from cranktrain.core.errors import InputError, StoreError
from cranktrain_lab.coupling.fmu_unit import FmuUnit
from cranktrain_lab.harness import running
from cranktrain_lab.harness.file import load_harness

HEAD = """
stop_s = 1.0
step_s = 0.01
[units.mass]
fmu = "Mass.fmu"
[units.spring]
fmu = "Spring.fmu"
[connections]
map = ["mass.place -> spring.place", "spring.force -> mass.force"]
[[scenario]]
name = "first"
"""


def test_a_ratio_to_a_scenario_that_asserts_nothing_itself(harness):
    """What other scenarios refer to is recorded there too: the order of the two plays no part."""
    second = """
[[scenario]]
name = "second"
start = { spring = { stiffness = 2.0 } }
assert = [{ output = "mass.speed", what = "rms", ratio_to = "first", expected = 1.0, tolerance = 1e-9 }]
"""
    code, found, _ = harness(HEAD + second, "--junit", "out.xml", "--html", "out.html")
    assert (code, found["passed"]) == (0, True)
    assert ElementTree.parse("out.xml").getroot().get("tests") == "3"
    assert "mass.speed over the time" in Path("out.html").read_text("utf-8")


@pytest.mark.parametrize(("name", "ends"), [("Fatal", "1 / 0"), ("Dying", "__import__('os').abort()")])
def test_a_unit_that_does_not_end_well_fails(harness, name, ends):
    """The run is complete and kept, and its values meet what is asserted; fmi2Terminate fails, or its process dies."""
    changed = MASS[2] | {"mass": ("parameter", f"1.0; self.terminate = lambda: {ends}")}
    small_fmu(Path.cwd(), name, MASS[1], changed, MASS[3])
    text = HEAD.replace("Mass.fmu", f"{name}.fmu")
    code, found, _ = harness(text + 'assert = [{ output = "mass.speed", what = "maximum", most = 10 }]')
    (scenario,) = found["scenarios"]
    assert (code, scenario["passed"]) == (1, False) and "run itself is complete" in scenario["ended"]
    assert scenario["assertions"][1]["passed"]


def test_an_output_as_large_as_a_number_may_be_has_its_report(harness):
    text = HEAD.replace("Spring.fmu", "Loud.fmu").replace('"mass.place -> spring.place", "spring.force -> mass.force"',
                                                          '"mass.place -> spring.place"')  # fmt: skip
    text += """assert = [
    { output = "spring.force", what = "maximum", most = 1e30 },
    { output = "spring.force", what = "rms", most = 1e30 },
    { output = "spring.force", what = "peak_to_peak", most = 1e30 },
]
"""
    code, found, _ = harness(text, "--junit", "out.xml", "--html", "out.html")
    largest, rms, swing = found["scenarios"][0]["assertions"][1:]
    assert code == 1 and largest["found"] == 1.7e308 and not largest["passed"]
    assert rms["found"] is None and swing["found"] is None and "too large" in swing["remark"]
    page = Path("out.html").read_text("utf-8")
    assert "<svg" in page and "NaN" not in page and "Infinity" not in page


@pytest.mark.parametrize(("text", "said"), refused_files()["traps"]["added"])
def test_what_cannot_tell_anything_is_refused(small, text, said):
    path = small / "refused.toml"
    path.write_text(HEAD + text, "utf-8")
    with one_line(said):
        load_harness(path)


@pytest.mark.parametrize("step", ["", "step = [{ input = 'spring.anchor', at_s = 0.5, value = 1 }]\n"])
def test_an_order_has_two_communication_points_an_oscillation(harness, step):
    """50 a cycle resolve order 12.5. It is known before the run, unless an event might change the speed."""
    text = "speed_rpm = 240\n" + HEAD + step + "assert = [{ output = 'mass.speed', order = 12.5, most = 10 }]"
    assert harness(text)[0] == 0
    code, found, _ = harness(text.replace("12.5", "13"))
    said = found["scenarios"][0]["assertions"][1]["remark"] if step else found["error"]["what"]
    assert code == (1 if step else 2) and "order 13 needs a communication point every 13.85 deg" in said


def test_a_fault_just_before_the_end_strikes(harness):
    code, found, _ = harness(HEAD + "fault = [{ of = 'spring', kind = 'fails', at_s = 0.999 }]")
    assert code == 1 and found["scenarios"][0]["ended"].startswith("spring, step from 0.99 s")


def test_nan_of_a_unit_that_nothing_reads_is_refused(harness):
    text = HEAD.replace('"mass.place -> spring.place", "spring.force -> mass.force"', '"mass.place -> spring.place"')
    code, found, _ = harness(text + "fault = [{ of = 'spring', kind = 'nan', at_s = 0.5 }]")
    assert code == 2 and "none of its outputs is read" in found["error"]["what"]
    code, found, _ = harness(text + "fault = [{ of = 'spring', kind = 'nan', output = 'force', at_s = 0.5 }]")
    assert code == 1 and "force is nan" in found["scenarios"][0]["ended"]


def test_a_place_that_is_full_costs_its_scenario_only(harness, monkeypatch):
    """The others run, and the file of results for other programs is written."""
    whole = running.keep_run

    def full(path, *rest):
        if path.name == "first.h5":
            raise StoreError(f"{path}: cannot be written (No space left on device); choose another place")
        return whole(path, *rest)

    monkeypatch.setattr(running, "keep_run", full)
    text = HEAD + "ends = [{ how = 'fails' }]\n[[scenario]]\nname = 'second'\n"
    code, found, _ = harness(text, "--junit", "out.xml")
    first, second = found["scenarios"]
    assert code == 1 and not first["passed"] and "No space left" in first["ended"] and first["result"] is None
    assert second["passed"] and Path(second["result"]).is_file() and Path("out.xml").is_file()


@pytest.mark.parametrize(
    ("first", "said"),
    [
        ("fault = [{ of = 'mass', kind = 'fails', at_s = 0 }]", "scenario 'first' did not end as it was to"),
        ("start = { spring = { stiffness = 0.0 } }", "is zero in scenario 'first'"),
    ],
)
def test_a_ratio_without_a_reference_is_no_number_and_fails(harness, first, said):
    """A run that ended too early has other values, and what is over zero is no ratio: neither may pass."""
    second = """
[[scenario]]
name = "second"
assert = [{ output = "spring.force", what = "rms", ratio_to = "first", most = 1e9 }]
"""
    code, found, _ = harness(HEAD + first + second, "--junit", "out.xml")
    ratio = found["scenarios"][1]["assertions"][1]
    assert code == 1 and not ratio["passed"] and ratio["found"] is None and said in ratio["remark"]
    assert Path("out.xml").is_file()


def test_a_reference_that_fails_as_it_was_to_is_compared_with(harness):
    text = HEAD + "fault = [{ of = 'mass', kind = 'fails', at_s = 0.5 }]\nends = [{ of = 'mass' }]\n"
    text += """
[[scenario]]
name = "second"
assert = [{ output = "mass.place", what = "mean", to_s = 0.4, ratio_to = "first", expected = 1, tolerance = 1e-9 }]
"""
    code, found, _ = harness(text)
    assert (code, found["passed"]) == (0, True)


def test_a_window_between_communication_points_says_so(harness):
    between = 'assert = [{ output = "mass.place", what = "mean", from_s = 0.502, to_s = 0.508, most = 9 }]'
    code, found, _ = harness(HEAD + between)
    assert code == 1 and "no communication point lies in the window" in found["scenarios"][0]["assertions"][1]["remark"]


@pytest.mark.parametrize("value", [1.5, 1 << 31, 1e30, -1e12])
def test_a_whole_number_that_a_variable_cannot_hold_is_refused(small, tmp_path, value):
    """It is neither cut off nor taken modulo 2^32."""
    fmu = edited(small / "Mass.fmu", tmp_path / "Whole.fmu", [('<Real start="1"/>', '<Integer start="1"/>')])
    with pytest.raises(InputError, match="is no whole number from -2147483648 to 2147483647"):
        FmuUnit(fmu, "mass", {"mass": value})
    assert FmuUnit(fmu, "mass", {"mass": 2.0}).has("mass")
