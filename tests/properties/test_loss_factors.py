"""Damping of the assembled cranktrain: loss factors of tables, stated ratios, attached and joined bodies.

A chain of discs is written out in numpy: inertias J, stiffnesses k (1 + iη). Its complex eigenvalues μ of (K*, M) give
s = i√μ, so a mode's damping ratio is Im √μ/|√μ|; its response at ω solves (K* − ω² M) x = T. In a system of which all
shafts have one η every mode has the ratio η/2, whatever is attached.
"""

import math
from dataclasses import replace
from itertools import pairwise

import entry
import numpy as np
import pytest
from scipy.linalg import eigh

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import rigid_body
from cranktrain.dynamics.model.arrays import build_model, structural_damping
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.drive_line_chain import DriveLineChain
from cranktrain.engine.file import load_engine
from cranktrain.engine.torsional_chain import Chain, Disc, Shaft
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.crank.chain import chain_body
from cranktrain.structure.crank.level import running_crank
from cranktrain.structure.crank.modal import cranktrain_matrices
from cranktrain.structure.crank.reduction import attached_parts, complete_crankshaft
from cranktrain.structure.in_motion.inherited_damping import Decay, with_damping, with_stated_damping
from cranktrain.studies.torsion.damped_modes import damped_modes
from cranktrain.studies.torsion.shaft_orders import ShaftOrders

ETA = 0.035
ENGINES = ["diesel_i6", "five_petrol", "single_petrol", "v_twin", "v12_petrol"]
SPEED = 200.0
SETTINGS = Settings(crank="torsional", bearings="held")


def engine_of(name):
    """A shipped engine, its connecting shaft undamped, without a cut-off."""
    engine = load_engine(name)
    line, reduction = replace(engine.drive_line, damping=0.0), replace(engine.reduction, running_cutoff_hz=2e4)
    return replace(engine, drive_line=line, reduction=reduction, drive_line_chain=None, damper=None)


def pins_of(engine):
    return [f"pin[{k}]" for k in range(1, max(engine.cylinders.pins) + 1)]


def chain_of(engine, eta=ETA, stiffness=6e5):
    """Pulley, a disc at each pin, flywheel; alternate shafts are stiffer."""
    names = ["pulley", *pins_of(engine), "flywheel"]
    shafts = [Shaft((a, b), stiffness * (1.0 + 0.5 * (k % 2)), loss_factor=eta)
              for k, (a, b) in enumerate(pairwise(names))]  # fmt: skip
    discs = [Disc(name, 0.02 if name.startswith("pin") else 0.004) for name in names]
    return Chain(tuple(discs), tuple(shafts))


def shaft_matrix(chain):
    """Complex stiffness (n, n) of a chain's shafts."""
    found = np.zeros((len(chain.discs), len(chain.discs)), dtype=complex)
    for shaft in chain.shafts:
        twist = np.zeros(len(chain.discs))
        twist[[chain.names.index(end) for end in shaft.between]] = 1.0, -1.0
        found += shaft.stiffness * (1.0 + 1j * shaft.loss_factor) * np.outer(twist, twist)
    return found


def mean_rods(engine):
    """Pin and mean inertia of each rod with its piston, kg m²."""
    for pin, rod, throw in zip(engine.cylinders.pins, engine.rods, engine.throws, strict=True):
        mass = rod.big_end_mass + 0.5 * (rod.small_end_mass + engine.cylinders.piston_mass)
        yield f"pin[{pin}]", mass * throw**2


def assembled(engine, chain, rods=None):
    """Complex stiffness and mass (n, n) of the chain with pulley, flywheel, mean rods, and the dynamometer's shaft."""
    inertia = {disc.name: disc.inertia for disc in chain.discs}
    for name, part in attached_parts(engine):
        inertia[name] += part.polar_inertia
    for pin, own in mean_rods(engine) if rods is None else zip(pins_of(engine), rods, strict=True):
        inertia[pin] += own
    stiffness = shaft_matrix(chain)
    held = chain.names.index("flywheel")
    stiffness[held, held] += engine.drive_line.stiffness
    return stiffness, np.diag([inertia[name] for name in chain.names])


def hysteretic(stiffness, mass):
    """Frequencies (rad/s) and damping ratios of a complex stiffness, rising."""
    root = np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)))
    root = root[np.argsort(root.real)]
    return root.real, root.imag / np.abs(root)


def in_time(engine, body, settings=SETTINGS):
    """Frequencies and damping ratios of the running model, its rods replaced by their mean."""
    model = build_model(engine, body, settings, SPEED, GasTrace.from_engine(engine))
    own = slice(5, None)
    damping, stiffness = (matrix[own, own] for matrix in entry.matrices(model, damper=settings.damper == "fitted"))
    mass = np.eye(len(stiffness))
    for pin, inertia in mean_rods(engine):
        turn = np.pad(body.shapes[body.index(pin), 5, own], (0, len(mass) - body.n_modes + 5))
        mass += inertia * np.outer(turn, turn)
    found = damped_modes(stiffness, damping, mass)
    return found.hz * 2.0 * math.pi, found.damping_ratios


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("case", ["equal", "mixed", "driven"])
def test_modes_in_time_have_the_loss_of_the_assembled_chain(name, case):
    """All shafts with one loss factor, or every second one with none; or a stiff drive line with other loss factors.

    The crank alone has far higher frequencies.
    """
    engine = engine_of(name)
    chain = chain_of(engine)
    if case == "mixed":
        chain = replace(chain, shafts=tuple(replace(s, loss_factor=ETA * (k % 2)) for k, s in enumerate(chain.shafts)))
    stiffness, mass = assembled(engine, chain)
    if case == "driven":
        line = Chain((Disc("gear", 0.3),), (Shaft(("flywheel", "gear"), 4e5, loss_factor=0.08),
                                             Shaft(("gear", "dynamometer"), 3e3, loss_factor=0.1)))  # fmt: skip
        held, n = chain.names.index("flywheel"), len(mass)
        stiffness[held, held] -= engine.drive_line.stiffness
        stiffness, mass = np.pad(stiffness, (0, 1)), np.pad(mass, (0, 1))
        joined = np.zeros(n + 1)
        joined[[held, n]] = 1.0, -1.0
        stiffness += 4e5 * (1.0 + 0.08j) * np.outer(joined, joined)
        stiffness[n, n] += 3e3 * (1.0 + 0.1j)
        mass[n, n] = 0.3
        engine = replace(engine, drive_line_chain=DriveLineChain.of(line))
    omega, ratios = hysteretic(stiffness, mass)
    found, damping = in_time(engine, running_crank(engine, "torsional", chain_body(engine, chain)))
    for k in [0, 1, 2] if case == "driven" else [1, 2]:
        own = int(np.argmin(np.abs(found - omega[k])))
        # Cranks that are not balanced move nothing across either: their bearings hold the axis.
        assert found[own] == pytest.approx(omega[k], rel=5e-3 if case == "driven" else 5e-4)
        assert damping[own] == pytest.approx(ratios[k], rel=0.02)
    # The soft shaft of the dynamometer loses nothing.
    assert case == "driven" or np.all(ratios[1:3] < 0.5 * ETA)
    assert case != "equal" or np.all(ratios[1:3] > 0.45 * ETA)


def constant_gas(engine):
    pressure = np.full(720, engine.combustion.exhaust_pressure if engine.combustion is not None else 1e5)
    return GasTrace(pressure, pressure, 0.0, 200.0, 0.0, "constant")


@pytest.mark.parametrize("name", ENGINES)
def test_orders_and_shaft_torques_are_those_of_the_complex_stiffness(name):
    """Unit torque on the first pin, at speeds at which orders meet the first mode: every disc, and every shaft."""
    engine = engine_of(name)
    chain = chain_of(engine)
    body = running_crank(engine, "torsional", chain_body(engine, chain))
    structure = ShaftOrders(engine, body, SETTINGS, constant_gas(engine), 12.0)
    # Gas at a constant pressure has a stiffness of its own, which is none of the chain's.
    structure._by_turn = structure._by_lead = (np.zeros(structure.pins), np.zeros(structure.pins))
    stiffness, mass = assembled(engine, chain, structure.inertia[0].real)
    omega, _ = hysteretic(stiffness, mass)
    speeds, orders = np.array([0.97, 1.0, 1.03]) * omega[1] / 6.0, np.array([2, 9, 12, 16])
    moved = structure.transfer(speeds, orders)[..., 0]
    at, first = structure.at, chain.names.index("pin[1]")
    names = [*pins_of(engine), "pulley", "flywheel"]
    rows = [*range(structure.pins), at.pulley, at.flywheel]
    twists = moved[..., at.shafts :]
    torques = structure.shaft_torques(speeds, np.pad(twists, ((0, 0), (0, 25 - len(orders)), (0, 0))), np.zeros((3, 1)))
    assert structure.shafts[1:] == tuple(" to ".join(shaft.between) for shaft in chain.shafts)
    for i, speed in enumerate(speeds):
        for j, order in enumerate(0.5 * orders):
            load = np.zeros(len(mass))
            load[first] = 1.0
            own = np.linalg.solve(stiffness - (order * speed) ** 2 * mass, load)
            expected = np.array([own[chain.names.index(one)] for one in names])
            assert moved[i, j, rows] == pytest.approx(expected, abs=0.01 * np.abs(expected).max())
            for k, shaft in enumerate(chain.shafts):
                twist = own[chain.names.index(shaft.between[0])] - own[chain.names.index(shaft.between[1])]
                assert twists[i, j, 1 + k] == pytest.approx(twist, abs=0.01 * np.abs(own).max())
    # The torque of a shaft is k (1 + iη) times its twist.
    law = np.array([shaft.stiffness * (1.0 + 1j * ETA) for shaft in chain.shafts])
    assert torques[:, 1 : len(orders), 1:] == pytest.approx(law * twists[:, 1:, 1:])


def ratios_of(engine, body):
    """Damping ratios of the assembled cranktrain's torsional modes."""
    stiffness, mass = (matrix[5:, 5:] for matrix in cranktrain_matrices(engine, body))
    return damped_modes(stiffness, np.diag(structural_damping(engine, body)[5:]), mass).damping_ratios


@pytest.mark.parametrize("name", ENGINES)
def test_stated_and_inherited_ratios_are_those_of_the_assembled_cranktrain(name):
    engine = engine_of(name)
    stated = replace(engine, damping=replace(engine.damping, torsional_ratios=(0.03, 0.02)))
    body = running_crank(engine, "torsional", chain_body(engine, chain_of(engine, 0.0)))
    hz = body.frequencies_hz[6:8]
    ratios = np.array([0.03, 0.02])[: hz.size]
    above = Decay(hz, ratios, SPEED)
    for damped in (with_stated_damping(stated, body), with_damping(engine, body, "beam", above)):
        assert ratios_of(engine, damped)[: hz.size] == pytest.approx(ratios, rel=0.02)


@pytest.mark.parametrize("name", ENGINES)
def test_a_body_with_damping_ratios_keeps_them_whatever_is_attached(name):
    """An own superelement with 2ζω: flywheel, pulley and mean rods lower its frequencies, not its ratios."""
    engine = engine_of(name)
    bare = chain_body(engine, chain_of(engine, 0.0))
    bare = replace(bare, damping=2.0 * 0.013 * bare.omega)
    whole = complete_crankshaft(engine, bare)
    assert whole.omega[6] < 0.9 * bare.omega[6]
    running = running_crank(engine, "torsional", bare)
    assert ratios_of(engine, running)[:2] == pytest.approx([0.013, 0.013], rel=0.015)


def test_joined_bodies_keep_their_damping_ratios():
    """A heavy rotor behind gears of ratio 1 lowers the frequencies of a shaft, not its damping ratios."""
    engine = engine_of("diesel_i6")
    shaft = chain_body(engine, chain_of(engine, 0.0))
    shaft = replace(shaft, damping=2.0 * 0.02 * shaft.omega)
    rotor = rigid_body("rotor", 50.0, np.diag([2.0, 2.0, 3.0]), (0.0, 0.0, 0.0), {"hub": (0.0, 0.0, 0.0)})
    frames = ct.Frame("f", 1.0), ct.Frame("g", -1.0, axis=(0.5, 0.0))
    topology = ct.Topology(
        frames,
        (ct.Body("shaft", shaft, "f"), ct.Body("rotor", rotor, "g")),
        (ct.Connection("gears", "rigid_gear", (ct.End("shaft", "flywheel"), ct.End("rotor", "hub"))),),
    )
    [(omega, damping)] = entry.joined_modes(topology)
    elastic = omega > 1e-6 * omega.max()
    assert damping[elastic] == pytest.approx(2.0 * 0.02 * omega[elastic], rel=1e-6)
    assert omega[elastic].min() < 0.9 * shaft.omega[6]


def test_discs_that_damp_are_viscous_dampers():
    """Absolute damping of a pin's disc and relative damping of a shaft: c exactly, in modes of the assembled chain."""
    engine = engine_of("diesel_i6")
    chain = chain_of(engine, 0.0)
    discs = tuple(replace(disc, damping=3.0 if disc.name == "pin[2]" else 0.0) for disc in chain.discs)
    shafts = tuple(replace(shaft, damping=50.0 if k == 1 else 0.0) for k, shaft in enumerate(chain.shafts))
    body = running_crank(engine, "torsional", chain_body(engine, Chain(discs, shafts)))
    stiffness, mass = assembled(engine, chain)
    damping = np.zeros_like(mass)
    damping[2, 2] += 3.0
    twist = np.zeros(len(mass))
    twist[1:3] = 1.0, -1.0
    damping += 50.0 * np.outer(twist, twist)
    expected = damped_modes(stiffness.real, damping, mass)
    found, ratios = in_time(engine, body)
    own = [int(np.argmin(np.abs(found - 2.0 * math.pi * hz))) for hz in expected.hz[1:3]]
    assert ratios[own] == pytest.approx(expected.damping_ratios[1:3], rel=0.02)


def test_mains_that_no_pin_needs_may_be_left_out():
    """A pin between its two mains turns by their mean; with a disc of its own it needs none of them."""
    engine = engine_of("diesel_i6")
    chain = chain_of(engine)
    body = chain_body(engine, chain)
    squares = eigh(shaft_matrix(chain).real, np.diag([disc.inertia for disc in chain.discs]), eigvals_only=True)
    assert body.omega[6:] == pytest.approx(np.sqrt(squares[1:]), rel=1e-6)
    between = body.shapes[body.index("main[3]"), 5], body.shapes[[body.index("pin[2]"), body.index("pin[3]")], 5]
    assert between[0] == pytest.approx(between[1].mean(axis=0), abs=1e-6 * np.abs(between[1]).max())


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("pin[6]", "pin[7]", r"engine has no 'pin\[7\]'; did you mean"),
        ("pin[3]", "third", r"has no disc 'pin\[3\]' for cylinder 3; add it, or the discs 'main\[3\]' and 'main\[4\]'"),
        ("pulley", "nose", "has no disc 'pulley'"),
    ],
)
def test_a_table_whose_places_do_not_fit_is_refused(old, new, message):
    engine, chain = engine_of("diesel_i6"), chain_of(engine_of("diesel_i6"))
    names = {name: new if name == old else name for name in chain.names}
    wrong = Chain(
        tuple(replace(disc, name=names[disc.name]) for disc in chain.discs),
        tuple(replace(shaft, between=tuple(map(names.get, shaft.between))) for shaft in chain.shafts),
    )
    with pytest.raises(InputError, match=message):
        chain_body(engine, wrong)
