"""Further signals that could be measured, and the information on the sought parameters that each would add.

The information of a signal follows without measured values: B = Jᵀ C⁻¹ J, with the derivatives J of the model at an
estimate and the expected covariance C of the signal's values.

Orders of rotation at another position and torques of the drive line's shafts are taken at the orders and speeds of the
file's own orders, with the same noise and bias. The twist is the difference of pulley and flywheel, so only two of the
three count as measurements. Decays, frequencies and shapes are those of the first torsional modes, with and without the
damper's ring, with the default deviation of the file. The deviation of a frequency is at least a tenth of the damping
ratio, because its peak is wide.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import CranktrainError
from cranktrain.core.types import Array
from cranktrain.results.run_up.run_up import FLYWHEEL, TORSION
from cranktrain.structure.crank.torsional import shaft_nodes
from cranktrain.studies.torsion.frequency_run_up import shaft_output
from cranktrain_lab.identification.bias import Bias
from cranktrain_lab.identification.comparison import Comparison
from cranktrain_lab.identification.data import FREQUENCY, RATIO, Data, Orbit, Scalar, Shape, Strand
from cranktrain_lab.identification.model import TorsionalModel, mode_of, shape_of
from cranktrain_lab.identification.parameters import outer_values
from cranktrain_lab.identification.tables import OUTPUTS, TWIST, DecayTable, FrequencyTable, ModeTable

MODES = 2
"""Number of torsional modes whose decays, frequencies and shapes are considered."""
DAMPED = 0.2
"""Largest damping ratio of a mode whose decay or frequency can be measured."""
OF_WIDTH = 0.1
"""Least relative standard deviation of a measured frequency, as a fraction of the mode's damping ratio."""
SPEEDS, HIGHEST = 24, 12.0
"""Number of speeds, and highest order, of orders that are considered if the file has no orders."""
NOISE, ERROR = 0.01, 0.02
"""Assumed noise of further orders and torques, as a fraction of the largest order, and relative model bias."""


@dataclass(frozen=True)
class Signal:
    """Further signal that could be measured, with its information on the sought parameters.

    Attributes
    ----------
    words, states : description, and the entry of the measured file that gives the signal
    information : information (p, p) in u
    agreed : True if all levels of the model give the same values
    """

    words: str
    states: str
    information: Array
    agreed: bool


@dataclass(frozen=True)
class _Wanted:
    """Further signal whose information is not yet computed: description, entry of the measured file, and data."""

    words: str
    states: str
    data: Data


def further_signals(model: TorsionalModel, comparison: Comparison, inner: Array) -> list[Signal]:
    """Return signals that the data lack, with their information at u (p,); empty if the model cannot be evaluated."""
    wanted = [*_orders(model, comparison), *_numbers(model, comparison, inner)]
    strands, scalars, shapes = (
        tuple(k for one in wanted for k in getattr(one.data, part)) for part in ("strands", "scalars", "shapes")
    )
    data = Data(strands, scalars, shapes)
    beside = Comparison(model.beside(data), data, comparison.sought)
    try:
        own = beside.own(inner)
        beside.weigh({name: _bias(comparison, name, data.strands, own) for name in data.order_sets}, own)
        pieces = beside.pieces(inner)
    except (CranktrainError, ArithmeticError, np.linalg.LinAlgError):
        return []
    slopes = beside.whitened([piece.slopes for piece in pieces])
    found = []
    for one in wanted:
        chosen = np.concatenate([s for s, piece in zip(slopes, pieces, strict=True) if piece.name in one.data.names])
        if np.isfinite(chosen).all():
            found.append(Signal(one.words, one.states, chosen.T @ chosen, not one.data.strands))
    return found


def _rotation(comparison: Comparison) -> list[Strand]:
    """Return the orders of the first set of rotation, with phases."""
    found = [one for one in comparison.data.strands if one.output in OUTPUTS and not isinstance(one, Orbit)]
    return [one for one in found if one.name == found[0].name]


def _orders(model: TorsionalModel, comparison: Comparison) -> Iterator[_Wanted]:
    """Yield orders of rotation and torque at positions that were not measured."""
    own, noise = _rotation(comparison), "as noisy as those of the file"
    if not own:
        speeds, noise = np.linspace(*model.engine.speeds, SPEEDS), f"with {100.0 * NOISE:.0f} % of noise"
        orders = 0.5 * np.arange(1, round(2.0 * HIGHEST) + 1)
        still = np.zeros(speeds.size)
        own = [
            Strand("", TORSION, order, speeds, still.astype(complex), still + math.nan, still > 1.0, True)
            for order in orders.tolist()
        ]
    measured = {one.output for one in comparison.data.strands}
    line = model.engine.drive_line_chain
    shafts = [] if line is None else [f"{a} to {b}" for a, b in zip(line.starts, line.ends, strict=True)]
    places = {TORSION: "pulley", FLYWHEEL: "flywheel"} if TWIST not in measured else {TORSION: "pulley"}
    if len(measured & set(OUTPUTS)) > 1:
        places = {}
    asked = [(name, f"orders at the {at}, {noise}", f'[[orders]] output = "{name}"') for name, at in places.items()]
    for shaft in shafts:
        said = f"orders of the torque from {shaft}, with {100.0 * NOISE:.0f} % of noise"
        asked.append((shaft_output(shaft), said, f'[[torque]] shaft = "{shaft}"'))
    for output, words, states in asked:
        if output not in measured:
            strands = [replace(one, name=output, output=output, held=one.speeds < 0.0, phases=True) for one in own]
            if output not in OUTPUTS:
                strands = [replace(one, noise=np.full(one.speeds.size, math.nan)) for one in strands]
            yield _Wanted(words, states, Data(tuple(strands)))


def _bias(comparison: Comparison, name: str, strands: Sequence[Strand], own: Sequence[NDArray[np.complex128]]) -> Bias:
    """Return noise and bias assumed for further orders: those of the first set of rotation, if measured."""
    sizes = [float(np.sqrt(np.mean(np.abs(a) ** 2))) for one, a in zip(strands, own, strict=True) if one.name == name]
    noise, rotation = NOISE * max(sizes), _rotation(comparison)
    span = float(np.ptp(np.concatenate([one.speeds for one in strands])))
    if not rotation:
        return Bias(noise, ERROR, span)
    known = comparison.biases[rotation[0].name]
    return known if name in OUTPUTS else known._replace(noise=noise)


def _numbers(model: TorsionalModel, comparison: Comparison, inner: Array) -> Iterator[_Wanted]:
    """Yield decays, frequencies and shapes of the first modes that were not measured but could be."""
    made = model.assembly(outer_values(comparison.sought, inner))
    measured = {(one.kind, one.number, one.damper) for one in comparison.data.scalars}
    fitted = model.damper and model.engine.damper is not None
    for number in range(1, MODES + 1):
        for damper in (False, True) if fitted else (False,):
            asked = Scalar("", FREQUENCY, number, 1.0, 1.0, damper)
            with suppress(CranktrainError):
                hz, ratio = mode_of(made, replace(asked, value=100.0))
                if not 0.0 < ratio < DAMPED:
                    continue
                where = f"mode {number}" + (" with the damper" if damper else " without the damper's ring" * fitted)
                also = f"number = {number}" + ", damper = true" * damper
                width = max(FrequencyTable().deviation, OF_WIDTH * ratio)
                for kind, value, said, table, spread in (
                    (RATIO, ratio, "a free decay of", "decay", DecayTable().deviation),
                    (FREQUENCY, hz, "the frequency of", "frequencies", width),
                ):
                    if (kind, number, damper) not in measured:
                        one = replace(asked, name=f"{kind} {number} {damper}", kind=kind, value=value, deviation=spread)
                        words = f"{said} {where}, known to {100.0 * spread:.2g} %"
                        yield _Wanted(words, f"[[{table}]] {also}", Data(scalars=(one,)))
        if number not in {one.number for one in comparison.data.shapes}:
            places, spread = tuple(shaft_nodes(model.engine)), ModeTable(shape={}).deviation
            with suppress(CranktrainError):
                shape = Shape(f"shape {number}", number, places, np.ones(len(places)), spread)
                shape = replace(shape, values=shape_of(made, shape))
                words = f"the shape of mode {number} at pulley, mains and flywheel, known to {100.0 * spread:.2g} %"
                yield _Wanted(words, f"[[modes]] number = {number}", Data(shapes=(shape,)))
