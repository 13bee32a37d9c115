"""Numba's types of four doubles and of eight singles in a vector register, and their arithmetic.

Products and sums by + - * / are rounded one by one: nothing is contracted or reordered. A processor without 256-bit
registers computes the same bits in two halves. :mod:`cranktrain.core.vectors` makes, loads and stores vectors of
doubles, :mod:`cranktrain.core.side_by_side` vectors of singles. A comparison of two vectors of singles gives a mask
with one bit per lane; masks are combined by & | and ^.
"""

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
SINGLES = 8
SINGLE_VECTOR = ir.VectorType(ir.FloatType(), SINGLES)
MASK_VECTOR = ir.VectorType(ir.IntType(1), SINGLES)


class VectorKind(types.Type):
    """Numba type of a vector register whose lanes have one LLVM type."""

    def __init__(self, name: str, vector: Any) -> None:
        super().__init__(name)
        self.vector = vector


class FourDoubles(VectorKind):
    """Type of four doubles."""


class EightSingles(VectorKind):
    """Type of eight singles."""


class EightTruths(VectorKind):
    """Type of a mask: one truth value for each of eight lanes."""


FOUR = FourDoubles("four_doubles", VECTOR)
EIGHT = EightSingles("eight_singles", SINGLE_VECTOR)
MASK = EightTruths("eight_truths", MASK_VECTOR)


@register_model(FourDoubles)
@register_model(EightSingles)
@register_model(EightTruths)
class _VectorModel(models.PrimitiveModel):
    """Data model: an LLVM vector."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, kind.vector)


def all_lanes(builder: Any, scalar: Any, vector: Any = VECTOR) -> Any:
    """Vector with one scalar in all lanes; a double is rounded to single if the lanes are singles."""
    if vector is SINGLE_VECTOR and scalar.type != ir.FloatType():
        scalar = builder.fptrunc(scalar, ir.FloatType())
    undefined = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(undefined, scalar, ir.Constant(ir.IntType(32), 0))
    none = ir.Constant(ir.VectorType(ir.IntType(32), vector.count), [0] * vector.count)
    return builder.shuffle_vector(first, undefined, none)


def _define(symbol: Any, of: VectorKind, answer: VectorKind, number: Any, make: Any) -> None:
    """Define operator ``symbol`` for two vectors, or number and vector; ``make(builder, left, right)`` emits code."""
    pairs = [(of, of)] + ([(number, of), (of, number)] if number is not None else [])

    class _Template(ConcreteTemplate):
        cases = [signature(answer, *pair) for pair in pairs]  # noqa: RUF012 - numba reads a plain list

    infer_global(symbol)(_Template)
    for pair in pairs:

        @lower_builtin(symbol, *pair)
        def _generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            left, right = (
                value if kind == of else all_lanes(builder, value, of.vector)
                for kind, value in zip(sig.args, values, strict=True)
            )
            return make(builder, left, right)


def _instruction(name: str) -> Any:
    return lambda builder, left, right: getattr(builder, name)(left, right)


def _comparison(symbol: str) -> Any:
    return lambda builder, left, right: builder.fcmp_ordered(symbol, left, right)


for _symbols, _name in (
    ((operator.add, operator.iadd), "fadd"),
    ((operator.sub, operator.isub), "fsub"),
    ((operator.mul, operator.imul), "fmul"),
    ((operator.truediv, operator.itruediv), "fdiv"),
):
    for _symbol in _symbols:
        for _kind in (FOUR, EIGHT):
            _define(_symbol, _kind, _kind, types.float64, _instruction(_name))
for _symbol, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")):
    _define(_symbol, EIGHT, MASK, types.float64, _comparison(_sign))
_define(operator.ne, EIGHT, MASK, types.float64, lambda builder, one, other: builder.fcmp_unordered("!=", one, other))
for _symbol, _name in ((operator.and_, "and_"), (operator.or_, "or_"), (operator.xor, "xor")):
    _define(_symbol, MASK, MASK, None, _instruction(_name))
