"""Search for the periodic motion of a run: distance of a cycle from it, and corrections that reach it in few cycles."""
