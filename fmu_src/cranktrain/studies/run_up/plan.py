"""Request for a run-up: its speeds, and the job common to all speeds. All invalid input is refused here."""

import math
from collections.abc import Sequence

from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.dynamics.outputs.register import nearest_output, output_counts, output_needs
from cranktrain.engine.quantities import SLOWEST_RPM
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.gas_pressure import Gas
from cranktrain.results.run_up.run_up import AXIAL, TORSION
from cranktrain.structure.assembly import Assembly
from cranktrain.studies.constant_speed import Request
from cranktrain.studies.run_up.steady import Job

MOST_SPEEDS = 20_000


def run_up_speeds(first_rpm: float, last_rpm: float, step_rpm: float) -> list[float]:
    """Speeds (rad/s) from the first to the last, rev/min, rising; ``InputError`` for an invalid run-up range."""
    if not SLOWEST_RPM <= first_rpm <= last_rpm:
        if first_rpm < SLOWEST_RPM:
            raise InputError(
                f"--from {first_rpm:g} rev/min: steady cycles need {SLOWEST_RPM:g} rev/min or more, so a run-up cannot "
                "start at standstill; begin higher (the FMU takes any speed from 0)"
            )
        raise InputError(f"--to {last_rpm:g} is below --from {first_rpm:g} rev/min; exchange them")
    if not step_rpm > 0.0:
        raise InputError(f"--step {step_rpm:g} rev/min must be above 0")
    count = math.floor((last_rpm - first_rpm) / step_rpm + 1e-9) + 1
    if count > MOST_SPEEDS:
        raise InputError(f"--step {step_rpm:g} rev/min makes {count} speeds, at most {MOST_SPEEDS}; take a longer one")
    return [(first_rpm + k * step_rpm) * RPM for k in range(count)]


def job_of(request: Request, made: Assembly, gas: Gas | None, outputs: Sequence[str], highest_order: float) -> Job:
    """Job of a run-up, the request common to all its speeds.

    Raises ``InputError``: outputs that the run does not have, orders that its step does not resolve.
    """
    samples = math.ceil(4.0 * math.pi / made.settings.step - 1.0e-9)
    if highest_order > 0.25 * samples:
        step = 180.0 / highest_order
        raise InputError(
            f"--highest-order {highest_order:g}: steps of {math.degrees(made.settings.step):g} deg resolve orders to "
            f"{0.25 * samples:g}; take --step-deg {step:.3g} or less"
        )
    needs = output_needs(output_counts(made.engine))
    carries = bearing_law(made.settings.bearings).carries
    shown = [name for name, need in needs.items() if carries or "bearings" not in need or "block" in need]
    for name in outputs:
        if name not in shown:
            raise InputError(f"--outputs '{name}' is no output of this run; {nearest_output(name, shown)}")
    own = [name for name in (TORSION, AXIAL) if name in shown]
    return Job(
        made=made,
        gas=gas,
        settle=request.settle,
        highest_order=highest_order,
        outputs=tuple(dict.fromkeys([*own, *outputs])),
        film_temperature=request.film_temperature,
        damper_balance=request.damper_temperature == "heat-balance",
    )
