"""Which cylinders fit a crankshaft: every one fires once, and rods that share a pin lie side by side on it."""

from __future__ import annotations

from itertools import pairwise

from cranktrain.engine.checks.crankshaft import in_mm
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Cylinders

Rule = tuple[str, bool, str]


def cylinder_rules(engine: Engine) -> list[Rule]:
    """What rods, firing order, pins and banks must fulfil: (``table.key``, whether it holds, what is wrong)."""
    crank, rod, cylinders = engine.crankshaft, engine.rod, engine.cylinders
    n, throws = len(cylinders.firing_order), len(crank.throw_angles)
    reach = crank.throw + abs(cylinders.pin_offset)
    return [
        ("rod.length", rod.length > reach, f"{in_mm(rod.length)} is shorter than throw and pin offset, {in_mm(reach)}"),
        ("cylinders.firing_order", n >= 1, "is empty"),
        *_order_rules(cylinders),
        ("cylinders.pins", len(cylinders.pins) == n, f"{len(cylinders.pins)} pins for {n} cylinders; give one each"),
        (
            "cylinders.pins",
            all(1 <= pin <= throws for pin in cylinders.pins),
            f"{list(cylinders.pins)} names a pin that is not one of 1..{throws}",
        ),
        (
            "cylinders.bank_angles",
            len(cylinders.bank_angles) == n,
            f"{len(cylinders.bank_angles)} angles for {n} cylinders; give one for each",
        ),
        ("cylinders.compression_ratio", cylinders.compression_ratio > 1.0, "must exceed 1"),
        *_rod_rules(engine),
    ]


def _order_rules(cylinders: Cylinders) -> list[Rule]:
    """Every cylinder that has a pin fires once."""
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
    return [
        ("cylinders.firing_order", not (twice or never), f"{', '.join(wrong)}{remedy or '; each fires once'}"),
        (
            "cylinders.firing_order",
            not strange,
            f"cylinder {(strange or (0,))[0]} has no pin; cylinders.pins knows 1..{n}",
        ),
    ]


def _rod_rules(engine: Engine) -> list[Rule]:
    """Rods that share a pin lie on it side by side."""
    crank, cylinders, big_end = engine.crankshaft, engine.cylinders, engine.big_end_bearing
    n, offsets, half_pin = len(cylinders.firing_order), cylinders.rod_offsets, 0.5 * crank.pin_width
    rules: list[Rule] = [
        (
            "cylinders.rod_offsets",
            len(offsets) in (0, n),
            f"{len(offsets)} offsets for {n} cylinders; give one for each, or none",
        ),
        *(
            (
                "cylinders.rod_offsets",
                abs(offset) < half_pin,
                f"rod {k} at {in_mm(offset)} lies beside its pin, which ends {in_mm(half_pin)} from its middle",
            )
            for k, offset in enumerate(offsets, start=1)
        ),
    ]
    if big_end is None or len(offsets) not in (0, n) or len(cylinders.pins) != n:
        return rules
    for pin in sorted(set(cylinders.pins)):
        rods = sorted((engine.rod_offsets[k], k + 1) for k in range(n) if cylinders.pins[k] == pin)
        if rods == [(0.0, rods[0][1])]:
            continue  # the width of a single big end belongs to the rules of its bearing
        names = " and ".join(str(k) for _, k in rods)
        together = len(rods) * big_end.width
        rules.append(
            (
                "crankshaft.pin_width",
                together <= crank.pin_width,
                f"pin {pin} is {in_mm(crank.pin_width)} wide, but rods {names} of {in_mm(big_end.width)} each need "
                f"{in_mm(together)}; widen it or lessen big_end_bearing.width to {in_mm(crank.pin_width / len(rods))}",
            )
        )
        for (before, first), (after, second) in pairwise(rods):
            rules.append(
                (
                    "cylinders.rod_offsets",
                    after - before >= big_end.width * (1.0 - 1e-9),
                    f"rods {first} and {second} overlap on pin {pin}: {in_mm(after - before)} apart, their big ends "
                    f"{in_mm(big_end.width)} wide; set them at least {in_mm(big_end.width)} apart, e.g. at "
                    f"-{in_mm(0.5 * big_end.width)} and {in_mm(0.5 * big_end.width)}",
                )
            )
        rules += [
            (
                "cylinders.rod_offsets",
                abs(offset) + 0.5 * big_end.width <= half_pin * (1.0 + 1e-9),
                f"rod {k} at {in_mm(offset)} with its big end of {in_mm(big_end.width)} reaches beyond pin {pin}; keep "
                f"within {in_mm(half_pin - 0.5 * big_end.width)} of its middle",
            )
            for offset, k in rods
        ]
    return rules
