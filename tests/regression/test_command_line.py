"""The command line: what its JSON holds, that two runs agree, and that wrong input ends in one line and exit code 2."""

import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from engine_texts import coarse_text

from cranktrain.cli.functions import verb_of
from cranktrain.cli.main import main
from cranktrain.cli.parser import function_of
from cranktrain.cli.verbs import FUNCTIONS, VERBS
from cranktrain.core.errors import InputError
from cranktrain.dynamics.outputs.register import Counts, output_names
from cranktrain.engine.file import load_engine
from cranktrain.results.files import check_target, output_unit
from cranktrain.results.tables import NOTHING, cranktrain_table, critical_speed_table, free_table
from cranktrain.store.hdf5 import read_result

ORDERS = [3, 6, 6.5, 7.5, 9, 12]


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """Engine file with a coarse mesh, and a cache of its own."""
    folder = tmp_path_factory.mktemp("coarse")
    text = coarse_text("diesel_i6", 30)
    path = folder / "coarse_i6.toml"
    path.write_text(text.replace('name = "diesel_i6"', 'name = "coarse_i6"'), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CRANKTRAIN_CACHE", str(folder / "cache"))
        yield str(path)


def test_modal_json_has_the_keys_that_machines_read(coarse, run_json):
    report = run_json("modal", coarse)
    assert {"crankshaft_free", "cranktrain", "critical_speeds", "reduction", "seconds"} <= set(report)
    for part in ("crankshaft_free", "cranktrain"):
        for mode in report[part]["modes"]:
            assert mode["shape"] in ("bending", "torsional", "axial")
            assert sum(mode["shares"].values()) == pytest.approx(1.0, abs=1e-6)
            assert mode["shape"] == max(mode["shares"], key=mode["shares"].get)
    first = report["cranktrain"]["first_torsional_hz"]
    assert {entry["order"] for entry in report["critical_speeds"]} >= set(ORDERS)
    for entry in report["critical_speeds"]:
        assert entry["rpm"] == pytest.approx(60.0 * first / entry["order"], rel=1e-9)
    reduction = report["reduction"]
    assert len(reduction["full_hz"]) == len(reduction["reduced_hz"])
    assert reduction["max_relative_error"] < 0.005
    assert reduction["dofs_full"] > 10 * reduction["modes"] > 300


def test_simulate_writes_a_result_and_repeats_itself(coarse, run_json, tmp_path):
    runs = []
    for name in ("a.h5", "b.h5"):
        options = ("--speed", "2000", "--cycles", "2", "--output", str(tmp_path / name), "--plots", str(tmp_path / "p"))
        runs.append(run_json("simulate", coarse, *options))
    summary = runs[0]
    assert set(summary["pulley"]) == {"torsion_deg", "axial_um"}
    pictures = ("pulley_torsion.png", "main_loads.png", "orbits.png", "least_films.png")
    assert summary["plots"] == [str(tmp_path / "p" / name) for name in pictures]
    assert sorted(path.name for path in (tmp_path / "p").iterdir()) == sorted(pictures)
    assert [set(row) for row in summary["big_ends"]] == [{"name", "peak_load_n"}] * 6  # rigid: no films
    assert [row["name"] for row in summary["bearings"]] == [f"main[{i}]" for i in range(1, 8)]
    clearance_um = 1e6 * load_engine(coarse).main_bearing.clearance
    for row in summary["bearings"]:
        assert 0.0 < row["max_eccentricity"] < 1.0
        assert row["max_pressure_pa"] > 1e6 and row["max_moment_nm"] == 0.0  # films without tilt
        assert row["min_film_um"] == pytest.approx(clearance_um * (1.0 - row["max_eccentricity"]), rel=1e-6)
    first, attributes = read_result(tmp_path / "a.h5")
    second, _ = read_result(tmp_path / "b.h5")
    assert attributes["speed"] == pytest.approx(2000.0 * math.pi / 30.0)
    assert set(first) == {"time", "angle", "film_temperature_c", *output_names(Counts(7, 6, 4))}
    for name, (values, unit) in first.items():
        assert np.array_equal(values, second[name][0]), name
        assert unit == {"time": "s", "angle": "rad"}.get(name) or unit == output_unit(name)
    assert first["bearing[1].velocity.x"][1] == "m/s" and first["bearing[1].moment.x"][1] == "N m"
    assert not list(tmp_path.glob(".*"))  # nothing half-written is left


def test_a_run_says_that_its_films_leave_the_pressure_law_out(coarse, capsys, tmp_path):
    text = Path(coarse).read_text(encoding="utf-8")
    engine = tmp_path / "barus.toml"
    engine.write_text(text.replace('pressure_law = { value = "none"', 'pressure_law = { value = "barus"'), "utf-8")
    options = ("--speed", "1500", "--cycles", "1", "--crank", "rigid", "--bearings", "linear")
    for path, warns in ((coarse, False), (str(engine), True)):
        main(["simulate", path, *options, "--output", str(tmp_path / "run.h5")])
        assert ("oil.pressure_law 'barus'" in capsys.readouterr().err) == warns


def test_rigid_crank_on_springs_and_a_measured_trace(coarse, run_json, tmp_path):
    csv = tmp_path / "trace.csv"
    angle = np.arange(0.0, 720.0, 2.0)
    bar = 2.0 + 120.0 * np.exp(-(((angle - 365.0) / 25.0) ** 2))
    csv.write_text("angle_deg;pressure_bar\n" + "\n".join(f"{a};{p}" for a, p in zip(angle, bar, strict=True)))
    options = ("--speed", "1500", "--cycles", "2", "--crank", "rigid", "--bearings", "linear")
    summary = run_json("simulate", coarse, *options, "--pressure", str(csv), "--output", str(tmp_path / "rigid.h5"))
    assert summary["gas"]["peak_mpa"] == pytest.approx(12.2, rel=0.01)
    # a rigid crank does not twist: pulley and flywheel move as one
    outputs, _ = read_result(tmp_path / "rigid.h5")
    assert outputs["pulley.torsion"][0] == pytest.approx(outputs["flywheel.torsion"][0], abs=1e-12)


def test_a_run_says_how_settled_it_is(coarse, capsys, run_json, tmp_path):
    """In the summary, in JSON and in the file; exactly N cycles run where N are asked for."""
    path = tmp_path / "run.h5"
    options = ("--speed", "1500", "--crank", "rigid", "--bearings", "linear", "--output", str(path))
    settling = run_json("simulate", coarse, *options)["settling"]
    assert settling["repeats_every_cycles"] == 1 and settling["tolerance"] == 1e-3
    assert 0.0 < max(settling["left"].values()) <= 1e-3 and {"pulley.torsion", "bearing.force"} <= set(settling["left"])
    outputs, attributes = read_result(path)
    assert attributes["cycles"] == settling["cycles"] <= 8 and attributes["settling_left"] <= 1e-3
    assert '"pulley.torsion"' in attributes["settling_left_by_family"]
    assert outputs["angle"][0][-1] == pytest.approx(4.0 * math.pi)
    assert main(["simulate", coarse, *options, "--cycles", "3"]) == 0
    assert "Settling: " in capsys.readouterr().out
    outputs, attributes = read_result(path)
    assert attributes["cycles"] == 3 and outputs["angle"][0][-1] == pytest.approx(12.0 * math.pi)


def test_tables_for_people_show_published_values_and_calibration(coarse, capsys):
    assert main(["modal", coarse]) == 0
    text = capsys.readouterr().out
    for part in (
        "Free crankshaft",
        "Cranktrain at rest",
        "Critical speeds",
        "published",
        "Reduction:",
        "calibrated",
    ):
        assert part in text
    assert main(["reduce", coarse]) == 0
    assert "static stiffness" in capsys.readouterr().out


@pytest.mark.parametrize("arguments", [(), ("modl", "diesel_i6"), ("simulate", "diesel_i6"), ("modal",)])
def test_a_wrong_call_ends_in_one_line_and_exit_code_2(arguments):
    done = subprocess.run(
        [sys.executable, "-m", "cranktrain.cli.main", *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stdout == "" and done.stderr.count("\n") == 1


@pytest.mark.parametrize("verb", [*VERBS])
def test_help_of_each_verb(verb, capsys):
    with pytest.raises(SystemExit) as end:
        main([*verb.split(), "--help"])
    assert end.value.code == 0
    assert f"usage: cranktrain {verb}" in capsys.readouterr().out


def test_help_lists_every_verb(capsys):
    with pytest.raises(SystemExit) as end:
        main(["--help"])
    assert end.value.code == 0
    listed = re.findall(r"^  ([a-z-]+(?: [a-z]+)?) ", capsys.readouterr().out, re.MULTILINE)
    assert {*VERBS} <= {*listed}


@pytest.mark.parametrize("verb", [*VERBS])
def test_the_list_has_the_first_line_of_each_verb(verb):
    assert VERBS[verb] == verb_of(function_of(FUNCTIONS[verb])).about.partition("\n")[0]


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["engines"], ["engines", "--json"], ["simulat"]])
def test_what_is_asked_first_loads_no_mathematics(arguments):
    """Nor what numba, SciPy and tables on terminals need: it answers in a tenth of a second."""
    code = "import sys; from cranktrain.cli.main import main\ntry: main(sys.argv[1:])\nexcept SystemExit: pass\n"
    code += "print({*sys.modules} & {'numpy', 'scipy', 'numba', 'rich', 'h5py', 'matplotlib'}, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True)
    assert done.stderr.splitlines()[-1] == "set()"


def test_a_result_never_replaces_what_is_no_result(tmp_path):
    notes = tmp_path / "notes.txt"
    notes.write_text("keep me")
    with pytest.raises(InputError, match="no cranktrain result file"):
        check_target(notes)
    with pytest.raises(InputError, match="is a folder"):
        check_target(tmp_path)
    with pytest.raises(InputError, match="not a writable folder"):
        check_target(notes / "result.h5")
    assert notes.read_text() == "keep me"
    check_target(tmp_path / "new" / "result.h5")


def mode(hz, shape):
    return {
        "hz": hz,
        "shape": shape,
        "shares": {kind: float(kind == shape) for kind in ("bending", "torsional", "axial")},
    }


def test_tables_put_each_published_frequency_beside_the_mode_that_answers_to_it():
    engine = load_engine("diesel_i6")
    modes = [
        mode(18.0, "torsional"),
        mode(205.0, "bending"),
        mode(240.0, "torsional"),
        mode(310.0, "axial"),
        mode(640.0, "bending"),
    ]
    named = {"first_torsional_hz": 240.0, "second_torsional_hz": 640.0, "first_axial_hz": 310.0}
    table = cranktrain_table(engine, {"modes": modes, **named})
    rows = {row[0]: row for row in table.rows}
    assert rows["18.0"][5] == NOTHING
    assert rows["240.0"][5:] == ("238", "+0.8 %", "237")
    assert rows["310.0"][5:] == ("300", "+3.3 %", "292")
    assert rows["205.0"][5] == "208"
    assert rows["640.0"][5:] == ("650", "-1.5 %", NOTHING)
    assert [row[5] for row in table.rows if row[0] == NOTHING] == ["267", "289"]
    # Shapes are paired as a whole: 276.9 Hz answers to 289 Hz, though 267 Hz is nearer to it.
    modes = [mode(hz, "bending") for hz in (193.3, 199.8, 253.6, 276.9, 361.0, 640.0)]
    rows = cranktrain_table(engine, {"modes": [*modes, mode(300.0, "axial"), mode(240.0, "torsional")], **named}).rows
    assert {row[0]: row[5] for row in rows if row[1] == "bending" and row[5] not in (NOTHING, "650")} == {
        "199.8": "208",
        "253.6": "267",
        "276.9": "289",
    }
    free = free_table(engine, {"modes": [mode(252.0, "torsional")], "torsional_hz": [252.0]})
    assert free.rows[0][5:] == ("252", "+0.0 %")
    entries = [{"order": 6, "rpm": 2380.0, "excitation": 1.0}, {"order": 4, "rpm": 3570.0}]
    speeds = critical_speed_table(engine, entries)
    assert speeds.rows[0] == ("6", "2380", "100", "2380", "+0.0 %", "2370")
    assert speeds.rows[1][2:] == 4 * (NOTHING,)
