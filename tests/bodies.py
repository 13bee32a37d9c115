"""Bodies and engines for tests of the dynamics: the six on a coarse mesh, and lumped cranks made by hand."""

from dataclasses import replace
from functools import cache

import numpy as np

import cranktrain as ct
from cranktrain.core.reduced_body import ReducedBody, check
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


def _skew(r):
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


def rigid_crank(engine, mass=80.0, inertia=(6.0, 6.0, 1.4), centre=(0.0, 0.0, 0.35), pitch=0.128):
    """Rigid body with the engine's interfaces, from mass, inertia (3,) or (3, 3) about its centre, and centre of mass.

    G, C, K_σ − C, f_c and f_e are the integrals of the rigid modes, written out with the second moments.
    """
    c = engine.crankshaft
    throws = len(c.throw_angles)
    names, places = [], []
    for i in range(throws + 1):
        names.append(f"main[{i + 1}]")
        places.append((0.0, 0.0, pitch * i))
    for i, angle in enumerate(c.throw_angles):
        names.append(f"pin[{i + 1}]")
        places.append((-c.throw * np.sin(angle), c.throw * np.cos(angle), pitch * (i + 0.5)))
    names += ["pulley", "flywheel", "thrust"]
    places += [(0.0, 0.0, -0.08), (0.0, 0.0, pitch * throws + 0.04), (0.0, 0.0, pitch * 3)]
    places, centre = np.array(places), np.array(centre)
    inertia = np.diag(inertia) if np.ndim(inertia) == 1 else np.array(inertia)
    # Second moments ∫ρ X Xᵀ about the origin, and the inertia about it.
    about = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    second = about + mass * np.outer(centre, centre)
    origin = np.trace(second) * np.eye(3) - second
    turn = _skew((0.0, 0.0, 1.0))
    flat = np.diag([1.0, 1.0, 0.0])
    eye = np.eye(3)
    # Fields as u = B [1, X]: six motions of the origin.
    fields = np.zeros((6, 3, 4))
    for k in range(3):
        fields[k, k, 0] = 1.0
        fields[3 + k, :, 1:] = _skew(eye[k])
    moments = np.zeros((4, 4))
    moments[0, 0], moments[0, 1:], moments[1:, 0], moments[1:, 1:] = mass, mass * centre, mass * centre, second
    position = np.hstack((np.zeros((3, 1)), eye))

    def paired(a, b):
        return np.einsum("iab,bc,jac->ij", a, moments, b)

    turned = turn @ fields
    mass_matrix = paired(fields, fields)
    order = [5, 0, 1, 2, 3, 4]
    factor = np.linalg.cholesky(mass_matrix[np.ix_(order, order)])
    basis = np.zeros((6, 6))
    basis[np.ix_(order, order)] = np.linalg.inv(factor).T
    centrifugal = paired(turned, turned)
    stress = np.zeros((6, 6))
    # Work of the centrifugal load on the second-order motion of a rotation: see reduced_body's docstring.
    load = second @ flat
    stress[3:, 3:] = np.trace(load) * eye - 0.5 * (load + load.T)
    stress[5, :] = stress[:, 5] = centrifugal[5]
    shapes = np.zeros((len(names), 6, 6))
    for k, place in enumerate(places):
        shapes[k, :3, :3], shapes[k, :3, 3:], shapes[k, 3:, 3:] = eye, -_skew(place), eye
    body = ReducedBody(
        name="rigid crank",
        omega=np.zeros(6),
        interfaces=tuple(names),
        positions=places,
        shapes=shapes @ basis,
        gyroscopic=basis.T @ paired(fields, turned) @ basis,
        centrifugal=basis.T @ centrifugal @ basis,
        stress_stiffness=basis.T @ stress @ basis,
        centrifugal_load=basis.T @ paired(fields, (flat @ position)[None])[:, 0],
        euler_load=basis.T @ paired(fields, (turn @ position)[None])[:, 0],
        translation=(moments[0] @ fields.transpose(0, 2, 1)).T @ basis,
        mass=mass,
        centre=centre,
        inertia=origin,
    )
    check(body)
    return body


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
