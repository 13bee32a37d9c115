"""Orders of a signal, and the resonances that they show."""
