"""Integrators whose largest pressures of elastic films do not settle are refused wherever they are chosen."""

import tomllib
from pathlib import Path

import pytest

from cranktrain.core.errors import InputError
from cranktrain.dynamics.model.basis import basis
from cranktrain.dynamics.model.settings import Settings, check_levels, keeps_peaks, resolved
from cranktrain.dynamics.model.slots import LOSES_PEAKS, METHOD_COLUMNS
from cranktrain.dynamics.time.integrators import INTEGRATORS, amplification, settles_films
from cranktrain.engine.file import load_engine
from cranktrain.film.laws.register import LAWS
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain_lab.tradeoff.level_points import level_case, numerical_entries

LOST = ["sdirk4", "esdirk5", "esdirk57"]


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
    for method in LOST:
        chosen = resolved(Settings(integrator=method, **levels), engine)
        with pytest.raises(
            InputError, match=f"do not converge with integrator '{method}'; use auto, or one of"
        ) as error:
            check_levels(chosen, engine)
        assert "\n" not in str(error.value)
        others = resolved(Settings(integrator=method, bearings="table"), engine)
        check_levels(others, engine)
        assert keeps_peaks(method, others, engine) and not keeps_peaks(method, chosen, engine)
    for method in ("auto", "esdirk3", "esdirk4", "esdirk47"):
        check_levels(resolved(Settings(integrator=method, **levels), engine), engine)


def test_the_interface_of_the_fmu_names_them():
    listed = tomllib.loads((Path(__file__).parents[2] / "modelDescription" / "interface.toml").read_text("utf-8"))
    [told] = [row["description"] for row in listed["variable"] if row["name"] == "solver.integrator"]
    assert f"{', '.join(LOST[:-1])} and {LOST[-1]} are refused" in told


def test_usual_methods_are_those_that_settle():
    assert all(settles_films(law.integrator) for law in LAWS.values() if law.cost == LAWS["ehd"].cost)
    held = resolved(Settings(bearings="ehd", reconstruction="hold"), load_engine("diesel_i6"))
    assert settles_films(held.integrator)


def test_a_model_knows_which_methods_it_refuses():
    """The FMU chooses its integrator by number: models with elastic films mark the methods, others mark none."""
    engine = load_engine("diesel_i6")
    gas = GasTrace.from_engine(engine)
    for level, marked in (("ehd", LOST), ("table", [])):
        methods = basis(engine, resolved(Settings(bearings=level), engine), gas).methods
        assert [name for name, row in zip(INTEGRATORS, methods, strict=True) if row[LOSES_PEAKS]] == marked
        assert methods.shape == (len(INTEGRATORS), METHOD_COLUMNS)


def test_trade_off_leaves_refused_methods_out():
    engine = load_engine("diesel_i6")
    for level, missing in (("ehd", set(LOST)), ("impedance", set())):
        case = level_case(engine, 200.0, Settings(bearings=level))
        named = {
            str(entry.case.settings.integrator).partition(":")[0] for entry in numerical_entries(case, quick=False)
        }
        assert set(INTEGRATORS) - named == missing
