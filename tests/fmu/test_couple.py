"""The verb ``couple``: cranktrain, combustion and valve train as FMUs under the reference master."""

import json
import math
import zipfile

import pytest
from benchmarks.misfire import ORDERS, figures
from fmpy.ssp.ssd import read_ssd
from small_fmus import small_combustion

import cranktrain as ct
from cranktrain.cli.main import main
from cranktrain.engine.file import engine_folder, load_engine
from cranktrain.fmu.build import build_fmu
from cranktrain.store.hdf5 import read_result
from cranktrain_lab.coupling.ssp import write_ssp
from cranktrain_lab.coupling.virtual_engine import Partners, virtual_engine

SPEED = 209.43951023931953


@pytest.fixture(scope="session")
def valvetrain(tmp_path_factory):
    return build_fmu("valvetrain_i6", tmp_path_factory.mktemp("valvetrain"))


@pytest.fixture(scope="session")
def couple(fmu, partner, valvetrain, ran, tmp_path_factory):
    """Run the verb in a process of its own."""
    folder = tmp_path_factory.mktemp("coupled")

    def run(*options, cranktrain=fmu, combustion=partner, valvetrain=valvetrain):
        units = "--cranktrain", cranktrain, "--combustion", combustion
        if "--no-valvetrain" not in options:
            units += "--valvetrain", valvetrain
        verb = "-m", "cranktrain.cli.main", "couple", "diesel_i6", "--speed", "2000", "--json", "--output", "run.h5"
        done = ran(*verb, *units, *options, cwd=folder)
        return done.returncode, json.loads(done.stdout), done.stderr, folder / "run.h5"

    return run


def test_schemes_agree_and_the_power_closes(couple):
    """Jacobi and Gauss-Seidel at 1 degree, the pressures' angle told: within half a percent of each other."""
    found = {}
    for scheme in ("jacobi", "gauss-seidel"):
        code, found[scheme], stderr, path = couple("--cycles", 2, "--scheme", scheme)
        assert code == 0, stderr
    one, other = (run["pulley"]["torsion_deg"] for run in found.values())
    assert one["peak_to_peak"] == pytest.approx(other["peak_to_peak"], rel=5e-3)
    for run in found.values():
        assert run["imep_pa"] == pytest.approx(1.534e6, rel=0.02)
        engine = load_engine("diesel_i6")
        swept = 6 * 2.0 * engine.crankshaft.throw * math.pi / 4.0 * engine.cylinders.bore**2
        assert run["indicated_torque_nm"] == pytest.approx(run["imep_pa"] * swept / (4.0 * math.pi), rel=2e-3)
        assert run["coupling_residual_w"] < 0.02 * 209.4 * max(abs(run["indicated_torque_nm"]), 3000.0)
        assert abs(run["coupling_residual_fraction"]) < 1e-4
        assert run["coupling_residual_mean_w"] == pytest.approx(
            209.44 * run["indicated_torque_nm"] * run["coupling_residual_fraction"], rel=1e-3
        )
        assert run["steps"] == run["sweeps"] == 1440
        assert (
            run["valvetrain"]["torque_nm"] == pytest.approx(8.6, abs=0.5) and run["valvetrain"]["contact_loss"] == 0.0
        )
    data, attributes = read_result(path)
    assert data["cranktrain/pulley.torsion"][1] == "rad" and data["combustion/cylinder[1].pressure"][1] == "Pa"
    assert data["valvetrain/cylinder[1].intake_lift"][1] == "m"
    assert attributes["scheme"] == "gauss-seidel" and attributes["ended"] == ""


def test_without_a_valve_train_the_combustion_has_its_own_lifts(couple):
    code, found, _, _ = couple("--no-valvetrain", "--cycles", 1)
    assert code == 0 and "valvetrain" not in found
    assert found["imep_pa"] == pytest.approx(1.534e6, rel=0.02)


def test_iterated_units_agree_at_coarse_steps(couple):
    code, found, stderr, _ = couple("--cycles", 1, "--scheme", "iterative", "--step-deg", 3)
    assert code == 0, stderr
    assert found["steps"] < found["sweeps"] < 10 * found["steps"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--set", "cranktrain.crank.levle=rigid"), "there is no variable 'crank.levle'; did you mean 'crank.level'"),
        (("--set", "cranktrian.crank.level=rigid"), "units: cranktrain, combustion, valvetrain"),
        (
            ("--no-valvetrain", "--set", "valvetrain.train.lash=1e-4"),
            "start values are given for the valve train, which is left out",
        ),
    ],
)
def test_wrong_input_is_one_line(couple, options, said):
    code, found, stderr, _ = couple(*options)
    assert code == 2 and len(stderr.strip().splitlines()) == 1
    assert said in stderr
    assert set(found) == {"error"}


def test_fmus_of_two_engines_are_refused(couple, tmp_path):
    code, _, stderr, _ = couple(combustion=build_fmu("combustion_v8", tmp_path))
    assert code == 2 and "pressures of 8 cylinders" in stderr and "take FMUs of one engine" in stderr
    code, _, stderr, _ = couple(valvetrain=build_fmu("valvetrain_v8", tmp_path))
    assert code == 2 and "16 lifts for 6 cylinders" in stderr and "take FMUs of one engine" in stderr


def test_an_engine_without_a_valve_train_of_its_own(partner, tmp_path, capsys):
    text = (engine_folder() / "diesel_i6.toml").read_text("utf-8")
    own = tmp_path / "own_six.toml"
    own.write_text(text.replace('name = "diesel_i6"', 'name = "own_six"'), "utf-8")
    assert main(["couple", str(own), "--speed", "2000", "--combustion", str(partner)]) == 2
    said = capsys.readouterr().err
    assert "no valvetrain ships for engine 'own_six'" in said and "--no-valvetrain" in said


def test_the_system_as_an_ssp(fmu, partner, valvetrain, tmp_path):
    """Valid by the standard's schema, and equal bytes from equal systems."""
    written = []
    for k in range(2):
        path = tmp_path / f"VirtualEngineI6_{k}.ssp"
        engine = virtual_engine(Partners(fmu, partner, {}, valvetrain), SPEED, "jacobi", "own")
        units = {name: (unit, unit.path) for name, unit in engine.units.items()}
        written.append(
            write_ssp(path, "VirtualEngineI6", units, engine.connections, engine.values, engine.outputs, 0.12)
        )
    assert written[0].read_bytes() == written[1].read_bytes()
    system = read_ssd(written[0]).system
    assert {component.name for component in system.elements} == {"cranktrain", "combustion", "valvetrain"}
    assert len(system.connections) == (2 + 6 + 1) + 6 * (2 + 1) + (2 + 12 + 1)
    with zipfile.ZipFile(written[0]) as archive:
        values = archive.read("resources/cranktrain.ssv").decode()
    assert 'name="speed"' in values and 'value="polytropic"' in values


@pytest.mark.parametrize(
    ("step", "without", "said"),
    [
        (["if time > 0.01:", "    ctypes.string_at(0)"], "", "combustion, step at 0.01 s: died with SIGSEGV"),
        (["if time > 0.01:", "    raise ValueError('injector stuck')"], "", "injector stuck"),
        ([], "pressure.angle", "combustion has no output 'pressure.angle'"),
    ],
)
def test_a_foreign_partner_that_dies_fails_or_lacks_a_variable(couple, tmp_path, step, without, said):
    """One line that names it; the file keeps the run so far."""
    foreign = small_combustion(tmp_path, "Foreign", 6, [*step, "pass"], without)
    code, found, stderr, path = couple("--set", "cranktrain.crank.level=rigid", "--cycles", 1, combustion=foreign)
    assert code == 2 and set(found) == {"error"} and said in stderr.splitlines()[-1]
    if step:
        data, attributes = read_result(path)
        assert data["time"][0][-1] == pytest.approx(0.01, abs=2e-4) and said in attributes["ended"]


def test_a_combustion_of_one_angle_goes_on_with_a_sentence(couple, tmp_path):
    foreign = small_combustion(tmp_path, "OneAngle", 6, ["pass"], "")
    code, found, stderr, _ = couple("--set", "cranktrain.crank.level=rigid", "--cycles", 1, combustion=foreign)
    assert code == 0 and "coupling_residual_fraction" in found
    assert "OneAngle.fmu takes no volume deviations: it computes all volumes at one crank angle" in stderr


@pytest.mark.parametrize(
    ("degrees", "reconstruction", "given", "taken"),
    [
        (1.5, "own", {}, "esdirk3"),
        (1.5, "quadratic", {}, "sdirk3"),
        (1.6, "own", {}, None),
        (1.0, "own", {"solver.integrator": "esdirk5"}, "esdirk5"),
        (1.0, "own", {"solver.control": "fixed"}, None),
    ],
)
def test_short_steps_choose_the_integrator(fmu, partner, degrees, reconstruction, given, taken):
    """Three implicit stages up to 1.5 degrees a step, unless the user has chosen the steps or the method."""
    partners = Partners(fmu, partner, {"cranktrain": given})
    engine = virtual_engine(partners, SPEED, "jacobi", reconstruction, math.radians(degrees) / SPEED)
    assert engine.values["cranktrain"].get("solver.integrator") == taken


@pytest.mark.slow
def test_orders_rise_as_the_frequency_domain_says(tmp_path):
    """Within 7 %: order by order where the misfire adds most, all orders by the balance."""
    fmus = ct.build_fmu("diesel_i6", tmp_path, film_table=False, block=False), ct.build_fmu("combustion_i6", tmp_path)
    found = figures(fmus, 2000.0)
    misfire, normal = found["misfire"], found["normal"]
    for k, order in enumerate(ORDERS):
        if order <= 2.0:
            assert abs(misfire["linear_off"][k]) < 0.07
        for run in (misfire, normal):
            assert abs(run["balance_off"][k]) < 2e-3
    assert misfire["coupled_mdeg"][0] > 30.0 * normal["coupled_mdeg"][0]
