"""Status of a step or a preparation: the integers that kernels return, with their causes and remedies for a user."""

from collections.abc import Sequence

OK, DIVERGED, SINGULAR, FILM_FAILED, STALLED, WORK_SPENT, TOO_LONG = range(7)
NOT_EMBEDDED, TOLERANCE_RANGE, STEP_RANGE, DELAY_RANGE, UNKNOWN_METHOD, OIL_RANGE, THIN_OIL = range(16, 23)
DAMPER_RANGE, BORE_FIXED, TRACE_FIXED, LIMIT_RANGE, NO_RIGID_PART, CLEARANCE_FIXED, PEAKS_LOST = range(23, 30)
NO_EQUILIBRIUM, GEARS_FIXED = 32, 33
NOT_AHEAD = 10
INPUT_NOT_FINITE, INPUT_NEGATIVE = 1000, 2000
"""First status of each kind of invalid input; the status is this number plus the index of the input."""
REFUSED, FAILED = "refused", "failed"
"""Kinds of statuses: a refused request, and a failed step, which other inputs or a shorter step may avoid."""
REMEDIES = {
    DIVERGED: (
        "the forces at the ports found no balance",
        "use a smaller solver.step, or check pressures, clearance and oil temperature",
    ),
    SINGULAR: (
        "the equations of the structure are singular",
        "check mounts, drive line and dampers for stiffnesses that are zero or far too large",
    ),
    WORK_SPENT: (
        "the work that solver.work_limit allows a communication step is spent and no result within reach",
        "allow more, or use a shorter communication step or a larger solver.step",
    ),
    TOO_LONG: (
        "the communication step takes a million internal steps or more",
        "use a shorter communication step or a larger solver.step, and a state and a speed that an engine can have",
    ),
    STALLED: (
        "the load torque stalls the engine, which does not run backwards",
        "lower the torque",
    ),
    FILM_FAILED: (
        "a film found no pressure that fulfils its equations",
        "use a smaller solver.step, or check clearance, oil temperature and the bearing's table or mesh",
    ),
    NO_EQUILIBRIUM: (
        "a film cannot carry the load at the start",
        "lower the pressures or check clearance and viscosity",
    ),
}
"""Cause and remedy of each failure of a step or a start."""
REFUSALS = {
    NOT_EMBEDDED: "the integrator has no error estimate, which adaptive control needs; take another, or fixed steps",
    PEAKS_LOST: "the largest pressures of elastic films do not converge with this integrator; take esdirk3 or auto",
    TOLERANCE_RANGE: "tolerance of adaptive control must be 1e-10 to 1",
    STEP_RANGE: "internal step must be a positive angle, 1e-5 rad or more, or 0 for the level's default",
    LIMIT_RANGE: "the work limit of a communication step must be 0 (no limit) or a positive number of iterations",
    DELAY_RANGE: "given pressures may be 0 to 2 communication steps late",
    UNKNOWN_METHOD: "the integrator does not exist",
    OIL_RANGE: "the oil's law has no value at its temperature; give a higher one",
    THIN_OIL: "Roelands' law needs oil of a higher viscosity; give a lower temperature",
    DAMPER_RANGE: "the damper's temperature lies outside the range of its law",
    TRACE_FIXED: "the gas trace is given and belongs to another bore or compression ratio; leave them there",
    NO_RIGID_PART: "no rigid part has the inertias of flywheel, pulley or clutch: the polar one is at most twice the "
    "diametral one; change both",
    CLEARANCE_FIXED: "the films of this level were made for their clearance; leave main_bearing.clearance and "
    "big_end_bearing.clearance, choose bearing.level impedance or linear, or build the FMU of an engine file with the "
    "new clearance",
    GEARS_FIXED: "the crank's modes include bodies on rigid gears and belong to the masses of flywheel, pulley, clutch "
    "and damper housing; leave these, or change them in the engine file",
    BORE_FIXED: "the flexible block was made for another bore; leave it there",
}
"""Reason and remedy of each refusal to prepare a model."""


def statuses(input_names: Sequence[str]) -> dict[int, tuple[str, str]]:
    """Kind and text of every status except 0 that the kernels of a run return, by its number."""
    found = {code: (FAILED, f"{cause}; {remedy}") for code, (cause, remedy) in REMEDIES.items()}
    found |= {code: (REFUSED, text) for code, text in REFUSALS.items()}
    found[NOT_AHEAD] = REFUSED, "a communication step must be positive, and at most 1 s"
    for k, name in enumerate(input_names):
        found[INPUT_NOT_FINITE + k] = REFUSED, f"{name} must be a finite number"
        found[INPUT_NEGATIVE + k] = REFUSED, f"{name} must not be negative"
    return found
