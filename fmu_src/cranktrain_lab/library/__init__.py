"""Functions of the library whose calls differ from their verbs."""
