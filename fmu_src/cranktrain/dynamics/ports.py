"""Ports: the components of motion at which force laws act, and which law couples which of them.

Ports come in this order:

1. x and y of each main journal,
2. z of the thrust collar,
3. x and y of each crank pin,
4. x and y of each rod's big end, where films carry it,
5. where films feel tilt: the journals' ends against their middle, x and y (slope times half the width, m), and the
   collar's rotations about x and y (rad),
6. z-rotation of each pin, z-rotation of each main journal.

All but the last group are unknowns of a stage's Newton iteration. A *connection* is one force law with the Newton ports
it couples; connections come as main journals, crank pins (or the films of the big ends), thrust bearing, rods of free
big ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cranktrain.engine import Engine
from cranktrain.reduced_body import Array, ReducedBody

# Columns of the layout: first port of rods, of tilts (0: none), connection of the thrust bearing and of the first rod,
# modes of the crank.
RODS, TILTS, THRUST_LAW, ROD_LAWS, CRANK_MODES = range(5)
PIN_SCALE = 1.0e-4
"""Displacement of a pin that counts as much as a clearance, m."""


class Ports(NamedTuple):
    """Shapes (m, n) of the ports, connections (k, 5), scales (n_newton,) and layout (5,)."""

    shapes: Array
    connections: Array
    scales: Array
    layout: Array


def lay_ports(engine: Engine, body: ReducedBody, crank_modes: int, tilted: bool, free_big_ends: bool) -> Ports:
    """Lay out the ports of an engine's crankshaft; ``body`` holds ``rod[i]`` too where big ends are free."""
    mains = [body.index(f"main[{i + 1}]") for i in range(len(engine.crankshaft.main_widths))]
    pins = [body.index(f"pin[{i + 1}]") for i in range(len(engine.crankshaft.throw_angles))]
    rods = [body.index(f"rod[{i + 1}]") for i in range(engine.n_cylinders)] if free_big_ends else []
    collar = body.index("thrust")
    shapes = body.shapes
    b, p, half_width = len(mains), len(pins), 0.5 * engine.main_bearing.width
    clearance = engine.main_bearing.clearance
    rows = [shapes[k, :2] for k in mains] + [shapes[collar, 2:3]] + [shapes[k, :2] for k in (*pins, *rods)]
    scales = [clearance] * (2 * b) + [0.5 * engine.thrust.clearance]
    scales += [PIN_SCALE] * (2 * p)
    if engine.big_end_bearing is not None:
        scales += [engine.big_end_bearing.clearance] * (2 * len(rods))
    first_pin = 2 * b + 1
    first_rod = first_pin + 2 * p
    tilts = len(scales)
    laws = [[2 * i, 2 * i + 1] for i in range(b)]
    if rods:
        for c, pin in enumerate(engine.cylinders.pins):
            pin_port, rod_port = first_pin + 2 * (pin - 1), first_rod + 2 * c
            laws.append([pin_port, pin_port + 1, rod_port, rod_port + 1])
    else:
        laws += [[first_pin + 2 * k, first_pin + 2 * k + 1] for k in range(p)]
    thrust_law = len(laws)
    laws.append([2 * b])
    rod_laws = len(laws)
    laws += [[first_rod + 2 * c, first_rod + 2 * c + 1] for c in range(len(rods))]
    if tilted:
        rows += [half_width * np.array([shapes[k, 4], -shapes[k, 3]]) for k in mains] + [shapes[collar, 3:5]]
        radius = 0.25 * (engine.thrust.inner_diameter + engine.thrust.outer_diameter)
        scales += [clearance] * (2 * b) + [0.5 * engine.thrust.clearance / radius] * 2
        for i in range(b):
            laws[i] += [tilts + 2 * i, tilts + 2 * i + 1]
        laws[thrust_law] += [tilts + 2 * b, tilts + 2 * b + 1]
    rows += [shapes[k, 5:6] for k in (*pins, *mains)]
    table = np.zeros((len(laws), 5))
    for row, law in zip(table, laws, strict=True):
        row[0] = len(law)
        row[1 : 1 + len(law)] = law
    return Ports(
        shapes=np.ascontiguousarray(np.concatenate(rows)),
        connections=table,
        scales=np.array(scales),
        layout=np.array([first_rod, tilts if tilted else 0, thrust_law, rod_laws, crank_modes], dtype=np.float64),
    )
