"""CalculiX: elastic modes of the free crankshaft of the six on one mesh of curved ten-node tetrahedra.

CalculiX integrates these with four points; ours does so here as well, and by its own rule (exact for the mass of
straight elements) besides. Both begin with the mesh and end with the modes; ours takes the program's own way, balanced
loads instead of a shift. The deck's writing and the start of Python are left out.
"""

from __future__ import annotations

import os
import re
import resource
import shutil
import statistics
import subprocess
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import numpy as np
from benchmarks.peer_programs.environment import ONE_THREAD, Absent
from skfem import MeshTet2

from cranktrain.core.reduced_body import Array
from cranktrain.core.threads import one_thread
from cranktrain.engine.file import load_engine
from cranktrain.engine.parts import Material
from cranktrain.structure.fem import elasticity
from cranktrain.structure.fem.craig_bampton import Flexibility, eigenmodes, rigid_motions
from cranktrain.structure.fem.mesh import crankshaft_mesh

ELASTIC, RIGID = 20, 6
FOUR_POINTS = 2
"""Order of the quadrature with four points."""
ROUNDS = 3
BLOCK = 8
"""Vectors at once: for few modes a fifth quicker than the 16 that suit the many of a reduction."""


def deck(mesh: MeshTet2, material: Material) -> str:
    """Free vibration in CalculiX's input; its ten nodes come in scikit-fem's order, right-handed."""
    elements = mesh.dofs.element_dofs.T + 1
    corners = mesh.p[:, mesh.t]
    turned = np.linalg.det((corners[:, 1:] - corners[:, :1]).transpose(2, 0, 1)) < 0.0
    elements[turned] = elements[turned][:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{k}, {x:.12e}, {y:.12e}, {z:.12e}" for k, (x, y, z) in enumerate(mesh.doflocs.T, 1)]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=BODY")
    lines += [f"{k}, " + ", ".join(map(str, nodes)) for k, nodes in enumerate(elements, 1)]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{material.youngs_modulus:.12e}, {material.poisson_ratio}"]
    lines += ["*DENSITY", f"{material.density:.12e}", "*SOLID SECTION, ELSET=BODY, MATERIAL=M"]
    lines += ["*STEP", "*FREQUENCY, SOLVER=SPOOLES", f"{RIGID + ELASTIC}", "*END STEP", ""]
    return "\n".join(lines)


def spent() -> float:
    """Processor seconds of children that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def calculix(program: str, folder: Path) -> tuple[float, Array]:
    """Processor seconds and elastic frequencies, Hz."""
    before = spent()
    run = subprocess.run(
        [program, "crank"], cwd=folder, capture_output=True, text=True, check=False, env=os.environ | ONE_THREAD
    )
    seconds = spent() - before
    printed = (folder / "crank.dat").read_text() if run.returncode == 0 else ""
    rows = re.findall(r"^\s+\d+\s+(-?\d\.\d+E[+-]\d+)(?:\s+\S+){3}\s*$", printed, re.MULTILINE)
    values = np.array(rows[: RIGID + ELASTIC], dtype=float)
    if values.size < RIGID + ELASTIC:
        raise Absent(f"ccx found no {RIGID + ELASTIC} modes: {(run.stdout + run.stderr).strip()[-200:]}")
    return seconds, np.sqrt(np.sort(values)[RIGID:]) / (2.0 * np.pi)


def ours(mesh: MeshTet2, material: Material, order: int) -> tuple[float, Array]:
    """The same of our finite elements with a quadrature of this order."""
    began = time.process_time()
    with patch.object(elasticity, "QUADRATURE_ORDER", order), one_thread():
        model = elasticity.finite_elements(mesh, material)
        free = Flexibility.of(model.stiffness, model.mass, rigid_motions(model))
        omega, _ = eigenmodes(free.solve, model.mass, ELASTIC, block=BLOCK)
    return time.process_time() - began, omega / (2.0 * np.pi)


def measured() -> dict[str, Any]:
    """Costs, and how far frequencies are apart."""
    program = shutil.which("ccx")
    if program is None:
        raise Absent("ccx is not installed; Debian has it in the package calculix-ccx")
    said = subprocess.run([program, "-v"], capture_output=True, text=True, check=False).stdout
    engine = load_engine("diesel_i6")
    mesh = crankshaft_mesh(engine.crankshaft, engine.thrust.main)
    costs: dict[str, list[float]] = {"theirs": [], "own": [], "usual": []}
    small = crankshaft_mesh(replace(engine.crankshaft, mesh_size=2.0 * engine.crankshaft.mesh_size))
    ours(small, engine.material, FOUR_POINTS)  # compiled before the clock starts
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "crank.inp").write_text(deck(mesh, engine.material))
        for _ in range(ROUNDS):
            seconds, theirs = calculix(program, folder)
            costs["theirs"].append(seconds)
            seconds, own = ours(mesh, engine.material, FOUR_POINTS)
            costs["own"].append(seconds)
            seconds, usual = ours(mesh, engine.material, elasticity.QUADRATURE_ORDER)
            costs["usual"].append(seconds)
    cost = {key: statistics.median(each) for key, each in costs.items()}
    return {
        "program": f"CalculiX {said.strip().rpartition(' ')[2].rstrip('.')}",
        "compared": f"{ELASTIC} elastic modes of the free crankshaft, {3 * mesh.doflocs.shape[1]} degrees of freedom",
        "cost": "processor time from the mesh to the modes",
        "difference_of_frequencies": float(np.abs(own / theirs - 1.0).max()),
        "difference_by_our_own_quadrature": float(np.abs(usual / theirs - 1.0).max()),
        "first_hz": float(own[0]),
        "own_s": cost["own"],
        "other_s": cost["theirs"],
        "ratio": round(cost["theirs"] / cost["own"], 2),
        "own_usual_quadrature_s": cost["usual"],
        "ratio_usual_quadrature": round(cost["theirs"] / cost["usual"], 2),
        "not_comparable": "CalculiX reads its input and finds the modes' stresses within its time; ours has the rigid "
        "motions by formula",
    }
