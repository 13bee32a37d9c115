"""Outputs of the running model."""
