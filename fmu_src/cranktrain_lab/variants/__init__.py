"""Many variants of an engine: designs, models that compute one variant, execution, and optima."""
