"""Which parameters describe a crankshaft: refused in one line before any CAD kernel sees them."""

from __future__ import annotations

import math

from cranktrain.core.errors import InputError
from cranktrain.engine.parts import BalanceWeights, Crankshaft


def check_crankshaft(crankshaft: Crankshaft) -> None:
    """Refuse parameters that describe no crankshaft, before any CAD kernel sees them.

    Raises
    ------
    InputError
        one line that starts with the key, e.g. ``crankshaft.web_pin_radius``
    """
    c = crankshaft
    throws = len(c.throw_angles)
    main, pin = 0.5 * c.main_diameter + c.fillet, 0.5 * c.pin_diameter + c.fillet
    narrowest = min((c.pin_width, *c.main_widths))
    slim = min(c.pin_diameter, c.main_diameter)
    heavy, drilled = any(c.counterweights), c.oil_holes
    rules: tuple[tuple[bool, str, str], ...] = (
        (throws >= 1, "throw_angles", "is empty; give the angle of each throw"),
        (
            len(c.main_widths) == throws + 1,
            "main_widths",
            f"{len(c.main_widths)} widths for {throws} throws; give one more than there are throws",
        ),
        (
            len(c.counterweights) == 2 * throws,
            "counterweights",
            f"{len(c.counterweights)} entries for {throws} throws; give one for each of the two webs of a throw",
        ),
        *((0.0 < width < math.inf, "main_widths", "every width must be positive") for width in c.main_widths),
        *((math.isfinite(angle), "throw_angles", "every angle must be a finite number") for angle in c.throw_angles),
        *(
            (0.0 < value < 10.0, key, "must be positive and below 10 m; check its unit")
            for key, value in vars(c).items()
            if isinstance(value, float)
        ),
        (
            c.web_pin_radius >= pin,
            "web_pin_radius",
            f"the pin lies outside its web: {in_mm(c.web_pin_radius)} is less than its radius and fillet, {in_mm(pin)}",
        ),
        (
            c.web_main_radius >= main,
            "web_main_radius",
            f"the main journal lies outside the web: {in_mm(c.web_main_radius)} is less than its radius and fillet, "
            f"{in_mm(main)}",
        ),
        (
            2.0 * c.fillet < narrowest,
            "fillet",
            f"two fillets of {in_mm(c.fillet)} leave nothing of the narrowest journal, {in_mm(narrowest)}",
        ),
        (
            0.5 * c.nose_diameter + c.fillet < 0.5 * c.main_diameter,
            "nose_diameter",
            f"{in_mm(c.nose_diameter)} and two fillets must be thinner than the main journal, {in_mm(c.main_diameter)}",
        ),
        (c.nose_length > c.fillet, "nose_length", f"{in_mm(c.nose_length)} is shorter than the fillet"),
        (
            0.5 * c.flange_diameter > main,
            "flange_diameter",
            f"{in_mm(c.flange_diameter)} must be wider than the last main journal and its fillets, {in_mm(2.0 * main)}",
        ),
        (
            c.counterweight_radius > c.web_main_radius or not heavy,
            "counterweight_radius",
            f"{in_mm(c.counterweight_radius)} does not reach beyond the web, {in_mm(c.web_main_radius)}",
        ),
        (
            c.counterweight_half_width > main or not heavy,
            "counterweight_half_width",
            f"{in_mm(c.counterweight_half_width)} is narrower than the main journal with its fillet, {in_mm(main)}",
        ),
        (
            c.oil_hole_diameter < min(0.5 * slim, narrowest - 2.0 * c.fillet) or not drilled,
            "oil_hole_diameter",
            f"{in_mm(c.oil_hole_diameter)} does not fit between the fillets or exceeds half of a journal's diameter",
        ),
        (
            c.mesh_size >= 0.02 * c.main_diameter,
            "mesh_size",
            f"{in_mm(c.mesh_size)} would take millions of elements; give at least {in_mm(0.02 * c.main_diameter)}",
        ),
    )
    for holds, key, text in rules:
        if not holds:
            raise InputError(f"crankshaft.{key}: {text}")


def check_balance_weights(weights: BalanceWeights, crankshaft: Crankshaft) -> None:
    """Refuse balance weights that are incomplete or at no journal; the error starts with ``balance_weights.key``."""
    count, mains = len(weights.mains), len(crankshaft.main_widths)
    for key, values in vars(weights).items():
        if len(values) != count:
            raise InputError(f"balance_weights.{key}: {len(values)} values for {count} mains; give one for each weight")
    for main in weights.mains:
        if not 1 <= main <= mains:
            raise InputError(f"balance_weights.mains: {main} is not one of the main journals 1..{mains}")


def in_mm(length: float) -> str:
    """A length (m) as a message says it."""
    return f"{1e3 * length:.4g} mm"
