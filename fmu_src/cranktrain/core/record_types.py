"""Numba's type of a record at an address: kernels pass one pointer instead of every array's address and shape.

A run's model has some ninety arrays. Numba passes named tuples by value, which makes six hundred arguments in every
call; they cost compile time, and run time if the called function is not inlined. With the pointer a member is read
where it is used. Records are not rewritten while kernels run, so LLVM may keep the values that it has read.
"""

from hashlib import sha256
from threading import Lock
from typing import Any

from numba import typeof, types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, register_model, typeof_impl, unbox

from cranktrain.core import vector_types  # noqa: F401 - the import registers numba's vector types
from cranktrain.core.records import record_image

_KEPT = 16


class RecordType(types.Type):
    """A record at an address.

    Parameters
    ----------
    plain : numba's type of the same named tuple by value; the record has its memory layout
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
        """Short name for symbols, because LLVM's text repeats the name at every call."""
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
    """Value of a record's member; for an inner record its address."""
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
"""Last records that Python passed to kernels, by identity, each with its image."""


def _address(record: Any) -> int:
    with _alone:
        found = _images.pop(id(record), None) or (record, record_image(record))
        _images[id(record)] = found
        if len(_images) > _KEPT:
            del _images[next(iter(_images))]
    return int(found[1].ctypes.data)


def at_address(cls: type) -> None:
    """Make calls from Python pass records of a class by address."""
    typeof_impl.register(cls)(lambda record, context: record_type(record))


def record_type(record: Any) -> RecordType:
    """Numba type of ``record``, passed by address."""
    return RecordType(_by_value(record))


def _by_value(member: Any) -> Any:
    """Numba's type of a member as it is laid out in memory, with inner records inside outer ones."""
    if isinstance(member, tuple):
        return types.BaseTuple.from_types([_by_value(inner) for inner in member], type(member))
    return typeof(member)
