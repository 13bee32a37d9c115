"""Check of cylinders and crankshaft: every cylinder fires once, and rods on one pin lie side by side."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Cylinders
from cranktrain.engine.quantities import mm, need

_of = partial(need, "cylinders")


def check_cylinders(engine: Engine) -> None:
    """Refuse rods, firing orders, pins and banks that do not fit: ``InputError`` that starts with ``table.key``."""
    crank, length, cylinders = engine.crankshaft, engine.rod.length, engine.cylinders
    pins, n, throws = cylinders.pins, len(cylinders.firing_order), len(crank.throw_angles)
    reach = crank.throw + abs(cylinders.pin_offset)
    need("rod", "length", length > reach, f"{mm(length)} is shorter than throw and pin offset, {mm(reach)}")
    _of("firing_order", n >= 1, "is empty")
    _check_order(cylinders)
    _of("pins", len(pins) == n, f"{len(pins)} pins for {n} cylinders; give one each")
    _of("pins", all(1 <= pin <= throws for pin in pins), f"{list(pins)} names a pin that is not one of 1..{throws}")
    banks = len(cylinders.bank_angles)
    _of("bank_angles", banks == n, f"{banks} angles for {n} cylinders; give one for each")
    for key in ("firing_angles", "firing_intervals"):
        given = len(getattr(cylinders, key))
        _of(key, given in (0, n), f"{given} values for {n} cylinders; give one for each, or none")
    both = bool(cylinders.firing_angles and cylinders.firing_intervals)
    _of("firing_intervals", not both, "and firing_angles are both given; leave one of them out")
    _check_rods(engine)


def _check_order(cylinders: Cylinders) -> None:
    """Refuse a firing order in which a cylinder fires twice or never."""
    order, pins, banks = cylinders.firing_order, len(cylinders.pins), len(cylinders.bank_angles)
    # Two lists that agree say how many cylinders there are; the order may have lost one.
    n = pins if pins == banks else len(order)
    twice = sorted({c for c in order if order.count(c) > 1})
    never = sorted(set(range(1, n + 1)) - set(order))
    strange = sorted(set(order) - set(range(1, n + 1)))
    wrong = [f"cylinder {c} fires twice" for c in twice[:1]]
    wrong += [f"cylinder {c} of 1..{n} never fires" for c in never[:1]]
    spare = (twice or strange)[:1]
    remedy = f"; put {never[0]} in place of {'one ' if twice else 'the '}{spare[0]}" if spare and never else ""
    _of("firing_order", not (twice or never), f"{', '.join(wrong)}{remedy or '; each fires once'}")
    _of("firing_order", not strange, f"cylinder {(strange or (0,))[0]} has no pin; cylinders.pins knows 1..{n}")


def _check_rods(engine: Engine) -> None:
    """Refuse rods that share a pin and do not lie on it side by side."""
    crank, cylinders, big_end = engine.crankshaft, engine.cylinders, engine.big_end_bearing
    n, offsets, half_pin = len(cylinders.firing_order), cylinders.rod_offsets, 0.5 * crank.pin_width
    text = f"{len(offsets)} offsets for {n} cylinders; give one for each, or none"
    _of("rod_offsets", len(offsets) in (0, n), text)
    for k, offset in enumerate(offsets, start=1):
        text = f"rod {k} at {mm(offset)} lies beside its pin, which ends {mm(half_pin)} from its middle"
        _of("rod_offsets", abs(offset) < half_pin, text)
    if big_end is None:
        return
    width = big_end.width
    for pin in sorted(set(cylinders.pins)):
        rods = sorted((engine.rod_offsets[k], k + 1) for k in range(n) if cylinders.pins[k] == pin)
        if rods == [(0.0, rods[0][1])]:
            continue  # the width of a single big end belongs to the rules of its bearing
        names = " and ".join(str(k) for _, k in rods)
        together = len(rods) * width
        text = (
            f"pin {pin} is {mm(crank.pin_width)} wide, but rods {names} of {mm(width)} each need {mm(together)}; "
            f"widen it or lessen big_end_bearing.width to {mm(crank.pin_width / len(rods))}"
        )
        need("crankshaft", "pin_width", together <= crank.pin_width, text)
        for (before, first), (after, second) in pairwise(rods):
            text = (
                f"rods {first} and {second} overlap on pin {pin}: {mm(after - before)} apart, their big ends "
                f"{mm(width)} wide; set them at least {mm(width)} apart, e.g. at -{mm(0.5 * width)} and "
                f"{mm(0.5 * width)}"
            )
            _of("rod_offsets", after - before >= width * (1.0 - 1e-9), text)
        for offset, k in rods:
            text = (
                f"rod {k} at {mm(offset)} with its big end of {mm(width)} reaches beyond pin {pin}; keep within "
                f"{mm(half_pin - 0.5 * width)} of its middle"
            )
            _of("rod_offsets", abs(offset) + 0.5 * width <= half_pin * (1.0 + 1e-9), text)
