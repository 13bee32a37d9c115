"""Reynolds' equation for any film on a rectangle; offline."""
