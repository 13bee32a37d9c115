"""Which parameters describe a crankshaft: refused in one line before any CAD kernel sees them."""

from __future__ import annotations

from functools import partial

from cranktrain.engine.parts import BalanceWeights, Crankshaft
from cranktrain.engine.quantities import check_values, mm, need, need_equal_lengths


def check_crankshaft(c: Crankshaft) -> None:
    """Refuse parameters that describe no crankshaft, before any CAD kernel sees them.

    Raises ``InputError``: one line that starts with the key, e.g. ``crankshaft.web_pin_radius``.
    """
    of, throws, widths, webs = (
        partial(need, "crankshaft"),
        len(c.throw_angles),
        len(c.main_widths),
        len(c.counterweights),
    )
    of("throw_angles", throws >= 1, "is empty; give the angle of each throw")
    of("main_widths", widths == throws + 1, f"{widths} widths for {throws} throws; give one more than there are throws")
    text = f"{webs} entries for {throws} throws; give one for each of the two webs of a throw"
    of("counterweights", webs == 2 * throws, text)
    check_values(c, "crankshaft")
    main, pin = 0.5 * c.main_diameter + c.fillet, 0.5 * c.pin_diameter + c.fillet
    least = min((c.pin_width, *c.main_widths))
    text = f"the pin lies outside its web: {mm(c.web_pin_radius)} is less than its radius and fillet, {mm(pin)}"
    of("web_pin_radius", c.web_pin_radius >= pin, text)
    text = f"the main journal lies outside the web: {mm(c.web_main_radius)} is less than radius and fillet, {mm(main)}"
    of("web_main_radius", c.web_main_radius >= main, text)
    text = f"two fillets of {mm(c.fillet)} leave nothing of the narrowest journal, {mm(least)}"
    of("fillet", 2.0 * c.fillet < least, text)
    text = f"{mm(c.nose_diameter)} and two fillets must be thinner than the main journal, {mm(c.main_diameter)}"
    of("nose_diameter", 0.5 * c.nose_diameter + c.fillet < 0.5 * c.main_diameter, text)
    of("nose_length", c.nose_length > c.fillet, f"{mm(c.nose_length)} is shorter than the fillet")
    text = f"{mm(c.flange_diameter)} must be wider than the last main journal and its fillets, {mm(2.0 * main)}"
    of("flange_diameter", 0.5 * c.flange_diameter > main, text)
    if any(c.counterweights):
        text = f"{mm(c.counterweight_radius)} does not reach beyond the web, {mm(c.web_main_radius)}"
        of("counterweight_radius", c.counterweight_radius > c.web_main_radius, text)
        text = f"{mm(c.counterweight_half_width)} is narrower than the main journal with its fillet, {mm(main)}"
        of("counterweight_half_width", c.counterweight_half_width > main, text)
    widest = min(0.5 * min(c.pin_diameter, c.main_diameter), least - 2.0 * c.fillet)
    text = f"{mm(c.oil_hole_diameter)} does not fit between the fillets or exceeds half of a journal's diameter"
    of("oil_hole_diameter", c.oil_hole_diameter < widest or not c.oil_holes, text)
    finest = 0.02 * c.main_diameter
    text = f"{mm(c.mesh_size)} would take millions of elements; give at least {mm(finest)}"
    of("mesh_size", c.mesh_size >= finest, text)


def check_balance_weights(weights: BalanceWeights, mains: int) -> None:
    """Refuse balance weights that are incomplete or at no journal; the error starts with ``balance_weights.key``."""
    need_equal_lengths(weights, "balance_weights")
    for main in weights.mains:
        text = f"{main} is not one of the main journals 1..{mains}"
        need("balance_weights", "mains", 1 <= main <= mains, text)
