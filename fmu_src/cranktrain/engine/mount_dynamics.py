"""Stiffness of mounts over frequency, ``[[mount_dynamics]]``: a measured table, or fluid moved behind a rubber spring.

    [[mount_dynamics]]                         [[mount_dynamics]]
    name = "rubber"                            name = "fluid"
    axes = ["x", "z"]                          axes = ["y"]
    mounts = { value = [1, 2], ... }           mounts = { value = [1, 2], ... }
    frequencies = { value = [5, 20, 200], ...} fluid_stiffness = { value = 2e5, unit = "N/m", ... }
    stiffness = { value = [...], ... }         fluid_mass = { value = 45, unit = "kg", ... }
    loss_factors = { value = [...], ... }      fluid_damping = { value = 900, unit = "N s/m", ... }

A table states the storage stiffness K' and the loss factor η = K''/K' of K = K' (1 + iη) along an axis. It takes the
place of the constant stiffness and damping of ``[mounts]``. Fluid adds to these constants k and c

    K(s) = k + c s + Σ k_f D/(k_f + D),    D = c_f s + m_f s²

with the swelling stiffness k_f of the upper chamber, and the mass m_f and damping c_f of the fluid in its track, all
three times the square of an area ratio, so that they act on the mount's displacement. A constant mount is the case
without fluid, a Maxwell element the case m_f = 0. Several tables of fluid for a mount add up. Sources: W. C. Flower,
SAE 850975; R. Singh, G. Kim, P. V. Ravindra, Journal of Sound and Vibration 158 (1992) 219-243.
"""

from dataclasses import dataclass

from cranktrain.engine import quantities as q
from cranktrain.engine.parts import Given, Needed

AXES = ("x", "y", "z")
"""Directions in which a mount may have a stiffness over frequency."""


@dataclass(frozen=True)
class MountDynamics:
    """Stiffness over frequency of some mounts along some axes, from a table or from fluid moved by the mount.

    Attributes
    ----------
    axes : ``x``, ``y`` and ``z`` of the engine, along which it acts
    mounts : numbers of the mounts of ``[mounts]``, from 1
    frequencies, stiffness, loss_factors : table of K' (N/m) and η = K''/K' over frequency (Hz), for small amplitudes.
        It is linear between its frequencies and constant beyond them; K' and K'' are not held to causality
        (Kramers and Kronig)
    fluid_stiffness, fluid_mass, fluid_damping : k_f, m_f and c_f of the equation above, N/m, kg and N s/m
    """

    @staticmethod
    def needed(given: Given) -> Needed:
        """Keys of a table, or of fluid."""
        if given("fluid_stiffness") or given("fluid_damping") or given("fluid_mass"):
            return Needed(("fluid_stiffness", "fluid_damping"), "fluid needs")
        return Needed(
            ("frequencies", "stiffness", "loss_factors"), "give fluid_stiffness and fluid_damping, or a table"
        )

    name: str
    axes: tuple[str, ...]
    mounts: tuple[q.MountNumber, ...]
    frequencies: tuple[q.Frequency, ...] = ()
    stiffness: tuple[q.Stiffness, ...] = ()
    loss_factors: tuple[q.MountLoss, ...] = ()
    fluid_stiffness: q.Stiffness = 0.0
    fluid_mass: q.AddedMass = 0.0
    fluid_damping: q.Damping = 0.0
