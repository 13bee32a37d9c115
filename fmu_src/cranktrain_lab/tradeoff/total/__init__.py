"""Study of total error against cost, for all choices of crank, bearings, block and step, against the best model."""
