"""Native FMU, which needs no Python: machine code of the kernels, a C shim, and the model's data as one flat file."""
