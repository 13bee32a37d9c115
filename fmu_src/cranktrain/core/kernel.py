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

A record of many arrays is handed on as one address: its class, a named tuple, has the line ``@record``. Nothing
rewrites such a record while kernels run.

A library of machine code (:mod:`.machine_code`) holds what a run calls. Numba is loaded when something is compiled, not
before: with a library a run starts without it.
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
"""Called once when numba is loaded."""


@cache
def compiler() -> Any:
    """Numba, loaded at the first call."""
    import numba
    from numba import core, extending  # noqa: F401 - the package does not promise to have loaded them

    for cls in _AT_ADDRESS:
        resolve(_AT_ADDRESS_BY)(cls)
    for notice in BEFORE_COMPILING:
        notice()
    return numba


_AT_ADDRESS: list[type] = []
_RECORD_TYPES = Path(__file__).with_name("record_types.py")
"""How kernels take records; none of them imports it."""
_AT_ADDRESS_BY = "cranktrain.core.record_types:at_address"


def record(cls: type) -> type:
    """Let kernels take named tuples of a class as one address, also where Python calls them."""
    _AT_ADDRESS.append(cls)
    if compiler.cache_info().currsize:
        resolve(_AT_ADDRESS_BY)(cls)
    return cls


@cache
def _kernel_folder(file: str) -> str:
    """Folder for the compiled kernels of a source file; empty where it cannot be written, or others may do so."""
    source = Path(file)
    if edited_meanwhile(rests_on(source)):
        return ""  # what was imported is no longer what the digest would name
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
    """How kernels that no library has become code that runs: numba compiles each for itself, for this machine.

    Attributes
    ----------
    keeps : whether compiled kernels are kept in the user's cache
    options : of ``numba.njit``
    """

    keeps = True
    options: Mapping[str, Any] = OPTIONS

    def call(self, function: Kernel, arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
        """Call a kernel from Python."""
        return function.dispatcher(*arguments, **named)

    def address(self, function: Kernel, arguments: tuple[Any, ...]) -> int:
        """Address at which :data:`call_kernel` finds a kernel for arguments of these types."""
        compiled = overload(function, arguments)
        if compiler().types.unliteral(compiled.signature.return_type) != compiler().types.int64:
            raise TypeError(f"{function.py_func.__name__} must return an integer to be called at its address")
        return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


_COMPILING = [Compiling()]


@contextmanager
def compiled_by(way: Compiling) -> Iterator[None]:
    """Compile kernels in another way meanwhile."""
    _COMPILING.append(way)
    try:
        yield
    finally:
        _COMPILING.pop()


class Kernel:
    """A function in the native-safe subset, for other kernels and for Python.

    A call from Python is one of the library's where that has the kernel for such arguments; else numba compiles it.

    Attributes
    ----------
    py_func : the function as it was written
    """

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        update_wrapper(self, function)
        self.py_func, self._options = function, options
        self._dispatchers: dict[Compiling, Any] = {}

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call with values and arrays of any types."""
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
        """What numba compiles, one code for each set of types; cached on disk where possible."""
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
        """By this numba knows it where another kernel calls it."""
        return self.dispatcher._numba_type_


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` in the native-safe subset, cached on disk where possible."""
    return Kernel(function)


def inlined_kernel(function: Callable[..., Any]) -> Any:
    """Kernel that is compiled into each of its callers: a small piece of one, dearer to call than to run."""
    return Kernel(function, forceinline=True)


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


law_kernel = kernel
"""For kernels that are called at their address."""


def kernel_address(function: Any, *arguments: Any) -> int:
    """Address at which :func:`call_kernel` finds ``function`` for arguments of these types.

    It is that of the library of machine code where there is one; else the kernel is compiled.
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
    """What numba makes of a kernel for arguments of these types."""
    signature = tuple(compiler().typeof(argument) for argument in arguments)
    function.dispatcher.compile(signature)
    return function.dispatcher.overloads[signature]


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
    entry: Callable[..., Any] = overload(function, arguments).entry_point
    return entry


def bound_call(function: Any, arguments: tuple[Any, ...]) -> Callable[[], int]:
    """A kernel that returns an integer, to be called again and again with the same arrays; takes under a microsecond.

    ``arguments`` are arrays, whose memory stays theirs, and numbers, which stay as they are.
    """
    call = calls_of(kernel_name(function)).get(layout(arguments))
    if call is not None:
        return call.bound(arguments)
    return partial(typed_kernel(function, *arguments), *arguments)


class Intrinsic:
    """What kernels call and only LLVM can say, made when the first of them is compiled."""

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
"""Call the kernel at an address with a tuple of arguments, of the very types that the address was made for."""

ADDRESSES: dict[int, str] = {}
"""Names of the kernels that were given out as addresses."""
RECORDS: dict[int, Any] = {}
"""Records that were given out as addresses and whose owners live."""
_LAYOUTS: dict[type, str] = {}
"""What the records are made of that each class' reader knows."""


def keep_record(record: Any, owner: NDArray[Any]) -> int:
    """Address at which a reader finds ``record``, a named tuple of arrays, for as long as the array ``owner`` lives.

    ``TypeError`` where it is not of the kind that its class' reader was made for: a law would read what is not there.
    """
    if layout(record) != _LAYOUTS.get(type(record)):
        raise TypeError(f"{type(record).__name__} of other arrays than its reader knows: {layout(record)}")
    image = record_image(record)
    address = int(image.ctypes.data)
    RECORDS[address] = record
    weakref.finalize(owner, _forget, address, image)  # a finalizer's arguments live until then
    return address


def _forget(address: int, image: Any) -> None:
    del RECORDS[address]


def record_reader(example: Any) -> Any:
    """Function for kernels that reads a record of ``example``'s type from its address, see :func:`keep_record`."""
    _LAYOUTS[type(example)] = layout(example)

    def reading() -> Any:
        kind = resolve("cranktrain.core.record_types:record_type")(example)

        def read(typing_context: Any, address: Any) -> Any:
            def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
                return builder.inttoptr(values[0], context.get_value_type(kind))

            return kind(address), generate

        return read

    return Intrinsic(reading)
