"""Blocks for tests of what stands: a rigid block made by hand, with every interface that an engine's block has."""

import numpy as np

from cranktrain.core.reduced_body import rigid_body

LINER_UPPER, LINER_LOWER, HEAD = 0.33, 0.16, 0.345  # m along the cylinder from the crank axis


def rigid_block(engine, crank, mass=320.0, inertia=(25.0, 22.0, 9.0), centre=(0.01, 0.12, 0.4)):
    """Rigid block around ``crank``: mass, principal moments of inertia about its centre of mass, and where that is."""
    places = {f"bore[{i + 1}]": crank.positions[crank.index(f"main[{i + 1}]")]
              for i in range(len(engine.crankshaft.main_widths))}  # fmt: skip
    places["thrust"] = crank.positions[crank.index("thrust")]
    for k, pin in enumerate(engine.cylinders.pins):
        bank = engine.cylinders.bank_angles[k]
        along = np.array([-np.sin(bank), np.cos(bank), 0.0])
        z = crank.positions[crank.index(f"pin[{pin}]"), 2] + engine.rod_offsets[k]
        for name, height in (("liner[{}].upper", LINER_UPPER), ("liner[{}].lower", LINER_LOWER), ("head[{}]", HEAD)):
            places[name.format(k + 1)] = height * along + [0.0, 0.0, z]
    places |= {f"mount[{i}]": place for i, place in enumerate(engine.mounts.positions, 1)} | {"cover": (0.0, -0.2, 0.4)}
    return rigid_body("rigid block", mass, np.diag(inertia), centre, places)
