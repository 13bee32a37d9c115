"""Fillets of one throw by sub-models and on the whole crank, refined at the same fillet, under the same static loads.

``python benchmarks/fillet_stress.py [FINENESS [PLACE …]]``: a crank of one throw hangs free under rod and bearing
forces and turns; its coarse solution drives the sub-models, by the cuts' motion and by their resultants. Peaks of von
Mises stress by case and place, MPa, and least over largest principal stress at the refined peak.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cranktrain.core.threads import one_thread
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.structure.crank.reduction import crankshaft_interfaces
from cranktrain.structure.crank.shape import fillet_ends
from cranktrain.structure.fem.craig_bampton import Flexibility, rigid_motions
from cranktrain.structure.fem.elasticity import component_dofs, finite_elements, sample, scalar_basis
from cranktrain.structure.fem.interfaces import InterfaceSet
from cranktrain.structure.fem.mesh import crankshaft_mesh
from cranktrain.structure.stress.features import surface_features
from cranktrain.structure.stress.fillet_factors import free_surface
from cranktrain.structure.stress.nodal_stress import NodalStress, von_mises
from cranktrain.structure.stress.sub_model import CUTS, cut_places, fillet_modes
from cranktrain.structure.stress.throw_mesh import throw_places

SPEED = 230.0
LOADS = {
    "bending": {"pin[1]": (0.0, -6e4, 0, 0, 0, 0), "main[1]": (0, 3e4, 0, 0, 0, 0), "main[2]": (0, 3e4, 0, 0, 0, 0)},
    "torsion": {"pulley": (0, 0, 0, 0, 0, 1e3), "flywheel": (0, 0, 0, 0, 0, -1e3)},
    "inertia": {"pin[1]": (0, 0, 0, 0, 0, 0)},
}


def one_throw(mesh_size: float = 0.018) -> Engine:
    """The six's first throw alone."""
    engine = load_engine("diesel_i6")
    c = replace(
        engine.crankshaft, throw_angles=(0.0,), main_widths=(0.04, 0.04), counterweights=(True, True),
        mesh_size=mesh_size,
    )  # fmt: skip
    return replace(engine, crankshaft=c, thrust=replace(engine.thrust, main=1))


def wrenches(interfaces: InterfaceSet) -> np.ndarray:
    """Loads (m, 6, cases) by interface."""
    return np.stack([[case.get(name, np.zeros(6)) for name in interfaces.names] for case in LOADS.values()], axis=2)


def solved(model, interfaces, speeds):
    """Displacement (ndof, cases) with inertia relief, rigid acceleration (cases, 6) of the origin, loads (m, 6, cases).

    The crank turns steadily; what its loads lack of balance accelerates it.
    """
    with one_thread():
        free = Flexibility.of(model.stiffness, model.mass, rigid_motions(model), model.positions)
        loads = wrenches(interfaces)
        outward = model.mass @ sample(model, lambda x: x * np.array([[1.0], [1.0], [0.0]]))
        force = interfaces.averaging.T @ loads.reshape(-1, loads.shape[2]) + np.outer(outward, speeds**2)
        motions = rigid_motions(model)
        return free.solve(force), np.linalg.solve(motions.T @ (model.mass @ motions), motions.T @ force).T, loads


def cut_wrenches(model, interfaces, loads, acceleration, speeds, crankshaft):
    """Force and moment (cases, 12) about either cut's middle of all beyond it, loads and inertia."""
    elements = scalar_basis(model.mesh)
    points, weights = np.asarray(elements.global_coordinates()).reshape(3, -1).T, elements.dx.ravel()
    weights = model.material.density * weights
    found = []
    for z, side in zip(cut_places(crankshaft, 1), (-1.0, 1.0), strict=True):
        beyond, middle = side * (points[:, 2] - z) > 0.0, np.array([0.0, 0.0, z])
        for case, speed in enumerate(speeds):
            x = points[beyond]
            field = acceleration[case, :3] + np.cross(acceleration[case, 3:], x) - speed**2 * x * [1.0, 1.0, 0.0]
            inertia = -weights[beyond, None] * field
            wrench = np.concatenate((inertia.sum(axis=0), np.cross(x - middle, inertia).sum(axis=0)))
            for k, place in enumerate(interfaces.positions):
                if side * (place[2] - z) > -1e-3:
                    force, moment = loads[k, :3, case], loads[k, 3:, case]
                    wrench += np.concatenate((force, moment + np.cross(place - middle, force)))
            found.append(wrench)
    return np.hstack((found[: len(speeds)], found[len(speeds) :]))


def peaks(crankshaft, points, stress, place):
    """Greatest von Mises stress (cases) at a fillet, MPa, and least over largest principal stress there."""
    names, number = surface_features(crankshaft, points.T)
    own = number == names.index(place)
    values, tensors = von_mises(stress.transpose(1, 0, 2))[:, own], stress[:, :, own]
    return 1e-6 * values.max(axis=1), [free_surface(tensor) for tensor in tensors]


def on_mesh(engine, mesh, speeds):
    """Model, interfaces, motion, acceleration and loads of a crank's own mesh, and stress at its corner nodes."""
    model = finite_elements(mesh, engine.material)
    interfaces = crankshaft_interfaces(model, engine.crankshaft)
    moved, acceleration, loads = solved(model, interfaces, speeds)
    nodes = np.unique(mesh.facets[:, mesh.boundary_facets()])
    stress = NodalStress.of(mesh, engine.material, nodes)(moved[component_dofs(model.basis)])
    return model, interfaces, moved, acceleration, loads, mesh.doflocs[:, nodes], stress


def compare(fineness: float, places: Sequence[str] = (), mesh_size: float = 0.018) -> dict:
    """Peaks (MPa) by case and place: coarse crank, both sub-models, refined crank."""
    engine = one_throw(mesh_size)
    c, thrust = engine.crankshaft, engine.thrust.main
    speeds = np.array([0.0, 0.0, SPEED])
    model, interfaces, moved, acceleration, loads, points, stress = on_mesh(engine, crankshaft_mesh(c, thrust), speeds)
    coarse = (model.mesh.doflocs, moved[component_dofs(model.basis)])
    wrench = cut_wrenches(model, interfaces, loads, acceleration, speeds, c)
    pin = interfaces.positions[interfaces.names.index("pin[1]")]
    acceleration[:, :3] += np.cross(acceleration[:, 3:], pin)
    at = [interfaces.names.index(name) for name in ("pin[1]", "main[1]", "main[2]")]
    drive = np.column_stack((np.eye(len(speeds)), *(loads[k].T for k in at), acceleration, speeds**2))
    found: dict = {case: {} for case in LOADS}
    for place in places or fillet_ends(c):
        if place not in throw_places(c, 1):
            continue
        fine = fillet_modes(c, engine.material, coarse, 1, place, fineness=fineness)
        rows = {"coarse": peaks(c, points, stress, place)[0]}
        for name, motions in (("motion", 0.0), ("resultants", fine.by_resultants(drive, wrench))):
            driven = np.column_stack((drive, np.zeros((len(drive), CUTS)) + motions))
            tensors = np.tensordot(driven, fine.modes.astype(float), axes=1)
            rows[name] = 1e-6 * von_mises(tensors.transpose(1, 0, 2)).max(axis=1)
        mesh = crankshaft_mesh(c, thrust, fineness, [place])
        rows["refined"], rows["free_surface"] = peaks(c, *on_mesh(engine, mesh, speeds)[-2:], place)
        for k, case in enumerate(LOADS):
            found[case][place] = {name: float(values[k]) for name, values in rows.items()}
    return found


if __name__ == "__main__":
    report = compare(float(sys.argv[1]) if len(sys.argv) > 1 else 1.5, sys.argv[2:])
    print(json.dumps(report, indent=1))
