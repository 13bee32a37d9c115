"""Two results side by side: their differences, and whether these are within tolerances."""
