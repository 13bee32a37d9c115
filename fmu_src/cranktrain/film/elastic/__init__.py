"""Journal films in an elastic bore, solved online."""
