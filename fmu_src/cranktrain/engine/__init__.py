"""An engine described: its parts as data, its file, and what is refused."""
