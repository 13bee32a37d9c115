"""The jit decorator of the running model, and the rules that compiled functions (kernels) obey.

A kernel must also compile ahead of time into a library without Python: the caller owns all memory, no ``np.linalg``,
no exceptions (integer status codes), no ``reshape``, no global mutable state, no parallel loops. Kernels are compiled
without numba's run-time (``_nrt=False``), so a kernel that allocates memory does not compile.

Compiled kernels are kept in the user's cache under a digest of all sources that their file imports, directly or
through others. Numba itself checks only a kernel's own file and would run a stale copy of the functions that it calls.
With the digest an edit recompiles the kernels that depend on it and no others. Kernels are not kept if the cache cannot
be written, or can be written by others; numba would then put them next to the sources.

Numba compiles a kernel together with everything that it calls, again at every level above. A run needs at most one of
the large force laws, so these are called by address with numba's calling convention. Each is compiled separately, and
only if a model uses it.

A record of many arrays is passed as one address: its class, a named tuple, has the decorator ``@record``. No record is
rewritten while kernels run.

A library of machine code (:mod:`.machine_code`) holds the kernels that a run calls. Numba is loaded only when something
is compiled, so a run with a library starts without numba.
"""

from __future__ import annotations

import tempfile
import warnings
import weakref
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, cached_property, partial, update_wrapper
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from cranktrain.core.cache import NotPrivateError, private_folder
from cranktrain.core.machine_code import Call, calls_of, function_address
from cranktrain.core.named import resolve
from cranktrain.core.records import layout, record_image
from cranktrain.core.sources import PACKAGE, edited_meanwhile, rests_on, source_digest

BEFORE_COMPILING: list[Callable[[], None]] = []
"""Functions that are called once, when numba is loaded."""


@cache
def compiler() -> Any:
    """Numba, loaded at the first call."""
    import numba
    from numba import core, extending  # noqa: F401 - importing numba alone may not load them

    for cls in _AT_ADDRESS:
        resolve(_AT_ADDRESS_BY)(cls)
    for notice in BEFORE_COMPILING:
        notice()
    return numba


_AT_ADDRESS: list[type] = []
_RECORD_TYPES = Path(__file__).with_name("record_types.py")
"""Source file of numba's type of records. No kernel imports this file, so it enters the digest separately."""
_AT_ADDRESS_BY = "cranktrain.core.record_types:at_address"


def record(cls: type) -> type:
    """Class decorator: kernels take named tuples of this class as one address, also in calls from Python."""
    _AT_ADDRESS.append(cls)
    if compiler.cache_info().currsize:
        resolve(_AT_ADDRESS_BY)(cls)
    return cls


@cache
def _kernel_folder(file: str) -> str:
    """Folder for the compiled kernels of a source file; empty if it cannot be written, or can be by others."""
    source = Path(file)
    if edited_meanwhile(rests_on(source)):
        return ""  # the digest would belong to the edited source, not to the imported source
    try:
        folder = private_folder("kernels", f"{source.stem}-{source_digest(source)}-{source_digest(_RECORD_TYPES)[:6]}")
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


class Compiling:
    """Compilation of kernels that are in no library: by numba, for this machine, at their first call.

    Attributes
    ----------
    keeps : True if compiled kernels are kept in the user's cache
    options : options of ``numba.njit``
    """

    keeps = True
    options: Mapping[str, Any] = OPTIONS

    def call(self, function: Kernel, arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
        """Call a kernel from Python."""
        return function.dispatcher(*arguments, **named)

    def address(self, function: Kernel, arguments: tuple[Any, ...]) -> int:
        """Address of a kernel compiled for the types of ``arguments``, for use with :data:`call_kernel`."""
        compiled = overload(function, arguments)
        if compiler().types.unliteral(compiled.signature.return_type) != compiler().types.int64:
            raise TypeError(f"{function.py_func.__name__} must return an integer to be called at its address")
        return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


_COMPILING = [Compiling()]


@contextmanager
def compiled_by(way: Compiling) -> Iterator[None]:
    """Context in which kernels are compiled by ``way``, another :class:`Compiling`."""
    _COMPILING.append(way)
    try:
        yield
    finally:
        _COMPILING.pop()


class Kernel:
    """A function in the native-safe subset, callable from other kernels and from Python.

    A call from Python runs the library's code if the library has the kernel for these argument types; else numba
    compiles it.

    Attributes
    ----------
    py_func : the undecorated Python function
    """

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        update_wrapper(self, function)
        self.py_func, self._options = function, options
        self._dispatchers: dict[Compiling, Any] = {}

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the kernel with values and arrays of any types."""
        if self._calls and not named:
            call = self._calls.get(layout(arguments))
            if call is not None:
                return call(arguments)
        return _COMPILING[-1].call(self, arguments, named)

    @cached_property
    def _calls(self) -> dict[str, Call]:
        return calls_of(kernel_name(self))

    @property
    def dispatcher(self) -> Any:
        """Numba's dispatcher of the kernel, with compiled code for each set of types; cached on disk if possible."""
        way = _COMPILING[-1]
        if way not in self._dispatchers:
            self._dispatchers[way] = self._dispatcher(way)
        return self._dispatchers[way]

    def _dispatcher(self, way: Compiling) -> Any:
        numba = compiler()
        folder = _kernel_folder(self.py_func.__code__.co_filename) if way.keeps else ""
        config = numba.config
        kept = getattr(config, "CACHE_DIR", "")
        config.CACHE_DIR = folder
        try:
            made = numba.njit(cache=bool(folder), **way.options, **self._options)(self.py_func)
        finally:
            config.CACHE_DIR = kept
        if folder:
            _forget_unknown_classes(made)
        return made

    @property
    def _numba_type_(self) -> Any:
        """Type by which numba recognises the kernel in a call from another kernel."""
        return self.dispatcher._numba_type_


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` in the native-safe subset, cached on disk where possible."""
    return Kernel(function)


def inlined_kernel(function: Callable[..., Any]) -> Any:
    """Kernel that is inlined into each caller, for short functions whose call costs more than their body."""
    return Kernel(function, forceinline=True)


def _forget_unknown_classes(compiled: Any) -> None:
    """Make a kernel compile again if its cache index names classes that no longer exist in their modules.

    A kernel's file need not import the classes of its record arguments, so its digest does not change when they move.
    """
    file = compiled._cache._cache_file
    load = file._load_index

    def index() -> Any:
        try:
            return load()
        except (ImportError, AttributeError):
            return {}

    file._load_index = index


law_kernel = kernel
"""Decorator for kernels that are called by address."""


def kernel_address(function: Any, *arguments: Any) -> int:
    """Address of ``function`` compiled for the types of ``arguments``, for use with :func:`call_kernel`.

    The address is in the library of machine code if that has the kernel; otherwise the kernel is compiled.
    """
    return kernel_addresses([function], *arguments)[0]


def kernel_addresses(functions: Iterable[Any], *arguments: Any) -> list[int]:
    """Addresses of several functions for the same arguments, see :func:`kernel_address`."""
    addresses, kinds = [], layout(arguments)
    for function in functions:
        name = kernel_name(function)
        address = function_address(name, kinds)
        if address is None:
            address = _COMPILING[-1].address(function, arguments)
        ADDRESSES[address] = name
        addresses.append(address)
    return addresses


def overload(function: Any, arguments: tuple[Any, ...]) -> Any:
    """Numba's compilation result of a kernel for the types of ``arguments``."""
    signature = tuple(compiler().typeof(argument) for argument in arguments)
    function.dispatcher.compile(signature)
    return function.dispatcher.overloads[signature]


def kernel_name(function: Any) -> str:
    """Full name of a kernel, ``package.module:function``; the same in an FMU, whose package has another name."""
    module = function.py_func.__module__
    if module.partition(".")[0] == PACKAGE:
        module = "cranktrain" + module.removeprefix(PACKAGE)
    return f"{module}:{function.py_func.__name__}"


def typed_kernel(function: Any, *arguments: Any) -> Callable[..., Any]:
    """Kernel compiled for the types of ``arguments``, as a function that does not check argument types again.

    Numba's own check of all argument types takes ten microseconds per call for a model's arrays.
    """
    entry: Callable[..., Any] = overload(function, arguments).entry_point
    return entry


def bound_call(function: Any, arguments: tuple[Any, ...]) -> Callable[[], int]:
    """Call of a kernel with fixed arguments, for kernels that return an integer; takes less than a microsecond.

    Arrays in ``arguments`` are used in place, so the kernel sees their present values; numbers keep their values.
    """
    call = calls_of(kernel_name(function)).get(layout(arguments))
    if call is not None:
        return call.bound(arguments)
    return partial(typed_kernel(function, *arguments), *arguments)


class Intrinsic:
    """Function for kernels that is written in LLVM code, created when the first kernel that uses it is compiled."""

    def __init__(self, make: Callable[[], Any]) -> None:
        self._make = make

    @cached_property
    def _made(self) -> Any:
        return compiler().extending.intrinsic(self._make())

    @property
    def _numba_type_(self) -> Any:
        from numba.core.registry import cpu_target

        made, context = self._made, cpu_target.typing_context
        context.refresh()
        return context.resolve_value_type(made)


def _calling() -> Any:
    numba = compiler()

    def call_kernel(typing_context: Any, address: Any, arguments: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            pointer, packed = values
            kinds = tuple(arguments.types)
            function = context.call_conv.get_function_type(numba.types.int64, kinds).as_pointer()
            unpacked = [builder.extract_value(packed, k) for k in range(len(kinds))]
            callee = builder.inttoptr(pointer, function)
            _, result = context.call_conv.call_function(builder, callee, numba.types.int64, kinds, unpacked)
            return result

        return numba.types.int64(address, arguments), generate

    return call_kernel


call_kernel: Any = Intrinsic(_calling)
"""Call the kernel at an address with a tuple of arguments of exactly the types that the address was made for."""

ADDRESSES: dict[int, str] = {}
"""Kernel names by address, for the addresses that were handed out."""
RECORDS: dict[int, Any] = {}
"""Records by address, for all addresses handed out whose owner arrays are alive."""
_LAYOUTS: dict[type, str] = {}
"""Layout of records that the reader of each record class expects."""


def keep_record(record: Any, owner: NDArray[Any]) -> int:
    """Address under which a reader finds ``record``, a named tuple of arrays, while the array ``owner`` is alive.

    ``TypeError`` if its layout differs from the one that the reader of its class was made for, because a force law
    would then read wrong memory.
    """
    if layout(record) != _LAYOUTS.get(type(record)):
        raise TypeError(f"{type(record).__name__} of other arrays than its reader knows: {layout(record)}")
    image = record_image(record)
    address = int(image.ctypes.data)
    RECORDS[address] = record
    weakref.finalize(owner, _forget, address, image)  # the finalizer keeps the image alive until the owner is gone
    return address


def _forget(address: int, image: Any) -> None:
    del RECORDS[address]


def record_reader(example: Any) -> Any:
    """Kernel function that returns the record of ``example``'s type at an address, see :func:`keep_record`."""
    _LAYOUTS[type(example)] = layout(example)

    def reading() -> Any:
        kind = resolve("cranktrain.core.record_types:record_type")(example)

        def read(typing_context: Any, address: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
                return builder.inttoptr(values[0], context.get_value_type(kind))

            return kind(address), generate

        return read

    return Intrinsic(reading)
