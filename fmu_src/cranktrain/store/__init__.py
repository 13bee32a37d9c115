"""Storage of data: HDF5 files, film tables, journals and caches of studies."""
