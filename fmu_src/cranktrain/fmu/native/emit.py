"""Emission of kernels' machine code as one object file without symbols of Python.

Numba produces the LLVM IR of each exported kernel and of all kernels that it calls. They become one program
(:mod:`.whole_program`), which is optimised once. LLVM emits its object for any supported platform. Arithmetic is never
reordered, so the code of all platforms gives bit-identical results, except for differences of libm.

Entries have C's calling convention, ``int64_t entry(void *run, double x)``, and read a record at the given address.
Functions have numba's convention, in which :data:`cranktrain.core.kernel.call_kernel` calls them.
"""

from collections import namedtuple
from collections.abc import Callable
from contextlib import ExitStack
from types import MappingProxyType
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import types

from cranktrain.core.kernel import OPTIONS, Compiling, Kernel, compiled_by, kernel_name, overload, record_reader
from cranktrain.core.machine_code import Call, this_platform
from cranktrain.core.records import layout
from cranktrain.fmu.native.platforms import PLATFORMS
from cranktrain.fmu.native.whole_program import Loaded, linked, module_of, optimise, texts_alone

_ENTRY = """
define i64 @{name}(ptr %run, double %x) {{
  %result = alloca i64, align 8
  %excuse = alloca ptr, align 8
  store i64 -1, ptr %result
  store ptr null, ptr %excuse
  %address = ptrtoint ptr %run to i64
  %code = call i32 @{called}(ptr %result, ptr %excuse, i64 %address, double %x)
  %status = load i64, ptr %result
  ret i64 %status
}}
declare i32 @{called}(ptr, ptr, i64, double)
"""
_RESULTS = {types.int64: "i", types.float64: "f", types.boolean: "b"}


class Emission(Compiling):
    """Compilation of kernels into one object file; kernels are compiled in its context.

    Kernels that Python calls in this context also run at once. Kernels that others call by address are replaced by a
    kernel that does nothing.

    Parameters
    ----------
    share : prefix of the names of exports that Python calls: ``films_call_0``
    exported : function that is true for the name of a kernel to be exported; others are called only

    Attributes
    ----------
    symbols : all exports, by the names that numba gave
    called : symbols of the kernels that Python calls, with ``name|layout of the arguments|kinds of the results``; kinds
        as in :class:`cranktrain.core.machine_code.Call`
    """

    keeps = False
    options = MappingProxyType({**OPTIONS, "no_cpython_wrapper": True})

    def __init__(self, share: str = "ct", exported: Callable[[str], bool] = lambda name: True) -> None:
        self.symbols: dict[str, str] = {}
        self.called: dict[str, str] = {}
        self._share, self._exported = share, exported
        self._libraries: list[Any] = []
        self._entries: list[Any] = []
        self._callable: dict[tuple[str, str], tuple[Call, Loaded]] = {}
        self._stand_ins: dict[tuple[str, str], tuple[int, Loaded]] = {}
        self._context = ExitStack()

    def __enter__(self) -> "Emission":
        self._context.enter_context(compiled_by(self))
        self._context.enter_context(texts_alone())
        return self

    def __exit__(self, *error: object) -> None:
        self._context.close()

    def entry(self, symbol: str, run: Any, kernel: Kernel) -> None:
        """Export a kernel ``kernel(run)`` or ``kernel(run, x)``, for records like ``run``, as an entry."""
        read = record_reader(run)
        if kernel.py_func.__code__.co_argcount == 1:

            def entry(address, x):
                return kernel(read(address))
        else:

            def entry(address, x):
                return kernel(read(address), x)

        self._export(*_entry(symbol, entry))

    def function(self, symbol: str, kernel: Kernel, arguments: tuple[Any, ...]) -> None:
        """Export a kernel that other kernels call by numba's convention with arguments of these types.

        ``TypeError`` if it does not return an integer.
        """
        compiled = _integral(symbol, overload(kernel, arguments))
        self.symbols[compiled.fndesc.llvm_func_name] = symbol
        self._libraries.append(compiled.library)

    def call(self, function: Kernel, arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
        """Call a kernel as Python does, and export it; ``KeyError`` if its result is not a number."""
        known = kernel_name(function), layout(arguments)
        if named:
            raise TypeError(f"{known[0]}: a kernel that a library is to have is called without named arguments")
        if known not in self._callable:
            symbol, kinds, library, entry = self.python_calls(function, arguments)
            loaded = Loaded(linked(library, more=[entry], exports=[symbol]))
            self._callable[known] = Call(loaded.address(symbol), kinds), loaded
        return self._callable[known][0](arguments)

    def python_calls(self, function: Kernel, arguments: tuple[Any, ...]) -> tuple[str, str, Any, Any]:
        """Export a kernel that Python calls with arguments of these types.

        Returns symbol, kinds of the results, library, and module of its entry.
        """
        name = kernel_name(function)
        given = types.unliteral(overload(function, arguments).signature.return_type)
        single = given != types.none and not isinstance(given, types.BaseTuple)
        results = () if given == types.none else (given,) if single else given
        kinds = "".join(_RESULTS[types.unliteral(kind)] for kind in results)
        exported = self._exported(name)
        symbol = f"{self._share}_call_{len(self.called)}" if exported else "call"
        _, library, entry = _entry(symbol, _calling(function, arguments, len(kinds), single))
        kinds = kinds if single else f"({kinds})"
        if exported:
            self._export(symbol, library, entry)
            self.called[symbol] = f"{name}|{layout(arguments)}|{kinds}"
        return symbol, kinds, library, entry

    def address(self, function: Kernel, arguments: tuple[Any, ...]) -> int:
        """Address of a stand-in for a kernel with these argument types; the stand-in returns 0 and does nothing."""
        known = kernel_name(function), layout(arguments)
        if known in self._stand_ins:
            return self._stand_ins[known][0]
        names = ", ".join(function.py_func.__code__.co_varnames[: function.py_func.__code__.co_argcount])
        scope: dict[str, Any] = {}
        exec(f"def stands_in({names}): return 0", scope)
        compiled = overload(Kernel(scope["stands_in"]), arguments)
        name = compiled.fndesc.llvm_func_name
        loaded = Loaded(linked(compiled.library, exports=[name]))
        self._stand_ins[known] = loaded.address(name), loaded
        return self._stand_ins[known][0]

    def program(self) -> bytes:
        """LLVM bitcode of all exports, optimised for the faster processors of this machine's platform."""
        whole = linked(*self._libraries, more=self._entries, exports=self.symbols)
        for function in list(whole.functions):
            if not function.is_declaration:
                function.add_function_attribute("nounwind")  # no kernel raises, so unwind tables are useless
            if function.name in self.symbols:
                function.name = self.symbols[function.name]
                function.visibility = "hidden"
        row = PLATFORMS.get(this_platform())
        cpu = row.fast or row.cpu if row else llvm.get_host_cpu_name()
        target = llvm.Target.from_default_triple()
        optimise(whole, target.create_target_machine(cpu=cpu, opt=3, reloc="pic", codemodel="default"), 3)
        return bytes(whole.as_bitcode())

    def _export(self, symbol: str, library: Any, entry: Any) -> None:
        self.symbols[symbol] = symbol
        self._libraries.append(library)
        self._entries.append(entry)


def _entry(symbol: str, function: Any) -> tuple[str, Any, Any]:
    """Symbol of an entry, library of ``function(address, number)``, and the module that calls this function."""
    compiled = _integral(symbol, overload(Kernel(function), (0, 0.0)))
    module = module_of(_ENTRY.format(name=symbol, called=f'"{compiled.fndesc.llvm_func_name}"'))
    return symbol, compiled.library, module


def _integral(symbol: str, compiled: Any) -> Any:
    if types.unliteral(compiled.signature.return_type) != types.int64:
        raise TypeError(f"{symbol} must return an integer, not {compiled.signature.return_type}")
    return compiled


def _calling(function: Kernel, arguments: tuple[Any, ...], count: int, single: bool) -> Any:
    """Function of an address and a number that calls a kernel; results and arguments are in a record at the address."""
    values = ["result"] * count if single else [f"result[{k}]" for k in range(count)]
    names = [f"given_{k}" for k in range(len(arguments))]
    handed = ", ".join(f"record.{name}" for name in names)
    stored = "".join(f"    record.result[{k}] = {value}\n" for k, value in enumerate(values))
    example = namedtuple("Arguments", ["result", *names])(np.zeros(1), *arguments)
    scope = {"kernel": function, "read": record_reader(example)}
    text = f"def entry(address, x):\n    record = read(address)\n    result = kernel({handed})\n{stored}    return 0"
    exec(text, scope)
    return scope["entry"]
