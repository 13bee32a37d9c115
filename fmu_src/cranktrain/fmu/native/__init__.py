"""The FMU that needs no Python: machine code of the kernels, a C shim over it, and a model's data as one flat file."""
