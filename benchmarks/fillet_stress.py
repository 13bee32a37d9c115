"""Fillets of one throw by a sub-model and on the whole crank refined, under the same static loads.

``python benchmarks/fillet_stress.py [FINENESS]``: a crank of one throw hangs free under rod and bearing forces and
turns; its coarse solution drives the sub-model. Peaks of von Mises stress by fillet, MPa.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace

import numpy as np

from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.structure.crank.reduction import crankshaft_interfaces
from cranktrain.structure.fem.craig_bampton import Flexibility, rigid_motions
from cranktrain.structure.fem.elasticity import component_dofs, finite_elements, sample
from cranktrain.structure.fem.factor import one_thread
from cranktrain.structure.fem.interfaces import InterfaceSet
from cranktrain.structure.fem.mesh import crankshaft_mesh
from cranktrain.structure.stress.features import surface_features
from cranktrain.structure.stress.nodal_stress import NodalStress, von_mises
from cranktrain.structure.stress.sub_model import fillet_modes

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
    """Displacement (ndof, cases) with inertia relief, and rigid acceleration (cases, 6) of the origin."""
    with one_thread():
        free = Flexibility.of(model.stiffness, model.mass, rigid_motions(model))
        loads = wrenches(interfaces)
        outward = model.mass @ sample(model, lambda x: x * np.array([[1.0], [1.0], [0.0]]))
        force = interfaces.averaging.T @ loads.reshape(-1, loads.shape[2]) + np.outer(outward, speeds**2)
        motions = rigid_motions(model)
        return free.solve(force), np.linalg.solve(motions.T @ (model.mass @ motions), motions.T @ force).T, loads


def peaks(crankshaft, points, stress):
    """Greatest von Mises stress (cases) by fillet, MPa."""
    names, number = surface_features(crankshaft, points.T)
    values = von_mises(stress.transpose(1, 0, 2))
    return {
        name: 1e-6 * values[:, number == k].max(axis=1)
        for k, name in enumerate(names)
        if name in ("pin[1] front fillet", "pin[1] rear fillet", "main[1] rear fillet", "main[2] front fillet")
    }


def on_mesh(engine, mesh, speeds):
    """Model, motion and peaks of a crank's own mesh."""
    model = finite_elements(mesh, engine.material)
    interfaces = crankshaft_interfaces(model, engine.crankshaft)
    moved, acceleration, loads = solved(model, interfaces, speeds)
    nodes = np.unique(mesh.facets[:, mesh.boundary_facets()])
    stress = NodalStress.of(mesh, engine.material, nodes)(moved[component_dofs(model.basis)])
    return model, interfaces, moved, acceleration, loads, peaks(engine.crankshaft, mesh.doflocs[:, nodes], stress)


def compare(fineness: float, mesh_size: float = 0.018) -> dict:
    """Peaks (MPa) by case and fillet: coarse crank, sub-model, refined crank."""
    engine = one_throw(mesh_size)
    c = engine.crankshaft
    speeds = np.array([0.0, 0.0, SPEED])
    model, interfaces, moved, acceleration, loads, coarse = on_mesh(
        engine, crankshaft_mesh(c, engine.thrust.main), speeds
    )
    places = (model.mesh.doflocs, moved[component_dofs(model.basis)])
    found = fillet_modes(c, engine.material, places, 1, fineness=fineness)
    pin = interfaces.positions[interfaces.names.index("pin[1]")]
    acceleration[:, :3] += np.cross(acceleration[:, 3:], pin)
    at = [interfaces.names.index(name) for name in ("pin[1]", "main[1]", "main[2]")]
    drive = np.column_stack((np.eye(len(speeds)), *(loads[k].T for k in at), acceleration, speeds**2))
    stress = np.tensordot(drive, found.modes.astype(float), axes=1)
    sub_model = peaks(c, found.points.T, stress)
    refined = on_mesh(engine, crankshaft_mesh(c, engine.thrust.main, fineness), speeds)[-1]
    return {
        case: {
            name: {"coarse": coarse[name][k], "sub_model": sub_model[name][k], "refined": refined[name][k]}
            for name in refined
        }
        for k, case in enumerate(LOADS)
    }


if __name__ == "__main__":
    report = compare(float(sys.argv[1]) if len(sys.argv) > 1 else 1.5)
    print(json.dumps(report, indent=1, default=float))
