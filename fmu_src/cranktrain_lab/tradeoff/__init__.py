"""Accuracy against speed: cost and error of each choice of method, level and resolution."""
