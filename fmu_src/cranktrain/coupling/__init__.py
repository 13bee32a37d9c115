"""Units that are simulated together: a master, its schemes, what it makes of the values that it hands on."""
