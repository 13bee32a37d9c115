"""Motion of frames with the crank angle, and coefficients of terms that depend on the crank angle.

Frames rotate, or move as the rod or the piston of a rigid crank.

A rotating frame has its axes at the angle s(kθ) + ψ in the engine's axes, and its origin is at rest. For rod and
piston, let the pin be at (x, y) across and along the cylinder from the crank's axis, s = x − e with the cylinder's
offset e, and l the rod's length,

    rod: origin at the pin, angle β with sin β = s/l;      h = √(l² − s²)
    piston: origin at (e, y + h), no angle

    β′ = x′/h,   β″ = (x″ + s β′²)/h,   h′ = −s β′,   h″ = −x′ β′ − s β″

both rotated by the cylinder's bank angle. All derivatives are by the crank angle θ.
"""

import math

import numpy as np

from cranktrain.core.kernel import kernel
from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.topology import slots as at


@kernel
def move_frames(frames: Array, theta: float, out: Array) -> None:
    """Angle, position and derivatives of frames (F, FRAME) at the crank angle ``theta``, into ``out`` (F, MOVED)."""
    for f in range(frames.shape[0]):
        frame = frames[f]
        moved = out[f]
        for k in range(at.MOVED):
            moved[k] = 0.0
        ratio = frame[at.RATIO]
        if frame[at.FRAME_KIND] == at.TURNING:
            moved[at.TURNED] = ratio * theta + frame[at.START]
            moved[at.TURN] = ratio
            continue
        cos = math.cos(ratio * theta)
        sin = math.sin(ratio * theta)
        x = cos * frame[at.PIN_X] - sin * frame[at.PIN_Y]
        y = sin * frame[at.PIN_X] + cos * frame[at.PIN_Y]
        s = x - frame[at.AXIS_OFFSET]
        h = math.sqrt(frame[at.LENGTH] * frame[at.LENGTH] - s * s)
        turn = -ratio * y / h
        turn2 = (-ratio * ratio * x + s * turn * turn) / h
        cos_bank = math.cos(frame[at.START])
        sin_bank = math.sin(frame[at.START])
        moved[at.TURNED] = frame[at.START]
        if frame[at.FRAME_KIND] == at.ROD_FRAME:
            across, along = x, y
            across1, along1 = -ratio * y, ratio * x
            across2, along2 = -ratio * ratio * x, -ratio * ratio * y
            moved[at.TURNED] += math.asin(s / frame[at.LENGTH])
            moved[at.TURN] = turn
            moved[at.TURN2] = turn2
        else:
            across, along = frame[at.AXIS_OFFSET], y + h
            across1, along1 = 0.0, ratio * x - s * turn
            across2, along2 = 0.0, -ratio * ratio * y + ratio * y * turn - s * turn2
        moved[at.PLACE_X] = cos_bank * across - sin_bank * along
        moved[at.PLACE_Y] = sin_bank * across + cos_bank * along
        moved[at.PLACE_X1] = cos_bank * across1 - sin_bank * along1
        moved[at.PLACE_Y1] = sin_bank * across1 + cos_bank * along1
        # Derivatives of the origin's position in the frame's own axes.
        cos = math.cos(moved[at.TURNED] - frame[at.START])
        sin = math.sin(moved[at.TURNED] - frame[at.START])
        moved[at.OWN_X1] = cos * across1 + sin * along1
        moved[at.OWN_Y1] = cos * along1 - sin * across1
        moved[at.OWN_X2] = cos * across2 + sin * along2
        moved[at.OWN_Y2] = cos * along2 - sin * across2


@kernel
def fill_coefficients(terms: Array, frames: Array, speed: float, out: Array) -> None:
    """Coefficients and their rates (T, 2) of all terms for moved ``frames`` (F, MOVED), at a ``speed`` in rad/s."""
    for t in range(terms.shape[0]):
        term = terms[t]
        given = frames[int(term[at.GIVEN_FRAME])]
        own = frames[int(term[at.OWN_FRAME])]
        turned = given[at.TURNED] - own[at.TURNED] + term[at.ANGLE]
        value = term[at.AMPLITUDE] * math.cos(turned)
        rate = -term[at.AMPLITUDE] * (given[at.TURN] - own[at.TURN]) * math.sin(turned)
        if term[at.LEVER_FRAME] >= 0.0:
            over = frames[int(term[at.LEVER_FRAME])]
            way = int(term[at.LEVER_WAY])
            lever = over[at.PLACE_X + way] - term[at.LEVER_START]
            rate = rate * lever + value * over[at.PLACE_X1 + way]
            value *= lever
        out[t, 0] = value
        out[t, 1] = speed * rate


def frames_at(frames: Array, theta: float) -> Array:
    """Frames (F, MOVED) at a crank angle (rad), without compiled code."""
    moved = np.zeros((len(frames), at.MOVED))
    move_frames.py_func(frames, theta, moved)
    return moved


def coefficients_at(frames: Array, terms: Array, theta: float) -> Array:
    """Coefficients (T,) of all terms at a crank angle (rad), without compiled code."""
    found = np.zeros((len(terms), 2))
    fill_coefficients.py_func(terms, frames_at(frames, theta), 0.0, found)
    return np.asarray(found[:, 0])
