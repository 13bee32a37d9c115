"""Dead centre and zero of traces by other formulas of gas and heat than the fit's, with noise and drift.

Chain: noise of 30 mbar, 100 cycles, zero wrong by -0.4 bar, drifting by 0.6 bar, samples each half degree, dead centre
wrong by 0.8 deg. Gas and heat are those of ``independent_pressures``. Cylinders: a small petrol engine at full and part
load, a truck's, a medium-speed diesel with 0.32 m of bore, a two-stroke with 2 m of stroke, and a small one.
"""

import math
from functools import cache

import numpy as np
import pytest
from independent_pressures import annand, hohenberg, trace
from pulse_signals import channel

from cranktrain_lab.measured.cylinder import Cylinder
from cranktrain_lab.measured.pressure import cycles_by_encoder, pegged

# (bore, stroke, rod, compression ratio), rev/min, intake Pa and K, wall K, cycle deg, intake's end deg
CASES = {
    "petrol": ((0.0765, 0.0806, 0.1385, 10.5), 3000, 1.0e5, 330, 420, 720, -135.0),
    "petrol, part load": ((0.0765, 0.0806, 0.1385, 10.5), 1500, 0.45e5, 350, 400, 720, -135.0),
    "truck": ((0.107, 0.135, 0.215, 17.0), 1800, 2.2e5, 370, 440, 720, -140.0),
    "medium speed": ((0.32, 0.42, 0.9, 14.5), 750, 3.6e5, 350, 450, 720, -130.0),
    "large two-stroke": ((0.5, 2.0, 2.0, 15.0), 105, 3.5e5, 330, 450, 360, -118.0),
    "small two-stroke": ((0.05, 0.05, 0.095, 9.0), 5000, 1.1e5, 340, 450, 360, -105.0),
}
SHIFT = 0.8


@cache
def fitted(name, heat, fired):
    """Fit, true shift less the found one, deg, and mean error of the zeros, mbar."""
    sizes, rpm, intake, temperature, wall, cycle, closes = CASES[name]
    swept = 0.25 * math.pi * sizes[0] ** 2 * sizes[1]
    fuel = 1.6e6 * swept * intake / 1e5 if fired else 0.0
    angle, pressure = trace(sizes, rpm, intake, temperature, wall, heat, fuel, closes=closes, cycle=cycle)
    rng, n = np.random.default_rng(0), 100 * pressure.size
    phase = math.tau * np.arange(n) / n
    values = np.tile(pressure, 100) - 0.4e5 + 0.3e5 * np.sin(phase) + rng.normal(0.0, 0.03e5, n)
    made = cycles_by_encoder(channel(1e-5 * values, 1.0, "p", "bar"), pressure.size, angle[0] - SHIFT,
                             rpm * math.pi / 30.0, cycle=math.radians(cycle))  # fmt: skip
    zeros = 0.4e5 - 0.3e5 * np.sin((np.arange(len(made.pressure)) + 0.5) * math.tau / 100)
    cylinder = Cylinder(*sizes, cycle=math.radians(cycle))
    found, fit = pegged(
        made, cylinder, intake_temperature=temperature - 20.0, wall_temperature=wall, correct_shift=True
    )
    return fit, math.degrees(fit.shift) - SHIFT, 1e-2 * float(np.mean(found.zeros - zeros))


@pytest.mark.parametrize("fired", [False, True])
@pytest.mark.parametrize("heat", [hohenberg, annand])
@pytest.mark.parametrize("name", CASES)
def test_traces_of_other_formulas(name, heat, fired):
    """Motored: dead centre within 0.1 deg, zero within 6 mbar of petrol engines and 0.6 % of others' intake pressure.

    Of a fired trace one flank tells less: 0.3 deg, 1.7 % of the intake, and three of the errors that the fit states.
    """
    fit, shift, zero = fitted(name, heat, fired)
    least, share = (12.0, 0.017) if fired else (6.0, 0.006)
    assert fit.motored != fired and abs(shift) < (0.3 if fired else 0.1)
    assert abs(zero) < max(least, share * 1e-2 * CASES[name][2])
    if fired:
        assert abs(shift) < 3.2 * math.degrees(fit.shift_error)
        assert abs(zero) < 3.0 * 1e-2 * fit.zero_error + 5.0
    else:
        assert not fit.doubt


def test_more_heat_makes_a_larger_loss_angle():
    """Annand's heat of a motored truck cylinder is the larger one, and its peak the earlier one."""
    one, two = (fitted("truck", heat, False)[0] for heat in (hohenberg, annand))
    assert two.heat > 1.2 * one.heat and two.loss > one.loss + math.radians(0.05)
