"""Linear run-ups of torsional crank variants, with all speeds and orders at once.

The model is that of ``cranktrain runup --crank torsional --method linear``
(:mod:`cranktrain.studies.torsion.frequency_run_up`). Outputs over the speed are half of the peak-to-peak value over a
cycle unless stated otherwise:

    twist              pulley against flywheel, rad
    pulley.torsion     pulley against the frame that turns steadily, rad
    NAME.order[N]      amplitude of order N of one of these two
    damper.heat        mean power lost in the damper, W: ½ Σ ω Im κ |ψ|², κ its complex stiffness, ψ its twist
    damper.torque      torque between hub and ring, N m
    shaft.torque       largest torque of all pieces of the crank between pulley, mains and flywheel, N m
    shaft.stress       largest nominal shear stress of these pieces, Pa: T/W, W = π d³/16 of the thinnest solid circle
    frequency[N]       N-th torsional frequency with mean rods, undamped and without the damper's ring, Hz; one value

A nominal stress has no notch factor; fillets are judged by ``cranktrain fatigue``.
"""

import re
from dataclasses import replace

import numpy as np

from cranktrain.core.argument_checks import whole_number
from cranktrain.core.errors import InputError, SolverError, nearest
from cranktrain.core.types import Array
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.results.orders.harmonics import ComplexArray
from cranktrain.structure.assembly import Assembly
from cranktrain.structure.crank.torsional import shaft_nodes
from cranktrain.studies.torsion.frequency_run_up import HIGHEST_ORDER, SolvedOrders, frame_wobble, solved_orders
from cranktrain.studies.torsion.shaft_orders import ShaftOrders

TWIST, TORSION, HEAT, TORQUE = "twist", "pulley.torsion", "damper.heat", "damper.torque"
SHAFT, STRESS, FREQUENCY = "shaft.torque", "shaft.stress", "frequency"
UNITS_OF = {TWIST: "rad", TORSION: "rad", HEAT: "W", TORQUE: "N m", SHAFT: "N m", STRESS: "Pa", FREQUENCY: "Hz"}
OF_DAMPER, OF_SHAFT, OF_ORDERS = (HEAT, TORQUE), (SHAFT, STRESS), (TWIST, TORSION)
_FINER = 2
"""Ratio of samples per cycle for peaks to the model's samples, which gives 32 samples per period of the top order."""
_NAME = re.compile(r"([a-z.]+?)(?:\.order)?(?:\[([0-9.]+)\])?")


def base_name(output: str) -> str:
    """Return the name of an output without its order or number."""
    match = _NAME.fullmatch(output)
    return match[1] if match else output


def check_torsional_output(output: str, damper: bool) -> None:
    """Raise ``InputError`` for an output that a linear run-up does not have."""
    match, name = _NAME.fullmatch(output), base_name(output)
    number = match[2] if match else None
    by_order = ".order[" in output
    if name not in UNITS_OF or (by_order and name not in OF_ORDERS) or (not by_order and number and name != FREQUENCY):
        valid = (*(n for n in UNITS_OF if n != FREQUENCY), "twist.order[6]", "pulley.torsion.order[6]", "frequency[1]")
        raise InputError(f"outputs: a torsional crank has no '{output}'; {nearest(output, valid)}")
    if name == FREQUENCY and not (whole_number(number or "") or 0) >= 1:
        raise InputError(f"outputs: '{output}' has no number; write frequency[1] for the first")
    if by_order:
        order = float(number or 0.0)
        if not (0.5 <= order <= HIGHEST_ORDER and (2.0 * order).is_integer()):
            raise InputError(f"outputs: '{output}': orders are 0.5, 1, … {HIGHEST_ORDER:g}")
    if name in OF_DAMPER and not damper:
        raise InputError(f"outputs: '{output}' needs a damper; give the engine a [damper], or leave the output out")


def structure_of(made: Assembly, highest: float = HIGHEST_ORDER) -> ShaftOrders:
    """Return the linear structure of one variant for orders up to ``highest``; raises ``InputError``."""
    return ShaftOrders(made.engine, made.body, made.settings, GasTrace.from_engine(made.engine), highest)


def variant_orders(made: Assembly, speeds: Array, structure: ShaftOrders | None = None) -> SolvedOrders:
    """Solve the linear motion of one variant at ``speeds`` (s,) rad/s; ``structure`` may be given if known.

    Raises ``InputError``, ``SolverError``.
    """
    damper = (made.engine, made.settings) if made.settings.damper == "fitted" else None
    return solved_orders(structure_of(made) if structure is None else structure, damper, speeds)


def against_frame(solved: SolvedOrders, speeds: Array, row: Array) -> ComplexArray:
    """Return the rotation (s, k + 1) of a place relative to the frame of a run; ``row`` (n,) acts on coordinates."""
    swing = solved.structure.ends_rows()[2]
    wobble = frame_wobble(speeds[:, None], speeds[:, None] * solved.structure.orders)
    return np.asarray(solved.motion @ row - wobble * (solved.motion @ swing))


def torsional_answer(
    made: Assembly, speeds: Array, outputs: tuple[str, ...], structure: ShaftOrders | None = None
) -> dict[str, Array]:
    """Return each output of one variant at s speeds, (s,), frequencies (1,); ``made`` includes the damper's housing.

    ``structure`` is the linear structure of ``made`` if known.

    Raises ``InputError``, ``SolverError``.
    """
    engine = made.engine
    solved = variant_orders(made, speeds, structure)
    structure, motion, _, twist, stiffness, link = solved
    _, pulley, _, flywheel = structure.ends_rows()
    found: dict[str, Array] = {}
    bases = {base_name(output) for output in outputs}
    orders: dict[str, ComplexArray] = {}
    if TWIST in bases:
        orders[TWIST] = motion @ (pulley - flywheel)
    if TORSION in bases:
        orders[TORSION] = against_frame(solved, speeds, pulley)
    if twist is not None and stiffness is not None and link is not None:
        omega = speeds[:, None] * structure.orders
        found[HEAT] = 0.5 * np.sum(omega * stiffness.imag * np.abs(twist) ** 2, axis=1)
        if TORQUE in bases:
            # A shear-thinning fluid has the torque of its force law, not of the linear damper with the same heat.
            law = link.torque(structure.signal(1j * omega * twist, 1)) if link.thinning else None
            found[TORQUE] = _half_range(structure, stiffness * twist) if law is None else 0.5 * np.ptp(law, axis=1)
    if bases & set(OF_SHAFT):
        # Pieces lie between neighbours of pulley, mains and flywheel.
        twists = np.diff(structure.rotations(made.body, shaft_nodes(engine)), axis=0)
        stiffnesses = made.body.records["shaft_stiffness"][:, None]
        torques = _half_range(structure, motion @ (stiffnesses * twists).T)
        found[SHAFT] = torques.max(axis=1)
        # Polar section moduli (mains + 1,) of the crank's pieces as solid circles, m³. The diameter of a piece
        # between two mains is the smaller of main and pin, of the front piece the smaller of nose and main, of the
        # rear piece the smaller of flange and main.
        c = engine.crankshaft
        thin = np.full(len(c.main_widths) + 1, min(c.main_diameter, c.pin_diameter))
        thin[0], thin[-1] = min(c.nose_diameter, c.main_diameter), min(c.flange_diameter, c.main_diameter)
        found[STRESS] = (torques / np.asarray(np.pi * thin**3 / 16.0)).max(axis=1)
    hz = structure.frequencies_hz() if FREQUENCY in bases else np.zeros(0)
    return {output: _one(output, orders, found, hz, structure) for output in outputs}


def _one(
    output: str, orders: dict[str, ComplexArray], found: dict[str, Array], hz: Array, structure: ShaftOrders
) -> Array:
    """Return one output of a variant by the output's name, from its solved orders."""
    name, match = base_name(output), _NAME.fullmatch(output)
    number = match[2] if match else None
    if name == FREQUENCY:
        place = int(number or 1)
        if place > hz.size:
            raise SolverError(f"has {hz.size} torsional frequencies only, no {output}")
        return hz[place - 1 : place]
    if ".order[" in output:
        return np.abs(orders[name][:, round(2.0 * float(number or 0.0))])
    if name in orders:
        return _half_range(structure, orders[name])
    return found[name]


def _half_range(structure: ShaftOrders, orders: ComplexArray) -> Array:
    """Return half of the peak-to-peak value (s, …) over a cycle of complex orders (s, k + 1, …)."""
    count = _FINER * structure.samples
    moved = 0.5 * count * orders
    moved[:, 0] *= 2.0
    signal = np.fft.irfft(moved, count, axis=1)
    return np.asarray(0.5 * (_peak(signal) + _peak(-signal)))


def _peak(signal: Array) -> Array:
    """Return the largest value of samples (s, N, …) over a cycle, from a parabola through the largest three."""
    top = signal.argmax(axis=1)[:, None]
    before, at, after = (np.take_along_axis(signal, (top + k) % signal.shape[1], axis=1)[:, 0] for k in (-1, 0, 1))
    bend = 2.0 * at - before - after
    return np.asarray(at + 0.125 * (after - before) ** 2 / np.where(bend > 0.0, bend, 1.0))


def with_load(made: Assembly, load: float) -> Assembly:
    """Return the assembly with pressures of another load, given as a fraction of the full-load burn."""
    return made if made.settings.gas_load == load else replace(made, settings=replace(made.settings, gas_load=load))
