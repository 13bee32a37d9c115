"""Force laws of bearings: their register, and one module for each law."""
