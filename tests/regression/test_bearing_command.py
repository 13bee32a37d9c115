"""``cranktrain bearing``: its keys, norms that fit each other, and wrong input in one line with exit code 2."""

import math

import numpy as np
import pytest

from cranktrain.cli.main import main
from cranktrain.engine.lubricant import walther_through, walther_viscosity

GIVEN = ("bearing", "plain", "--length-ratio", "0.5", "--eccentricity", "0.6")
MACHINE = ("--diameter-mm", "80", "--width-mm", "40", "--clearance-um", "40", "--viscosity", "0.01", "--speed", "2000")
LOADED = ("bearing", "plain", *MACHINE, "--load-n", "5000")
OIL = ("--inlet-temperature-c", "80", "--oil-viscosity-40", "100", "--oil-viscosity-100", "11")
WARM = ("bearing", "plain", *MACHINE[:6], *MACHINE[8:], "--load-n", "5000", *OIL)


def test_by_eccentricity(run_json):
    result = run_json(*GIVEN)
    assert list(result) == [
        "sommerfeld", "attitude_deg", "side_flow", "friction", "p_max", "force", "moment", "seconds"
    ]  # fmt: skip
    assert result["sommerfeld"] == pytest.approx(0.4982, rel=5e-3)
    assert result["attitude_deg"] == pytest.approx(48.049, abs=0.2)
    assert result["side_flow"] == pytest.approx(0.5634, rel=0.01)
    assert math.hypot(*result["force"]) == pytest.approx(result["sommerfeld"])
    assert result["force"][0] < 0.0 < result["force"][1]
    shear = math.pi / (0.8 * result["sommerfeld"]) + 0.3 * math.sin(math.radians(result["attitude_deg"]))
    assert result["friction"] == pytest.approx(shear)
    assert result["moment"] == [0.0, 0.0]


def test_the_load_that_belongs_to_an_eccentricity_returns_it(run_json):
    given = run_json(*GIVEN)
    omega, psi = 2000.0 * math.pi / 30.0, 1e-3
    load = given["sommerfeld"] * 0.04 * 0.08 * 0.01 * omega / psi**2
    back = run_json("bearing", "plain", *MACHINE, "--load-n", repr(load), "--grid", "96", "16")
    assert list(back) == [
        "eccentricity", "attitude_deg", "min_film_um", "stiffness", "damping", "whirl_threshold", "flow",
        "friction_torque", "p_max", "seconds",
    ]  # fmt: skip
    assert back["eccentricity"] == pytest.approx(0.6, rel=1e-6)
    assert back["attitude_deg"] == pytest.approx(given["attitude_deg"], rel=1e-6)
    assert back["min_film_um"] == pytest.approx(16.0, rel=1e-6)
    assert back["flow"] == pytest.approx(given["side_flow"] * 0.04**3 * psi * omega, rel=1e-5)
    assert back["p_max"] == pytest.approx(given["p_max"] * 0.01 * omega / psi**2, rel=1e-5)
    assert back["friction_torque"] == pytest.approx(given["friction"] * psi * load * 0.04, rel=1e-5)
    assert np.shape(back["stiffness"]) == np.shape(back["damping"]) == (2, 2)


def test_tilt_moves_the_force_to_the_closer_end(run_json):
    result = run_json(*GIVEN, "--tilt", "0.1", "0")
    # Force against the eccentricity at the end z > 0: ∫z dF_x < 0, a negative moment about y.
    assert result["moment"][1] < 0.0
    assert result["sommerfeld"] > run_json(*GIVEN)["sommerfeld"]
    other = run_json(*GIVEN, "--tilt", "-0.1", "0")
    np.testing.assert_allclose(other["force"], result["force"], rtol=1e-6)
    np.testing.assert_allclose(other["moment"], -np.array(result["moment"]), rtol=1e-6)


def test_squeeze(run_json):
    rotating = run_json(*GIVEN, "--squeeze", "0.2")
    assert rotating["sommerfeld"] > run_json(*GIVEN)["sommerfeld"]
    squeezed = run_json(*GIVEN, "--squeeze-only")
    assert squeezed["attitude_deg"] == pytest.approx(0.0, abs=1e-6)
    assert squeezed["friction"] == pytest.approx(0.0, abs=1e-9)
    # Fast squeeze drowns the rotation.
    fast = run_json(*GIVEN, "--squeeze", "1e6")
    assert fast["sommerfeld"] / 1e6 == pytest.approx(squeezed["sommerfeld"], rel=1e-4)


def test_several_speeds_give_a_stribeck_curve(run_json):
    """Friction falls from that of the boundary to a least value and rises again; each entry is that of its speed."""
    rough = (
        "--roughness-um", "0.8", "--asperity-density", "3000", "--asperity-radius-um", "20", "--contact-modulus-gpa",
        "60", "--hardness-mpa", "200", "--boundary-friction", "0.12", "--grid", "96", "12",
    )  # fmt: skip
    given = ("bearing", "plain", *MACHINE[:8], "--load-n", "20000", *rough, "--speed")
    curve = run_json(*given, "0.1", "50", "300", "3000")["curve"]
    assert [found["speed_rpm"] for found in curve] == [0.1, 50.0, 300.0, 3000.0]
    friction = [found["friction_coefficient"] for found in curve]
    assert friction[0] > friction[1] > friction[2] < friction[3]
    alone = run_json(*given, "50")
    assert {key: curve[1][key] for key in alone if key != "seconds"} == {
        key: value for key, value in alone.items() if key != "seconds"
    }
    for key in ("contact_load", "contact_friction_torque", "contact_pressure_max_mpa", "contact_area_mm2"):
        assert curve[0][key] > curve[1][key] > curve[2][key] >= 0.0, key


def test_heat_balance(run_json):
    warm = run_json(*WARM)
    power = warm["friction_torque"] * 2000.0 * math.pi / 30.0
    rise = warm["outlet_temperature_c"] - 80.0
    assert 0.8 * power == pytest.approx(860.0 * 2000.0 * warm["flow"] * rise, rel=1e-6)
    assert warm["effective_temperature_c"] == pytest.approx(80.0 + 0.5 * rise)
    laws = walther_through([(313.15, 100e-6), (373.15, 11e-6)])
    viscosity = walther_viscosity(warm["effective_temperature_c"] + 273.15, *laws, 860.0)
    assert warm["viscosity"] == pytest.approx(viscosity, rel=1e-6)
    # The same bearing with that viscosity given.
    given = run_json(*LOADED, "--viscosity", repr(warm["viscosity"]))
    assert given["eccentricity"] == pytest.approx(warm["eccentricity"], rel=1e-6)
    assert given["stiffness"] == pytest.approx(np.array(warm["stiffness"]), rel=1e-4)
    cooler = run_json(*WARM, "--heat-share", "0.4")
    assert cooler["effective_temperature_c"] < warm["effective_temperature_c"]


def test_rough_surfaces_oil_under_pressure_and_an_elastic_bore(run_json):
    """One interface: by load, then the place of that load in units; each option changes what it should."""
    machine = ("--diameter-mm", "80", "--width-mm", "30", *MACHINE[4:], "--grid", "72", "10")
    rough = ("--roughness-um", "1.2", "--boundary-friction", "0.08")
    oil = ("--pressure-law", "roelands", "--pressure-viscosity", "15", "--compressibility", "dowson-higginson")
    plain = run_json("bearing", "plain", *machine, "--load-n", "10000", "--cavitation", "mass-conserving")
    thick = run_json("bearing", "plain", *machine, "--load-n", "10000", *oil)
    assert thick["min_film_um"] > 1.01 * plain["min_film_um"]
    everything = run_json("bearing", "plain", *machine, "--load-n", "10000", *rough, *oil, "--bore", "diesel_i6")
    assert everything["bore_displacement_um"] > 2.0 and 0.0 <= everything["contact_load"] < 10000
    assert everything["contact_friction_torque"] < everything["friction_torque"]
    placed = run_json("bearing", "plain", *machine, "--eccentricity", str(plain["eccentricity"]))
    assert placed["load"] == pytest.approx(10000, rel=1e-3)
    assert placed["min_film_um"] == pytest.approx(plain["min_film_um"], rel=1e-3)


def test_whirl_of_full_and_of_heavily_loaded_films(run_json):
    # A full film has no stiffness along its line of centres: no speed is stable. Above some load every speed is.
    assert run_json(*LOADED, "--cavitation", "full")["whirl_threshold"] < 1e-3
    assert run_json(*LOADED[:-1], "100000")["whirl_threshold"] is None


def test_without_load_there_is_no_attitude(run_json):
    centred = run_json("bearing", "plain", "--length-ratio", "0.5", "--eccentricity", "0")
    assert centred["sommerfeld"] == 0.0
    assert centred["attitude_deg"] is None
    assert centred["friction"] is None
    squeezed = run_json("bearing", "plain", "--length-ratio", "0.5", "--eccentricity", "0", "--squeeze-only")
    assert squeezed["sommerfeld"] > 0.0
    assert squeezed["attitude_deg"] == pytest.approx(0.0, abs=1e-6)


def test_small_negative_numbers_are_no_options(run_json):
    one, other = (run_json(*GIVEN, "--tilt", a, b) for a, b in (("-1e-2", "-.1e-1"), ("-0.01", "-0.01")))
    assert one["force"] == other["force"]
    assert run_json(*GIVEN, "--squeeze", "-1e-1")["force"] == run_json(*GIVEN, "--squeeze", "-0.1")["force"]


def test_grid_and_moment(run_json):
    assert run_json(*GIVEN, "--grid", "192", "32")["sommerfeld"] == pytest.approx(0.4982, rel=2e-3)
    tilted = run_json(*LOADED, "--moment-nm", "5", "-10")
    assert np.shape(tilted["stiffness"]) == (4, 4)
    # A moment about −y is a load that presses at z < 0 more than at z > 0.
    assert tilted["tilt"][0] < 0.0


def test_tables_for_people(capsys):
    assert main([*GIVEN]) == 0
    assert "F psi²/(B D eta omega)" in capsys.readouterr().out
    assert main([*LOADED, "--grooves", "two-axial", "--groove-deg", "30"]) == 0
    assert "whirl_threshold" in capsys.readouterr().out
