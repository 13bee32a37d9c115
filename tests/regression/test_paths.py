"""Paths of users: endings in any case, blanks, letters of any alphabet, ~ for the home folder."""

import json
import math

import numpy as np
import pytest
from engine_texts import coarse_text

from cranktrain.cli.main import main
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.studies.scene import load_scene

FOLDER = "Häuser & Höfe ⚙"
LINE = "Scheibe;Trägheit [kg m²];nach;Steifigkeit [kNm/rad]\nflywheel;;;40\nclutch;0,05;dynamometer;40\n"
CHAIN = "disc,inertia,stiffness\na,0.1,1e5\nb,0.2,1e5\nc,0.3,\n"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A home folder with an engine, a trace, a drive line and a chain, whose names a shell would want quoted."""
    home = tmp_path_factory.mktemp("home")
    folder = home / FOLDER
    folder.mkdir()
    (folder / "My Six.TOML").write_text(coarse_text("diesel_i6", 30), "utf-8")
    engine = load_engine("diesel_i6")
    gas = GasTrace.from_engine(engine)
    angle = np.arange(-360.0, 360.0)
    pressure = 1e-5 * np.interp(np.radians(angle), gas.angles, gas.fired, period=4.0 * math.pi)
    rows = "\n".join(f"{a};{p:.5f}" for a, p in zip(angle, pressure, strict=True))
    (folder / "Druck 1.CSV").write_text("Kurbelwinkel;Druck\n°KW;bar\n" + rows.replace(".", ","), "cp1252")
    (folder / "Linie.CSV").write_text(LINE, "utf-16")
    (folder / "chain.CSV").write_text(CHAIN)
    (folder / "Prüfstand 1.CSV").write_text("Zeit [s];p [bar]\n0;1\n0,1;2,5\n0,2;3\n", "utf-16")
    (folder / "Messung.TXT").write_text("Drehzahl [1/min]\tOrdnung\tAmplitude [°]\n1500\t6\t0,2\n", "utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(home))
        patch.setenv("USERPROFILE", str(home))
        patch.setenv("CRANKTRAIN_CACHE", str(home / "cache"))
        patch.chdir(folder)
        yield folder


@pytest.mark.parametrize("where", ["~/" + FOLDER + "/", ""], ids=["home", "beside"])
@pytest.mark.parametrize(
    ("arguments", "written"),
    [
        pytest.param(["modal", "{}My Six.TOML", "--crank", "beam"], None, marks=pytest.mark.slow),
        (["modal", "{}chain.CSV"], None),
        (["measured", "{}Prüfstand 1.CSV"], None),
        (["modal", "{}My Six.TOML", "--crank", "torsional", "--drive-line={}Linie.CSV"], None),
        (["simulate", "{}My Six.TOML", "--speed", "1500", "--cycles", "1", "--crank", "rigid", "--bearings", "held",
          "--pressure={}Druck 1.CSV", "--drive-line={}Linie.CSV", "--output", "{}Läufe 1.H5"], "Läufe 1.H5"),
        (["export", "{}Läufe 1.H5", "--to", "{}Tafel 1.CSV"], "Tafel 1.CSV"),
        (["runup", "{}My Six.TOML", "--from", "1400", "--to", "1600", "--step", "100", "--crank", "torsional",
          "--no-inherit", "--method", "linear", "--pressure", "{}Druck 1.CSV", "--output", "{}Hochlauf.H5"],
         "Hochlauf.H5"),
        (["plot", "{}Hochlauf.H5", "--measured", "{}Messung.TXT", "--plots", "{}Bilder"], "Bilder"),
        (["schema", "engine", "--output", "{}Schema.JSON"], "Schema.JSON"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)  # fmt: skip
def test_verbs_take_paths_of_any_form(place, capsys, arguments, written, where):
    given = [argument.replace("{}", where) for argument in arguments]
    assert main([*given, "--json"] if given[0] != "schema" else given) == 0, capsys.readouterr().err
    if given[0] != "schema":
        json.loads(capsys.readouterr().out)
    assert written is None or (place / written).exists()
    assert not (place / "~").exists()


@pytest.mark.parametrize("where", ["~/" + FOLDER + "/", ""], ids=["home", "beside"])
def test_files_name_paths_of_any_form(place, where):
    scene = place / "Szene 1.TOML"
    scene.write_text(
        f'engine = "{where}My Six.TOML"\noutputs = ["pulley.torsion"]\nfrequency_hz = 300\naccuracy = 0.05\n'
        f'speeds_rpm = [1500]\n[gas]\npressure_file = "{where}Druck 1.CSV"\n',
        encoding="utf-8",
    )
    read = load_scene(scene)
    assert read.engine.name == "diesel_i6" and read.pressure.file.is_file()
