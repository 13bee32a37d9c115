"""Four or eight numbers side by side, as tuples that a compiler keeps in vector registers."""

from __future__ import annotations

from cranktrain.core.kernel import kernel

ZEROS = (0.0, 0.0, 0.0, 0.0)


@kernel
def four(row, at):
    """Four numbers of ``row`` from ``at`` on."""
    return row[at], row[at + 1], row[at + 2], row[at + 3]


@kernel
def put_four(row, at, values):
    """Write four numbers into ``row`` from ``at`` on."""
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


@kernel
def eight(row, at):
    """Eight numbers of ``row`` from ``at`` on."""
    return row[at], row[at + 1], row[at + 2], row[at + 3], row[at + 4], row[at + 5], row[at + 6], row[at + 7]


@kernel
def put_eight(row, at, values):
    """Write eight numbers into ``row`` from ``at`` on."""
    c0, c1, c2, c3, c4, c5, c6, c7 = values
    put_four(row, at, (c0, c1, c2, c3))
    put_four(row, at + 4, (c4, c5, c6, c7))


@kernel
def add_eight(a, factor, b):
    """A tuple of eight plus ``factor`` times another."""
    a0, a1, a2, a3, a4, a5, a6, a7 = a
    b0, b1, b2, b3, b4, b5, b6, b7 = b
    return (
        a0 + factor * b0, a1 + factor * b1, a2 + factor * b2, a3 + factor * b3,
        a4 + factor * b4, a5 + factor * b5, a6 + factor * b6, a7 + factor * b7,
    )  # fmt: skip


@kernel
def scale_eight(factor, a):
    """``factor`` times a tuple of eight."""
    a0, a1, a2, a3, a4, a5, a6, a7 = a
    return a0 * factor, a1 * factor, a2 * factor, a3 * factor, a4 * factor, a5 * factor, a6 * factor, a7 * factor
