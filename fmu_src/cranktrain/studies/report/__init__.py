"""Report of an engine: one HTML file with all results of the package."""
