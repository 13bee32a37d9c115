"""General solver of Reynolds' equation on a rectangle, for offline use."""
