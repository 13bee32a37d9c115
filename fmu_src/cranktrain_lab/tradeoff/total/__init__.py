"""Total error against cost: every choice of crank, bearings, block and step against the best model there is."""
