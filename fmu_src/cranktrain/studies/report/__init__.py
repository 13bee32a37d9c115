"""Report of an engine: one HTML file with what the package knows of it."""
