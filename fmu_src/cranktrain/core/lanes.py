"""Arithmetic on tuples of four numbers, which a compiler keeps in vector registers."""

from cranktrain.core.kernel import kernel

ZEROS = (0.0, 0.0, 0.0, 0.0)


@kernel
def four(row, at):
    """Four consecutive numbers of ``row``, starting at index ``at``."""
    return row[at], row[at + 1], row[at + 2], row[at + 3]


@kernel
def put_four(row, at, values):
    """Write four numbers into ``row``, starting at index ``at``."""
    row[at], row[at + 1], row[at + 2], row[at + 3] = values


@kernel
def plus(a, b):
    """Sum of two tuples of four."""
    a0, a1, a2, a3 = a
    b0, b1, b2, b3 = b
    return a0 + b0, a1 + b1, a2 + b2, a3 + b3


@kernel
def minus(a, b):
    """Difference of two tuples of four."""
    a0, a1, a2, a3 = a
    b0, b1, b2, b3 = b
    return a0 - b0, a1 - b1, a2 - b2, a3 - b3


@kernel
def scaled(factor, a):
    """``factor`` times a tuple of four."""
    a0, a1, a2, a3 = a
    return factor * a0, factor * a1, factor * a2, factor * a3
