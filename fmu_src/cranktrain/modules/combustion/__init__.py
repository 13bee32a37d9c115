"""Combustion: cylinder pressures of a virtual engine from a single-zone cycle with gas exchange.

Each cylinder is one zone of ideal gas, a mixture of air and products of combustion, between a piston whose angle is
given and two manifolds whose pressures and temperatures are given:

    dm/dt = ṁ_i − ṁ_e + ḃ,   dU/dt = −p dV/dt − Q̇_w + H_u ḃ + h_i ṁ_i − h_e ṁ_e,   p V = m R T,  U = m u(T, y)

with the fuel that burns ḃ (:mod:`.burn`), the wall heat Q̇_w (:mod:`.wall_heat`), the valves' flows ṁ
(:mod:`.valve_flow`) and the gas properties of :mod:`.gas`. Fuel takes no room before it burns. Energies, masses, work
and heats are integrated together by one Runge–Kutta method, which keeps their linear balances to rounding.
"""
