"""Balance of oil at the nodes of a film that ruptures and refills, with its derivatives.

One unknown u per node: u ≥ 0 is the pressure of a full film, P = p₀ u with p₀ = 12 η (R/c)²; u < 0 is minus the void
share of a ruptured one, so that its fill is θ = 1 + u and its pressure zero (Jakobsson–Floberg–Olsson by
complementarity). With H = h/c and ω the journal's speed, the bore at rest, each node balances

    ∂(θH)/∂t + ∂φ(½ω θH − H³ ∂φΠ) − (D/L)² ∂ζ(H³ ∂ζΠ) = 0        (1/s)

on node-centred finite volumes: H³ at the middle of faces, θ from the node upstream, no pressure flow into ruptured
nodes but what their full neighbours press there. The rate has two forms, after what the node was at the step's start:

* full: ∂H/∂t from the velocities of the stage, minus the void share's growth, − |u| H/Δt. A full film thus keeps the
  order of the stage's own rule;
* void: [θH − (θH)_start]/Δt, backward Euler from the start. The oil of ruptured regions is conserved to rounding.

The fill then lies in [0, 1] by itself: it is a mean of what was there and what flows in. H is the floored film
δ₀ + ½[H − δ₀ + √((H − δ₀)² + δ₀²)]: a journal beyond its bore leaves δ₀ open, what carries there is contact. The matrix ∂R/∂u is an M-matrix by columns.
"""

from __future__ import annotations

import math

from cranktrain.film.asperity import HIGHEST, SIGMA, contact_pressure
from cranktrain.film.elastic_grid import CLEARANCE, FLOOR, N_PHI, N_Z, RADIUS, VISCOSITY, WIDTH
from cranktrain.kernel import kernel

# Fields of nodes (both ends included) and of circumferential faces.
FILM, OPEN, SLOPE, BEND, PRESSURE, VOID, FULL, START_MASS, WAS_VOID = 0, 1, 2, 3, 4, 5, 6, 7, 8
OWN, AFTER, BEFORE, SQUEEZE, GROWTH, CONTACT, CONTACT_SLOPE = 9, 10, 11, 12, 13, 14, 15
FACE_OPEN, FACE_SLOPE, FACE_FLUX = 0, 1, 2


@kernel
def pressure_unit(constants):
    """p₀ = 12 η (R/c)² (Pa s)."""
    return 12.0 * constants[VISCOSITY] * (constants[RADIUS] / constants[CLEARANCE]) ** 2


@kernel
def combined(row, shares, columns):
    """Σ row·shares over a multiple of eight columns, summed in pairs: shorter chains than one by one."""
    total = 0.0
    for r in range(0, columns, 8):
        a = row[r] * shares[r] + row[r + 1] * shares[r + 1]
        b = row[r + 2] * shares[r + 2] + row[r + 3] * shares[r + 3]
        c = row[r + 4] * shares[r + 4] + row[r + 5] * shares[r + 5]
        d = row[r + 6] * shares[r + 6] + row[r + 7] * shares[r + 7]
        total += (a + b) + (c + d)
    return total


@kernel
def node_films(film, place, shift, out):
    """Unfloored film H at all nodes and both ends into ``out``.

    ``place`` (4,) position and tilt over the clearance, ``shift`` amplitudes of the shapes over the clearance, filled
    up with zeros to the columns of ``film.shapes``.
    """
    n_phi = int(film.constants[N_PHI])
    lines = int(film.constants[N_Z]) + 2
    columns = film.shapes.shape[1]
    for i in range(n_phi):
        cos = film.trig[i, 0]
        sin = film.trig[i, 1]
        middle = 1.0 - place[0] * cos - place[1] * sin
        tilt = place[2] * cos + place[3] * sin
        for j in range(lines):
            row = film.shapes[i * lines + j]
            total = middle - tilt * film.lines[j, 0]
            total += combined(row, shift, columns)
            out[i * lines + j] = total


@kernel
def face_films(film, place, shift, out):
    """Unfloored film H at the circumferential faces into ``out``."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    columns = film.shapes.shape[1]
    first = n_phi * (n_z + 2)
    for i in range(n_phi):
        cos = film.trig[i, 2]
        sin = film.trig[i, 3]
        middle = 1.0 - place[0] * cos - place[1] * sin
        tilt = place[2] * cos + place[3] * sin
        for j in range(n_z):
            row = film.shapes[first + i * n_z + j]
            total = middle - tilt * film.lines[j + 1, 0]
            total += combined(row, shift, columns)
            out[i * n_z + j] = total


@kernel
def film_start(film, place, shift, start, nodes):
    """Oil (θH) at the start of the step, and which nodes held void then; from the state there."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    floor = film.constants[FLOOR]
    mass = nodes[START_MASS]
    was_void = nodes[WAS_VOID]
    void = False
    for k in range(n_phi * n_z):
        if start[k] < 0.0:
            void = True
            break
    for k in range(n_phi * (n_z + 2)):
        was_void[k] = 0.0
    if not void:
        return
    node_films(film, place, shift, mass)
    for i in range(n_phi):
        for j in range(n_z):
            u = start[i * n_z + j]
            q = i * (n_z + 2) + j + 1
            if u < 0.0:
                above = mass[q] - floor
                fill = 1.0 + u if u > -1.0 else 0.0
                root = math.sqrt(above * above + floor * floor)
                rest = 0.5 * (above + root) if above > 0.0 else 0.5 * floor * floor / (root - above)
                mass[q] = fill * (floor + rest)
                was_void[q] = 1.0


@kernel
def open_films(film, floor, nodes, faces):
    """Floored films with first and second derivative, at nodes and faces; contact pressure, over p₀, with its slope."""
    constants = film.constants
    h = nodes[FILM]
    is_open = nodes[OPEN]
    slope = nodes[SLOPE]
    bend = nodes[BEND]
    for k in range(h.shape[0]):
        above = h[k] - floor
        root = math.sqrt(above * above + floor * floor)
        inverse = 1.0 / root
        # ½(above + root), without cancellation below the floor.
        rest = 0.5 * (above + root) if above > 0.0 else 0.5 * floor * floor / (root - above)
        is_open[k] = floor + rest
        slope[k] = rest * inverse
        bend[k] = 0.5 * floor * floor * inverse * inverse * inverse
    h = faces[FACE_OPEN]
    slope = faces[FACE_SLOPE]
    for k in range(h.shape[0]):
        above = h[k] - floor
        root = math.sqrt(above * above + floor * floor)
        rest = 0.5 * (above + root) if above > 0.0 else 0.5 * floor * floor / (root - above)
        h[k] = floor + rest
        slope[k] = rest / root
    if film.contact[SIGMA] > 0.0:
        c = constants[CLEARANCE]
        unit = 1.0 / pressure_unit(constants)
        reach = HIGHEST * film.contact[SIGMA] / c
        h = nodes[FILM]
        for k in range(h.shape[0]):
            if h[k] < reach:
                p, by_gap, _ = contact_pressure(h[k] * c, film.contact, film.contact_table)
                nodes[CONTACT, k] = p * unit
                nodes[CONTACT_SLOPE, k] = by_gap * c * unit
            else:
                nodes[CONTACT, k] = 0.0
                nodes[CONTACT_SLOPE, k] = 0.0


@kernel
def film_rates(film, pace, shift_rate, nodes):
    """∂H/∂t (1/s) of the unfloored film at nodes that were full at the start, from the velocities of the stage."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    columns = film.shapes.shape[1]
    growth = nodes[GROWTH]
    for i in range(n_phi):
        cos = film.trig[i, 0]
        sin = film.trig[i, 1]
        middle = -pace[0] * cos - pace[1] * sin
        tilt = pace[2] * cos + pace[3] * sin
        for j in range(1, n_z + 1):
            q = i * (n_z + 2) + j
            row = film.shapes[q]
            total = middle - tilt * film.lines[j, 0]
            total += combined(row, shift_rate, columns)
            growth[q] = total


@kernel
def grid_factors(constants):
    """Factors of the balance: 1/Δφ² and (D/L)²/Δζ² of pressure flow, 1/Δφ of transport."""
    per_angle = constants[N_PHI] / (2.0 * math.pi)
    per_zeta = 0.5 * (constants[N_Z] + 1.0)
    ratio = 2.0 * constants[RADIUS] / constants[WIDTH]
    return per_angle * per_angle, ratio * ratio * per_zeta * per_zeta, per_angle


@kernel
def oil_balance(film, half_speed, per_step, nodes, faces, first, band, residual):
    """Residual R (n_phi n_z,) of every node's balance (1/s), the band of ∂R/∂u, and the factors of ∂R/∂H.

    The band's rows start at column ``first`` and go once around: columns of the grid follow each other in the sense of
    rotation. What couples the last column and the first stands where the band would go on, and no solver reads it.
    ``half_speed`` ½ω (rad/s), ``per_step`` 1/Δt (1/s).
    """
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    around, across, per_angle = grid_factors(film.constants)
    forward = half_speed * per_angle if half_speed > 0.0 else 0.0
    backward = -half_speed * per_angle if half_speed < 0.0 else 0.0
    is_open = nodes[OPEN]
    slope = nodes[SLOPE]
    pressure = nodes[PRESSURE]
    void = nodes[VOID]
    full = nodes[FULL]
    height = faces[FACE_OPEN]
    flux = faces[FACE_FLUX]
    face_slope = faces[FACE_SLOPE]
    entries = band.shape[1]
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        up = i - 1 if i > 0 else n_phi - 1
        down = i + 1 if i + 1 < n_phi else 0
        for j in range(n_z):
            q = i * lines + j + 1
            q_up = up * lines + j + 1
            q_down = down * lines + j + 1
            row = band[position * n_z + j]
            for k in range(entries):
                row[k] = 0.0
            f = i * n_z + j
            f_up = up * n_z + j
            if film.supply[f] > 0.0:
                row[n_z] = 1.0
                residual[f] = 0.0
                flux[f] = _face_change(height, face_slope, pressure, void, f, q, q_down, around, forward, backward)
                nodes[OWN, q] = 0.0
                nodes[AFTER, q] = 0.0
                nodes[BEFORE, q] = 0.0
                nodes[SQUEEZE, q] = 0.0
                continue
            h = height[f]
            h_up = height[f_up]
            g = around * h * h * h
            g_up = around * h_up * h_up * h_up
            mean = 0.5 * (is_open[q] + is_open[q + 1])
            mean_before = 0.5 * (is_open[q] + is_open[q - 1])
            side = across * mean * mean * mean
            side_before = across * mean_before * mean_before * mean_before
            p = pressure[q]
            u = void[q]
            after = p - pressure[q + 1]
            before = p - pressure[q - 1]
            total = (
                g * (p - pressure[q_down]) + h * (forward * (1.0 + u) - backward * (1.0 + void[q_down]))
                + g_up * (p - pressure[q_up]) - h_up * (forward * (1.0 + void[q_up]) - backward * (1.0 + u))
                + side * after + side_before * before
            )  # fmt: skip
            by_after = 1.5 * across * mean * mean * after
            by_before = 1.5 * across * mean_before * mean_before * before
            own = slope[q] * (by_after + by_before)
            if nodes[WAS_VOID, q] > 0.0:
                total += ((1.0 + u) * is_open[q] - nodes[START_MASS, q]) * per_step
                own += (1.0 + u) * slope[q] * per_step
                nodes[SQUEEZE, q] = 0.0
            else:
                total += slope[q] * nodes[GROWTH, q] + u * is_open[q] * per_step
                own += nodes[BEND, q] * nodes[GROWTH, q] + u * slope[q] * per_step
                nodes[SQUEEZE, q] = slope[q]
            residual[f] = total
            nodes[OWN, q] = own
            nodes[AFTER, q] = by_after * slope[q + 1]
            nodes[BEFORE, q] = by_before * slope[q - 1]
            flux[f] = _face_change(height, face_slope, pressure, void, f, q, q_down, around, forward, backward)
            if full[q] > 0.0:
                row[n_z] = g + g_up + side + side_before
            else:
                row[n_z] = is_open[q] * per_step + forward * h + backward * h_up
            if j > 0 and full[q - 1] > 0.0:
                row[n_z - 1] = -side_before
            if j < n_z - 1 and full[q + 1] > 0.0:
                row[n_z + 1] = -side
            row[0] = -g_up if full[q_up] > 0.0 else -forward * h_up
            row[2 * n_z] = -g if full[q_down] > 0.0 else -backward * h


@kernel
def _face_change(height, face_slope, pressure, void, f, q, q_down, around, forward, backward):
    """Derivative of the flux through the face behind node q by the unfloored film there."""
    h = height[f]
    driven = forward * (1.0 + void[q]) - backward * (1.0 + void[q_down])
    return face_slope[f] * (3.0 * around * h * h * (pressure[q] - pressure[q_down]) + driven)


@kernel
def shape_sources(film, per_gain, nodes, faces, first, block, columns):
    """−∂R/∂δ of eight columns of shapes, from column 8 ``block`` on, into ``columns`` (n_phi n_z, 8), in band order.

    ``per_gain`` 1/g: the shapes' velocities follow their amplitudes by the stage's own rule.
    """
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    flux = faces[FACE_FLUX]
    start = n_phi * lines
    at = 8 * block
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        up = i - 1 if i > 0 else n_phi - 1
        for j in range(n_z):
            q = i * lines + j + 1
            target = columns[position * n_z + j]
            if film.supply[i * n_z + j] > 0.0:
                for r in range(8):
                    target[r] = 0.0
                continue
            own = nodes[OWN, q] + per_gain * nodes[SQUEEZE, q]
            after = nodes[AFTER, q]
            before = nodes[BEFORE, q]
            out = flux[i * n_z + j]
            into = flux[up * n_z + j]
            here = film.shapes[q]
            right = film.shapes[q + 1]
            left = film.shapes[q - 1]
            face = film.shapes[start + i * n_z + j]
            face_up = film.shapes[start + up * n_z + j]
            for half in range(0, 8, 4):
                k = at + half
                c0 = into * face_up[k] - out * face[k] - own * here[k] - after * right[k] - before * left[k]
                k += 1
                c1 = into * face_up[k] - out * face[k] - own * here[k] - after * right[k] - before * left[k]
                k += 1
                c2 = into * face_up[k] - out * face[k] - own * here[k] - after * right[k] - before * left[k]
                k += 1
                c3 = into * face_up[k] - out * face[k] - own * here[k] - after * right[k] - before * left[k]
                target[half] = c0
                target[half + 1] = c1
                target[half + 2] = c2
                target[half + 3] = c3


@kernel
def motion_sources(film, nodes, faces, first, columns):
    """−∂R/∂(x, y, a, b) and −∂R/∂(vx, vy, va, vb), all over the clearance, into ``columns`` (n_phi n_z, 8)."""
    n_phi = int(film.constants[N_PHI])
    n_z = int(film.constants[N_Z])
    lines = n_z + 2
    flux = faces[FACE_FLUX]
    for position in range(n_phi):
        i = first + position
        if i >= n_phi:
            i -= n_phi
        up = i - 1 if i > 0 else n_phi - 1
        cos = film.trig[i, 0]
        sin = film.trig[i, 1]
        for j in range(n_z):
            q = i * lines + j + 1
            target = columns[position * n_z + j]
            if film.supply[i * n_z + j] > 0.0:
                for r in range(8):
                    target[r] = 0.0
                continue
            zeta = film.lines[j + 1, 0]
            own = nodes[OWN, q]
            after = nodes[AFTER, q]
            before = nodes[BEFORE, q]
            out = flux[i * n_z + j]
            into = flux[up * n_z + j]
            # A displacement closes the film: the shapes of x, y, a, b are −cos φ, −sin φ, −ζ cos φ, −ζ sin φ.
            sides = own + after + before
            tilted = own * zeta + after * film.lines[j + 2, 0] + before * film.lines[j, 0]
            by_x = out * film.trig[i, 2] - into * film.trig[up, 2]
            by_y = out * film.trig[i, 3] - into * film.trig[up, 3]
            target[0] = by_x + sides * cos
            target[1] = by_y + sides * sin
            target[2] = by_x * zeta + tilted * cos
            target[3] = by_y * zeta + tilted * sin
            squeeze = nodes[SQUEEZE, q]
            target[4] = squeeze * cos
            target[5] = squeeze * sin
            target[6] = squeeze * zeta * cos
            target[7] = squeeze * zeta * sin
