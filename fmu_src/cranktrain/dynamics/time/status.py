"""What became of a step: the integer that kernels return, and what a user can do about it."""

from __future__ import annotations

OK, DIVERGED, SINGULAR, FILM_FAILED = range(4)
REMEDIES = {
    DIVERGED: (
        "the forces at the ports found no balance",
        "use a smaller solver.step, or check pressures, clearance and oil temperature",
    ),
    SINGULAR: (
        "the equations of the structure are singular",
        "check mounts, drive line and dampers for stiffnesses that are zero or far too large",
    ),
    FILM_FAILED: (
        "a film found no pressure that fulfils its equations",
        "use a smaller solver.step, or check clearance, oil temperature and the bearing's table or mesh",
    ),
}
"""What each failure of a step means, and what to try."""
NO_START = ("a film cannot carry the load at the start", "lower the pressures or check clearance and viscosity")
"""The same where a run finds no start."""
