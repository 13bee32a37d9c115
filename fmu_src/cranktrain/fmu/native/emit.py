"""Machine code of kernels as one object file, with no symbols of Python.

Numba compiles each exported kernel through a wrapper that is made here anew, since kernels that come from its cache
have no text to link. Their LLVM modules become one; what no export reaches is dropped; LLVM emits the object for any
platform that it knows. Arithmetic is never reordered, so every platform's code gives the same bits but for its libm.

Entries have C's calling convention, ``int64_t entry(void *run, double x)``, and read a record at the address that they
are given; functions keep numba's own, as :func:`cranktrain.core.kernel.call_kernel` calls them.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import njit, typeof, types

from cranktrain.core.kernel import OPTIONS, Kernel, record_reader

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Platform:
    """Where machine code is to run.

    Attributes
    ----------
    folder : of an FMU's binaries, as FMI 2.0 names it
    suffix : of a shared library
    triple : as LLVM names the platform
    cpu : least processor
    zig : as ``zig cc -target`` names it
    """

    folder: str
    suffix: str
    triple: str
    cpu: str
    zig: str


PLATFORMS = {
    row.folder: row
    for row in (
        Platform("linux64", ".so", "x86_64-unknown-linux-gnu", "x86-64-v2", "x86_64-linux-gnu.2.17"),
        Platform("win64", ".dll", "x86_64-w64-windows-gnu", "x86-64-v2", "x86_64-windows-gnu"),
        Platform("aarch64-linux", ".so", "aarch64-unknown-linux-gnu", "generic", "aarch64-linux-gnu.2.17"),
    )
}
"""FMI 2.0 names no folder for ARM; the last is FMI 3.0's."""

_KEPT: list[Any] = []
"""What LLVM made, until the process ends: freed in the order of Python's garbage it sometimes ends in an assertion."""
_NEXT = "\n;;;\n"
"""Between modules of one text."""
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


def entry_module(name: str, run: Any, kernel: Any) -> str:
    """LLVM's text of an entry by its C name: a kernel ``kernel(run)`` or ``kernel(run, x)`` on records like ``run``."""
    read = record_reader(run)
    if len(inspect.signature(kernel.py_func).parameters) == 1:

        def entry(address, x):
            return kernel(read(address))
    else:

        def entry(address, x):
            return kernel(read(address), x)

    return _with_entry(name, entry)


def _with_entry(name: str, function: Callable[..., Any]) -> str:
    """LLVM's text of a function of an address and a number, with an entry by its C name that calls it."""
    called = f"{name}_kernel"
    return _module(function, (types.int64, types.float64), called) + _NEXT + _ENTRY.format(name=name, called=called)


def function_module(name: str, kernel: Any, arguments: Iterable[Any]) -> str:
    """LLVM's text of a kernel that is called by numba's convention, for arguments of the types of ``arguments``."""
    return _module(_of_arity(kernel), tuple(typeof(argument) for argument in arguments), name)


def call_module(name: str, kernel: Kernel, arguments: tuple[Any, ...]) -> tuple[str, str]:
    """LLVM's text of an entry, by its C name, that calls a kernel as Python does; and the kinds of what it gives.

    Its record is an array for the results, one value each, and the arguments; see
    :class:`cranktrain.core.machine_code.Call`. ``TypeError`` where the kernel gives what is no number.
    """
    signature = tuple(typeof(argument) for argument in arguments)
    kernel.dispatcher.compile(signature)
    given = types.unliteral(kernel.dispatcher.overloads[signature].signature.return_type)
    many = isinstance(given, types.BaseTuple)
    kinds = "".join(_RESULTS[types.unliteral(kind)] for kind in (given if many else (given,)) if kind != types.none)
    values = [f"result[{k}]" for k in range(len(kinds))] if many else ["result"] * len(kinds)
    handed = ", ".join(f"record[{k + 1}]" for k in range(len(arguments)))
    stored = "".join(f"    record[0][{k}] = {value}\n" for k, value in enumerate(values))
    scope = {"kernel": kernel, "read": record_reader((np.zeros(1), *arguments))}
    text = f"def entry(address, x):\n    record = read(address)\n    result = kernel({handed})\n{stored}    return 0"
    exec(text, scope)
    return _with_entry(name, scope["entry"]), f"({kinds})" if many else kinds


_RESULTS = {types.int64: "i", types.float64: "f", types.boolean: "b"}


def _of_arity(kernel: Any) -> Callable[..., Any]:
    """A plain function with a kernel's parameters that calls it."""
    names = ", ".join(kernel.py_func.__code__.co_varnames[: kernel.py_func.__code__.co_argcount])
    scope = {"kernel": kernel}
    exec(f"def function({names}):\n    return kernel({names})", scope)
    return scope["function"]


def _module(function: Callable[..., Any], signature: tuple[Any, ...], name: str) -> str:
    """LLVM's text of a function and of all that it calls, its own symbol renamed."""
    options: dict[str, Any] = {**OPTIONS, "no_cpython_wrapper": True}
    compiled: Any = njit(**options)(function)
    compiled.compile(signature)
    _KEPT.append(compiled)
    overload = compiled.overloads[signature]
    if types.unliteral(overload.signature.return_type) != types.int64:
        raise TypeError(f"{name} must return an integer, not {overload.signature.return_type}")
    text = overload.library.get_llvm_str()
    return text.replace(overload.fndesc.llvm_func_name, name)


def object_code(texts: Mapping[str, str], platform: Platform) -> bytes:
    """Object file of modules by exported names (:func:`entry_module`, :func:`function_module`), for one platform."""
    _initialize()
    whole = None
    for text in texts.values():
        for part in text.split(_NEXT):
            module = llvm.parse_assembly(_for(part, platform))
            _KEPT.append(module)
            if whole is None:
                whole = module
            else:
                whole.link_in(module)
    assert whole is not None
    machine = llvm.Target.from_triple(platform.triple).create_target_machine(
        cpu=platform.cpu, opt=3, reloc="pic", codemodel="default"
    )
    _keep_only(whole, set(texts), machine)
    whole.verify()
    return bytes(machine.emit_object(whole))


def _initialize() -> None:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()


def _for(text: str, platform: Platform) -> str:
    """A module's text for a platform: it is made for this machine's, whose data layout both others share."""
    text = re.sub(r'(?m)^target triple = ".*"$', f'target triple = "{platform.triple}"', text)
    text = re.sub(r'(?m)^target datalayout = ".*"$', f'target datalayout = "{_layout(platform)}"', text)
    return text


def _layout(platform: Platform) -> str:
    return str(llvm.Target.from_triple(platform.triple).create_target_machine(cpu=platform.cpu).target_data)


def _keep_only(module: Any, exports: set[str], machine: Any) -> None:
    """Hide all but the exports and drop what they do not reach."""
    for function in module.functions:
        if function.is_declaration:
            continue
        if function.name in exports:
            function.visibility = "hidden"
        else:
            function.linkage = "internal"
    for variable in module.global_variables:
        if not variable.is_declaration and not variable.name.startswith("llvm."):
            variable.linkage = "internal"
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=2))
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.add_strip_dead_prototype_pass()
    passes.run(module, builder)
    _KEPT.append((machine, builder, passes))
