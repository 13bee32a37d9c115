"""Fluid films of journals in a rigid bore, solved online."""
