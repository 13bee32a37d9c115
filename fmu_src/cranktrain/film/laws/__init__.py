"""Force laws of bearings: the register, and one file a law."""
