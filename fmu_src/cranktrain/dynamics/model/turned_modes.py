"""Kernels that transform arrays of rotating bodies into the modes of a crankshaft with other masses.

With q = T q' shapes become Φ T, loads Tᵀ f, matrices Tᵀ G T (:mod:`.reattached` makes T). A body with a mode to itself
has the shape 1/√m and the load √m.
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model import lump_slots as of
from cranktrain.dynamics.model import numbers as to
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import couples_modes, turning_modes, turning_ports

TOTAL, ALONG_AXIS = 8, 3
"""Position in scratch of the crank's mass and first moments, and index of the axial first moment there."""


@kernel
def turned_row(lumps, base, out, changed, power):
    """Transform a row over the rotating modes into the new modes; ``power`` is 1 for shapes, −1 for loads."""
    turn = lumps.room[of.TURN]
    r = lumps.fixed.shape[2]
    for j in range(r):
        if changed == 0:
            out[j] = base[j]
            continue
        total = 0.0
        for i in range(r):
            total += base[i] * turn[i, j]
        out[j] = total
    for j in range(r, lumps.vectors.shape[1]):
        scale = lumps.vectors[of.SCALE, j]
        out[j] = base[j] * scale if power > 0 else base[j] / scale


@kernel
def turn_shapes(model, changed):
    """Set the shapes of ports, shafts and the points that outputs are read from."""
    lumps = model.lumps
    for k in range(turning_ports(model)):
        turned_row(lumps, lumps.ports[k], model.bodies.shapes[k], changed, 1)
        for j in range(turning_modes(model)):
            model.bodies.transposed[j, k] = model.bodies.shapes[k, j]
    for k in range(model.tilts.shape[0]):
        turned_row(lumps, lumps.tilts[k], model.tilts[k], changed, 1)
    for k in range(model.ends.shape[0]):
        turned_row(lumps, lumps.ends[k], model.ends[k], changed, 1)
    for k in range(model.shafts.shape[0]):
        turned_row(lumps, lumps.shafts[k], model.shafts[k], changed, 1)
    r = lumps.fixed.shape[2]
    for j in range(model.lag.shape[0]):
        scale = lumps.vectors[of.SCALE, j] if j >= r else 1.0
        model.lag[j] = lumps.lag[j] / scale
        model.rotor[j] = lumps.rotor[j] * scale
    if r > 0:
        model.scalars[at.RIGID_ROTATION] = lumps.ends[at.PULLEY_ROTATION, at.ROTATION]
    if changed != 0:
        model.scalars[at.RIGID_ROTATION] *= lumps.room[of.TURN, at.ROTATION, at.ROTATION]


@kernel
def turn_loads(model, changes, changed):
    """Set the loads by rotation and gravity, and ω² of the crank's modes, for ``changes`` (2, MOMENTS) of its parts."""
    lumps = model.lumps
    r = lumps.fixed.shape[2]
    load = lumps.vectors[of.LOAD]
    for row in range(of.LOADS):
        for i in range(load.shape[0]):
            load[i] = lumps.loads[row, i]
        for k in range(2 * of.MOMENTS if changed != 0 else 0):
            for a in range(of.COORDINATES):
                for i in range(r):
                    load[i] += changes[k] * lumps.unit_loads[k, row, a] * lumps.fixed[k // of.MOMENTS, a, i]
        out = model.gravity[max(row - of.TRANSLATION, 0)]
        if row == of.CENTRIFUGAL_LOAD:
            out = model.bodies.centrifugal_load
        elif row == of.EULER_LOAD:
            out = model.bodies.euler_load
        turned_row(lumps, load, out, changed, -1)
        if changed != 0 and lumps.traits[of.TWISTS] > 0.0:
            for j in range(6, r):
                out[j] = 0.0
    for i in range(r):
        model.omega2[i] = lumps.vectors[of.OMEGA2, i] if changed != 0 else lumps.omega2[i]


@kernel
def damp_modes(model, numbers, changed):
    """Set the structural damping of the crank's modes, 1/s, with the masses of crank and rods."""
    lumps = model.lumps
    own = lumps.traits[of.DAMPING_KIND] == of.OWN_DAMPING
    other_rods = False
    for slot in (to.SET_BIG_END, to.SET_SMALL_END, to.SET_PISTON):
        other_rods = other_rods or numbers[slot] != lumps.values[slot]
    for i in range(lumps.fixed.shape[2]):
        if changed == 0 and (own or not other_rods):
            model.damping[i] = lumps.damping[i]
        elif own:
            model.damping[i] = own_damping(lumps, i, model.omega2[i])
        else:
            model.damping[i] = stated_damping(model, numbers, i)


@kernel
def stated_damping(model, numbers, mode):
    """Damping of a mode from the engine file, 1/s, see :func:`cranktrain.dynamics.model.arrays.structural_damping`."""
    lumps, ports = model.lumps, model.bodies.shapes
    traits, square = lumps.traits, model.omega2[mode]
    if mode < 6:
        return 0.0
    mass = 1.0
    for c in range(model.cylinders.shape[0]):
        rod = lumps.rod_masses[c]
        if traits[of.ROD_ALIKE] > 0.0:
            rod = numbers[to.SET_BIG_END] + 0.5 * (numbers[to.SET_SMALL_END] + numbers[to.SET_PISTON])
        pin = int(model.cylinders[c, at.PIN_PORT])
        if pin >= 0:
            mass += rod * (ports[pin, mode] ** 2 + ports[pin + 1, mode] ** 2)
        else:
            turn = ports[int(model.cylinders[c, at.PIN_TURN]), mode]
            mass += rod * (model.pins[c, 0] ** 2 + model.pins[c, 1] ** 2) * turn**2
    if traits[of.DAMPING_KIND] == of.MODAL:
        return 2.0 * traits[of.DAMPING_A] * math.sqrt(square * mass)
    return traits[of.DAMPING_A] * mass + traits[of.DAMPING_B] * square


@kernel
def own_damping(lumps, mode, square):
    """Damping (1/s) of a new mode of a body with damping of its own; see core.reduced_body.damping_in_modes."""
    total = 0.0
    for i in range(lumps.fixed.shape[2]):
        lost = lumps.room[of.TURN, i, mode] ** 2 * lumps.damping[i]
        if lumps.omega2[i] == 0.0:
            total += lost
        elif square > 0.0:
            total += lost * math.sqrt(lumps.omega2[i] / square)
    return total


@kernel
def turn_matrices(model, changed):
    """Set the gyroscopic matrix G and K_σ − C (stress stiffness minus centrifugal matrix) of the crank."""
    lumps = model.lumps
    r = lumps.fixed.shape[2]
    for i in range(turning_modes(model)):
        for j in range(turning_modes(model)):
            model.bodies.spin[i, j] = lumps.spin[i, j]
            model.bodies.gyroscopic[i, j] = lumps.gyroscopic[i, j]
    if changed == 0 or not couples_modes(model):
        return
    # A crank that only twists has gyroscopic and centrifugal terms for its rigid motions only.
    n = 6 if lumps.traits[of.TWISTS] > 0.0 else r
    room = lumps.room
    turn, product = room[of.TURN], room[of.PRODUCT]
    for which in range(of.GYROSCOPIC, of.CHANGING):
        matrix = room[which]
        rows = 6 if which >= of.MOVING else n
        columns = 6 if which == of.TILTING else n
        for i in range(rows):
            for j in range(columns):
                total = 0.0
                for k in range(columns):
                    total += matrix[i, k] * turn[k, j]
                product[i, j] = total
        for i in range(rows):
            for j in range(columns):
                total = 0.0
                for k in range(rows):
                    total += turn[k, i] * product[k, j]
                matrix[i, j] = total
    for i in range(n):
        for j in range(n):
            model.bodies.gyroscopic[j, i] = room[of.GYROSCOPIC, i, j]
            model.bodies.spin[j, i] = room[of.STRESS, i, j] - room[of.CENTRIFUGAL, i, j]
            if i < 6:
                model.bodies.spin[j, i] += room[of.MOVING, i, j]
            if i < 6 and j < 6:
                model.bodies.spin[j, i] += room[of.TILTING, i, j]


@kernel
def weigh_axis(model, changed):
    """Write the crank's mass and first moments about the origin to scratch, and set the weights of the main journals.

    Their sum is 1, and the weighted sum of displacements of a rigid axis is the displacement at the crank's centre of
    mass. Of all such weights these have the least sum of squares; they are equal if all journals coincide.
    """
    lumps = model.lumps
    count = lumps.mains.shape[0]
    total = lumps.scratch[TOTAL : TOTAL + of.MOMENTS]
    total[0] = lumps.traits[of.CRANK_MASS]
    for k in range(3):
        total[1 + k] = total[0] * lumps.traits[of.CRANK_CENTRE + k]
    for side in range(2 if changed != 0 else 0):
        added = lumps.scratch[of.MOMENTS * side + of.OF_MASS]
        total[0] += added
        for k in range(3):
            total[1 + k] += added * lumps.places[side, k]
        total[ALONG_AXIS] += lumps.scratch[of.MOMENTS * side + of.OF_FIRST]
    mean = 0.0
    for i in range(count):
        mean += lumps.mains[i] / count
    spread = 0.0
    for i in range(count):
        spread += (lumps.mains[i] - mean) ** 2
    for i in range(count):
        model.axis_weights[i] = 1.0 / count
        if spread > 0.0:
            model.axis_weights[i] += (lumps.mains[i] - mean) * (total[ALONG_AXIS] / total[0] - mean) / spread
