"""Stored data: HDF5 files, film tables."""
