"""Loads on the crankshaft: gas, rods and pistons, drive line."""
