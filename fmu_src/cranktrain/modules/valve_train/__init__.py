"""Valve train: lifts, forces and the torque on the crank of a virtual engine's valve train, from crank angle and speed.

A timing drive with backlash drives a rigid camshaft, J ω̇ = T_d − Σ F (z′ + μ i (r_b + s)) − d ω. Each of its cams
drives a pair of valves through follower, pushrod, rocker and bridge. These are reduced to one mass at the valve, with
one stiffness and the lash. The spring is distributed; its surge modes are excited by the motion of the valve:

    m ẍ + Σ μ_n q̈_n + p + k x = F(z − x) + S(−x),   m_n q̈_n + c_n q̇_n + k_n q_n + μ_n ẍ = 0,   z = i s(ψ) − lash

with the lift s of the cam at its angle ψ (:mod:`.cam`), contact forces F of the train and S of the seat that only push
(:mod:`.line`), and the modes of :mod:`.settings`. Camshaft and all valves are solved together (:mod:`.stepping`).
"""
