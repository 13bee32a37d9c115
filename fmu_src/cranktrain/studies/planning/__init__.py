"""Scenes: the lowest levels that serve one, chosen by figures measured on its own model, and the runs that check it."""
