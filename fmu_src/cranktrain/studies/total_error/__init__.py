"""Stored and shipped total errors: measured choices of levels, output families, and reader of shipped errors."""
