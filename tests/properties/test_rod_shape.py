"""Elastic rods of all cylinders from the table [rod_shape]: masses, forces, energy, eyes, refusals."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import entry
import numpy as np
import pytest
from one_line import one_line
from rods import FOUR
from some import some

import cranktrain as ct
from cranktrain.core.units import RPM
from cranktrain.dynamics.simulation import Simulation
from cranktrain.dynamics.topology.tables import file_frames
from cranktrain.dynamics.topology.values import REST, Topology
from cranktrain.engine.file import load_engine
from cranktrain.engine.rod_shape import RodShape
from cranktrain.loads.gas_pressure import GasTrace, gas_pressure, gas_tables
from cranktrain.results.summary import run_summary
from cranktrain.structure.additions import read_added, shaft_body

STIFF = 1e13
"""Young's modulus, Pa, of a rod that hardly gives."""
ENGINES = [("single_petrol", 3000.0), ("four", 3000.0), ("diesel_i6", 1500.0), ("diesel_v8", 1500.0)]


def with_rods(name, heavy=0.5, **more):
    """An engine and the same with elastic rods, a fraction ``heavy`` of whose mass an even beam would have."""
    engine = load_engine(FOUR if name == "four" else name)
    engine = replace(engine, frame=(), body=(), connection=())
    rod = engine.rod
    area = heavy * (rod.big_end_mass + rod.small_end_mass) / (7850.0 * rod.length)
    areas = (2.0 * area, 0.8 * area, area)
    shape = RodShape(
        stations=(0.0, 0.18 * rod.length, 0.85 * rod.length, rod.length), areas=areas,
        second_moments=tuple(0.5 * one**2 for one in areas),
    )  # fmt: skip
    return engine, load_engine(replace(engine, rod_shape=replace(shape, **more)))


@pytest.mark.parametrize("name", ["single_petrol", "diesel_i6", "diesel_v8"])
@pytest.mark.parametrize("heavy", [0.5, 0.02])  # the second one leaves a mass to the middle
def test_a_rod_has_mass_centre_and_inertia_of_the_engines(name, heavy):
    engine, made = with_rods(name, heavy)
    rod, mass = engine.rod, engine.rod.big_end_mass + engine.rod.small_end_mass
    body = read_added(made)["rod[1]"]
    assert ("middle" in body.interfaces) == (heavy < 0.1)
    assert body.mass == pytest.approx(mass, rel=1e-9)
    assert body.centre[:2] == pytest.approx([0.0, rod.small_end_mass * rod.length / mass], abs=1e-9)
    # A unit rotation about z through the centre of mass, from the rigid modes at both ends.
    rigid = body.omega < 1.0
    ends = [body.shapes[body.index(end)][:, rigid] for end in ("big", "small")]
    lever = body.centre[1], body.centre[1] - rod.length
    wanted = np.zeros((2, 6))
    wanted[:, 5], wanted[:, 0] = 1.0, lever
    q = np.linalg.lstsq(np.vstack(ends), wanted.ravel(), rcond=None)[0]
    assert q @ q == pytest.approx(rod.inertia, rel=1e-5)


def test_first_bending_of_a_light_rod_with_its_mass_in_the_middle():
    """Pinned, with 17/35 of its own mass in the middle: ω² = 48 EI/(l³ (m + 17/35 m_b)), within 1 %."""
    _, made = with_rods("single_petrol", 0.02, areas=3 * (1e-5,), second_moments=3 * (3e-11,))
    table = next(body for body in made.additions.body if body.name == "rod[1]")
    length, middle = made.rod.length, dict(zip(table.discs, table.disc_masses, strict=True))["middle"]
    rod = shaft_body(table, Topology(file_frames(made)).frame("rod[1]"))
    pins = tuple(
        ct.Connection(end, "spring", (ct.End("rod", end), ct.End("ground")), {"stiffness": (1e10, 1e10, 1e10)})
        for end in ("big", "small")
    )
    turn = ct.Connection("turn", "spring", (ct.End("rod", "big"), ct.End("ground")), {"turning_stiffness": (0, 1e6, 0)})
    modes = ct.topology_modes(Topology((), (ct.Body("rod", rod, REST.name),), (*pins, turn)))
    mass = middle + 17.0 / 35.0 * 7850.0 * 1e-5 * length
    exact = math.sqrt(48.0 * 210e9 * 3e-11 / (length**3 * mass)) / (2.0 * math.pi)
    assert np.abs(modes.frequencies_hz / exact - 1.0).min() < 0.01


def by_angle(run):
    """Outputs of a run over the crank angle, (1440,) each."""
    angle, grid = np.asarray(run.outputs["crank.angle_cycle"]), np.arange(1440) * math.radians(0.5)
    order = np.argsort(angle)
    return {
        key: np.interp(grid, angle[order], np.asarray(values)[order], period=4.0 * math.pi)
        for key, values in run.outputs.items() if np.ndim(values) == 1
    }  # fmt: skip


@cache
def run(name, rpm, level="impedance", own=False, stiff=True, **more):
    """A settled cycle of an engine's own rods with floating big ends, or of its elastic ones."""
    engine, made = with_rods(name, big_end=level, **({"youngs_modulus": STIFF} if stiff else {}))
    chosen = {"crank": "beam", "block": "ground", "inherit": False, "step_deg": 1.25} | more
    return ct.simulate(engine if own else made, speed_rpm=rpm, **({"big_ends": level} if own else {}), **chosen)


@pytest.mark.parametrize(("name", "rpm"), ENGINES)
def test_nearly_rigid_rods_do_to_the_mains_what_the_engines_own_do(name, rpm):
    """Forces of main bearings by crank angle, within 1 % of the largest: piston friction is all that differs."""
    own, rods = (by_angle(run(name, rpm, own=whose, step_deg=2.5)) for whose in (True, False))
    mains = [key for key in own if re.fullmatch(r"bearing\[\d+\]\.force\.[xy]", key)]
    largest = max(np.ptp(own[key]) for key in mains)
    for key in some(mains):
        assert np.abs(own[key] - rods[key]).max() < 0.01 * largest, key


@pytest.mark.parametrize(("name", "rpm"), ENGINES[1:3])
def test_energy_closes(name, rpm):
    energy = run_summary(run(name, rpm), "")["energy"]
    assert abs(energy["residual_of_gas_work"]) < 1e-5


@pytest.mark.parametrize(("name", "rpm"), [("single_petrol", 3000.0), ("diesel_i6", 1500.0)])
def test_output_gas_work_is_the_work_of_given_pressures_on_pistons_that_are_bodies(name, rpm):
    """Within 1e-3 of the energy account's ∫ P dt, and 3e-3 of ∮ p dV with rigid rods, without clearances of films."""
    _, engine = with_rods(name, youngs_modulus=STIFF)
    made = ct.assemble(engine, ct.Settings(crank="rigid", block="ground", bearings="linear", gas_source="input"))
    simulation = Simulation(made.engine, made.body, made.settings, parts=made.parts)
    count, speed, trace = engine.n_cylinders, rpm * RPM, gas_tables(GasTrace.from_engine(engine)).sum(axis=0)
    simulation.inputs[0] = speed
    simulation.pressures[:] = gas_pressure(-np.array(engine.firing_angles), trace)
    simulation.initialize()
    names = ["crank.angle", "gas.work", *(f"cylinder[{c + 1}].volume" for c in range(count))]
    places, rows, step = [simulation.output_names.index(one) for one in names], [], math.radians(1.0) / speed
    for k in range(2 * 720):
        simulation.pressures[:] = gas_pressure(simulation.outputs[places[0]] - np.array(engine.firing_angles), trace)
        simulation.step((k + 1) * step)
        pressures = entry.pressures(simulation) - made.settings.crankcase_pressure
        rows.append([*simulation.outputs[places[1:]], entry.power(simulation, "gas_work"), *pressures])
    work, *others = np.array(rows)[-721:].T
    volumes, power, pressures = others[:count], others[count], others[count + 1 :]
    assert work[-1] - work[0] == pytest.approx(np.trapezoid(power, dx=step), rel=1e-3)
    assert work[-1] - work[0] == pytest.approx(np.trapezoid(pressures, volumes).sum(), rel=3e-3)


@pytest.mark.parametrize("name", ["single_petrol", "four"])
def test_a_film_in_an_eye_is_that_of_the_engines_own_big_end(name):
    """Level ehd: force within 1 % of the largest, eccentricity and pressure within 4 %, well below the hardness."""
    own, rods = (by_angle(run(name, 3000.0, "ehd", own=whose, step_deg=2.0)) for whose in (True, False))
    forces = [np.hypot(*(one[f"{at}.force.{way}"] for way in "xy")) for one, at in (
        (own, "big_end[1]"), (rods, "connection[big_end_1]"))]  # fmt: skip
    assert np.abs(forces[0] - forces[1]).max() < 0.01 * forces[0].max()
    for key in ("eccentricity", "pressure_max"):
        one, other = own[f"big_end[1].{key}"], rods[f"connection[big_end_1].{key}"]
        assert np.abs(one - other).max() < 0.04 * one.max(), key
    hardness = load_engine("single_petrol").big_end_bearing.hardness
    assert rods["connection[big_end_1].pressure_max"].max() < 0.6 * hardness


@pytest.mark.slow
def test_steps_and_modes_converge_at_the_highest_speed():
    """Peak pressure and force of an elastic eye at 9000 rev/min: half a step changes 0.5 %, more modes 0.01 %."""
    _, made = with_rods("single_petrol", big_end="ehd")
    chosen = {"crank": "beam", "block": "ground", "bearings": "impedance", "inherit": False}
    found = []
    for step, hz in ((2.0, 6000.0), (1.0, 6000.0), (1.0, 30000.0)):
        engine = made.with_({"rod_shape.cutoff_hz": hz})
        outputs = by_angle(ct.simulate(engine, speed_rpm=9000.0, step_deg=step, **chosen))
        found.append([np.abs(outputs[f"connection[big_end_1].{key}"]).max() for key in ("pressure_max", "force.y")])
    coarse, fine, rich = np.array(found)
    assert coarse == pytest.approx(fine, rel=0.01) and rich == pytest.approx(fine, rel=1e-4)


TABLE = """
[rod_shape]
stations = { value = [0, 25, 125, 144], unit = "mm", origin = "chosen" }
areas = { value = [900, 200, 400], unit = "mm^2", origin = "chosen" }
second_moments = { value = [2e5, 2.2e4, 8e4], unit = "mm^4", origin = "chosen" }
big_end = { value = "ehd", origin = "chosen" }
"""
OWN_ROD = """
[[frame]]
name = "own"
motion = "rod"
cylinder = { value = 1, unit = "1", origin = "chosen" }
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[0, 25, 125, 144]", "[0, 25, 125, 140]", "rod_shape.stations: reach from 0 mm to 140 mm; begin at 0 and end"),
        ("[0, 25, 125, 144]", "[0, 125, 25, 144]", "rod_shape.stations: needs at least two stations, increasing"),
        ("[900, 200, 400]", "[900, 200]", "rod_shape.areas: 2 values for 3 pieces between 4 stations"),
        ("[2e5, 2.2e4, 8e4]", "[2e5]", "rod_shape.second_moments: 1 values for 3 pieces between 4 stations"),
        ('"ehd"', '"ehb"', "rod_shape.big_end: unknown level 'ehb'; did you mean 'ehd'?"),
        ("[900, 200, 400]", "[900, 210, 500]", "rod.small_end_mass is 0.16 kg; give less area or density"),
        ("[900, 200, 400]", "[3000, 200, 10]", "rod.big_end_mass is 0.4 kg; give less area or density"),
        ("big_end =", 'small_end = { value = "impedance", origin = "chosen" }\nbig_end =',
         "'small_end_clearance' are missing; a film of the small end needs them"),
        ("\n[rod_shape]", OWN_ROD + "\n[rod_shape]", "frame 'own'.cylinder: the rod of cylinder 1 is that of"),
    ],
)  # fmt: skip
def test_slips_of_the_table_are_told(tmp_path, old, new, said):
    assert old in TABLE
    path = tmp_path / "four.toml"
    plain = FOUR.read_text(encoding="utf-8").split("# Two shafts")[0]
    path.write_text(plain + TABLE.replace(old, new, 1), encoding="utf-8")
    with one_line(said):
        load_engine(path)


def test_engines_whose_big_ends_have_no_film_of_their_own_are_told():
    articulated = load_engine(Path(__file__).parents[1] / "data" / "engines" / "v12_articulated.toml")
    own, _ = with_rods("single_petrol")
    for engine, said in (
        (articulated, "cylinders.rods_on_pin: rods run on each other there"),
        (replace(own, big_end_bearing=None), "rod_shape.big_end: a film needs the table [big_end_bearing]"),
    ):
        shape = RodShape(stations=(0.0, engine.rod.length), areas=(1e-5,), second_moments=(1e-10,))
        with one_line(said):
            load_engine(replace(engine, rod_shape=shape))
