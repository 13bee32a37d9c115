"""Solution of several elastic films at once, one film in each lane of the vector registers."""
