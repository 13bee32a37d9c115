"""Description of an engine: its parts as data, its file, and checks of its values."""
