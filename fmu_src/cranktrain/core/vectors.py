"""Four doubles at once, for the innermost loops that LLVM does not vectorise by itself.

Each operation takes four neighbouring columns as an LLVM vector. Products and sums are rounded one by one, in the order
of the rows: nothing is contracted or reordered. So the bits are those of the plain loop on every processor; one
without 256-bit registers does the same in two halves.

Rows must be contiguous (arrays of layout C). The caller checks the bounds: columns ``j`` to ``j + 3`` must exist.
"""

from collections.abc import Callable
from typing import Any

from cranktrain.core.kernel import Intrinsic, compiler

LANES = 4


def _address(context: Any, builder: Any, kind: Any, array: Any, indices: list[Any]) -> Any:
    """Address of an entry of a float64 array of layout C."""
    from numba.np import arrayobj

    made = arrayobj.make_array(kind)(context, builder, array)
    return arrayobj.cgutils.get_item_pointer(context, builder, kind, made, indices)


def _vector(builder: Any, address: Any, lanes: int = LANES) -> Any:
    """Four doubles, or one double, loaded from an address aligned to a double; and the pointer to store them."""
    from llvmlite import ir

    if lanes == 1:
        return builder.load(address), address
    pointer = builder.bitcast(address, ir.VectorType(ir.DoubleType(), LANES).as_pointer())
    return builder.load(pointer, align=8), pointer


def contiguous(*arrays: Any, kind: str = "float64") -> None:
    """Refuse arrays that are not of type ``kind`` and layout C."""
    numba = compiler()
    for array in arrays:
        if array.layout != "C" or array.dtype != getattr(numba.types, kind):
            raise numba.core.errors.TypingError(f"vectors need {kind} arrays of layout C, not {array}")


def _subtracting(rows: int, pivots: int, lanes: int = LANES) -> Callable[[], Any]:
    def making() -> Any:
        numba = compiler()
        integer = numba.types.intp

        def subtract(typing_context: Any, out: Any, left: Any, right: Any, i: Any, k: Any, j: Any) -> Any:
            contiguous(out, left, right)

            def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
                i0, k0, j0 = values[3:]

                def entry(place: int, row: Any, column: Any) -> Any:
                    return _address(context, builder, (out, left, right)[place], values[place], [row, column])

                def after(index: Any, offset: int) -> Any:
                    return builder.add(index, context.get_constant(integer, offset))

                known = [_vector(builder, entry(2, after(k0, p), j0), lanes)[0] for p in range(pivots)]
                for r in range(rows):
                    row = after(i0, r)
                    value, target = _vector(builder, entry(0, row, j0), lanes)
                    for p in range(pivots):
                        factor = builder.load(entry(1, row, after(k0, p)))
                        if lanes > 1:
                            factor = _types().all_lanes(builder, factor)
                        value = builder.fsub(value, builder.fmul(factor, known[p]))
                    builder.store(value, target, align=8)
                return context.get_dummy_value()

            return numba.types.void(out, left, right, integer, integer, integer), generate

        return subtract

    return making


subtract_4x4: Any = Intrinsic(_subtracting(4, 4))
"""``out[i + r, j:j+4] -= left[i + r, k + p] right[k + p, j:j+4]`` for p = 0..3 in turn, for rows r = 0..3.

Called with ``(out, left, right, i, k, j)``."""
subtract_1x4: Any = Intrinsic(_subtracting(1, 4))
"""``out[i, j:j+4] -= left[i, k + p] right[k + p, j:j+4]`` for p = 0..3 in turn, for one row."""
subtract_column: Any = Intrinsic(_subtracting(4, 4, 1))
"""``out[i + r, j] -= left[i + r, k + p] right[k + p, j]`` for p = 0..3 in turn, for rows r = 0..3."""


# Vectors as values, which kernels add, subtract and multiply by + - *, see :mod:`cranktrain.core.vector_types`.


def _types() -> Any:
    from cranktrain.core import vector_types

    return vector_types


def entry_place(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    """Address of an entry of the array in the first argument; the second is an index or a tuple of indices."""
    integer, (array, kind) = compiler().types.intp, signature.args[:2]
    if isinstance(kind, compiler().types.BaseTuple):
        parts = [(inner, builder.extract_value(values[1], k)) for k, inner in enumerate(kind)]
    else:
        parts = [(kind, values[1])]
    where = [context.cast(builder, part, inner, integer) for inner, part in parts]
    return _address(context, builder, array, values[0], where)


def _loading() -> Any:
    four = _types().FOUR

    def load(typing_context: Any, array: Any, at: Any) -> Any:
        contiguous(array)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return _vector(builder, entry_place(context, builder, signature, values))[0]

        return four(array, at), generate

    return load


def _loading_singles() -> Any:
    from llvmlite import ir

    found = _types()

    def load_singles(typing_context: Any, array: Any, at: Any) -> Any:
        contiguous(array, kind="float32")

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            address = entry_place(context, builder, signature, values)
            kind = ir.VectorType(ir.FloatType(), LANES)
            four = builder.load(builder.bitcast(address, kind.as_pointer()), align=4)
            return builder.fpext(four, found.VECTOR)

        return found.FOUR(array, at), generate

    return load_singles


def _storing() -> Any:
    four, numba = _types().FOUR, compiler()

    def store(typing_context: Any, array: Any, at: Any, vector: Any) -> Any:
        contiguous(array)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            address = entry_place(context, builder, signature, values)
            builder.store(values[2], builder.bitcast(address, values[2].type.as_pointer()), align=8)
            return context.get_dummy_value()

        return numba.types.void(array, at, four), generate

    return store


def _packing() -> Any:
    from llvmlite import ir

    found, double = _types(), compiler().types.float64

    def pack(typing_context: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            vector = ir.Constant(found.VECTOR, ir.Undefined)
            for k, value in enumerate(values):
                vector = builder.insert_element(vector, value, ir.Constant(ir.IntType(32), k))
            return vector

        return found.FOUR(double, double, double, double), generate

    return pack


def _spreading() -> Any:
    found, double = _types(), compiler().types.float64

    def splat(typing_context: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return found.all_lanes(builder, values[0])

        return found.FOUR(double), generate

    return splat


def _unpacking() -> Any:
    from llvmlite import ir

    found, numba = _types(), compiler()
    kind = numba.types.UniTuple(numba.types.float64, LANES)

    def unpack(typing_context: Any, vector: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            parts = [builder.extract_element(values[0], ir.Constant(ir.IntType(32), k)) for k in range(LANES)]
            return context.make_tuple(builder, kind, parts)

        return kind(found.FOUR), generate

    return unpack


def _choosing(*order: int, vectors: int = 2) -> Callable[[], Any]:
    """Shuffle: lanes of one vector, or of two with the second's lanes numbered from 4 on."""

    def making() -> Any:
        from llvmlite import ir

        four = _types().FOUR

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), list(order))
            return builder.shuffle_vector(values[0], values[-1], mask)

        def of_one(typing_context: Any, vector: Any) -> Any:
            return four(four), generate

        def of_two(typing_context: Any, first: Any, second: Any) -> Any:
            return four(four, four), generate

        return of_one if vectors == 1 else of_two

    return making


load: Any = Intrinsic(_loading)
"""``(array, index)``: four doubles that start at an entry; the index of an array with several axes is a tuple."""
load_singles: Any = Intrinsic(_loading_singles)
"""``(array, index)``: four numbers of a single-precision array, as doubles; half the memory to read."""
store: Any = Intrinsic(_storing)
"""``(array, index, vector)``: write four doubles."""
splat: Any = Intrinsic(_spreading)
"""Vector with one number in all lanes."""
pack: Any = Intrinsic(_packing)
"""Vector of four numbers."""
unpack: Any = Intrinsic(_unpacking)
"""Four numbers of a vector."""
swap_pairs: Any = Intrinsic(_choosing(1, 0, 3, 2, vectors=1))
"""Vector with lanes in the order 1, 0, 3, 2."""
even_lanes: Any = Intrinsic(_choosing(0, 2, 4, 6))
"""Lanes 0 and 2 of one vector, then those of another."""
odd_lanes: Any = Intrinsic(_choosing(1, 3, 5, 7))
"""Lanes 1 and 3 of one vector, then those of another."""
