"""Bodies and engines for tests of the dynamics: the six on a coarse mesh, and lumped cranks made by hand."""

from dataclasses import replace
from functools import cache

import numpy as np

import cranktrain as ct
from cranktrain.engine.file import load_engine

COARSE = 0.025  # m, the mesh of tests/fmu: the tests share its cached crankshaft


def free_six():
    """The six without its axial path: only its collar holds the crank along the axis, as laws alone are tested."""
    return replace(load_engine("diesel_i6"), axial_path=None)


@cache
def six():
    """:func:`free_six` and its running body, from a coarse mesh."""
    from cranktrain.structure.crank.reduction import running_body

    engine = free_six()
    engine = replace(engine, crankshaft=replace(engine.crankshaft, mesh_size=COARSE))
    return engine, running_body(engine)


def whole_six():
    """The engine of :func:`six` with its axial path, and the same body."""
    engine, body = six()
    return replace(engine, axial_path=load_engine("diesel_i6").axial_path), body


def joined(name, law, ends, **data):
    """A connection of an added body: ``ends`` are "a.gear crank.flywheel", a single one is joined to ground."""
    first, second = (*ends.split(), "ground")[:2]
    return ct.Connection(name, law, (ct.End(*first.split(".")), ct.End(*second.split("."))), data)


def rigid_crank(engine, mass=80.0, inertia=(6.0, 6.0, 1.4), centre=(0.0, 0.0, 0.35), pitch=0.128):
    """Rigid body with the engine's interfaces; inertia (3,) or (3, 3) about its centre of mass."""
    c = engine.crankshaft
    throws = len(c.throw_angles)
    places = {f"main[{i + 1}]": (0.0, 0.0, pitch * i) for i in range(throws + 1)}
    for i, angle in enumerate(c.throw_angles):
        places[f"pin[{i + 1}]"] = (-c.throw * np.sin(angle), c.throw * np.cos(angle), pitch * (i + 0.5))
    places |= {
        "pulley": (0.0, 0.0, -0.08),
        "flywheel": (0.0, 0.0, pitch * throws + 0.04),
        "thrust": (0.0, 0.0, pitch * 3),
    }
    tensor = np.diag(inertia) if np.ndim(inertia) == 1 else np.array(inertia)
    return ct.rigid_body("rigid crank", mass, tensor, centre, places)


def started(speed, engine=None, parts=None, **settings):
    """A simulation of a rigid crank, that of :func:`free_six` if none is named, initialized at a speed, rad/s."""
    from cranktrain.dynamics.simulation import Parts, Settings, Simulation

    engine = engine or free_six()
    chosen = Settings(**{"crank": "rigid", **settings})
    simulation = Simulation(engine, rigid_crank(engine), chosen, parts=parts or Parts())
    simulation.inputs[0] = speed
    simulation.initialize()
    return simulation


def series(simulation, steps, per_cycle):
    """Outputs by name over the next so many steps, ``per_cycle`` of them a cycle at the speed of the start."""
    rows = np.zeros((steps, simulation.outputs.size))
    assert simulation.series(4.0 * np.pi / simulation.inputs[0] / per_cycle, 1, rows) == steps
    return dict(zip(simulation.output_names, rows.T, strict=True))
