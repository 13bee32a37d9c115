"""Units that are simulated together: a master, its schemes, and the reconstruction of exchanged values."""
