"""Modes in motion: small motions about the settled cycle of an assembled engine, and what a crank inherits of them."""
