"""The native FMU: machine code of the very kernels that Python runs, behind a small C file, with an engine as data."""
