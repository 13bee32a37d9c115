"""Heat transfer to the walls with Woschni's coefficient.

    α = 130 D^−0.2 p^0.8 T^−0.53 (C₁ c_m + C₂ V_h T₁/(p₁ V₁) (p − p₀))^0.8     W/(m² K), p in bar, D in m

C₁ is 6.18 + 0.417 c_u/c_m while valves are open, else 2.28 + 0.308 c_u/c_m. C₂ is 3.24e-3 m/(s K) from the start of
combustion until a valve opens, else 0. p₀ is the pressure of the motored engine, here of a polytrope from state 1, at
which the valves closed.

Sources: G. Woschni, SAE 670931 (1967); G. P. Merker, C. Schwarz, Grundlagen Verbrennungsmotoren, section on heat
transfer (exponents of the later form).
"""

from cranktrain.core.kernel import inlined_kernel

COMBUSTION_TERM = 3.24e-3
"""Woschni's constant C₂ during combustion, m/(s K)."""
MOTORED_EXPONENT = 1.35
"""Exponent of the polytrope for the motored pressure p₀; chosen."""


@inlined_kernel
def woschni_coefficient(pressure, temperature, bore, gas_speed):
    """Heat transfer coefficient, W/(m² K), from pressure (Pa), temperature (K), bore (m) and gas speed (m/s)."""
    return 130.0 * bore**-0.2 * (1.0e-5 * pressure * gas_speed) ** 0.8 * temperature**-0.53


@inlined_kernel
def piston_term(open_valves, swirl):
    """Woschni's constant C₁ with open or closed valves, at a swirl c_u/c_m."""
    return 6.18 + 0.417 * swirl if open_valves else 2.28 + 0.308 * swirl
