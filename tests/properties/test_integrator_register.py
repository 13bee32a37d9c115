"""The register of integrators: a method of a new family is one file and two rows, and nothing else."""

import json
import sys
from pathlib import Path

import pytest
from bodies import rigid_crank

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.dynamics.time.integrators import (
    FAMILIES,
    INTEGRATORS,
    Family,
    Integrator,
    integrator_table,
    register_family,
    register_integrator,
)
from cranktrain.engine.file import load_engine
from cranktrain.fmu.description import read_interface
from cranktrain_lab.tradeoff.level_points import integrator_steps

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
    assert "toy" in capsys.readouterr().out
    assert ("toy", 3.0) in integrator_steps(quick=False)
    variables = {variable.name: variable for variable in read_interface(INTERFACE).variables}
    assert "toy: a method for play" in variables["solver.integrator"].description


def test_a_method_without_error_estimate_keeps_its_step(toy, capsys):
    assert main(["simulate", "diesel_i6", "--speed", "2000", "--integrator", "toy", "--tolerance", "1e-3"]) == 2
    assert "integrator 'toy' has no error estimate" in capsys.readouterr().err


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
    with pytest.raises(InputError) as error:
        integrator_table(name)
    assert line in str(error.value) and "\n" not in str(error.value)


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
