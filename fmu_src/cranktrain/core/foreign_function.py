"""Calls of C functions by address from kernels, used for the functions of an FMU's library.

Arguments are 64-bit integers and doubles, the result is a C ``int``. Addresses, sizes and C's shorter integers and
booleans each occupy one 64-bit register in the calling conventions of x86-64 (Linux, Windows, macOS) and of ARM64, so
a 64-bit integer can stand for all of them.
"""

from typing import Any

from cranktrain.core.kernel import Intrinsic, compiler


def _calling() -> Any:
    types = compiler().types
    from llvmlite import ir

    def call_foreign(typing_context: Any, address: Any, arguments: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            pointer, packed = values
            kinds = [ir.DoubleType() if kind == types.float64 else ir.IntType(64) for kind in arguments.types]
            callee = builder.inttoptr(pointer, ir.FunctionType(ir.IntType(32), kinds).as_pointer())
            result = builder.call(callee, [builder.extract_value(packed, k) for k in range(len(kinds))])
            return builder.sext(result, ir.IntType(64))

        return types.int64(address, arguments), generate

    return call_foreign


call_foreign: Any = Intrinsic(_calling)
"""Call the C function at an address with a tuple of arguments, each an int64 or a float64."""
