"""``cranktrain bearing``: its keys, norms that fit each other, and wrong input in one line with exit code 2."""

import json
import math
import re

import numpy as np
import pytest

from cranktrain.cli import main

GIVEN = ("bearing", "--length-ratio", "0.5", "--eccentricity", "0.6")
MACHINE = ("--diameter-mm", "80", "--width-mm", "40", "--clearance-um", "40", "--viscosity", "0.01", "--speed", "2000")
LOADED = ("bearing", *MACHINE, "--load", "5000")


def run(capsys, *arguments):
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_by_eccentricity(capsys):
    result = run(capsys, *GIVEN)
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


def test_the_load_that_belongs_to_an_eccentricity_returns_it(capsys):
    given = run(capsys, *GIVEN)
    omega, psi = 2000.0 * math.pi / 30.0, 1e-3
    load = given["sommerfeld"] * 0.04 * 0.08 * 0.01 * omega / psi**2
    back = run(capsys, "bearing", *MACHINE, "--load", repr(load), "--grid", "96", "16")
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


def test_tilt_moves_the_force_to_the_closer_end(capsys):
    result = run(capsys, *GIVEN, "--tilt", "0.1", "0")
    # Force against the eccentricity at the end z > 0: ∫z dF_x < 0, a negative moment about y.
    assert result["moment"][1] < 0.0
    assert result["sommerfeld"] > run(capsys, *GIVEN)["sommerfeld"]
    other = run(capsys, *GIVEN, "--tilt", "-0.1", "0")
    np.testing.assert_allclose(other["force"], result["force"], rtol=1e-6)
    np.testing.assert_allclose(other["moment"], -np.array(result["moment"]), rtol=1e-6)


def test_squeeze(capsys):
    rotating = run(capsys, *GIVEN, "--squeeze", "0.2")
    assert rotating["sommerfeld"] > run(capsys, *GIVEN)["sommerfeld"]
    squeezed = run(capsys, *GIVEN, "--squeeze-only")
    assert squeezed["attitude_deg"] == pytest.approx(0.0, abs=1e-6)
    assert squeezed["friction"] == pytest.approx(0.0, abs=1e-9)
    # Fast squeeze drowns the rotation.
    fast = run(capsys, *GIVEN, "--squeeze", "1e6")
    assert fast["sommerfeld"] / 1e6 == pytest.approx(squeezed["sommerfeld"], rel=1e-4)


def test_four_kinds_of_cavitation(capsys):
    attitude = {
        kind: run(capsys, *GIVEN, "--cavitation", kind)["attitude_deg"]
        for kind in ("full", "guembel", "reynolds", "mass-conserving")
    }
    assert attitude["full"] == pytest.approx(90.0, abs=1e-6)
    assert attitude["mass-conserving"] == pytest.approx(attitude["reynolds"], abs=0.2)
    assert abs(attitude["guembel"] - attitude["reynolds"]) > 0.5


def test_grid_and_moment(capsys):
    assert run(capsys, *GIVEN, "--grid", "192", "32")["sommerfeld"] == pytest.approx(0.4982, rel=2e-3)
    tilted = run(capsys, *LOADED, "--moment-nm", "5", "-10")
    assert np.shape(tilted["stiffness"]) == (4, 4)
    # A moment about −y is a load that presses at z < 0 more than at z > 0.
    assert tilted["tilt"][0] < 0.0


def test_tables_for_people(capsys):
    assert main([*GIVEN]) == 0
    assert "F psi²/(B D eta omega)" in capsys.readouterr().out
    assert main([*LOADED, "--grooves", "two-axial", "--groove-deg", "30"]) == 0
    assert "whirl_threshold" in capsys.readouterr().out


def test_help_states_the_norms(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["bearing", "--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    for part in ("So = F psi^2/(B D eta omega)", "deps/dt", "M psi^2/(B^2 D eta omega)", "omega_s sqrt(c m/W)"):
        assert part in text


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("bearing",), "needs --eccentricity"),
        (("bearing", "--eccentricity", "0.5"), "also needs --length-ratio"),
        (("bearing", "--load", "5"), "also needs --diameter-mm"),
        (("bearing", "--length-ratio", "0.5", "--eccentricity", "1"), "surfaces touch"),
        (("bearing", "--length-ratio", "0.5", "--eccentricity", "-0.1"), "not within 0 to 1"),
        (("bearing", "--length-ratio", "0", "--eccentricity", "0.5"), "length ratio 0"),
        ((*GIVEN, "--load", "100"), "--load does not go with --eccentricity"),
        ((*LOADED, "--tilt", "0", "0.1"), "--tilt does not go with --load"),
        ((*GIVEN, "--tilt", "0.5", "0"), r"edge touch .* less than 0\.4 is possible"),
        ((*GIVEN, "--cavitation", "raynolds"), "did you mean 'reynolds'"),
        ((*GIVEN, "--supply", "widest"), "did you mean 'widest-gap'"),
        ((*GIVEN, "--squeeze-only", "--squeeze", "1"), "drop one of the two"),
        ((*GIVEN, "--squeeze-only", "--cavitation", "mass-conserving"), "must rotate steadily"),
        ((*GIVEN, "--grid", "8", "16"), "12 to 4096"),
        ((*LOADED[:-1], "0"), "load 0 N must be above zero"),
        ((*LOADED[:-1], "-5"), "load -5 N must be above zero"),
        ((*LOADED[:-1], "1e15"), "no film carries"),
        ((*LOADED, "--clearance-um", "-40"), "--clearance-um -40 must be above zero"),
        ((*LOADED, "--clearance-um", "40000"), "twentieth of the diameter"),
        ((*LOADED, "--viscosity", "-1"), "--viscosity -1 must be above zero"),
        ((*LOADED, "--grooves", "two-axial", "--groove-deg", "180"), "overlap"),
        ((*LOADED, "--grooves", "one"), "valid: two-axial"),
        ((*LOADED, "--groove-deg", "20"), "needs --grooves"),
        ((*LOADED, "--moment-nm", "0", "2000"), "no film carries 5000 N and moment"),
        ((*LOADED, "--cavitation", "mass-conserving"), "for a given --eccentricity"),
    ],
)
def test_wrong_input_ends_in_one_line_and_exit_code_2(capsys, arguments, says):
    assert main([*arguments, "--json"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert re.search(says, captured.err), captured.err
