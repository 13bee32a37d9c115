"""Loads that take an input of the run: they act as the engine's own place of it does, or on a camshaft instead."""

from __future__ import annotations

import math

import numpy as np
import pytest
from one_line import one_line

import cranktrain as ct
from cranktrain.core.reduced_body import rigid_body
from cranktrain.dynamics.simulation import Simulation, input_units
from cranktrain.engine.file import load_engine

SPEED = 150.0
VALVES, ALONG = "valvetrain.torque", "flywheel.axial_force"


def outputs(made, topology, steps=144, cycles=2, **inputs):
    """Outputs by name of a run over some cycles with constant inputs, from its start."""
    run = Simulation(made.engine, made.body, made.settings, None, made.parts._replace(topology=topology))
    run.inputs[0] = SPEED
    for name, value in inputs.items():
        run.inputs[list(input_units(made.engine)).index(name)] = value
    run.initialize()
    rows = np.zeros((cycles * steps, run.outputs.size))
    assert run.series(4.0 * math.pi / SPEED / steps, 1, rows) == len(rows)
    return dict(zip(run.output_names, rows.T, strict=True))


def on_crank(name, interface, **data):
    return ct.Topology((), (), (ct.Connection(name, "load", (ct.End("crank", interface), ct.End("ground")), data),))


@pytest.mark.parametrize("engine", ["four_petrol", "diesel_i6"])
@pytest.mark.parametrize(("name", "value", "place"), [
    (VALVES, 25.0, ("pulley", {"torque": (0.0, 0.0, -1.0)})), (ALONG, 400.0, ("flywheel", {"force": (0.0, 0.0, 1.0)})),
])  # fmt: skip
def test_a_load_takes_an_input_from_its_usual_place(engine, name, value, place):
    """Where the engine has it, a load changes nothing; with another factor it is that many times the input."""
    settings = ct.Settings(crank="rigid", bearings="linear", newton_tolerance=1e-9)
    made = ct.assemble(load_engine(engine), settings, inherit=False)
    interface, data = place
    shown = "flywheel.torsion" if name == VALVES else "pulley.axial"
    wanted, none = (outputs(made, None, **{name: one})[shown] for one in (value, 0.0))
    moved = np.abs(wanted - none).max()
    assert moved > 1e-7
    for factor in (1.0, 4.0):
        load = {key: tuple(factor * one for one in values) for key, values in data.items()}
        found = outputs(made, on_crank("v", interface, input=name, **load), **{name: value / factor})[shown]
        assert np.abs(found - wanted).max() < 1e-6 * moved


def test_the_valve_train_loads_a_camshaft_that_a_belt_drives():
    """At half the crank's speed the cam takes twice the torque, by the difference of the strands' tensions."""
    made = ct.assemble(load_engine("diesel_i6"), ct.Settings(crank="rigid", bearings="linear"), inherit=False)
    z = float(made.body.positions[made.body.index("pulley"), 2])
    cam = rigid_body("cam", 4.0, np.diag([5e-3, 5e-3, 4e-3]), (0, 0, z), {"wheel": (0, 0, z)})
    held = {"stiffness": (1e9, 1e9, 1e8), "damping": (2e4, 2e4, 1e3), "turning_stiffness": (1e6, 1e6, 0.0),
            "turning_damping": (1e2, 1e2, 0.0)}  # fmt: skip
    belt = {"radius": 0.05, "stiffness": 4e5, "damping": 60.0, "tension": 600.0}
    ends = ct.End("cam", "wheel"), ct.End("ground")
    links = (
        ct.Connection("belt", "belt", (ct.End("crank", "pulley"), ct.End("cam", "wheel")), belt),
        ct.Connection("bearings", "spring", ends, held),
        ct.Connection("valves", "load", ends, {"torque": (0.0, 0.0, -2.0), "input": VALVES}),
    )
    whole = ct.Topology((ct.Frame("half", 0.5, axis=(0.0, 0.4)),), (ct.Body("cam", cam, "half"),), links)
    found = outputs(made, whole, steps=576, cycles=3, **{VALVES: 12.0})
    assert found["connection[valves].torque.z"] == pytest.approx(-24.0, rel=1e-12)
    on, off = (found[f"connection[belt].tension.{way}"][576:] for way in ("running_on", "running_off"))
    assert (on - off).mean() * 0.1 == pytest.approx(24.0, rel=0.02)


def test_an_input_that_no_run_has_is_told():
    """The nearest name comes with it."""
    made = ct.assemble(load_engine("diesel_i6"), ct.Settings(crank="rigid", bearings="linear"), inherit=False)
    with one_line("connection 'v'", "input", "valvetrain.torque"):
        outputs(made, on_crank("v", "pulley", torque=(0.0, 0.0, 1.0), input="valve.torque"))
