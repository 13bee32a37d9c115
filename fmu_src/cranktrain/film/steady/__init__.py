"""Plain bearings under a steady load: equilibrium, stiffness and damping, heat balance."""
