"""Readers of measurement files, one module per format, which list channels and read their samples in blocks."""
