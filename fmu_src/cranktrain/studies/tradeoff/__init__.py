"""Accuracy against speed: what each choice of method, level and resolution costs and how far it is off."""
