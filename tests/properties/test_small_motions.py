"""Small motions of bodies in turning frames, against closed forms and against runs."""

import math

import numpy as np
import pytest
from bodies import joined

import cranktrain as ct
from cranktrain.dynamics.model.pack import pack
from cranktrain.dynamics.tangents import tangents_at_rest
from cranktrain.structure.in_motion.eigenproblem import vibrations
from cranktrain.structure.in_motion.linear import SmallMotions

MASS, POLAR, ACROSS, REACH = 6.0, 0.08, 0.05, 0.07
SIDE, TILT, LOST = 4e6, 3e4, 40.0  # N/m, N m/rad, N s/m


def overhung(ratio, held="ground"):
    """A disc that overhangs its bearing by REACH, in a frame that turns ``ratio`` times as fast as the crank."""
    frame = ct.Frame("own", ratio)
    place = {"end": tuple(frame.local((0.0, 0.0, 0.0)))}
    centre = frame.local((0.0, 0.0, REACH))
    disc = ct.rigid_body("disc", MASS, np.diag([ACROSS, ACROSS, POLAR]), tuple(centre), place)
    ends = "disc.end" if held == "ground" else f"disc.end {held}"
    law = {"stiffness": (SIDE, SIDE, 1e7), "turning_stiffness": (TILT, TILT, 1e5), "damping": (LOST, LOST, 0.0)}
    return ct.Topology((frame,), (ct.Body("disc", disc, "own"),), (joined("bearing", "spring", ends, **law),))


def whirl(spin):
    """Exponents (4,) in space of z = x + iy of the disc's centre and of its tilt ψ, at ``spin`` (rad/s).

    The bearing is at distance −REACH from the centre, where the motion is z − REACH ψ with ψ = θ_y − iθ_x.
    """
    row = np.array([1.0, -REACH])
    stiffness = SIDE * np.outer(row, row) + np.diag([0.0, TILT])
    damping = LOST * np.outer(row, row) + np.diag([0.0, -1j * spin * POLAR])
    mass = np.diag([MASS, ACROSS])
    zero, unit = np.zeros((2, 2)), np.eye(2)
    return np.linalg.eigvals(
        np.block([[zero, unit], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    )


def nearest(values, wanted):
    return values[np.argmin(np.abs(values - wanted))]


@pytest.mark.parametrize("ratio", [1.0, -2.0, 0.5])
@pytest.mark.parametrize("speed", [50.0, 400.0])
def test_an_overhung_disc_whirls_forwards_and_backwards_as_the_closed_form(ratio, speed):
    """In its own axes, which turn at the spin, each whirl has the frequency in space less the spin."""
    model = pack(overhung(ratio))
    found = SmallMotions(model)
    values, shapes, _ = vibrations(found.equations(speed, tangents_at_rest(model)), 0.5, np.zeros((found.mode.size, 1)))
    spin = abs(ratio) * speed
    across = np.max(np.abs(shapes[(found.band == 0.0)]), axis=0) > 0.9 * np.max(np.abs(shapes), axis=0)
    exact = whirl(spin) - 1j * spin
    for one in exact:
        seen = one if one.imag > 0.0 else one.conjugate()
        if seen.imag > math.pi:
            assert nearest(values[across], seen) == pytest.approx(seen, rel=1e-9)
