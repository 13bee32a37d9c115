"""Rods of an engine as bodies of their own: forces, energy, cut loads, slow modes."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache

import entry
import numpy as np
import pytest
from bodies import series
from rods import FOUR, rods_of
from started import at_speed

import cranktrain as ct
from cranktrain.dynamics.settled.slow_modes import SlowModes
from cranktrain.dynamics.simulation import Simulation, simulate
from cranktrain.engine.file import load_engine
from cranktrain.results.strength.cut_loads import unbalanced_share
from cranktrain.results.strength.recorded_cycle import recorded_cycle
from cranktrain.results.summary import run_summary


@cache
def both(name, cylinders, block="ground", rpm=1500.0):
    """A run of an engine's own rods, and one in which some are bodies."""
    engine = load_engine(FOUR if name == "four" else name)
    engine = replace(engine, frame=(), body=(), connection=(), axial_path=None)
    settings = ct.Settings(crank="beam", block=block, step=math.radians(1.25))
    made = ct.assemble(engine, settings, inherit=False)
    more = rods_of(engine, made.body, cylinders, made.parts.block if block == "flexible" else None)
    speed = rpm * math.pi / 30.0
    return [simulate(made.engine, made.body, made.settings, speed, parts=parts, settle=1e-6)
            for parts in (made.parts, made.parts._replace(topology=more))]  # fmt: skip


@pytest.mark.parametrize(("name", "cylinders"), [("four", (2,)), ("diesel_i6", (6,)), ("diesel_v8", (3,))])
def test_a_rod_as_body_does_to_the_engine_what_the_engines_own_does(name, cylinders):
    """Carried by a film and a stiff guide: forces within 2 % of the largest, torque and torsion within 3 %."""
    own, added = both(name, cylinders)
    mains = [key for key in own.outputs if re.fullmatch(r"bearing\[\d+\]\.force\.[xy]", key)]
    largest = max(np.ptp(own.outputs[key]) for key in mains)
    for key in mains:
        assert np.abs(own.outputs[key] - added.outputs[key]).max() < 0.02 * largest, key
    for key in ("shaft.torque", "pulley.torsion"):
        assert np.abs(own.outputs[key] - added.outputs[key]).max() < 0.03 * np.ptp(own.outputs[key]), key


def test_a_replaced_piston_leaves_no_mass_of_its_own_in_the_block():
    """Across its cylinder the engine has its guided pistons' mass, less that of the added one's."""
    engine = replace(load_engine(FOUR), frame=(), body=(), connection=(), axial_path=None)
    made = ct.assemble(engine, ct.Settings(crank="beam", block="flexible"), inherit=False)
    more = rods_of(engine, made.body, (2,), made.parts.block)
    mass = engine.cylinders.piston_mass + engine.rod.small_end_mass
    for topology, guided in ((ct.Topology(), (1, 2, 3, 4)), (more, (1, 3, 4))):
        parts = made.parts._replace(topology=topology)
        run = at_speed(150.0, made.engine, made.body, made.settings, None, parts)
        across = np.concatenate([entry.translation(run)[0, entry.modes(run, f"piston[{c}]")] for c in guided])
        assert across @ across == pytest.approx(len(guided) * mass, rel=1e-12)
        assert entry.guided(run.model) == list(guided)


@pytest.mark.parametrize(("block", "left"), [("ground", 5e-6), ("flexible", 3e-4)])
def test_energy_of_rods_as_bodies_closes(block, left):
    """Over a cycle that repeats; gas does as much work on four added pistons as on the engine's own."""
    own, added = (run_summary(run, "")["energy"] for run in both("four", (1, 2, 3, 4), block, 3000.0))
    assert abs(added["residual_of_gas_work"]) < left
    assert added["gas_work_j"] == pytest.approx(own["gas_work_j"], rel=0.01)


@pytest.mark.parametrize("added", ["balancers", "rods"])
def test_cut_loads_with_added_connections_balance(added):
    """Forces of gears and films at the crank's interfaces, and its inertia: balanced to what the run solves to."""
    engine = load_engine(FOUR)
    if added == "rods":
        engine = replace(engine, frame=(), body=(), connection=())
    made = ct.assemble(engine, ct.Settings(crank="beam", block="ground", newton_tolerance=1e-11), inherit=False)
    more = rods_of(engine, made.body, (1, 2, 3, 4), None) if added == "rods" else None
    run = Simulation(engine, made.body, made.settings, None, made.parts._replace(topology=more))
    run.inputs[0] = 300.0
    cycle = recorded_cycle(run, engine, 0.5)
    assert list(cycle.added) == (["main[3]"] if added == "balancers" else [f"pin[{k}]" for k in range(1, 5)])
    assert np.abs(np.concatenate([*cycle.added.values()])).max() > 500.0
    assert unbalanced_share(cycle) < 1e-5


def test_slow_modes_leave_rods_on_their_pins():
    """Drive line and block move them as the mechanism does: no joint opens, none but what slides along has a rate."""
    engine = replace(load_engine(FOUR), frame=(), body=(), connection=())
    made = ct.assemble(engine, ct.Settings(crank="beam", block="flexible"), inherit=False)
    top = rods_of(engine, made.body, (1, 2, 3, 4), made.parts.block)
    speed = 300.0
    run = at_speed(speed, engine, made.body, made.settings, None, made.parts._replace(topology=top))
    modes, block = SlowModes(run.model, speed), made.parts.block
    assert modes.drive_line is not None and modes.block is not None
    turns = np.abs(block.shapes[block.index("bore[1]"), 5, :6]) > 1e-3  # a rigid mode of the block that rolls
    cases = [(modes.drive_line, k, True) for k in range(4)]
    cases += [(modes.block, k, k >= 6 or turns[k]) for k in range(12) if k % 6 not in (3, 4)]
    for part, k, has_rates in cases:
        y = np.eye(part.matrix.shape[0])[k]
        motion = part.lift(y)
        found = entry.openings(run, motion.place, motion.velocity, 0.0, speed)
        for connection in top.connections:
            place, rate = found[connection.name]
            assert np.abs(place).max() < 1e-9
            if has_rates and connection.name.startswith(("big", "small")):
                assert np.abs(rate[:2]).max() < 1e-9 * speed


def test_a_wall_leans_for_either_order_of_its_ends():
    """A guide between piston and liner, stated from the piston or from the block, does the same to both."""
    engine = replace(load_engine(FOUR), frame=(), body=(), connection=())
    made = ct.assemble(engine, ct.Settings(crank="beam", block="flexible"), inherit=False)
    guide = {"stiffness": (5e7, 0.0, 0.0), "damping": (1e4, 0.0, 0.0), "turning_stiffness": (0.0, 0.0, 1e5)}
    found = []
    for turned in (False, True):
        top = rods_of(engine, made.body, (2,), made.parts.block)
        skirt = next(one for one in top.connections if one.name == "skirt 2")
        ends = skirt.ends[::-1] if turned else skirt.ends
        others = tuple(one for one in top.connections if one is not skirt)
        top = replace(top, connections=(*others, replace(skirt, law="spring", ends=ends, data=guide)))
        run = at_speed(300.0, engine, made.body, made.settings, None, made.parts._replace(topology=top))
        found.append(series(run, 144, 288))
    for name in ("piston[2].position.x", "mount[1].force.y"):
        assert np.abs(found[0][name] - found[1][name]).max() < 1e-6 * np.ptp(found[0][name])
