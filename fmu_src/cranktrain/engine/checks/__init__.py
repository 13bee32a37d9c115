"""Rules that the tables of an engine file must keep, beyond the bounds of single values."""
