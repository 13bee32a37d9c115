"""Linking of kernels to one program as LLVM text, optimised once, in place of numba's code for each kernel.

Numba links all called kernels into every kernel, optimises it and makes machine code of it, again for each caller.
Compiling a program of some hundred kernels in this way takes several times as long as compiling its text once. Here the
LLVM text of a kernel is kept unchanged. All kernels reached from an export are linked and optimised together, and LLVM
drops arguments that a callee does not use.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target


class Text(JITCodeLibrary):
    """Library of numba that keeps a kernel as LLVM text: only its own functions, neither optimised nor linked."""

    def finalize(self) -> None:
        """Take numba's output unchanged."""
        self._raise_if_finalized()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0 for any name, because functions of an LLVM text cannot be called."""
        self._ensure_finalized()
        return 0

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _get_module_for_linking(self) -> Any:
        """LLVM module of the kernel with all kernels that it calls, for a library that numba makes by itself."""
        return linked(self)


@contextmanager
def texts_alone() -> Iterator[None]:
    """Context in which numba stops at LLVM text for the kernels that it compiles."""
    codegen = cpu_target.target_context.codegen()
    kind, setter = codegen._library_class, codegen.set_env
    codegen._library_class, codegen.set_env = Text, lambda name, env: None
    try:
        yield
    finally:
        codegen._library_class, codegen.set_env = kind, setter


def module_of(text: str) -> Any:
    """LLVM module from a text, with this machine's layout of data."""
    module = llvm.parse_assembly(text)
    module.data_layout = cpu_target.target_context.codegen()._data_layout
    return module


def linked(*libraries: Any, more: Iterable[Any] = (), exports: Iterable[str] = ()) -> Any:
    """One module of libraries, all that they call, and ``more`` modules; without exports it can be linked further."""
    exported = set(exports)
    whole = module_of("")
    for module in (*more, *(library._final_module for library in _reached(libraries))):
        added = module.clone()
        for value in _defined(added):
            # Functions of numba occur in several libraries with equal content, so any one of them may be linked.
            if value.linkage == llvm.Linkage.external and value.name not in exported:
                value.linkage = "linkonce_odr"
        whole.link_in(added)
    if exported:
        for value in _defined(whole):
            value.linkage = "external" if value.name in exported else "internal"
    return whole


def _defined(module: Any) -> list[Any]:
    values = (*module.functions, *module.global_variables)
    return [value for value in values if not value.is_declaration and not value.name.startswith("llvm.")]


def _reached(libraries: Iterable[Any]) -> list[Any]:
    """Libraries and the libraries that they call, each once; callers come first, as they determine needed callees."""
    seen: set[int] = set()
    callees_first: list[Any] = []

    def visit(library: Any) -> None:
        if id(library) not in seen:
            seen.add(id(library))
            for inner in reversed(list(library._linking_libraries)):
                visit(inner)
            callees_first.append(library)

    for library in reversed(list(libraries)):
        visit(library)
    return callees_first[::-1]


def optimise(module: Any, machine: Any, level: int) -> None:
    """Drop functions that no export reaches and optimise, in place, with bit-identical results."""
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=2))
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, builder)
    options = llvm.create_pipeline_tuning_options(speed_level=level)
    options.loop_vectorization, options.slp_vectorization = level > 1, False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    passes = llvm.create_new_module_pass_manager()
    passes.add_strip_dead_prototype_pass()
    passes.run(module, builder)
    module.verify()


class Loaded:
    """Functions of a module loaded into this process, compiled fast without optimisation.

    Attributes
    ----------
    address : method that returns the address of a function by its name
    """

    def __init__(self, module: Any) -> None:
        target = llvm.Target.from_default_triple()
        host = {"cpu": llvm.get_host_cpu_name(), "features": llvm.get_host_cpu_features().flatten()}
        machine = target.create_target_machine(**host, opt=0, jit=True, codemodel="jitdefault", reloc="default")
        optimise(module, machine, 0)
        self._engine = llvm.create_mcjit_compiler(module, machine)
        self._engine.finalize_object()

    def address(self, name: str) -> int:
        """Address of a function by its name."""
        return int(self._engine.get_function_address(name))
