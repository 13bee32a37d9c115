"""Lists follow the register of integrators; methods that lose largest pressures of elastic films are refused."""

from dataclasses import replace
from pathlib import Path

import entry
import pytest
from bodies import rigid_crank
from one_line import one_line
from refusals import refused_files

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.settings import Settings, check_levels, keeps_peaks, resolved
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.time.integrators import INTEGRATORS, amplification, integrator_table, settles_films
from cranktrain.engine.file import load_engine
from cranktrain.fmu.description import read_interface
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain_lab.tradeoff.level_points import integrator_steps, level_case, numerical_entries

LOST = ["sdirk4", "esdirk5", "esdirk57"]
INTERFACE = Path(__file__).parents[2] / "modelDescription"


def test_a_new_method_is_listed_wherever_integrators_are(monkeypatch, capsys):
    """One of a family of its own runs in ``tests/regression/test_contributing.py``."""
    monkeypatch.setitem(
        INTEGRATORS, "toy", replace(INTEGRATORS["backward-euler"], name="toy", title="a method for play")
    )
    with pytest.raises(SystemExit):
        main(["simulate", "--help"])
    assert "toy" in capsys.readouterr().out and ("toy", 3.0) in integrator_steps(quick=False)
    [told] = [one.description for one in read_interface(INTERFACE).variables if one.name == "solver.integrator"]
    assert "toy: a method for play" in told and f"{', '.join(LOST[:-1])} and {LOST[-1]} are refused" in told


@pytest.mark.parametrize(("name", "line"), refused_files()["levels"]["integrators"])
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


@pytest.mark.parametrize(("level", "lost"), [("ehd", LOST), ("table", []), ("impedance", [])])
def test_models_mark_which_methods_they_refuse_and_trade_off_leaves_them_out(level, lost):
    """The FMU chooses its integrator by number: models with elastic films mark the methods, others mark none."""
    engine = load_engine("diesel_i6")
    gas, settings = GasTrace.from_engine(engine), Settings(bearings=level)
    assert entry.losing_peaks(engine, resolved(settings, engine), gas) == lost
    entries = numerical_entries(level_case(engine, 200.0, settings), quick=False)
    named = {str(one.case.settings.integrator).partition(":")[0] for one in entries}
    assert set(INTEGRATORS) - named == set(lost)
