"""Verbs that run an engine take the same measured pressures and drive line, and say what they took."""

import json

import numpy as np
import pytest
from engine_texts import coarse_text

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.pressure_map import PressureMap, read_gas
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.studies.planning.scene_model import SceneModel
from cranktrain.studies.scene import load_scene

LINE = "disc,inertia,damping,to,stiffness,shaft_damping\nflywheel,,,,4e4,100\nclutch,0.05,0.5,dynamometer,4e4,100\n"
TORSIONAL = ("--crank", "torsional", "--no-inherit")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Folder with a coarse engine, a trace for each cylinder, a map of two speeds, and a drive line."""
    folder = tmp_path_factory.mktemp("pressures")
    text = coarse_text("diesel_i6", 30)
    (folder / "coarse.toml").write_text(text.replace('name = "diesel_i6"', 'name = "coarse"'), encoding="utf-8")
    engine = load_engine("diesel_i6")
    trace = GasTrace.from_engine(engine)
    angle = np.arange(0.0, 720.0)

    def write(name, columns):
        rows = zip(angle, *(1e-5 * column for column in columns), strict=True)
        (folder / name).parent.mkdir(exist_ok=True)
        lines = (";".join(f"{value:.5f}" for value in row) for row in rows)
        (folder / name).write_text("deg;bar\n" + "\n".join(lines), encoding="utf-8")

    write("six.csv", [share * trace.fired for share in (1.0, 0.9, 1.0, 0.95, 1.0, 0.9)])
    write("map/1000.csv", [0.8 * trace.fired])
    write("map/2000.csv", [trace.fired])
    (folder / "line.csv").write_text(LINE, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CRANKTRAIN_CACHE", str(folder / "cache"))
        patch.chdir(folder)
        yield folder


def ran(capsys, *arguments):
    """Found JSON and what was told beside it."""
    assert main([*arguments, "--json"]) == 0, capsys.readouterr().err
    said = capsys.readouterr()
    return json.loads(said.out), said.err


def test_simulate_follows_each_cylinder_and_interpolates_the_map(place, capsys):
    given = ("simulate", "diesel_i6", "--cycles", "1", "--crank", "rigid", "--bearings", "held")
    found, told = ran(capsys, *given, "--speed", "1500", "--pressure", "six.csv", "--drive-line", "line.csv")
    assert "six.csv: 720 points in bar" in told and "of each cylinder its own" in told
    ends = [read_gas(place / "map" / f"{rpm}.csv", load_engine("diesel_i6")).imep for rpm in (1000, 2000)]
    found, told = ran(capsys, *given, "--speed", "1500", "--pressure", "map")
    assert found["gas"]["imep_mpa"] == pytest.approx(0.5e-6 * sum(ends), rel=1e-9)
    _, told = ran(capsys, *given, "--speed", "2600", "--pressure", "map")
    assert "warning: map: 2600 rev/min lies beyond its speeds, 1000 to 2000 rev/min" in told


def test_run_ups_take_the_pressure_of_each_speed(place, capsys):
    """In the frequency domain the map's end is its own file; the middle lies between, and differs from both."""
    given = ("runup", "diesel_i6", "--from", "1000", "--to", "2000", "--step", "500", *TORSIONAL, "--method", "linear")
    sizes = []
    for name in ("map", "map/1000.csv", "map/2000.csv"):
        found, _ = ran(capsys, *given, "--pressure", name, "--output", f"{name.replace('/', '_')}.h5")
        sizes.append(np.abs(RunUp.load(found["result"]).torsion))
    of_map, low, high = sizes
    assert np.array_equal(of_map[0], low[0]) and np.array_equal(of_map[2], high[2])
    assert not np.allclose(of_map[1], low[1]) and not np.allclose(of_map[1], high[1])
    _, told = ran(capsys, *given[:3], "900", *given[4:], "--pressure", "map", "--output", "beyond.h5")
    assert "900 rev/min lies beyond its speeds" in told


@pytest.mark.slow
@pytest.mark.parametrize("way", [("--ramp", "400"), ("--workers", "1")])
def test_run_ups_in_time_take_maps(place, capsys, way):
    given = ("runup", "diesel_i6", "--from", "1200", "--to", "1500", "--step", "100", *TORSIONAL, "--anew")
    given += (*way, "--highest-order", "12", "--output", f"{way[0][2:]}.h5")
    found, told = ran(capsys, *given, "--pressure", "map")
    assert found["failed"] == [] and "map: between 2 of 2 traces" in told


@pytest.mark.slow
@pytest.mark.parametrize(
    "verb",
    [
        ("bearing-loads", "--speed", "1500", "--cycles", "1", "--crank", "rigid"),
        ("stress", "--speed", "1500", "--bearings", "linear", "--settle", "1e-2", "--no-check"),
        ("fatigue", "--speed", "1500", "--bearings", "linear", "--settle", "1e-2"),
        ("modal", "--speed", "1500", "--bearings", "linear"),
        ("report", "--quick"),
    ],
    ids=lambda verb: verb[0],
)
def test_every_verb_that_runs_takes_pressures_and_a_drive_line(place, capsys, verb):
    """The measured pressure changes what the verb finds, and the verb takes a drive line of discs."""
    name, *options = verb
    if name == "report":
        options += ["--output", "report.html"]
    plain, _ = ran(capsys, name, "coarse.toml", *options)
    found, told = ran(capsys, name, "coarse.toml", *options, "--pressure", "six.csv", "--drive-line", "line.csv")
    if name == "report":
        assert plain["report"] == found["report"]
    else:
        plain.pop("seconds", None), found.pop("seconds", None)
        assert found != plain
        assert "six.csv: 720 points in bar" in told


@pytest.mark.slow
def test_couple_takes_pressures_in_place_of_a_combustion(place, capsys):
    given = ("couple", "coarse.toml", "--speed", "1500", "--cycles", "2", "--no-valvetrain")
    rigid = ("--set", "cranktrain.crank.level=rigid", "--output", "coupled.h5")
    found, told = ran(capsys, *given, *rigid, "--pressure", "six.csv", "--drive-line", "line.csv")
    assert found["imep_pa"] == pytest.approx(GasTrace.from_csv(place / "six.csv", load_engine("diesel_i6")).imep)
    engine = load_engine("diesel_i6")
    torque = found["imep_pa"] * engine.displacement / (4.0 * np.pi)
    assert found["indicated_torque_nm"] == pytest.approx(torque, rel=0.02) and "six.csv: 720 points" in told


def test_what_does_not_go_together_is_refused(place, capsys):
    couple = ("couple", "diesel_i6", "--speed", "1500", "--no-valvetrain", "--pressure", "six.csv")
    for option, file, says in (
        ("--combustion", "own.fmu", "--pressure takes the place of the combustion; leave out --combustion"),
        ("--export-ssp", "six.ssp", "--export-ssp writes FMUs, which measured pressures are not"),
    ):
        assert main([*couple, option, file]) == 2
        said = capsys.readouterr().err
        assert says in said and said.count("\n") == 1, said


def test_a_scene_takes_a_map(place):
    scene = place / "scene.toml"
    scene.write_text(
        'engine = "diesel_i6"\noutputs = ["pulley.torsion"]\nfrequency_hz = 300\naccuracy = 0.05\n'
        'speeds_rpm = [1500]\n[gas]\npressure_file = "map"\n',
        encoding="utf-8",
    )
    assert isinstance(SceneModel(load_scene(scene)).gas, PressureMap)
