"""The register of integrators: a method of a new family is one file and two rows, and nothing else.

Methods whose largest pressures of elastic films do not settle are refused wherever they are chosen.
"""

import json
import sys
from pathlib import Path

import entry
import pytest
from bodies import rigid_crank
from one_line import one_line

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.settings import Settings, check_levels, keeps_peaks, resolved
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.time.integrators import (
    FAMILIES,
    INTEGRATORS,
    Family,
    Integrator,
    amplification,
    integrator_table,
    register_family,
    register_integrator,
    settles_films,
)
from cranktrain.engine.file import load_engine
from cranktrain.fmu.description import read_interface
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain_lab.tradeoff.level_points import integrator_steps, level_case, numerical_entries

LOST = ["sdirk4", "esdirk5", "esdirk57"]
INTERFACE = Path(__file__).parents[2] / "modelDescription"
TOY = '''
"""The implicit Euler method once more, as a family of its own."""

from cranktrain.core.kernel import law_kernel
from cranktrain.dynamics.model.slots import BIG_Q, BIG_V
from cranktrain.dynamics.model.state import POSITION, VELOCITY, offset
from cranktrain.dynamics.time.status import OK
from cranktrain.dynamics.time.step import keep_motion, solve_only_stage
from cranktrain.dynamics.time.tableaux import one_stage


def coefficients():
    return one_stage(1.0, 1.0)


@law_kernel
def toy_step(model, work, state, slot, h):
    n = model.omega2.shape[0]
    for i in range(n):
        work.modal[BIG_V, i] = state[offset(VELOCITY, n) + i]
        work.modal[BIG_Q, i] = state[offset(POSITION, n) + i] + h * work.modal[BIG_V, i]
    status = solve_only_stage(model, work, state, slot, h)
    if status == OK:
        keep_motion(model, work, state, 0)
    return status
'''


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """A method ``toy`` of a new family ``toys``, in one file outside the package."""
    (tmp_path / "toy_integrator.py").write_text(TOY)
    monkeypatch.syspath_prepend(tmp_path)
    import toy_integrator

    register_family(Family("toys", "toy_integrator:toy_step"))
    register_integrator(Integrator("toy", "a method for play", "toys", 1, toy_integrator.coefficients))
    yield
    del INTEGRATORS["toy"], FAMILIES["toys"], sys.modules["toy_integrator"]


def run(tmp_path, capsys, integrator):
    """Summary of a run of a rigid crank on springs."""
    arguments = ["--crank", "rigid", "--bearings", "linear", "--cycles", "1", "--speed", "2000", "--step-deg", "1"]
    output = str(tmp_path / f"{integrator}.h5")
    code = main(["simulate", "diesel_i6", *arguments, "--integrator", integrator, "--json", "--output", output])
    out = capsys.readouterr().out
    assert code == 0
    return json.loads(out)


@pytest.mark.slow
def test_a_toy_of_a_new_family_runs_from_the_command_line(toy, tmp_path, capsys):
    found, known = (run(tmp_path, capsys, name) for name in ("toy", "backward-euler"))
    torsion, expected = (summary["pulley"]["torsion_deg"]["peak_to_peak"] for summary in (found, known))
    assert torsion == pytest.approx(expected, rel=1e-6)


def test_a_toy_of_a_new_family_is_listed_wherever_integrators_are(toy, capsys):
    with pytest.raises(SystemExit):
        main(["simulate", "--help"])
    assert "toy" in capsys.readouterr().out and ("toy", 3.0) in integrator_steps(quick=False)
    [told] = [one.description for one in read_interface(INTERFACE).variables if one.name == "solver.integrator"]
    assert "toy: a method for play" in told and f"{', '.join(LOST[:-1])} and {LOST[-1]} are refused" in told


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("esdirk", "integrator 'esdirk' does not exist; did you mean 'esdirk"),
        ("bdf2:1", "integrator 'bdf2:1' does not exist"),
        ("hht:x", "integrator 'hht:x': alpha must be a number, e.g. hht:-0.1"),
        ("hht:-0.5", "hht needs -0.3333 <= alpha <= 0, got -0.5; -0.1 is a good start"),
        ("generalised-alpha:1.5", "generalised-alpha needs 0 <= rho <= 1, got 1.5; 0.6 is a good start"),
    ],
)
def test_names_that_are_not_valid_are_refused(name, line):
    with one_line(line):
        integrator_table(name)


def test_a_state_of_another_integrator_is_refused():
    engine = load_engine("diesel_i6")
    body = rigid_crank(engine)
    first, second = (Simulation(engine, body, Settings(bearings="linear", integrator=f"hht:{a}")) for a in (-0.1, -0.2))
    for simulation in (first, second):
        simulation.inputs[0] = 200.0
        simulation.initialize()
    second.state = second.state
    with pytest.raises(InputError, match="not one of integrator"):
        second.state = first.state


def test_rule_follows_the_coefficients():
    """Methods with coefficients of the size of the step are kept, and those far above are not."""
    assert [name for name in INTEGRATORS if not settles_films(name)] == LOST
    assert min(map(amplification, LOST)) > 1.4
    assert max(amplification(name) for name in INTEGRATORS if name not in LOST) < 1.25
    assert settles_films("generalised-alpha:0.8")


@pytest.mark.parametrize("levels", [{"bearings": "ehd"}, {"bearings": "ehd:fine"}, {"big_ends": "ehd"}])
@pytest.mark.parametrize("name", ["diesel_i6", "four_petrol", "v12_petrol"])
def test_elastic_films_refuse_them_in_one_line(name, levels):
    engine = load_engine(name)
    assert settles_films(resolved(Settings(reconstruction="hold", **levels), engine).integrator)
    for method in LOST:
        chosen = resolved(Settings(integrator=method, **levels), engine)
        with one_line(match=f"do not converge with integrator '{method}'; use auto, or"):
            check_levels(chosen, engine)
        others = resolved(Settings(integrator=method, bearings="table"), engine)
        check_levels(others, engine)
        assert keeps_peaks(method, others, engine) and not keeps_peaks(method, chosen, engine)
    for method in ("auto", "esdirk3", "esdirk4", "esdirk47"):
        check_levels(resolved(Settings(integrator=method, **levels), engine), engine)


def test_a_model_knows_which_methods_it_refuses():
    """The FMU chooses its integrator by number: models with elastic films mark the methods, others mark none."""
    engine = load_engine("diesel_i6")
    gas = GasTrace.from_engine(engine)
    for level, marked in (("ehd", LOST), ("table", [])):
        assert entry.losing_peaks(engine, resolved(Settings(bearings=level), engine), gas) == marked


def test_trade_off_leaves_refused_methods_out():
    engine = load_engine("diesel_i6")
    for level, missing in (("ehd", set(LOST)), ("impedance", set())):
        case = level_case(engine, 200.0, Settings(bearings=level))
        named = {str(one.case.settings.integrator).partition(":")[0] for one in numerical_entries(case, quick=False)}
        assert set(INTEGRATORS) - named == missing
