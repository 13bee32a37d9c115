"""Description of an engine: parts as data, engine files, and checks of the values."""
