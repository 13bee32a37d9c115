"""Many variants of an engine: designs, models that answer for one variant, and their running; optima."""
