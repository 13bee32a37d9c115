"""Kernels for modes of a crankshaft whose flywheel, clutch, pulley or damper housing have other masses and inertias.

The parts are rigid, axisymmetric and on the crank's axis. The mass matrix changes by ΔM = Bᵀ ΔZ B, with the shapes B of
the two interfaces that carry the parts and ΔZ linear in the changes of the parts' moments
(:func:`cranktrain.dynamics.model.lumps.unit_parts`); G, C, K_σ and the loads change likewise.
In the modes that the crank has in the FMU its mass matrix is then I + ΔM and its stiffness still diag(ω²): a Ritz
problem of a few dozen coordinates, see :mod:`.ritz_modes`. Its modes are the columns of T. The rigid motions come first
and stay exact. The factorisation begins with the rotation about the axis, like
:func:`cranktrain.core.rigid_slices.rigid_modes`, so that this mode stays a pure rotation.

The result is exact if the crank has all its modes. For a truncated crank the kept modes and static responses represent
the new modes as well as the old ones.
"""

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model import lump_slots as at
from cranktrain.dynamics.model import numbers as to


@kernel
def add_moments(values, slot, fitted, sign, out):
    """Add ``sign`` times the moments of the part at a slot of ``values`` to ``out`` (MOMENTS,).

    A ``fitted`` damper adds mass and inertias to the pulley, see loads.damper.
    """
    mass = values[slot + to.PART_MASS]
    polar = values[slot + to.PART_POLAR]
    diametral = values[slot + to.PART_DIAMETRAL]
    if fitted:
        mass += values[to.SET_DAMPER_MASS]
        polar += values[to.SET_HOUSING]
        diametral += 0.5 * (values[to.SET_HOUSING] + values[to.SET_RING])
    offset = values[slot + to.PART_OFFSET]
    out[at.OF_MASS] += sign * mass
    out[at.OF_FIRST] += sign * mass * offset
    out[at.OF_ACROSS] += sign * 0.5 * polar
    out[at.OF_ALONG] += sign * (diametral - 0.5 * polar + mass * offset * offset)


@kernel
def moment_changes(lumps, numbers, out):
    """Write changes (2, MOMENTS), flat, of the moments at flywheel and pulley to ``out``. Return 1 if any, else 0."""
    for k in range(2 * at.MOMENTS):
        out[k] = 0.0
    for slot in (to.SET_FLYWHEEL, to.SET_CLUTCH, to.SET_PULLEY):
        on_pulley = slot == to.SET_PULLEY
        own = out[at.MOMENTS :] if on_pulley else out
        fitted = on_pulley and lumps.traits[at.FITTED] > 0.0
        add_moments(numbers, slot, fitted, 1.0, own)
        add_moments(lumps.values, slot, fitted, -1.0, own)
    for k in range(2 * at.MOMENTS):
        if out[k] != 0.0:
            return 1
    return 0


@kernel
def add_changes(lumps, changes, row):
    """Fill the first matrices of ``room`` with the crank's own plus the ``changes`` (2 MOMENTS,) of moments.

    ``row`` (COORDINATES,) is scratch.
    """
    room = lumps.room
    r = lumps.fixed.shape[2]
    for which in range(at.CHANGING):
        for i in range(r):
            for j in range(r):
                room[which, i, j] = lumps.matrices[which, i, j]
    for side in range(2):
        shapes = lumps.fixed[side]
        for which in range(at.CHANGING):
            for i in range(r):
                for a in range(at.COORDINATES):
                    row[a] = 0.0
                    for k in range(at.MOMENTS * side, at.MOMENTS * (side + 1)):
                        for b in range(at.COORDINATES):
                            row[a] += changes[k] * shapes[b, i] * lumps.units[k, which, b, a]
                for j in range(r):
                    for a in range(at.COORDINATES):
                        room[which, i, j] += row[a] * shapes[a, j]
