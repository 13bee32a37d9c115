"""Fluid films of journals in an elastic bore, solved online."""
