"""Readers of measurement files, one file a format: each lists its channels and reads their samples in blocks."""
