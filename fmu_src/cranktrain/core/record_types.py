"""Numba's type of a record at an address: what kernels hand on is one pointer, not every array's address and shape.

A run's model has some ninety arrays. Passed by value, as numba passes named tuples, they are six hundred arguments of
every call, which cost compiling time, and time of the run where a callee is not inlined. A member is read where it is
used. Nothing rewrites a record while kernels run, so that LLVM may keep what it has read.
"""

from __future__ import annotations

from hashlib import sha256
from threading import Lock
from typing import Any

from numba import typeof, types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, register_model, typeof_impl, unbox

from cranktrain.core import vector_types  # noqa: F401 - kernels compute with vectors as with numbers
from cranktrain.core.records import record_image

_KEPT = 16


class RecordType(types.Type):
    """A record at an address.

    Parameters
    ----------
    plain : numba's type of the named tuple by value, whose layout the record has in memory
    """

    def __init__(self, plain: Any) -> None:
        self.plain = plain
        self.fields = tuple(plain.fields)
        self.kinds = tuple(RecordType(kind) if isinstance(kind, types.BaseNamedTuple) else kind for kind in plain)
        cls = plain.instance_class
        inner = ", ".join(f"{field}: {kind.name}" for field, kind in zip(self.fields, self.kinds, strict=True))
        super().__init__(f"record({cls.__module__}.{cls.__name__}({inner}))")
        self._short = f"{cls.__name__}{sha256(self.name.encode()).hexdigest()[:8]}"

    @property
    def mangling_args(self) -> tuple[str, tuple[Any, ...]]:
        """A short name for symbols: LLVM's text repeats it at every call."""
        return self._short, ()


@register_model(RecordType)
class _RecordModel(models.OpaqueModel):
    """A pointer."""


@infer_getattr
class _Members(AttributeTemplate):
    key = RecordType

    def generic_resolve(self, kind: RecordType, name: str) -> Any:  # type: ignore[override]
        return kind.kinds[kind.fields.index(name)] if name in kind.fields else None


@lower_getattr_generic(RecordType)
def _member(context: Any, builder: Any, kind: RecordType, address: Any, name: str) -> Any:
    """Address of an inner record; any other member is loaded."""
    place = kind.fields.index(name)
    record = builder.bitcast(address, context.get_value_type(kind.plain).as_pointer())
    member = cgutils.gep_inbounds(builder, record, 0, place)
    if isinstance(kind.kinds[place], RecordType):
        return builder.bitcast(member, cgutils.voidptr_t)
    value = builder.load(member)
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


@unbox(RecordType)
def _unbox(kind: RecordType, record: Any, c: Any) -> NativeValue:
    function = c.pyapi.unserialize(c.pyapi.serialize_object(_address))
    number = c.pyapi.call_function_objargs(function, (record,))
    c.pyapi.decref(function)
    place = cgutils.alloca_once_value(c.builder, c.context.get_constant_null(kind))
    failed = cgutils.is_null(c.builder, number)
    with cgutils.if_likely(c.builder, c.builder.not_(failed)):
        c.builder.store(c.pyapi.long_as_voidptr(number), place)
        c.pyapi.decref(number)
    return NativeValue(c.builder.load(place), is_error=failed)


_alone = Lock()
_images: dict[int, tuple[Any, Any]] = {}
"""Records that Python handed to kernels, by identity, with their images; the last of them."""


def _address(record: Any) -> int:
    with _alone:
        found = _images.pop(id(record), None) or (record, record_image(record))
        _images[id(record)] = found
        if len(_images) > _KEPT:
            del _images[next(iter(_images))]
    return int(found[1].ctypes.data)


def at_address(cls: type) -> None:
    """Let kernels take records of a class at their address where Python calls them."""
    typeof_impl.register(cls)(lambda record, context: record_type(record))


def record_type(record: Any) -> RecordType:
    """Type of a record like this."""
    return RecordType(_by_value(record))


def _by_value(member: Any) -> Any:
    """Numba's type of a member as it lies in memory, inner records within outer ones."""
    if isinstance(member, tuple):
        return types.BaseTuple.from_types([_by_value(inner) for inner in member], type(member))
    return typeof(member)
