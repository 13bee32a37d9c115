"""Damping ratio of an engine file: that of the crank's modes with flywheel, pulley and the mean rods on its pins.

Free oscillations fall as exp(−ζωt). A rod puts its big end and half its oscillating mass on its pin.
"""

import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from scipy.linalg import eigh
from started import at_speed

from cranktrain.dynamics.model.arrays import build_model, structural_damping
from cranktrain.dynamics.model.settings import Settings
from cranktrain.dynamics.simulation import Parts
from cranktrain.engine.file import load_engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.crank.level import crank_body

ZETA = 0.02
SETTINGS = Settings(crank="torsional", bearings="held")
ENGINES = ["four_petrol", "diesel_i6", "diesel_v8", "single_petrol", "v12_petrol"]


def engine_of(name, **damping):
    """A shipped engine with a damping ratio, its connecting shaft undamped and as soft as none."""
    engine = load_engine(name).without_additions
    reduction = replace(engine.reduction, torsional_source="ker-wilson")
    line = replace(engine.drive_line, stiffness=100.0, damping=0.0)
    own = replace(engine.damping, **({"kind": "modal", "ratio": ZETA} | damping))
    return replace(engine, damping=own, reduction=reduction, drive_line=line, drive_line_chain=None, damper=None)


def mean_rods(engine, body, bends=False):
    """Mass of the rods (n, n) in the modes of a crank that twists, at each pin m r² of its rotation, or that bends."""
    mass = np.zeros((body.n_modes, body.n_modes))
    for k, pin in enumerate(engine.cylinders.pins):
        shape, rod, beside = body.shapes[body.index(f"pin[{pin}]")], engine.rods[k], engine.rod_offsets[k]
        share = rod.big_end_mass + 0.5 * (rod.small_end_mass + engine.cylinders.piston_mass)
        moved = (
            (shape[0] + beside * shape[4], shape[1] - beside * shape[3]) if bends else (engine.throws[k] * shape[5],)
        )
        mass += sum(share * np.outer(across, across) for across in moved)
    return mass


def modes_of(engine, body):
    """Frequencies (n − 5,) rad/s and shapes of the crank with its mean rods: first it turns, then it twists."""
    mass = np.eye(body.n_modes) + mean_rods(engine, body)
    squares, shapes = eigh(np.diag(body.omega[5:] ** 2), mass[5:, 5:])
    return np.sqrt(np.maximum(squares, 0.0)), shapes


@pytest.mark.parametrize("name", ["four_petrol", "diesel_i6", "diesel_v8"])
def test_free_oscillations_of_the_running_crank_fall_with_the_stated_ratio(name):
    """Two runs without gas, one kicked in its first torsional mode; rods have their mass at every crank angle."""
    engine = engine_of(name)
    body = crank_body(engine, "torsional")
    (_, omega, *_), shapes = modes_of(engine, body)
    shape = shapes[:, 1]
    pressure = np.zeros(720)
    settings = replace(SETTINGS, integrator="esdirk4", step=math.radians(0.5))
    speed, revolution, more = 150.0, 720, 240
    h = 2.0 * math.pi / speed / revolution
    seen, motions = (np.eye(body.n_modes) + mean_rods(engine, body))[5:, 5:] @ shape, []
    for kick in (0.0, 1e-4):
        run = at_speed(speed, engine, body, settings, GasTrace(pressure, pressure, 0.0, 200.0, 0.0, "none"))
        state = run.state.copy()
        own = slice(5, 5 + shape.size)
        entry.motion(run, state)[1, own] += kick * omega * shape
        run.state = state
        rows = []
        for k in range(revolution + more):
            run.step((k + 1) * h)
            rows.append(entry.motion(run)[:2, own] @ seen)
        motions.append(np.array(rows))
    eta, velocity = (motions[1] - motions[0]).T
    energy = np.log(velocity**2 + (omega * eta) ** 2)
    fall = (energy[:more] - energy[revolution:]).mean() * speed / (2.0 * math.pi)
    assert fall / (2.0 * omega) == pytest.approx(ZETA, rel=0.01)


@pytest.mark.parametrize("name", ENGINES)
def test_rayleigh_damping_is_that_of_the_masses_with_rods(name):
    """D = α M + β K of the assembled crank: its first torsional mode has the ratio α/2ω + βω/2."""
    alpha, beta = 20.0, 1e-5
    engine = engine_of(name, kind="rayleigh", alpha=alpha, beta=beta)
    body = crank_body(engine, "torsional")
    (_, omega, *_), shapes = modes_of(engine, body)
    found = shapes[:, 1] ** 2 @ structural_damping(engine, body)[5:] / (2.0 * omega)
    assert found == pytest.approx(0.5 * (alpha / omega + beta * omega), rel=0.01)


@pytest.mark.parametrize("name", ENGINES)
def test_torsion_of_a_crank_that_bends_has_the_stated_ratio(name):
    """The free crank of beams with the mean rods' mass across: its first torsional mode, and ten modes within 3 %."""
    engine = engine_of(name)
    body = crank_body(engine, "beam")
    squares, shapes = eigh(np.diag(body.omega**2), np.eye(body.n_modes) + mean_rods(engine, body, bends=True))
    omega, shapes = np.sqrt(squares[6:]), shapes[:, 6:]
    ratios = structural_damping(engine, body) @ shapes**2 / (2.0 * omega)
    twist = np.abs((body.shapes[body.index("pulley"), 5] - body.shapes[body.index("flywheel"), 5]) @ shapes) / omega
    assert ratios[np.argmax(twist)] == pytest.approx(ZETA, rel=0.01)
    assert ratios[:10] == pytest.approx(np.full(10, ZETA), rel=0.03)


def test_heavier_pistons_chosen_for_a_run_keep_the_ratio():
    """A parameter of the FMU: the prepared model has the damping of an engine file with these pistons."""
    engine = engine_of("diesel_i6")
    heavier = replace(engine, cylinders=replace(engine.cylinders, piston_mass=1.5 * engine.cylinders.piston_mass))
    gas = GasTrace.from_engine(engine)
    data = {"cylinders.piston_mass": heavier.cylinders.piston_mass}
    given = crank_body(engine, "torsional"), SETTINGS, 200.0, gas
    models = (build_model(one, *given, Parts(data=values))
              for one, values in ((engine, data), (engine, None), (heavier, None)))  # fmt: skip
    found, own, wanted = map(entry.own_damping, models)
    assert found == pytest.approx(wanted, rel=1e-12)
    assert found[6] > 1.01 * own[6]
