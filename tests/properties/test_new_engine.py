"""Engine files that ``new`` writes: each layout is read back, fires as it says, is balanced as in theory, and runs."""

import json
import math
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

from cranktrain.cli import shipped
from cranktrain.cli.main import main
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import simulate
from cranktrain.engine.file import engine_names, load_engine
from cranktrain.engine.firing import firing_summary
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.assembly import assemble
from cranktrain.structure.crank.level import bare_crank
from cranktrain.structure.crank.modal import modal_report
from cranktrain.structure.crank.sections import crank_moments
from cranktrain.studies.design.balance import free_forces
from cranktrain.studies.design.layouts import LAYOUTS, VEE, layout
from cranktrain.studies.design.rules import document
from cranktrain.studies.design.sizes import sizes

RPM = math.pi / 30.0


def made(tmp_path, name, bore=0.0825, stroke=0.0928, bank=None, **further):
    """An engine of a layout as its file is read back, without a warning; and its sizes."""
    found = sizes(layout(name, bank), bore, stroke, **further)
    path = tmp_path / f"{name}.toml"
    path.write_text(document(name, found).text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return load_engine(path), found


@pytest.mark.parametrize("name", LAYOUTS)
def test_every_layout_is_read_back_and_fires_as_it_says(name, tmp_path):
    engine, found = made(tmp_path, name)
    row = found.layout
    fires = firing_summary(engine)
    assert tuple(fires["order"]) == row.order
    assert fires["intervals_deg"] == pytest.approx(row.intervals_deg, abs=1e-3)
    assert row.even == (name not in ("v2", "v4"))
    wanted = np.radians(row.firing_deg)
    assert (np.array(engine.firing_angles) - wanted + 1e-4) % (4.0 * math.pi) == pytest.approx(1e-4, abs=1e-4)


@pytest.mark.parametrize("name", LAYOUTS)
def test_rods_on_a_pin_agree_on_its_throw(name):
    row = LAYOUTS[name]
    throws = [row.throws_deg[pin - 1] for pin in row.pins]
    dead = np.array(row.banks_deg) - np.array(throws)
    assert (dead - np.array(row.firing_deg) + 1.0) % 360.0 == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("single", (1.0, 1.0, 0.0, 0.0)), ("i2", (2.0, 2.0, 0.0, 0.0)), ("i3", (0.0, 0.0, math.sqrt(3), math.sqrt(3))),
        ("i4", (0.0, 4.0, 0.0, 0.0)), ("i5", (0.0, 0.0, 0.449, 4.980)), ("i6", (0.0, 0.0, 0.0, 0.0)),
        ("i8", (0.0, 0.0, 0.0, 0.0)), ("v2", (1.0, math.sqrt(2), 0.0, 0.0)), ("v8", (0.0, 0.0, math.sqrt(10), 0.0)),
        ("v6_60", (0.0, 0.0, 1.5, 1.5)), ("v12", (0.0, 0.0, 0.0, 0.0)),
        ("boxer2", (0.0, 0.0, 1.0, 1.0)), ("boxer6", (0.0, 0.0, 0.0, 0.0)),
    ],
)  # fmt: skip
def test_free_forces_and_moments_are_those_of_the_textbooks(name, values):
    """Of one cylinder's m r ω², for the second order with λ (Köhler and Flierl, mass balance; Taylor, chapter 8)."""
    found = free_forces(LAYOUTS[name])
    assert (found.first, found.second, found.first_moment, found.second_moment) == pytest.approx(values, abs=1e-3)


def whole_resultants(engine):
    """Largest force and moment of both orders, N and N m over m_o r ω² and λ m_o r ω², summed over a revolution."""
    theta = np.radians(np.arange(0.0, 360.0, 0.25))
    pins = engine.crankshaft.pin_positions
    found = []
    for order in (1, 2):
        force, moment = np.zeros((2, 2, theta.size))
        for z, bank, firing in zip(
            engine.cylinder_positions, engine.cylinders.bank_angles, engine.firing_angles, strict=True
        ):
            along = np.outer((-math.sin(bank), math.cos(bank)), np.cos(order * (theta - firing)))
            force, moment = force + along, moment + (z - 0.5 * (pins[0] + pins[-1])) * along
        found.append([float(np.hypot(*resultant).max()) for resultant in (force, moment)])
    return found


@pytest.mark.parametrize("name", LAYOUTS)
def test_the_file_s_sentence_is_what_its_own_cylinders_leave_free(name, tmp_path):
    """Forces and moments (coefficient times the distance named) of the places, banks and firings in the file."""
    engine, _ = made(tmp_path, name)
    text = " ".join(line.strip("# ") for line in (tmp_path / f"{name}.toml").read_text("utf-8").splitlines()[:8])
    said = re.search(
        r"first order (\S+) m r w\^2, second order (\S+) lambda m r w\^2; free moments (\S+) m r w\^2 a and (\S+) "
        r"lambda m r w\^2 a, with (?:the distance a = (\S+) mm of ([a-z ]+) and )?lambda",
        text,
    )
    first, second, about, about_second = (float(value) for value in said.groups()[:4])
    distance = 1e-3 * float(said[5] or 0.0)
    wanted = whole_resultants(engine)
    close = {"rel": 6e-3, "abs": 1e-3}  # three digits are printed
    assert (first, second) == pytest.approx((wanted[0][0], wanted[1][0]), **close)
    assert distance * np.array([about, about_second]) == pytest.approx([wanted[0][1], wanted[1][1]], rel=6e-3, abs=1e-6)
    if name != "single":
        pins, split = np.array(engine.crankshaft.pin_positions), engine.crankshaft.pins_between_mains
        own = np.diff(pins[::2] if split else pins) if pins.size > 1 else np.diff(sorted(engine.cylinder_positions))
        assert distance == pytest.approx(own.mean(), rel=1e-3)


def test_counterweights_can_balance_what_turns_with_the_crank():
    """A 90-degree twin and a cross-plane eight have no first order that turns backwards; a single has half of it."""
    assert free_forces(LAYOUTS["v2"]).unbalanced_first == 0.0
    assert free_forces(LAYOUTS["v8"]).unbalanced_first_moment == 0.0
    assert free_forces(LAYOUTS["single"]).unbalanced_first == 0.5
    assert free_forces(layout("v2", 60.0)).unbalanced_first == pytest.approx(0.5)


def test_counterweights_balance_the_throws_of_a_four(tmp_path):
    """The first throw by itself, with its rod's big end, has its centre of mass on the axis within its fillets."""
    engine, _ = made(tmp_path, "i4")
    crank = engine.crankshaft
    first = replace(crank, throw_angles=(0.0,), main_widths=crank.main_widths[:2], counterweights=(True, True))
    along = crank_moments(replace(engine, crankshaft=first))[0, 2]
    big_end = engine.rod.big_end_mass * crank.throw
    assert abs(along + big_end) < 0.02 * big_end
    assert "balances 100 %" in (tmp_path / "i4.toml").read_text(encoding="utf-8")


def test_power_sets_the_heat(tmp_path):
    """Brake power over the mechanical efficiency is the work of all cylinders at the rated speed."""
    engine, found = made(tmp_path, "i4", power=80e3, rated=5500.0 * RPM)
    trace = GasTrace.from_engine(engine)
    share = 1.0 - trace.falloff * (found.rated / trace.best_speed - 1.0) ** 2
    power = share * trace.imep * engine.displacement * found.rated / (4.0 * math.pi)
    assert power == pytest.approx(80e3 / 0.85, rel=0.02)
    assert engine.speeds[1] == pytest.approx(5500.0 * RPM)


@pytest.mark.parametrize(
    ("name", "bore", "stroke", "fuel"),
    [("i4", 0.067, 0.0425, "petrol"), ("i6", 0.105, 0.120, "diesel"), ("i7", 0.5, 1.9, "diesel"),
     ("v16", 0.17, 0.19, "diesel"), ("boxer2", 0.1, 0.07, "petrol")],
)  # fmt: skip
def test_small_and_large_engines_are_possible(name, bore, stroke, fuel, tmp_path):
    engine, _ = made(tmp_path, name, bore, stroke, fuel=fuel)
    assert engine.displacement == pytest.approx(engine.n_cylinders * 0.25 * math.pi * bore**2 * stroke, rel=1e-3)


def test_another_bank_angle_moves_the_second_bank(tmp_path):
    engine, found = made(tmp_path, "v6", bank=60.0)
    assert not found.layout.even and set(found.layout.intervals_deg) == {60.0, 180.0}
    assert firing_summary(engine)["intervals_deg"] == pytest.approx(found.layout.intervals_deg)
    assert all(row.pins == tuple(range(1, row.cylinders + 1)) for row in LAYOUTS.values() if row.form != VEE)


@pytest.mark.parametrize("name", ["single", "i4", "v8", "v12"])
def test_a_new_engine_has_modes_and_runs(name, tmp_path):
    engine, found = made(tmp_path, name)
    report = modal_report(engine, bare_crank(engine, "beam"))
    assert report["cranktrain"]["first_torsional_hz"] > 100.0
    settings = Settings(crank="beam", bearings="impedance", block="ground")
    run = assemble(engine, settings)
    result = simulate(engine, run.body, run.settings, found.best, cycles=2, parts=run.parts)
    mean = result.outputs["shaft.torque"][result.outputs["shaft.torque"].shape[0] // 2 :].mean()
    assert np.isfinite(result.outputs["pulley.torsion"]).all() and mean > 0.0


def test_the_command_writes_a_file_once(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    order = ["new", "my_four", "--layout", "i4", "--bore-mm", "82.5", "--stroke-mm", "92.8", "--json"]
    assert main(order) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["file"] == "my_four.toml" and said["firing_order"] == [1, 3, 4, 2]
    assert said["displacement_l"] == pytest.approx(1.984, abs=1e-3)
    assert load_engine("my_four.toml").name == "my_four"
    assert main(order) == 2 and "my_four.toml: exists; give --force" in capsys.readouterr().err
    assert main([*order, "--force"]) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (["--layout", "i44"], "--layout 'i44' does not exist; did you mean 'i4'?"),
        (["--fuel", "petroleum"], "--fuel 'petroleum' does not exist; did you mean 'petrol'?"),
        (["--bank-angle-deg", "60"], "layout i4 is in line, without a V; leave it out"),
        (["--stroke-mm", "900"], "with a bore of 82.5 mm the stroke is 10.9 bores; engines have 0.3 to 5"),
        (["--rod-mm", "100"], "--rod-mm 100: the piston would meet the crank's webs; give 113.2 mm or more"),
        (["--power-kw", "900"], "would need an indicated mean effective pressure of 110 bar"),
        (["--bore-mm", "-3"], "--bore-mm"),
    ],
)
def test_bad_options_give_one_line(change, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "x", "--layout", "i4", "--bore-mm", "82.5", "--stroke-mm", "92.8", *change]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_engines_that_ship_are_listed(capsys):
    assert main(["engines", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["engines"]
    assert listed == json.loads(json.dumps(shipped.made()))
    assert [one["name"] for one in listed] == engine_names()
    layouts = {one["name"]: one["layout"] for one in listed}
    assert layouts["diesel_i6"] == "in line" and layouts["diesel_v8"] == layouts["v_twin"] == "V of 90 deg"
    assert layouts["single_petrol"] == "single" and layouts["v6_split"] == "V of 60 deg"
    assert main(["engines"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(listed)
