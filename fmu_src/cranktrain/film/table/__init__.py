"""Journal films in a rigid bore, read from a table."""
