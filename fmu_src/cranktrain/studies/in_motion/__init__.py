"""Modes in motion: small motions about the settled cycle of a running crank, as a damped eigenproblem."""
