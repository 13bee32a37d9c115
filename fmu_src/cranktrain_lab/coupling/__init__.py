"""Co-simulation of units (FMUs): a master, the master's schemes, and the reconstruction of exchanged values."""
