"""Torsion in the frequency domain, damped modes, damper optimum."""
