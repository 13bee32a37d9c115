"""Energy balance of a run: gas work = work at the dynamometer + heat + change of stored energy.

Powers and energies are written out in tests/plain_model.py from states and inputs alone, in the inertial frame, so that
what the frame's turning hides (torques and forces that do no work in the turning frame) must come out right.

A rigid crank closes to what the step leaves. An elastic one keeps angular momentum of second order in its bending,
which equations linear in the modes leave out; it is a state, so over a cycle only its small change counts. Taken into
account, the balance closes at second order.
"""

import math
from functools import cache

import numpy as np
import pytest
from bodies import six
from plain_model import PlainModel

from cranktrain.dynamics.cycle_run import communication_step
from cranktrain.dynamics.model import state as layout
from cranktrain.dynamics.simulation import Settings, Simulation

SPEED = 2000 * math.pi / 30
CYCLES = 3


@cache
def balance(bearings, crank, integrator, step_deg):
    """Works (J) of the last cycle by name, the open share of the gas work, the same with the bent shaft's momentum."""
    engine, body = six()
    settings = Settings(crank=crank, bearings=bearings, integrator=integrator, step=math.radians(step_deg))
    simulation, plain = Simulation(engine, body, settings), PlainModel(engine, body, settings, SPEED)
    simulation.inputs[0] = SPEED
    simulation.initialize()
    h = communication_step(SPEED, settings.step)
    per_cycle = round(4 * math.pi / SPEED / h)
    powers, energies, momenta = [], [], []
    for k in range(1, CYCLES * per_cycle + 1):
        simulation.step(k * h)
        if k < (CYCLES - 1) * per_cycle:
            continue
        state = simulation.state
        q, v = (state[layout.offset(i, plain.n) :][: plain.n] for i in range(2))
        y = np.concatenate([q, v, state[[layout.LEAD_ANGLE, layout.LEAD_SPEED]]])
        frame = plain.frame(0.0, y, state[layout.SHAFT_ANGLE])
        power = plain.powers(frame, q, v)
        powers.append(list(power.values()))
        energies.append(plain.energy(frame, q, v))
        momenta.append(plain.bent_momentum(frame, q, v))
    works = dict(zip(power, np.trapezoid(powers, dx=h, axis=0), strict=True))
    open_work = works["gas"] - sum(w for name, w in works.items() if name != "gas") - (energies[-1] - energies[0])
    closed = open_work + SPEED * (momenta[-1] - momenta[0])
    return works, open_work / works["gas"], closed / works["gas"]


@pytest.mark.parametrize("bearings", ["linear", "impedance"])
@pytest.mark.parametrize("crank", ["rigid", "solid"])
def test_gas_work_is_accounted_for_within_a_thousandth(crank, bearings):
    works, unaccounted, _ = balance(bearings, crank, "generalised-alpha", 1.0)
    assert works["gas"] > 5e3
    assert abs(unaccounted) < 1e-3
    assert all(heat > -1e-9 for name, heat in works.items() if name not in ("gas", "shaft"))


@pytest.mark.parametrize("bearings", ["linear", "impedance"])
@pytest.mark.parametrize("crank", ["rigid", "solid"])
def test_balance_improves_with_the_square_of_the_step(crank, bearings):
    steps = (4.0, 2.0, 1.0)
    left = [abs(balance(bearings, crank, "generalised-alpha", step)[2]) for step in steps]
    assert left[0] > 3 * left[1] > 9 * left[2]
