"""Kernels that change a model to other lumped data than its bodies were made for, while the model is prepared.

Each array is computed from the constants of :mod:`cranktrain.dynamics.model.lumps`, so that nothing of an earlier
preparation is left. With the engine file's values the arrays are identical to the built ones.

* Flywheel, clutch, pulley and the damper's housing change the crank's modes (:mod:`.reattached`). With q = T q', T
 transforms shapes, loads and G, C, K_σ.
* A part with a mode to itself (a free big end, the damper's ring, the dynamometer's rotor, the connecting shaft's mass)
 has the shape 1/√m and the load √m.
* Values of rods, pistons, connecting shaft, mounts, clearances, oil and damper follow the formulas of the builder.
"""

import math

from cranktrain.core.kernel import kernel
from cranktrain.dynamics.model import lump_slots as of
from cranktrain.dynamics.model import numbers as to
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.reattached import add_changes, moment_changes
from cranktrain.dynamics.model.ritz_modes import keep_twists, lock_journals, new_modes
from cranktrain.dynamics.model.turned_modes import (
    ALONG_AXIS,
    TOTAL,
    damp_modes,
    turn_loads,
    turn_matrices,
    turn_shapes,
    weigh_axis,
)
from cranktrain.dynamics.motion.linear_algebra import dot, factor_lu, solve_lu
from cranktrain.dynamics.time.status import CLEARANCE_FIXED, GEARS_FIXED, NO_RIGID_PART, OK
from cranktrain.film.laws.parameters import CLEARANCE
from cranktrain.loads.damper import FLUID, KIND, LOSS_FACTOR, NEWTONIAN, RUBBER, SPRING

ROUNDING = 1.0e-9
LOAD, LOAD_END, ROW = 12, 18, 20
"""Positions in scratch: load on the mounts, its end, and a row of a changed matrix."""
TURN_X, TURN_Z = 3, 5
"""Rotations of the engine about x and z among its rigid motions."""


@kernel
def trim_refusal(model, numbers):
    """Status for the reason why a model cannot have the lumped data in ``numbers``, or OK."""
    lumps = model.lumps
    traits = lumps.traits
    for slot in (to.SET_FLYWHEEL, to.SET_PULLEY, to.SET_CLUTCH):
        polar = numbers[slot + to.PART_POLAR]
        if polar > 2.0 * numbers[slot + to.PART_DIAMETRAL] * (1.0 + ROUNDING):
            return NO_RIGID_PART
    if traits[of.GEARED] > 0.0 and moment_changes(lumps, numbers, lumps.scratch) != 0:
        return GEARS_FIXED
    if traits[of.MAINS_FREE] == 0.0 and other(lumps, numbers, to.SET_MAIN_CLEARANCE):
        return CLEARANCE_FIXED
    if traits[of.ENDS_FREE] == 0.0 and other(lumps, numbers, to.SET_PIN_CLEARANCE):
        return CLEARANCE_FIXED
    return OK


@kernel
def other(lumps, numbers, slot):
    """True if a number differs from the value that the bodies were made for."""
    return numbers[slot] != lumps.values[slot]


@kernel
def trim_model(model, numbers):
    """Write lumped data into a model, which passed :func:`trim_refusal`. Return a status (0: success)."""
    lumps = model.lumps
    changes = lumps.scratch
    changed = moment_changes(lumps, numbers, changes)
    if changed != 0:
        add_changes(lumps, changes, lumps.scratch[ROW:])
        keep_twists(lumps)
        if new_modes(lumps) != 0:
            return NO_RIGID_PART
        lock_journals(lumps)
    for i in range(lumps.vectors.shape[1]):
        slot = int(lumps.grown[i])
        lumps.vectors[of.SCALE, i] = 1.0
        if slot >= 0 and other(lumps, numbers, slot):
            lumps.vectors[of.SCALE, i] = math.sqrt(lumps.values[slot] / numbers[slot])
    turn_shapes(model, changed)
    turn_loads(model, changes, changed)
    turn_matrices(model, changed)
    weigh_axis(model, changed)
    damp_modes(model, numbers, changed)
    trim_rods(model, numbers)
    trim_line(model, numbers)
    trim_pistons(model, numbers)
    trim_mounts(model, numbers)
    weigh_block(model, numbers)
    trim_films(model, numbers)
    trim_damper(model, numbers)
    return OK


@kernel
def trim_rods(model, numbers):
    """Set the masses of rods and pistons, which are eliminated onto the pins."""
    traits = model.lumps.traits
    if traits[of.ROD_ALIKE] == 0.0:
        return
    big, small, piston = numbers[to.SET_BIG_END], numbers[to.SET_SMALL_END], numbers[to.SET_PISTON]
    for k in range(model.cylinders.shape[0]):
        row = model.cylinders[k]
        if row[at.OWN_ROD] == 0.0:
            continue
        mass = big + small
        b = row[at.ROD] * small / mass
        row[at.M_SMALL] = small
        row[at.M_BIG] = 0.0 if traits[of.FREE_ENDS] > 0.0 else big
        row[at.M_OSC] = small + piston
        row[at.DELTA_J] = numbers[to.SET_ROD_INERTIA] - mass * b * (row[at.ROD] - b)


@kernel
def trim_line(model, numbers):
    """Set stiffness, damping and inertia of connecting shaft and axial path from the numbers of a run."""
    traits = model.lumps.traits
    if traits[of.ONE_SHAFT] > 0.0:
        model.shaft_laws[0, 0] = numbers[to.SET_LINE_STIFFNESS]
        model.shaft_laws[0, 1] = numbers[to.SET_LINE_DAMPING]
        square = traits[of.END_SPEED] ** 2
        # Part of the wind-up that is the shaft's own; the rest is that of springs between crank and drive line.
        part = 1.0 / (1.0 + traits[of.AHEAD] * square * numbers[to.SET_LINE_STIFFNESS])
        model.scalars[at.SHAFT_K] = part * square * numbers[to.SET_LINE_STIFFNESS]
        model.scalars[at.SHAFT_C] = part * part * square * numbers[to.SET_LINE_DAMPING]
        model.scalars[at.WINDUP_K] = numbers[to.SET_LINE_STIFFNESS]
        model.scalars[at.LINE_INERTIA] = square * numbers[to.SET_DYNAMOMETER]
    elif other(model.lumps, numbers, to.SET_DYNAMOMETER):
        more = numbers[to.SET_DYNAMOMETER] - model.lumps.values[to.SET_DYNAMOMETER]
        model.scalars[at.LINE_INERTIA] = traits[of.LINE_INERTIA] + more * traits[of.END_SPEED] ** 2
    else:
        model.scalars[at.LINE_INERTIA] = traits[of.LINE_INERTIA]
    path = int(traits[of.PATH_ROW])
    if path >= 0:
        model.shaft_laws[path, 0] = numbers[to.SET_PATH_STIFFNESS]
        model.shaft_laws[path, 1] = numbers[to.SET_PATH_DAMPING]


@kernel
def trim_pistons(model, numbers):
    """Set the two modes of guided pistons, which include the mass of the rod's small end."""
    lumps, block = model.lumps, model.block
    traits = lumps.traits
    if traits[of.GUIDED] == 0.0:
        return
    piston = numbers[to.SET_PISTON]
    arm = traits[of.PISTON_ARM]
    block.guidance[block.guidance.shape[0] - 1] = piston * arm
    one = math.sqrt(piston + numbers[to.SET_SMALL_END])
    before = math.sqrt(lumps.values[to.SET_PISTON] + lumps.values[to.SET_SMALL_END])
    lean = -piston * arm / one
    rest = math.sqrt(traits[of.TILT_INERTIA] + piston * arm * arm - lean * lean)
    shape = block.piston_shape
    shape[0, 0] = 1.0 / one
    shape[0, 1] = -lean / (one * rest)
    shape[1, 0] = 0.0
    shape[1, 1] = 1.0 / rest
    for i in range(2):
        for j in range(2):
            block.piston_inverse[i, j] = shape[i, 0] * shape[j, 0] + shape[i, 1] * shape[j, 1]
    start = int(traits[of.FIRST_PISTON])
    for c in range(int(traits[of.PISTONS])):
        for k in range(3):
            model.gravity[k, start + 2 * c] = lumps.gravity[k, start + 2 * c] * (one / before)
            model.gravity[k, start + 2 * c + 1] = 0.0


@kernel
def trim_mounts(model, numbers):
    """Set stiffness and damping of the mounts, by themselves and in the block's modes."""
    block = model.block
    modes = block.stiffness.shape[0]
    for i in range(modes):
        for j in range(modes):
            block.stiffness[i, j] = 0.0
            block.damping[i, j] = 0.0
    for row in range(block.mounts.shape[0]):
        slot = to.SET_MOUNTS + to.MOUNT_NUMBERS * (row // 6) + row % 6
        law, shape = block.mount_laws[row], block.mounts[row]
        law[at.MOUNT_STIFFNESS] = numbers[slot]
        law[at.MOUNT_DAMPING] = numbers[slot + 6]
        for i in range(modes):
            for j in range(modes):
                block.stiffness[i, j] += law[at.MOUNT_STIFFNESS] * shape[i] * shape[j]
                block.damping[i, j] += law[at.MOUNT_DAMPING] * shape[i] * shape[j]


@kernel
def weigh_block(model, numbers):
    """Set the forces of the mounts that carry the engine at rest, per m/s² of gravity."""
    lumps, block = model.lumps, model.block
    traits = lumps.traits
    rows = block.mounts.shape[0]
    for i in range(block.weight.shape[0]):
        block.weight[i] = 0.0
    if rows == 0:
        return
    crank, load, supports = lumps.scratch[TOTAL:LOAD], lumps.scratch[LOAD:LOAD_END], lumps.room[of.SQUARES]
    rods = numbers[to.SET_BIG_END] + numbers[to.SET_SMALL_END] + numbers[to.SET_PISTON]
    rods *= model.cylinders.shape[0]
    share = (crank[0] + rods) / crank[0]
    for k in range(6):
        load[k] = 0.0
    load[1] = -(traits[of.BLOCK_MASS] + crank[0] + rods)
    load[TURN_X] = traits[of.BLOCK_MASS] * traits[of.BLOCK_CENTRE + 2] + share * crank[ALONG_AXIS]
    load[TURN_Z] = -(traits[of.BLOCK_MASS] * traits[of.BLOCK_CENTRE] + share * crank[1])
    for i in range(6):
        for j in range(6):
            total = 0.0
            for row in range(rows):
                stiff = block.mount_laws[row, at.MOUNT_STIFFNESS]
                total += stiff * lumps.mount_motion[row, i] * lumps.mount_motion[row, j]
            supports[i, j] = total
    if factor_lu(supports, 6, lumps.vectors[of.PIVOTS]) != 0:
        return
    solve_lu(supports, 6, lumps.vectors[of.PIVOTS], load)
    for row in range(rows):
        carried = -block.mount_laws[row, at.MOUNT_STIFFNESS] * dot(lumps.mount_motion[row], load, 6)
        block.mount_laws[row, at.MOUNT_WEIGHT] = carried
        for i in range(block.weight.shape[0]):
            block.weight[i] += block.mounts[row, i] * carried


@kernel
def trim_films(model, numbers):
    """Set the clearances of main bearings and big ends."""
    lumps = model.lumps
    clearance = numbers[to.SET_MAIN_CLEARANCE]
    for i in range(model.bearings.shape[0]):
        if lumps.plain[i] > 0.0 and clearance > 0.0:
            model.bearings[i, CLEARANCE] = clearance
            row = model.connections[i]
            for k in range(row[at.COUPLED]):
                model.scales[row[at.FIRST + k]] = clearance
    clearance = numbers[to.SET_PIN_CLEARANCE]
    if clearance > 0.0:
        for k in range(model.big_ends.shape[0]):
            model.big_ends[k, CLEARANCE] = clearance
            port = int(model.cylinders[k, at.END_PORT])
            if port >= 0:
                model.scales[port] = clearance
                model.scales[port + 1] = clearance


@kernel
def trim_damper(model, numbers):
    """Set the fluid's viscosity, or stiffness and damping of the spring, in the damper."""
    damper = model.basis.damper
    lumps = model.lumps
    if lumps.traits[of.FITTED] == 0.0:
        return
    if lumps.values[to.SET_FLUID] > 0.0:
        damper[FLUID] = numbers[to.SET_FLUID]
    elif damper[KIND] == RUBBER:
        damper[SPRING] = numbers[to.SET_SPRING]
        damper[LOSS_FACTOR] = numbers[to.SET_SPRING_LOSS]
    elif damper[KIND] == NEWTONIAN and lumps.traits[of.STATED_DAMPER] > 0.0:
        damper[SPRING] = numbers[to.SET_SPRING]
        if other(lumps, numbers, to.SET_SPRING_LOSS):
            damper[FLUID] = numbers[to.SET_SPRING_LOSS]
