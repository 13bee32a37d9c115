"""Total errors as they are kept and shipped: points, output families, figures of an engine, and their reader."""
