"""Time integration: stages, integrators, step control, error."""
