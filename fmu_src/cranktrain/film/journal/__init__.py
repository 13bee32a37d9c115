"""Journal films in a rigid bore, solved online."""
