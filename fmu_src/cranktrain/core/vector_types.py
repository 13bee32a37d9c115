"""Numba's type of four doubles that stay in a vector register, and its arithmetic.

Products and sums by + - * are rounded one by one: nothing is contracted or reordered, and a processor without 256-bit
registers gives the same bits in two halves. :mod:`cranktrain.core.vectors` makes, loads and stores such vectors.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel import models
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import register_model

LANES = 4
VECTOR = ir.VectorType(ir.DoubleType(), LANES)


class FourDoubles(types.Type):
    """Four doubles in one register."""

    def __init__(self) -> None:
        super().__init__("four_doubles")


FOUR = FourDoubles()


@register_model(FourDoubles)
class _FourModel(models.PrimitiveModel):
    """An LLVM vector."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR)


def all_lanes(builder: Any, scalar: Any) -> Any:
    """A vector with one scalar in all lanes."""
    undefined = ir.Constant(VECTOR, ir.Undefined)
    first = builder.insert_element(undefined, scalar, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))


def _arithmetic(symbol: Any, instruction: str) -> None:
    """Define ``symbol`` of two vectors, and of a number and a vector either way."""
    number = types.float64
    pairs = [(FOUR, FOUR), (number, FOUR), (FOUR, number)]

    class _Template(ConcreteTemplate):
        cases = [signature(FOUR, *pair) for pair in pairs]  # noqa: RUF012 - numba reads a plain list

    infer_global(symbol)(_Template)
    for pair in pairs:

        @lower_builtin(symbol, *pair)
        def _generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            left, right = (
                value if kind == FOUR else all_lanes(builder, value)
                for kind, value in zip(sig.args, values, strict=True)
            )
            return getattr(builder, instruction)(left, right)


for _symbols, _instruction in (
    ((operator.add, operator.iadd), "fadd"),
    ((operator.sub, operator.isub), "fsub"),
    ((operator.mul, operator.imul), "fmul"),
    ((operator.truediv, operator.itruediv), "fdiv"),
):
    for _symbol in _symbols:
        _arithmetic(_symbol, _instruction)
