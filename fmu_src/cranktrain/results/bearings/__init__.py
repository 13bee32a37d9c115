"""Plain bearings over a cycle: loads, friction, limits, pictures."""
