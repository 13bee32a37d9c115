"""Modes in motion (small motions about the settled cycle of an assembled engine) and damping inherited from them."""
