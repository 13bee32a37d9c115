"""Variants of an engine as results: tables, percentiles, sensitivities, Pareto fronts, pictures."""
