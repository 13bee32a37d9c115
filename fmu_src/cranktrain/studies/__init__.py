"""Questions that take structure and dynamics together: optimum dampers, damped modes, run-ups."""
