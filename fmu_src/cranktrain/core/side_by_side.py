"""Vectors of the same number of several objects: eight singles, one object in each lane, or one double of one object.

A kernel written with these functions serves both: an array of singles holds eight objects, and its last axis counts in
groups of eight, one number per lane, so that a compiler knows all distances along it; an array of doubles holds one
object. Kernels compute with such vectors by + - * /, compare them to get masks, and select by masks, see
:mod:`cranktrain.core.vector_types`. Numbers may take the place of vectors. Lanes are independent: the value in a lane
does not depend on its neighbours. Sums that must not lose digits are kept in doubles (:data:`add_to`).

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


def _one(kind: Any) -> bool:
    """True for arrays of doubles, which hold one object, and for numbers."""
    return getattr(kind, "dtype", kind) != compiler().types.float32 and kind not in (_types().EIGHT, _types().MASK)


def _place(context: Any, builder: Any, array: Any, kind: Any, value: Any, index: Any, lanes: int) -> Any:
    """Address of lane 0 of an array entry, for an index whose last axis counts in groups of ``lanes``."""
    numba = compiler()
    if lanes == 1:
        return entry_place(context, builder, numba.types.void(array, kind), (value, index))
    integer = numba.types.intp
    whole = isinstance(kind, numba.types.BaseTuple)
    parts = list(kind) if whole else [kind]
    values = [builder.extract_value(index, k) for k in range(len(parts))] if whole else [index]
    last = context.cast(builder, values[-1], parts[-1], integer)
    eights = builder.mul(last, context.get_constant(integer, lanes))
    tuple_kind = numba.types.Tuple((*parts[:-1], integer))
    packed = context.make_tuple(builder, tuple_kind, [*values[:-1], eights])
    return entry_place(context, builder, numba.types.void(array, tuple_kind), (value, packed))


def _checked(array: Any) -> bool:
    """Return True for an array of doubles, False for one of singles; refuse any other, and layouts other than C."""
    one = _one(array)
    contiguous(array, kind="float64" if one else "float32")
    return one


def _loading() -> Any:
    found, numba = _types(), compiler()

    def load(typing_context: Any, array: Any, at: Any) -> Any:
        one = _checked(array)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            address = _place(context, builder, array, at, values[0], values[1], 1 if one else SINGLES)
            if one:
                return builder.load(address)
            return builder.load(builder.bitcast(address, found.SINGLE_VECTOR.as_pointer()), align=4)

        return (numba.types.float64 if one else found.EIGHT)(array, at), generate

    return load


def _storing() -> Any:
    found, numba = _types(), compiler()

    def store(typing_context: Any, array: Any, at: Any, vector: Any) -> Any:
        one = _checked(array)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            address = _place(context, builder, array, at, values[0], values[1], 1 if one else SINGLES)
            if one:
                builder.store(values[2], address)
            else:
                builder.store(values[2], builder.bitcast(address, found.SINGLE_VECTOR.as_pointer()), align=4)
            return context.get_dummy_value()

        return numba.types.void(array, at, numba.types.float64 if one else found.EIGHT), generate

    return store


def _adding() -> Any:
    from llvmlite import ir

    found, numba = _types(), compiler()
    wide = ir.VectorType(ir.DoubleType(), SINGLES)

    def add_to(typing_context: Any, array: Any, at: Any, vector: Any) -> Any:
        contiguous(array)
        one = _one(vector)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            address = _place(context, builder, array, at, values[0], values[1], 1 if one else SINGLES)
            if one:
                builder.store(builder.fadd(builder.load(address), values[2]), address)
            else:
                pointer = builder.bitcast(address, wide.as_pointer())
                total = builder.fadd(builder.load(pointer, align=8), builder.fpext(values[2], wide))
                builder.store(total, pointer, align=8)
            return context.get_dummy_value()

        return numba.types.void(array, at, numba.types.float64 if one else found.EIGHT), generate

    return add_to


def _rounding() -> Any:
    from llvmlite import ir

    found, numba = _types(), compiler()
    wide = ir.VectorType(ir.DoubleType(), SINGLES)

    def rounded(typing_context: Any, array: Any, at: Any, like: Any) -> Any:
        contiguous(array)
        one = _one(like)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            address = _place(context, builder, array, at, values[0], values[1], 1 if one else SINGLES)
            if one:
                return builder.load(address)
            doubles = builder.load(builder.bitcast(address, wide.as_pointer()), align=8)
            return builder.fptrunc(doubles, found.SINGLE_VECTOR)

        return (numba.types.float64 if one else found.EIGHT)(array, at, like), generate

    return rounded


def _spreading() -> Any:
    found, numba = _types(), compiler()

    def spread(typing_context: Any, number: Any, like: Any) -> Any:
        one = _one(like)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return values[0] if one else found.all_lanes(builder, values[0], found.SINGLE_VECTOR)

        return (numba.types.float64 if one else found.EIGHT)(numba.types.float64, like), generate

    return spread


def _counting() -> Any:
    numba = compiler()

    def lane_count(typing_context: Any, like: Any) -> Any:
        lanes = 1 if _one(like) else SINGLES

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return context.get_constant(numba.types.int64, lanes)

        return numba.types.int64(like), generate

    return lane_count


def _of_lanes(make: Callable[..., Any], masked: bool = False) -> Callable[[], Any]:
    """Make a function of two or three vectors or numbers, after a mask if ``masked``: ``make(builder, *values)``."""

    def making() -> Any:
        found, double = _types(), compiler().types.float64

        def typed(kinds: tuple[Any, ...]) -> Any:
            operands = kinds[masked:]
            vectors = [kind == found.EIGHT for kind in operands]
            answer = found.EIGHT if any(vectors) or (masked and kinds[0] == found.MASK) else double
            taken = [found.EIGHT if vector else double for vector in vectors]
            mask = [found.MASK if kinds[0] == found.MASK else compiler().types.boolean] if masked else []

            def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
                rest = [
                    value if kind == answer else found.all_lanes(builder, value, found.SINGLE_VECTOR)
                    for kind, value in zip(taken, values[masked:], strict=True)
                ]
                return make(builder, *values[:masked], *rest)

            return answer(*mask, *taken), generate

        def two(typing_context: Any, one: Any, other: Any) -> Any:
            return typed((one, other))

        def three(typing_context: Any, first: Any, one: Any, other: Any) -> Any:
            return typed((first, one, other))

        return two if make is _least or make is _most else three

    return making


def _choice(builder: Any, mask: Any, one: Any, other: Any) -> Any:
    return builder.select(mask, one, other)


def _least(builder: Any, one: Any, other: Any) -> Any:
    return builder.select(builder.fcmp_ordered("<", one, other), one, other)


def _most(builder: Any, one: Any, other: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", one, other), one, other)


def _plus(builder: Any, total: Any, one: Any, other: Any) -> Any:
    from llvmlite import ir

    vector = total.type
    if vector == ir.DoubleType():
        return builder.fadd(total, builder.fmul(one, other))
    function = builder.module.globals.get("llvm.fmuladd.v8f32")
    if function is None:
        function = ir.Function(builder.module, ir.FunctionType(vector, [vector] * 3), "llvm.fmuladd.v8f32")
    return builder.call(function, [one, other, total])


def _minus(builder: Any, total: Any, one: Any, other: Any) -> Any:
    from llvmlite import ir

    if total.type == ir.DoubleType():
        return builder.fsub(total, builder.fmul(one, other))
    return _plus(builder, total, builder.fneg(one), other)


def _reducing() -> Any:
    from llvmlite import ir

    numba = compiler()

    def any_lane(typing_context: Any, mask: Any) -> Any:
        one = _one(mask)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            if one:
                return values[0]
            bits = builder.bitcast(values[0], ir.IntType(SINGLES))
            return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(SINGLES), 0))

        return numba.types.boolean(mask), generate

    return any_lane


def _looking_up() -> Any:
    from llvmlite import ir

    found, numba = _types(), compiler()
    whole = ir.IntType(32)

    def looked_up(typing_context: Any, table: Any, place: Any, column: Any) -> Any:
        """Entries of one column of a table at the rows whose numbers are the integer parts of ``place``."""
        one = _checked(table)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            integer = numba.types.intp
            kind = numba.types.UniTuple(integer, 2)

            def entry(row: Any) -> Any:
                packed = context.make_tuple(builder, kind, [builder.sext(row, ir.IntType(64)), values[2]])
                return builder.load(entry_place(context, builder, numba.types.void(table, kind), (values[0], packed)))

            if one:
                return entry(builder.fptosi(values[1], whole))
            rows = builder.fptosi(values[1], ir.VectorType(whole, SINGLES))
            out = ir.Constant(found.SINGLE_VECTOR, ir.Undefined)
            for lane in range(SINGLES):
                at = ir.Constant(whole, lane)
                out = builder.insert_element(out, entry(builder.extract_element(rows, at)), at)
            return out

        vector = numba.types.float64 if one else found.EIGHT
        return vector(table, vector, numba.types.intp), generate

    return looked_up


get: Any = Intrinsic(_loading)
"""``(array, index)``: read the vector at an index whose last axis counts in groups of lanes."""
put: Any = Intrinsic(_storing)
"""``(array, index, vector)``: write a vector."""
add_to: Any = Intrinsic(_adding)
"""``(array of doubles, index, vector)``: add a vector to the doubles of its lanes."""
rounded: Any = Intrinsic(_rounding)
"""``(array of doubles, index, array)``: read the doubles of all lanes, rounded to the type of the second array."""
spread: Any = Intrinsic(_spreading)
"""``(number, array)``: vector with the number in all lanes, in the precision of the array."""
lane_count: Any = Intrinsic(_counting)
"""``(array)``: number of objects of an array, 1 in doubles; known when a kernel is compiled, and what depends on it."""
choose: Any = Intrinsic(_of_lanes(_choice, masked=True))
"""``(mask, one, other)``: in each lane ``one`` where the mask is true, else ``other``."""
plus_product: Any = Intrinsic(_of_lanes(_plus))
"""``(total, one, other)``: total + one · other; singles are rounded once if the processor can do so."""
minus_product: Any = Intrinsic(_of_lanes(_minus))
"""``(total, one, other)``: total − one · other; singles are rounded once if the processor can do so."""
least_of: Any = Intrinsic(_of_lanes(_least))
"""``(one, other)``: smaller number in each lane; ``other`` if either number is NaN."""
most_of: Any = Intrinsic(_of_lanes(_most))
"""``(one, other)``: larger number in each lane; ``other`` if either number is NaN."""
any_lane: Any = Intrinsic(_reducing)
"""``(mask)``: True if the mask is true in any lane."""
looked_up: Any = Intrinsic(_looking_up)
"""``(table, place, column)``: entries of a column of a table (n, m) at the rows ⌊place⌋ ≥ 0 of all lanes."""
