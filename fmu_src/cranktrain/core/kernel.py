"""The one jit decorator of the running model, and the rules its kernels keep.

A kernel must also compile ahead of time into a library without Python: the caller owns all memory, no ``np.linalg``,
no exceptions (integer status codes), no ``reshape``, no global mutable state, no parallel loops. Compiling without
numba's run-time (``_nrt=False``) holds kernels to that: one that would allocate does not compile.

Compiled kernels are kept in the user's cache under a digest of the sources that can reach them, those that their file
imports: numba itself looks only at a kernel's own file, and would run a stale copy of what that kernel calls. So an
edit compiles anew what rests on it and nothing else. They are not kept at all where the cache cannot be written, or can
be by others; numba would then put them beside the sources.

Numba compiles a kernel together with all that it calls, once more at every level above. Large force laws of which a run
needs one at most are therefore called at their address, by numba's own convention: each is compiled by itself, and
only where a model uses it.
"""

from __future__ import annotations

import tempfile
import warnings
import weakref
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba import config, njit, typeof, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from cranktrain.core.cache import NotPrivateError, private_folder
from cranktrain.core.machine_code import library
from cranktrain.core.records import record_image
from cranktrain.core.sources import PACKAGE, source_digest


@cache
def _kernel_folder(file: str) -> str:
    """Folder for the compiled kernels of a source file; empty where it cannot be written, or others may do so."""
    source = Path(file)
    try:
        folder = private_folder("kernels", f"{source.stem}-{source_digest(source)}")
        tempfile.TemporaryFile(dir=folder).close()
    except NotPrivateError as error:
        warnings.warn(
            f"{error.filename}: {error.strerror}, so that compiled kernels are not kept there and each start compiles "
            "them; take it for yourself (chmod 700), or set CRANKTRAIN_CACHE to another folder",
            stacklevel=1,
        )
        return ""
    except OSError:
        return ""
    return str(folder)


OPTIONS: dict[str, Any] = {
    "error_model": "numpy",
    "fastmath": False,
    "boundscheck": False,
    "_nrt": False,
    "no_cfunc_wrapper": True,
}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` in the native-safe subset, cached on disk where possible."""
    return _compiled(function, function.__code__.co_filename)


def inlined_kernel(function: Callable[..., Any]) -> Any:
    """Kernel that is compiled into each of its callers: a small piece of one, to which handing the model costs more."""
    return _compiled(function, function.__code__.co_filename, forceinline=True)


def _compiled(function: Callable[..., Any], file: str, **options: Any) -> Any:
    """Kernel that is cached with those of the source ``file``."""
    folder = _kernel_folder(file)
    kept = getattr(config, "CACHE_DIR", "")
    setattr(config, "CACHE_DIR", folder)  # noqa: B010 - numba makes its settings at run time, unknown to a type checker
    try:
        compiled = njit(cache=bool(folder), **OPTIONS, **options)(function)
    finally:
        setattr(config, "CACHE_DIR", kept)  # noqa: B010
    if folder:
        _forget_unknown_classes(compiled)
    return compiled


def _forget_unknown_classes(compiled: Any) -> None:
    """Let a kernel compile anew where its index in the cache names classes that have moved since.

    A kernel's file need not import the classes of the records that it is given, so its digest does not tell.
    """
    file = compiled._cache._cache_file
    load = file._load_index

    def index() -> Any:
        try:
            return load()
        except (ImportError, AttributeError):
            return {}

    file._load_index = index


LAWS_OF = "cranktrain"
"""Kind of the library that holds the functions which are called at their address."""
law_kernel = kernel
"""For kernels that are called at their address."""


def kernel_address(function: Any, *arguments: Any) -> int:
    """Address at which :func:`call_kernel` finds ``function`` for arguments of these types.

    It is that of the library of machine code where there is one; else the kernel is compiled.
    """
    name, code = kernel_name(function), library(LAWS_OF)
    if code is not None and name in code.functions:
        ADDRESSES[code.functions[name]] = name
        return code.functions[name]
    signature = tuple(typeof(argument) for argument in arguments)
    function.compile(signature)
    compiled = function.overloads[signature]
    if types.unliteral(compiled.signature.return_type) != types.int64:
        raise TypeError(f"{function.py_func.__name__} must return an integer to be called at its address")
    address = int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))
    ADDRESSES[address] = name
    return address


def kernel_name(function: Any) -> str:
    """Name of a kernel in full, ``package.module:function``, the same in an FMU, whose package has another."""
    module = function.py_func.__module__
    if module.partition(".")[0] == PACKAGE:
        module = "cranktrain" + module.removeprefix(PACKAGE)
    return f"{module}:{function.py_func.__name__}"


def typed_kernel(function: Any, *arguments: Any) -> Callable[..., Any]:
    """The kernel compiled for arguments of these types, to be called with such alone: nothing checks them again.

    Numba looks at the types of all arguments at every call, ten microseconds for a model's arrays.
    """
    signature = tuple(typeof(argument) for argument in arguments)
    function.compile(signature)
    entry: Callable[..., Any] = function.overloads[signature].entry_point
    return entry


@intrinsic
def call_kernel(typing_context: Any, address: Any, arguments: Any) -> Any:
    """Call the kernel at ``address`` with a tuple of arguments, of the very types that the address was made for."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        pointer, packed = values
        kinds = tuple(arguments.types)
        function = context.call_conv.get_function_type(types.int64, kinds).as_pointer()
        unpacked = [builder.extract_value(packed, k) for k in range(len(kinds))]
        callee = builder.inttoptr(pointer, function)
        _, result = context.call_conv.call_function(builder, callee, types.int64, kinds, unpacked)
        return result

    return types.int64(address, arguments), generate


ADDRESSES: dict[int, str] = {}
"""Names of the kernels that were given out as addresses."""
RECORDS: dict[int, Any] = {}
"""Records that were given out as addresses and whose owners live."""
_KINDS: dict[type, Any] = {}
"""Type of the records that each class' reader knows."""


def keep_record(record: Any, owner: NDArray[Any]) -> int:
    """Address at which a reader finds ``record``, a named tuple of arrays, for as long as the array ``owner`` lives.

    ``TypeError`` where it is not of the type that its class' reader was made for: a law would read what is not there.
    """
    if typeof(record) != _KINDS.get(type(record)):
        raise TypeError(f"{type(record).__name__} of other arrays than its reader knows: {typeof(record)}")
    image = record_image(record)
    address = int(image.ctypes.data)
    RECORDS[address] = record
    weakref.finalize(owner, _forget, address, image)  # a finalizer's arguments live until then
    return address


def _forget(address: int, image: Any) -> None:
    del RECORDS[address]


def record_reader(example: Any) -> Any:
    """Function for kernels that reads a record of ``example``'s type from its address, see :func:`keep_record`."""
    kind = typeof(example)
    _KINDS[type(example)] = kind

    @intrinsic
    def read(typing_context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            return builder.load(builder.inttoptr(values[0], context.get_value_type(kind).as_pointer()))

        return kind(address), generate

    return read
