"""Rods and pistons as bodies: their frames, runs beside an engine that they do not touch, and those of an engine."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import entry
import numpy as np
from bodies import rigid_crank
from started import at_speed

import cranktrain as ct
from cranktrain.core.reduced_body import rigid_body
from cranktrain.dynamics.simulation import Parts
from cranktrain.engine.file import load_engine

FOUR = Path(__file__).parents[1] / "examples" / "four_with_balancers.toml"


def pair(ratio, slider, axis):
    """Frames of a crank, its rod and its piston."""
    return (
        ct.Frame("crank of it", ratio, axis=axis),
        ct.Frame("rod", ratio, axis=axis, slider=slider),
        ct.Frame("piston", ratio, axis=axis, slider=replace(slider, piston=True)),
    )


def rotation(angle):
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


@cache
def plain_engine():
    """An engine to run beside, whose frame turns evenly."""
    engine = replace(load_engine("diesel_i6"), axial_path=None)
    return replace(engine, drive_line=replace(engine.drive_line, stiffness=1e12)), rigid_crank(engine)


def beside(topology, speed, tables=(), **chosen):
    """A run of a topology beside an engine that it does not touch, at its start; ``tables`` are those of its films."""
    engine, crank = plain_engine()
    settings = ct.Settings(crank="rigid", block="ground", gas_load=0.0, **chosen)
    return at_speed(speed, engine, crank, settings, None, Parts(topology=topology, film_tables=tables))


def part(run, state, body):
    """Modal places, velocities and accelerations (3, n) of an added body, a view of a state."""
    return entry.motion(run, state)[:, entry.modes(run, body)]


def in_space(run, frame, body, angle, rate):
    """Displacement across (m), rotation (rad) of an added body and their rates, (2, 3), in axes at rest.

    Its frame stands at an angle (rad) in space and turns at a rate (rad/s).
    """
    q, v, _ = part(run, run.state, body.name)
    across, turn = body.reduced.translation[:2] / body.reduced.mass, body.reduced.shapes[0, 5]
    axes = np.diag([1.0, frame.sense]) @ rotation(frame.sense * angle)
    place, swept = across @ q, frame.sense * rate * np.array([[0.0, -1.0], [1.0, 0.0]]) @ (across @ q)
    return np.array(
        [[*(axes @ place), frame.sense * (turn @ q)], [*(axes @ (across @ v + swept)), frame.sense * (turn @ v)]]
    )


def teeth(place, rate, apart, arms, stiffness, damping, play):
    """Loads (2, 3) in the plane of a gear mesh with backlash (m) on two bodies, by their motion (2, 3): x, y and angle.

    The second axis lies ``apart`` (m) from the first, the point of contact at ``arms`` (m) from both along that line.
    """
    towards, normal = np.array(apart) / np.hypot(*apart), (math.cos(math.radians(20.0)), math.sin(math.radians(20.0)))
    loads = np.zeros((2, 3))
    for side in (1.0, -1.0):
        way = side * normal[0] * np.array([-towards[1], towards[0]]) + normal[1] * towards
        rows = np.array([[*way, arm * (towards[0] * way[1] - towards[1] * way[0])] for arm in arms])
        gap, closing = (motion[0] @ rows[0] - motion[1] @ rows[1] for motion in (place, rate))
        pressed = gap - 0.5 * play * normal[0]
        root = math.hypot(pressed, 1e-7)
        force = 0.5 * stiffness * (pressed + root) + damping * 0.5 * (1.0 + pressed / root) * closing
        loads += force * rows * [[-1.0], [1.0]]
    return loads


def rods_of(engine, crank, cylinders, block):
    """Rods and pistons of cylinders as bodies, with the masses of the engine's own, between films and liners."""
    rod, hold = engine.rod, {"stiffness": (0.0, 0.0, 1e6), "damping": (0.0, 0.0, 1e2)}
    held = hold | {"turning_stiffness": (1e4, 1e4, 0.0), "turning_damping": (10.0, 10.0, 0.0)}
    bearing = {f.name: getattr(engine.big_end_bearing, f.name) for f in fields(engine.big_end_bearing)}
    if engine.piston_guidance is not None:
        names = [f.name for f in fields(engine.piston_guidance) if f.name not in ("mass_height", "tilt_inertia")]
        skirt = {name: getattr(engine.piston_guidance, name) for name in names}
    frames, bodies, connections = [], [], []
    for c in cylinders:
        angle = engine.crankshaft.throw_angles[engine.cylinders.pins[c - 1] - 1]
        pin = engine.crankshaft.throw * np.array([-math.sin(angle), math.cos(angle)])
        beside = engine.rod_offsets[c - 1]
        z = float(crank.positions[crank.index(f"pin[{engine.cylinders.pins[c - 1]}]"), 2]) + beside
        slider = ct.Slider((float(pin[0]), float(pin[1])), rod.length, engine.cylinders.bank_angles[c - 1],
                           engine.cylinders.pin_offset, cylinder=c)  # fmt: skip
        frames += [ct.Frame(f"rod {c}", slider=slider, ratio=1.0),
                   ct.Frame(f"piston {c}", slider=replace(slider, piston=True), ratio=1.0)]  # fmt: skip
        mass, tilt = (
            rod.big_end_mass + rod.small_end_mass,
            1e-3 if block is None else engine.piston_guidance.tilt_inertia,
        )
        own = rigid_body(
            f"rod[{c}]", mass, np.diag([rod.inertia, 0.2 * rod.inertia, rod.inertia]),
            (0.0, rod.small_end_mass / mass * rod.length, z), {"big": (0, 0, z), "small": (0, rod.length, z)},
        )  # fmt: skip
        piston = rigid_body(
            f"piston[{c}]", engine.cylinders.piston_mass, tilt * np.eye(3), (0, 0, z), {"pin": (0, 0, z)}
        )
        bodies += [ct.Body(f"rod[{c}]", own, f"rod {c}"), ct.Body(f"piston[{c}]", piston, f"piston {c}")]
        big, small = ct.End(f"rod[{c}]", "big"), ct.End(f"rod[{c}]", "small")
        on_crank, on_piston = (
            ct.End("crank", f"pin[{engine.cylinders.pins[c - 1]}]", (0, 0, beside)),
            ct.End(f"piston[{c}]", "pin"),
        )
        wall, head = ((ct.End("ground"),) * 2 if block is None
                      else (ct.End("block", f"liner[{c}].upper"), ct.End("block", f"head[{c}]")))  # fmt: skip
        rigid = {"stiffness": (2e9, 2e9, 0.0), "damping": (2e4, 2e4, 0.0)}
        guide = {
            "stiffness": (5e8, 0.0, 0.0),
            "damping": (1e4, 0.0, 0.0),
            "turning_stiffness": (0.0, 0.0, 1e5),
            "turning_damping": (0.0, 0.0, 20.0),
        }
        connections += [
            ct.Connection(f"big {c}", "film", (on_crank, big), bearing | {"level": "impedance"}),
            ct.Connection(f"along {c}", "spring", (on_crank, big), held),
            ct.Connection(f"small {c}", "spring", (on_piston, small), rigid | {"stiffness": (2e9, 2e9, 1e6)}),
            ct.Connection(f"gas {c}", "gas", (on_piston, head), {"bore": engine.cylinders.bore, "cylinder": c}),
            ct.Connection(f"tilt {c}", "spring", (on_piston, wall), held),
            ct.Connection(f"skirt {c}", *(("spring", (on_piston, wall), guide) if block is None
                                          else ("liner", (on_piston, wall), skirt))),
        ]  # fmt: skip
    return ct.Topology(tuple(frames), tuple(bodies), tuple(connections))
