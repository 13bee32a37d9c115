"""Relative motion of rotating and stationary bodies, in axes of the frame.

A film between journal (displacement u in the frame's axes) and bore (w in axes at rest) depends on d = u − Rᵀ w, where
R is the frame's rotation by θ. It acts on the bore with −R f. In a Newton iteration on d both bodies together have the
compliance H + Rᵀ H_b R, so a flexible block adds no unknowns to a stage. Velocities in space along the frame's axes
are ḋ + Ω e_z×d with ḋ = u̇ − Rᵀ ẇ + Ω e_z×Rᵀ w. The last term lags the iteration by one step, which costs no accuracy
because it is only Ω c_q/c_v, about a hundredth, of the others.

On rigid ground there are no pairs, so relative motion is a copy of the ports' motion.
"""

from cranktrain.core.kernel import inlined_kernel
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.layout import block_port_count, turning_ports


@inlined_kernel
def relative_motion(model, cos, sin, whirl, u, ud, d, dd):
    """Fill d and ḋ (n_newton,) from the displacement u and velocity u̇ (m,) of all ports."""
    for k in range(model.scales.shape[0]):
        d[k] = u[k]
        dd[k] = ud[k]
    for i in range(model.pairs.shape[0]):
        t = int(model.pairs[i, 0])
        s = int(model.pairs[i, 1])
        x = cos * u[s] + sin * u[s + 1]
        y = cos * u[s + 1] - sin * u[s]
        d[t] -= x
        d[t + 1] -= y
        dd[t] -= cos * ud[s] + sin * ud[s + 1] + whirl * y
        dd[t + 1] -= cos * ud[s + 1] - sin * ud[s] - whirl * x
    for i in range(model.axial.shape[0]):
        t = int(model.axial[i, 0])
        s = int(model.axial[i, 1])
        d[t] -= u[s]
        dd[t] -= ud[s]


@inlined_kernel
def relative_step(model, cos, sin, step):
    """Convert a change of all ports (m,) to a change of the relative motion, in place on the first n_newton ports."""
    for i in range(model.pairs.shape[0]):
        t = int(model.pairs[i, 0])
        s = int(model.pairs[i, 1])
        step[t] -= cos * step[s] + sin * step[s + 1]
        step[t + 1] -= cos * step[s + 1] - sin * step[s]
    for i in range(model.axial.shape[0]):
        step[int(model.axial[i, 0])] -= step[int(model.axial[i, 1])]


@inlined_kernel
def move_axis(model, frame, u):
    """Write to ``frame`` the displacement of the axes of crank and block with the block on its mounts, from u (m,).

    They are means of the displacements of main journals and bores, weighted for the crank's centre of mass.
    """
    frame[at.CRANK_X] = 0.0
    frame[at.CRANK_Y] = 0.0
    frame[at.BLOCK_X] = 0.0
    frame[at.BLOCK_Y] = 0.0
    if block_port_count(model) > 0:
        for i in range(model.axis_weights.shape[0]):
            weight = model.axis_weights[i]
            journal = int(model.pairs[i, 0])
            bore = int(model.pairs[i, 1])
            frame[at.CRANK_X] += weight * u[journal]
            frame[at.CRANK_Y] += weight * u[journal + 1]
            frame[at.BLOCK_X] += weight * u[bore]
            frame[at.BLOCK_Y] += weight * u[bore + 1]


@inlined_kernel
def reactions(model, cos, sin, f):
    """Set the forces on bores and thrust faces, opposite to those on journals and collar, in f (m,)."""
    for i in range(model.pairs.shape[0]):
        t = int(model.pairs[i, 0])
        s = int(model.pairs[i, 1])
        f[s] = sin * f[t + 1] - cos * f[t]
        f[s + 1] = -sin * f[t] - cos * f[t + 1]
    for i in range(model.axial.shape[0]):
        f[int(model.axial[i, 1])] = -f[int(model.axial[i, 0])]


@inlined_kernel
def relative_compliance(model, cos, sin, turning, standing, out):
    """Compliance H + Rᵀ H_b R of components that are ports, kept transposed like its parts, [k, i] = H_ik.

    Its rows and columns of ``out`` come after those of components of terms.
    """
    n = model.scales.shape[0]
    own = model.links.scales.shape[0]
    first = turning_ports(model)
    for k in range(n):
        row = out[own + k, own : own + n]
        for i in range(n):
            row[i] = turning[k, i]
    for i in range(model.pairs.shape[0]):
        t = own + int(model.pairs[i, 0])
        s = int(model.pairs[i, 1]) - first
        for j in range(model.pairs.shape[0]):
            r = own + int(model.pairs[j, 0])
            o = int(model.pairs[j, 1]) - first
            # Add Rᵀ B R for each 2 × 2 block B of the stationary compliance.
            xx = standing[s, o] * cos + standing[s, o + 1] * sin
            xy = standing[s, o + 1] * cos - standing[s, o] * sin
            yx = standing[s + 1, o] * cos + standing[s + 1, o + 1] * sin
            yy = standing[s + 1, o + 1] * cos - standing[s + 1, o] * sin
            out[t, r] += cos * xx + sin * yx
            out[t, r + 1] += cos * xy + sin * yy
            out[t + 1, r] += cos * yx - sin * xx
            out[t + 1, r + 1] += cos * yy - sin * xy
        for j in range(model.axial.shape[0]):
            r = own + int(model.axial[j, 0])
            o = int(model.axial[j, 1]) - first
            out[t, r] += cos * standing[s, o] + sin * standing[s + 1, o]
            out[t + 1, r] += cos * standing[s + 1, o] - sin * standing[s, o]
            out[r, t] += standing[o, s] * cos + standing[o, s + 1] * sin
            out[r, t + 1] += standing[o, s + 1] * cos - standing[o, s] * sin
    for i in range(model.axial.shape[0]):
        t = own + int(model.axial[i, 0])
        s = int(model.axial[i, 1]) - first
        out[t, t] += standing[s, s]
