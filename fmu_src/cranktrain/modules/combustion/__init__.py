"""Combustion: cylinder pressures of a virtual engine from a single-zone cycle with gas exchange.

Each cylinder is one zone of ideal gas, a mixture of air and combustion products, between a piston at a given angle and
two manifolds of given pressures and temperatures:

    dm/dt = ṁ_i − ṁ_e + ḃ,   dU/dt = −p dV/dt − Q̇_w + H_u ḃ + h_i ṁ_i − h_e ṁ_e,   p V = m R T,  U = m u(T, y)

with the burn rate ḃ of the fuel (:mod:`.burn`), the wall heat Q̇_w (:mod:`.wall_heat`), the valve flows ṁ
(:mod:`.valve_flow`) and the gas properties of :mod:`.gas`. Fuel occupies no volume before it burns. Energies, masses,
work and heats are integrated together by one Runge–Kutta method, which keeps their linear balances to rounding.
"""
