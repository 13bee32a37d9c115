"""Kernels for modes of a crankshaft whose flywheel, clutch, pulley or damper housing have other masses and inertias.

The parts are rigid, axisymmetric and on the crank's axis. The mass matrix changes by ΔM = Bᵀ ΔZ B, with the shapes B of
the two interfaces that carry the parts; G, C, K_σ and the loads change likewise (:mod:`cranktrain.core.rigid_slices`).
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
from cranktrain.dynamics.model.ritz_modes import inverse_of_six

MASS, FIRST, ACROSS, ALONG, MOMENTS = range(5)
"""Slots of the moments of parts at an interface: Σ m, Σ m o with axial offsets o, ∫ρ x² and ∫ρ z² about it."""
FLYWHEEL, PULLEY = range(2)
ROW_X, ROW_Y, ROW_Z, FIELD = range(0, 16, 4)
OF_X, OF_Y, OF_Z = 1, 2, 3
"""Columns of a field (3, 4) that multiply the position r in a part; column 0 is the motion at r = 0."""
F_FIELD, G_FIELD, H_FIELD = 0, FIELD, 2 * FIELD
"""Positions of three fields in scratch."""
TURN_X, TURN_Y, TURN_Z = 3, 4, 5
SPUN, PART = 3, 3
"""Row for the load of a rotation about z; number of values (mass, inertias) of a part."""
NOW, BEFORE, EXTRA = 8, 12, 16
"""Positions in scratch of new moments, old moments and the damper's part, after the changes of both interfaces."""


@kernel
def part_moments(numbers, slot, extra, out):
    """Add the moments of the part at a slot to ``out`` (MOMENTS,); ``extra`` (3,) is added to its mass and inertias."""
    mass = numbers[slot + to.PART_MASS] + extra[0]
    polar = numbers[slot + to.PART_POLAR] + extra[1]
    diametral = numbers[slot + to.PART_DIAMETRAL] + extra[2]
    offset = numbers[slot + to.PART_OFFSET]
    out[MASS] += mass
    out[FIRST] += mass * offset
    out[ACROSS] += 0.5 * polar
    out[ALONG] += diametral - 0.5 * polar + mass * offset * offset


@kernel
def fitted_extra(numbers, fitted, extra):
    """Mass, polar and diametral inertia that a fitted damper adds to the pulley, see loads.damper."""
    for k in range(3):
        extra[k] = 0.0
    if fitted > 0.0:
        extra[0] = numbers[to.SET_DAMPER_MASS]
        extra[1] = numbers[to.SET_HOUSING]
        extra[2] = 0.5 * (numbers[to.SET_HOUSING] + numbers[to.SET_RING])


@kernel
def moment_changes(lumps, numbers, out):
    """Write changes (2, MOMENTS) of the moments at flywheel and pulley to ``out``. Return 1 if any differ, else 0.

    ``out[8:20]`` is scratch.
    """
    fitted = lumps.traits[at.FITTED]
    changed = 0
    for side in range(2):
        for k in range(MOMENTS):
            out[NOW + k] = 0.0
            out[BEFORE + k] = 0.0
        for which in range(2):
            given = numbers if which == 0 else lumps.values
            moments = out[NOW : NOW + MOMENTS] if which == 0 else out[BEFORE : BEFORE + MOMENTS]
            extra = out[EXTRA : EXTRA + PART]
            fitted_extra(given, fitted if side == PULLEY else 0.0, extra)
            part_moments(given, to.SET_FLYWHEEL if side == FLYWHEEL else to.SET_PULLEY, extra, moments)
            if side == FLYWHEEL:
                fitted_extra(given, 0.0, extra)
                part_moments(given, to.SET_CLUTCH, extra, moments)
        for k in range(MOMENTS):
            out[MOMENTS * side + k] = out[NOW + k] - out[BEFORE + k]
            if out[MOMENTS * side + k] != 0.0:
                changed = 1
    return changed


@kernel
def field_of(shapes, mode, f):
    """Field f (12,), B (3, 4) row by row, of the motion of a part in a mode, at an interface with ``shapes`` (6, r)."""
    x, y, z = shapes[TURN_X, mode], shapes[TURN_Y, mode], shapes[TURN_Z, mode]
    f[ROW_X], f[ROW_X + OF_X], f[ROW_X + OF_Y], f[ROW_X + OF_Z] = shapes[0, mode], 0.0, -z, y
    f[ROW_Y], f[ROW_Y + OF_X], f[ROW_Y + OF_Y], f[ROW_Y + OF_Z] = shapes[1, mode], z, 0.0, -x
    f[ROW_Z], f[ROW_Z + OF_X], f[ROW_Z + OF_Y], f[ROW_Z + OF_Z] = shapes[2, mode], -y, x, 0.0


@kernel
def turned_of(f, g):
    """Write to ``g`` the field whose displacement is e_z × u, with u the displacement of field ``f``."""
    for k in range(4):
        g[k] = -f[4 + k]
        g[4 + k] = f[k]
        g[8 + k] = 0.0


@kernel
def paired(moments, f, g):
    """∫ρ u·v of the displacements of two fields over parts with the given ``moments``."""
    total = 0.0
    for a in range(0, 12, 4):
        total += moments[MASS] * f[a] * g[a] + moments[FIRST] * (f[a] * g[a + 3] + f[a + 3] * g[a])
        total += moments[ACROSS] * (f[a + 1] * g[a + 1] + f[a + 2] * g[a + 2]) + moments[ALONG] * f[a + 3] * g[a + 3]
    return total


@kernel
def add_changes(lumps, changes, scratch):
    """Fill MASS, GYROSCOPIC, CENTRIFUGAL, STRESS of ``room`` and the loads with the crank's values plus the changes.

    ``changes`` (2, MOMENTS) flat; ``scratch`` (64,).
    """
    room = lumps.room
    vectors = lumps.vectors
    r = lumps.fixed.shape[2]
    for i in range(r):
        vectors[at.CENTRIFUGAL_LOAD, i] = lumps.loads[0, i]
        vectors[at.EULER_LOAD, i] = lumps.loads[1, i]
        for k in range(3):
            vectors[at.TRANSLATION + k, i] = lumps.gravity[k, i]
        for j in range(r):
            room[at.MASS, i, j] = 1.0 if i == j else 0.0
            room[at.GYROSCOPIC, i, j] = lumps.gyroscopic[j, i]
            room[at.CENTRIFUGAL, i, j] = lumps.centrifugal[i, j]
            room[at.STRESS, i, j] = lumps.stress[i, j]
    f, g, h = scratch[F_FIELD : F_FIELD + FIELD], scratch[G_FIELD : G_FIELD + FIELD], scratch[H_FIELD : H_FIELD + FIELD]
    for side in range(2):
        moments = changes[MOMENTS * side : MOMENTS * side + MOMENTS]
        shapes = lumps.fixed[side]
        for i in range(r):
            field_of(shapes, i, f)
            turned_of(f, h)
            for j in range(r):
                field_of(shapes, j, g)
                room[at.MASS, i, j] += paired(moments, f, g)
                room[at.CENTRIFUGAL, i, j] += paired_turned(moments, h, g)
                turn_in_place(g)
                room[at.GYROSCOPIC, i, j] += paired(moments, f, g)
        add_loads(lumps, side, moments, scratch)
        add_stress(lumps, side, moments, scratch)


@kernel
def paired_turned(moments, turned, g):
    """∫ρ u·(e_z×v), with displacement u of the field ``turned`` and v of the field ``g``."""
    total = 0.0
    for a in range(0, 8, 4):
        b = 4 - a
        sign = -1.0 if a == 0 else 1.0
        total += sign * (
            moments[MASS] * turned[a] * g[b]
            + moments[FIRST] * (turned[a] * g[b + 3] + turned[a + 3] * g[b])
            + moments[ACROSS] * (turned[a + 1] * g[b + 1] + turned[a + 2] * g[b + 2])
            + moments[ALONG] * turned[a + 3] * g[b + 3]
        )
    return total


@kernel
def turn_in_place(g):
    """Replace the displacement u of field ``g`` by e_z × u."""
    for k in range(4):
        first = g[k]
        g[k] = -g[4 + k]
        g[4 + k] = first
        g[8 + k] = 0.0


@kernel
def add_loads(lumps, side, moments, scratch):
    """Add centrifugal load, Euler load and translation of the parts at an interface to ``vectors``."""
    vectors = lumps.vectors
    shapes = lumps.fixed[side]
    f, outward, around = (
        scratch[F_FIELD : F_FIELD + FIELD],
        scratch[G_FIELD : G_FIELD + FIELD],
        scratch[H_FIELD : H_FIELD + FIELD],
    )
    outward_field(lumps.places[side], outward)
    turned_of(outward, around)
    for i in range(lumps.fixed.shape[2]):
        field_of(shapes, i, f)
        vectors[at.CENTRIFUGAL_LOAD, i] += paired(moments, outward, f)
        vectors[at.EULER_LOAD, i] += paired(moments, around, f)
        for k in range(3):
            vectors[at.TRANSLATION + k, i] += moments[MASS] * f[4 * k] + moments[FIRST] * f[4 * k + 3]


@kernel
def outward_field(place, outward):
    """Write to ``outward`` the field of X_⊥, the position across the axis, for parts at ``place`` (3,)."""
    for k in range(12):
        outward[k] = 0.0
    outward[ROW_X], outward[ROW_X + OF_X] = place[0], 1.0
    outward[ROW_Y], outward[ROW_Y + OF_Y] = place[1], 1.0


@kernel
def add_stress(lumps, side, moments, scratch):
    """Add K_σ of the parts at an interface to STRESS of ``room``, with exact rows and columns of the rigid modes.

    See :func:`cranktrain.core.reduced_body.with_rigid_rows`. A crank that only twists has only the rigid part.
    """
    room = lumps.room
    shapes = lumps.fixed[side]
    r = lumps.fixed.shape[2]
    stress = room[at.STRESS]
    place = lumps.places[side]
    lean_x, lean_y = -0.5 * moments[FIRST] * place[0], -0.5 * moments[FIRST] * place[1]
    for i in range(6, r):
        for j in range(6, r):
            across = (
                shapes[TURN_X, i] * shapes[TURN_X, j]
                + shapes[TURN_Y, i] * shapes[TURN_Y, j]
                + 2.0 * shapes[TURN_Z, i] * shapes[TURN_Z, j]
            )
            leaning = lean_x * (shapes[TURN_X, i] * shapes[TURN_Z, j] + shapes[TURN_Z, i] * shapes[TURN_X, j])
            leaning += lean_y * (shapes[TURN_Y, i] * shapes[TURN_Z, j] + shapes[TURN_Z, i] * shapes[TURN_Y, j])
            stress[i, j] += moments[ACROSS] * across + leaning
    f, outward, load = (
        scratch[F_FIELD : F_FIELD + FIELD],
        scratch[G_FIELD : G_FIELD + FIELD],
        scratch[H_FIELD : H_FIELD + FIELD],
    )
    to_modes, turned, against = room[at.PRODUCT], room[at.VECTORS], room[at.SQUARES]
    inverse_of_six(lumps.rigid, room[at.TURN], to_modes, lumps.vectors[at.PIVOTS], lumps.vectors[at.HELP])
    outward_field(place, outward)
    for j in range(r):
        field_of(shapes, j, f)
        for k in range(3):
            skewed(outward, k, load)
            turned[k, j] = paired(moments, load, f)
        # ∫ρ (e_z×r_z)·(e_z×φ_j) with the rotation about z through the origin, e_z×X, turned to −X_⊥.
        turn_in_place(f)
        for k in range(12):
            load[k] = -outward[k]
        turned[SPUN, j] = paired(moments, load, f)
    for k in range(6):
        for j in range(r):
            against[k, j] = 0.0
    for k in range(3):
        for l in range(3):  # noqa: E741
            one, other = 0.0, 0.0
            for m in range(6):
                one += turned[k, m] * to_modes[m, 3 + l]
                other += turned[l, m] * to_modes[m, 3 + k]
            against[3 + k, 3 + l] = 0.5 * (one + other)
    for k in range(6):
        total = 0.0
        for m in range(6):
            total += turned[SPUN, m] * to_modes[m, k]
        against[TURN_Z, k] = total
    for k in range(5):
        against[k, TURN_Z] = against[TURN_Z, k]
    for i in range(6):
        for j in range(6):
            for k in range(6):
                for m in range(6):
                    stress[i, j] += lumps.rigid[k, i] * against[k, m] * lumps.rigid[m, j]
        for j in range(6, r):
            total = 0.0
            for k in range(3, 6):
                total += lumps.rigid[k, i] * turned[k - 3 if k < 5 else 3, j]
            stress[i, j] += total
            stress[j, i] += total


@kernel
def skewed(outward, k, load):
    """Write to ``load`` the field of e_k × X_⊥."""
    a = (k + 1) % 3
    b = (k + 2) % 3
    for c in range(4):
        load[4 * k + c] = 0.0
        load[4 * a + c] = -outward[4 * b + c]
        load[4 * b + c] = outward[4 * a + c]
