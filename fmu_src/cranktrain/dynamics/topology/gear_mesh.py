"""Force law of a gear mesh: a spring and damper along the normal of each flank, with backlash.

Let (t, r, z) be the motion of the first gear's pitch point relative to the second one's, along the pitch circles, from
the first centre towards the second, and along the axis. The teeth approach each other by

    p₁ = n_t t + n_r r + n_z z − j,    p₂ = −n_t t + n_r r − n_z z − j,    j = ½ b n_t

on the flanks that drive forwards and backwards, with the backlash b along the pitch circle. The normal n has the
components 1 : tan α/cos β : tan β; inside a ring gear n_r changes its sign. The force of each flank is k p⁺ + c p⁺' ṗ,
where p⁺ = ½ (p + √(p² + ε²)) rounds the corner over a tenth of a micrometre. Without backlash p₁⁺ − p₂⁺ is exactly p₁
if the distance of the centres is constant. The stiffness may vary once per tooth, k (1 + v cos zψ).

Sources: DIN 3990/ISO 6336-1 for the forces' directions; A. Kahraman and R. Singh, J. Sound Vib. 142 (1990) 49-75, for
the mesh as a spring with a gap.
"""

import math
from typing import NamedTuple

import numpy as np

from cranktrain.core.kernel import inlined_kernel, law_kernel, record_reader
from cranktrain.core.reduced_body import Array
from cranktrain.engine.connections import GearMesh
from cranktrain.film.laws.films import ANGLE, BY_PLACE, BY_VELOCITY, ECCENTRICITY, FRICTION

ROUNDED = 1.0e-7
"""Approach of two tooth flanks (m) over which the contact stiffness sets in smoothly."""
N_T, N_R, N_Z, STIFFNESS, DAMPING, HALF_GAP, TEETH, VARIATION, CONSTANTS = range(9)


class MeshRecord(NamedTuple):
    """Data of one mesh."""

    constants: Array  # (CONSTANTS,)


def mesh_record(mesh: GearMesh, inside: bool) -> MeshRecord:
    """Record of a mesh; ``inside`` is True for a ring gear, whose flank forces push the centres together."""
    tan = math.tan(mesh.pressure_angle) / math.cos(mesh.helix_angle)
    normal = np.array([1.0, -tan if inside else tan, math.tan(mesh.helix_angle)])
    normal /= np.linalg.norm(normal)
    return MeshRecord(np.array([
        *normal, mesh.stiffness, mesh.damping, 0.5 * mesh.backlash * normal[0], mesh.teeth, mesh.variation,
    ]))  # fmt: skip


_read = record_reader(MeshRecord(np.zeros(1)))


@law_kernel
def mesh_law(record, action, i, place, velocity, numbers, memory, out):
    """Write force (F_t, F_r, F_z) on the first gear and tangents, see :mod:`cranktrain.film.laws.films`. Return 0."""
    own = _read(record).constants
    for k in range(ECCENTRICITY):
        out[k] = 0.0
    out[FRICTION] = 0.0
    variation = 1.0
    if own[TEETH] > 0.0:
        variation += own[VARIATION] * math.cos(own[TEETH] * numbers[ANGLE])
    for flank in range(2):
        sign = 1.0 - 2.0 * flank
        normal = (sign * own[N_T], own[N_R], sign * own[N_Z])
        pressed = normal[0] * place[0] + normal[1] * place[1] + normal[2] * place[2] - own[HALF_GAP]
        rate = normal[0] * velocity[0] + normal[1] * velocity[1] + normal[2] * velocity[2]
        force, by_place, by_rate = _flank(pressed, rate, variation * own[STIFFNESS], own[DAMPING])
        for r in range(3):
            out[r] -= normal[r] * force
            for s in range(3):
                out[BY_PLACE + 4 * r + s] -= normal[r] * normal[s] * by_place
                out[BY_VELOCITY + 4 * r + s] -= normal[r] * normal[s] * by_rate
    return 0


@inlined_kernel
def _flank(pressed, rate, stiffness, damping):
    """Force of one flank, and derivatives of this force by approach and rate of approach."""
    root = math.sqrt(pressed * pressed + ROUNDED * ROUNDED)
    share = 0.5 * (1.0 + pressed / root)
    by_share = 0.5 * ROUNDED * ROUNDED / (root * root * root)
    force = stiffness * 0.5 * (pressed + root) + damping * share * rate
    return force, stiffness * share + damping * by_share * rate, damping * share
