"""Blocks for tests of what stands: a rigid block made by hand, with every interface that an engine's block has."""

import numpy as np

from cranktrain.core.reduced_body import ReducedBody, check, rigid_modes

LINER_UPPER, LINER_LOWER, HEAD = 0.33, 0.16, 0.345  # m along the cylinder from the crank axis


def _skew(r):
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


def rigid_block(engine, crank, mass=320.0, inertia=(25.0, 22.0, 9.0), centre=(0.01, 0.12, 0.4)):
    """Rigid block around ``crank``: mass, principal moments of inertia about its centre of mass, and where that is."""
    names, places = [], []
    for i in range(len(engine.crankshaft.main_widths)):
        names.append(f"bore[{i + 1}]")
        places.append(crank.positions[crank.index(f"main[{i + 1}]")])
    names.append("thrust")
    places.append(crank.positions[crank.index("thrust")])
    for k, pin in enumerate(engine.cylinders.pins):
        bank = engine.cylinders.bank_angles[k]
        along = np.array([-np.sin(bank), np.cos(bank), 0.0])
        z = crank.positions[crank.index(f"pin[{pin}]"), 2] + engine.rod_offsets[k]
        for name, height in (
            (f"liner[{k + 1}].upper", LINER_UPPER),
            (f"liner[{k + 1}].lower", LINER_LOWER),
            (f"head[{k + 1}]", HEAD),
        ):
            names.append(name)
            places.append(height * along + [0.0, 0.0, z])
    for i, place in enumerate(engine.mounts.positions):
        names.append(f"mount[{i + 1}]")
        places.append(place)
    names.append("cover")
    places.append((0.0, -0.2, 0.4))
    places, centre, inertia = np.array(places, dtype=float), np.array(centre), np.diag(inertia)
    arm = _skew(centre)
    matrix = np.zeros((6, 6))
    matrix[:3, :3], matrix[:3, 3:], matrix[3:, :3] = mass * np.eye(3), -mass * arm, mass * arm
    matrix[3:, 3:] = inertia - mass * arm @ arm
    basis = rigid_modes(matrix)
    shapes = np.zeros((len(names), 6, 6))
    for k, place in enumerate(places):
        shapes[k, :3, :3], shapes[k, :3, 3:], shapes[k, 3:, 3:] = np.eye(3), -_skew(place), np.eye(3)
    none = np.zeros((6, 6))
    body = ReducedBody(
        name="rigid block", omega=np.zeros(6), interfaces=tuple(names), positions=places, shapes=shapes @ basis,
        gyroscopic=none, centrifugal=none, stress_stiffness=none, centrifugal_load=np.zeros(6), euler_load=np.zeros(6),
        translation=matrix[:3] @ basis, mass=mass, centre=centre, inertia=matrix[3:, 3:],
    )  # fmt: skip
    check(body)
    return body
