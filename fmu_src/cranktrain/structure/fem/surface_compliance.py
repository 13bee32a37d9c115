"""Compliance of a round surface on patterns of pressure, from finite elements, stored in the user's cache.

C_ij = f_iᵀ K⁻¹ f_j with the load vectors f_i · v = ∫ p_i e_r · v dA is symmetric by construction.
"""

import json
from collections.abc import Callable
from hashlib import sha256
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray
from skfem import FacetBasis

from cranktrain.core.cache import cache_folder
from cranktrain.core.errors import CranktrainError
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Array
from cranktrain.store.whole_file import whole_file
from cranktrain.structure.fem.elasticity import FEModel
from cranktrain.structure.fem.factor import factorise


def radial_loads(model: FEModel, facets: FacetBasis, pressure: Array) -> Array:
    """Load vectors of radial pressures about z, outwards, (ndof, patterns).

    ``pressure``: (patterns, facets, points) pressure times area at each quadrature point of ``facets``.
    """
    x, y, z = np.asarray(facets.global_coordinates())
    radius = np.hypot(x, y)
    radial = np.stack((x / radius, y / radius, 0.0 * z))
    loads = np.zeros((model.basis.N, len(pressure)))
    for dofs, basis in zip(facets.element_dofs, facets.basis, strict=True):
        work = np.einsum("afq,afq->fq", np.asarray(basis[0]), radial)
        np.add.at(loads, dofs, np.einsum("pfq,fq->fp", pressure, work))
    return loads


def compliance_of(model: FEModel, clamped: NDArray[np.integer], loads: Array) -> Array:
    """Compliance (n, n) on n load vectors (ndof, n), with the degrees of freedom ``clamped`` fixed.

    Raises ``RuntimeError`` if these permit rigid motion.
    """
    free = np.setdiff1d(np.arange(model.basis.N), clamped)
    with one_thread():
        compliance = loads[free].T @ factorise(model.stiffness[free][:, free]).solve(loads[free])
    return np.asarray(0.5 * (compliance + compliance.T))


def kept_compliance(name: str, inputs: Any, computed: Callable[[], Array], rebuild: bool = False) -> Array:
    """Compliance for these ``inputs`` from the user's cache, or by ``computed``, whose result is stored.

    If the cache cannot be written, the next run computes the compliance again.
    """
    digest = sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()
    path = cache_folder() / f"{name}-{digest[:16]}.npz"
    try:
        with np.load(path) as data:
            if str(data["digest"]) == digest and not rebuild:
                return np.asarray(data["compliance"])
    except (OSError, ValueError, KeyError, BadZipFile):
        pass  # without a readable file the compliance is computed below
    compliance = computed()
    try:
        with whole_file(path) as temporary:
            np.savez(temporary, compliance=compliance, digest=digest)
    except CranktrainError:
        pass
    return compliance
