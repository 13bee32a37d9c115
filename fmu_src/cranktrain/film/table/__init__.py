"""Fluid films of journals in a rigid bore, read from a table."""
