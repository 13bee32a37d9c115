"""Vectors of eight single-precision numbers, with one film (or other object) in each lane.

The last axis of an array of singles counts in groups of eight, one number per lane, so a compiler knows all distances
along it. Kernels compute with such vectors by + - * /, compare them to get masks, and select by masks, see
:mod:`cranktrain.core.vector_types`. Lanes are independent: the value in a lane does not depend on its neighbours. Sums
that must not lose digits are kept in doubles (:data:`add_to`).

Arrays must be of layout C; the caller checks the bounds.
"""

from collections.abc import Callable
from typing import Any

from cranktrain.core.kernel import Intrinsic, compiler
from cranktrain.core.vectors import contiguous, entry_place

SINGLES = 8


def _types() -> Any:
    from cranktrain.core import vector_types

    return vector_types


def _whole_place(context: Any, builder: Any, array: Any, kind: Any, value: Any, index: Any) -> Any:
    """Address of lane 0 of an array entry, for an index whose last axis counts in groups of eight."""
    integer, numba = compiler().types.intp, compiler()
    whole = isinstance(kind, numba.types.BaseTuple)
    parts = list(kind) if whole else [kind]
    values = [builder.extract_value(index, k) for k in range(len(parts))] if whole else [index]
    last = context.cast(builder, values[-1], parts[-1], integer)
    eights = builder.mul(last, context.get_constant(integer, SINGLES))
    tuple_kind = numba.types.Tuple((*parts[:-1], integer))
    packed = context.make_tuple(builder, tuple_kind, [*values[:-1], eights])
    return entry_place(context, builder, numba.types.void(array, tuple_kind), (value, packed))


def _loading() -> Any:
    found = _types()

    def load(typing_context: Any, array: Any, at: Any) -> Any:
        contiguous(array, kind="float32")

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            address = _whole_place(context, builder, array, at, *values)
            return builder.load(builder.bitcast(address, found.SINGLE_VECTOR.as_pointer()), align=4)

        return found.EIGHT(array, at), generate

    return load


def _storing() -> Any:
    found, numba = _types(), compiler()

    def store(typing_context: Any, array: Any, at: Any, vector: Any) -> Any:
        contiguous(array, kind="float32")

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            address = _whole_place(context, builder, array, at, values[0], values[1])
            builder.store(values[2], builder.bitcast(address, found.SINGLE_VECTOR.as_pointer()), align=4)
            return context.get_dummy_value()

        return numba.types.void(array, at, found.EIGHT), generate

    return store


def _adding() -> Any:
    from llvmlite import ir

    found, numba = _types(), compiler()
    wide = ir.VectorType(ir.DoubleType(), SINGLES)

    def add_to(typing_context: Any, array: Any, at: Any, vector: Any) -> Any:
        contiguous(array)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            address = _whole_place(context, builder, array, at, values[0], values[1])
            pointer = builder.bitcast(address, wide.as_pointer())
            total = builder.fadd(builder.load(pointer, align=8), builder.fpext(values[2], wide))
            builder.store(total, pointer, align=8)
            return context.get_dummy_value()

        return numba.types.void(array, at, found.EIGHT), generate

    return add_to


def _rounding() -> Any:
    from llvmlite import ir

    found = _types()
    wide = ir.VectorType(ir.DoubleType(), SINGLES)

    def rounded(typing_context: Any, array: Any, at: Any) -> Any:
        contiguous(array)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            address = _whole_place(context, builder, array, at, *values)
            doubles = builder.load(builder.bitcast(address, wide.as_pointer()), align=8)
            return builder.fptrunc(doubles, found.SINGLE_VECTOR)

        return found.EIGHT(array, at), generate

    return rounded


def _spreading() -> Any:
    found, numba = _types(), compiler()

    def all_eight(typing_context: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return found.all_lanes(builder, values[0], found.SINGLE_VECTOR)

        return found.EIGHT(numba.types.float64), generate

    return all_eight


def _choosing() -> Any:
    found = _types()

    def choose(typing_context: Any, mask: Any, one: Any, other: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return builder.select(*values)

        return found.EIGHT(found.MASK, found.EIGHT, found.EIGHT), generate

    return choose


def _fusing(negative: bool) -> Callable[[], Any]:
    def making() -> Any:
        from llvmlite import ir

        found = _types()
        vector = found.SINGLE_VECTOR

        def product(typing_context: Any, total: Any, one: Any, other: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
                known = ir.FunctionType(vector, [vector] * 3)
                function = builder.module.globals.get("llvm.fmuladd.v8f32")
                if function is None:
                    function = ir.Function(builder.module, known, "llvm.fmuladd.v8f32")
                total, one, other = values
                return builder.call(function, [builder.fneg(one) if negative else one, other, total])

            return found.EIGHT(found.EIGHT, found.EIGHT, found.EIGHT), generate

        return product

    return making


def _extreme(sign: str) -> Callable[[], Any]:
    def making() -> Any:
        found = _types()

        def extreme(typing_context: Any, one: Any, other: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
                return builder.select(builder.fcmp_ordered(sign, values[0], values[1]), values[0], values[1])

            return found.EIGHT(found.EIGHT, found.EIGHT), generate

        return extreme

    return making


def _reducing() -> Any:
    from llvmlite import ir

    found, numba = _types(), compiler()

    def any_lane(typing_context: Any, mask: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            bits = builder.bitcast(values[0], ir.IntType(SINGLES))
            return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(SINGLES), 0))

        return numba.types.boolean(found.MASK), generate

    return any_lane


def _looking_up() -> Any:
    from llvmlite import ir

    found = _types()
    whole = ir.IntType(32)

    def looked_up(typing_context: Any, table: Any, place: Any, column: Any) -> Any:
        """Entries of one column of a table at eight rows, whose numbers are the integer parts of ``place``."""
        contiguous(table, kind="float32")

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            integer = compiler().types.intp
            rows = builder.fptosi(values[1], ir.VectorType(whole, SINGLES))
            out = ir.Constant(found.SINGLE_VECTOR, ir.Undefined)
            kind = compiler().types.UniTuple(integer, 2)
            for lane in range(SINGLES):
                at = ir.Constant(whole, lane)
                row = builder.sext(builder.extract_element(rows, at), ir.IntType(64))
                packed = context.make_tuple(builder, kind, [row, values[2]])
                address = entry_place(context, builder, compiler().types.void(table, kind), (values[0], packed))
                out = builder.insert_element(out, builder.load(address), at)
            return out

        return found.EIGHT(table, found.EIGHT, compiler().types.intp), generate

    return looked_up


eight: Any = Intrinsic(_loading)
"""``(array, index)``: read eight singles of an array; the last axis of the index counts in groups of eight."""
put_eight: Any = Intrinsic(_storing)
"""``(array, index, vector)``: write eight singles."""
add_to: Any = Intrinsic(_adding)
"""``(array of doubles, index, vector)``: add eight singles to eight doubles."""
rounded: Any = Intrinsic(_rounding)
"""``(array of doubles, index)``: read eight doubles, rounded to singles."""
all_eight: Any = Intrinsic(_spreading)
"""``(number)``: vector with one number in all lanes."""
choose: Any = Intrinsic(_choosing)
"""``(mask, one, other)``: in each lane ``one`` where the mask is true, else ``other``."""
plus_product: Any = Intrinsic(_fusing(False))
"""``(total, one, other)``: total + one · other, rounded once if the processor can do so, else twice."""
minus_product: Any = Intrinsic(_fusing(True))
"""``(total, one, other)``: total − one · other, rounded once if the processor can do so, else twice."""
least_of: Any = Intrinsic(_extreme("<"))
"""``(one, other)``: smaller number in each lane; ``other`` if either number is NaN."""
most_of: Any = Intrinsic(_extreme(">"))
"""``(one, other)``: larger number in each lane; ``other`` if either number is NaN."""
any_lane: Any = Intrinsic(_reducing)
"""``(mask)``: True if the mask is true in any lane."""
looked_up: Any = Intrinsic(_looking_up)
"""``(table, place, column)``: entries of a column of a table (n, m) of singles at eight rows, ⌊place⌋ ≥ 0."""
