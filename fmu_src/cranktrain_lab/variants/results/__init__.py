"""Results of variants: tables, percentiles, sensitivities, Pareto fronts, pictures."""
