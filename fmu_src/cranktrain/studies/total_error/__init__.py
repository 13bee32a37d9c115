"""Stored and shipped total errors: points, output families, figures of an engine, and their reader."""
