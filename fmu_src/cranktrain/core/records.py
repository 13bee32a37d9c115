"""Memory image of records for compiled kernels: nested named tuples of arrays and numbers, flattened to words.

An array of d dimensions is numba's structure of 5 + 2d words: owner and parent (native-safe kernels read neither),
number of values, bytes of each value, address, shape, strides. A number is one word.
"""

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray


def leaves(record: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Arrays and numbers of a record in order, those of inner records included, with their paths (``model.gas``)."""
    found: list[tuple[str, Any]] = []
    _add_leaves(record, path, found)
    return iter(found)


def _add_leaves(record: Any, path: str, found: list[tuple[str, Any]]) -> None:
    if not isinstance(record, tuple):
        found.append((path, record))
        return
    names = getattr(record, "_fields", None) or [str(k) for k in range(len(record))]
    before = f"{path}." if path else ""
    for name, value in zip(names, record, strict=True):
        _add_leaves(value, before + name, found)


def record_image(record: Any) -> NDArray[np.int64]:
    """Words of a record as an array, from whose address kernels read the record while its arrays are alive.

    ``TypeError`` for members that are neither arrays nor numbers of eight bytes.
    """
    words: list[int] = []
    _add_words(record, words)
    return np.array(words, dtype=np.int64)


def _add_words(record: Any, words: list[int]) -> None:
    for k, member in enumerate(record):
        if isinstance(member, np.ndarray):
            words += (0, 0, member.size, member.itemsize, address_of(member), *member.shape, *member.strides)
        elif isinstance(member, tuple):
            _add_words(member, words)
        elif isinstance(member, int | float | np.integer) and not isinstance(member, bool):
            words.append(number_word(member))
        else:
            name = getattr(record, "_fields", range(len(record)))[k]
            raise TypeError(f"'{name}' of {type(record).__name__} is a {type(member).__name__}, which no kernel reads")


def address_of(array: NDArray[Any]) -> int:
    """Address of an array's first value; faster than through ``ctypes``."""
    return int(array.__array_interface__["data"][0])


def layout(record: Any) -> str:
    """Layout of a record as text: dimensions and value type of each array and the type of each number, in order.

    Arrays that are not contiguous, or cannot be written, have a mark in their text.
    """
    kinds: list[str] = []
    _add_kinds(record, kinds)
    return " ".join(kinds)


def _add_kinds(record: Any, kinds: list[str]) -> None:
    if isinstance(record, tuple):
        for member in record:
            _add_kinds(member, kinds)
    elif isinstance(record, np.ndarray):
        kinds.append(_array_kind(record.ndim, record.dtype, record.flags.c_contiguous, record.flags.writeable))
    elif isinstance(record, bool | np.bool_) or not isinstance(record, int | float | np.integer):
        kinds.append(type(record).__name__)
    else:
        kinds.append("float" if isinstance(record, float) else "int")


@cache
def _array_kind(dimensions: int, dtype: np.dtype[Any], contiguous: bool, writeable: bool) -> str:
    special = ("" if contiguous else "strided") + ("" if writeable else "constant")
    return f"{dimensions}{dtype.kind}{dtype.itemsize}{special}"


def number_word(number: int | float | np.integer[Any]) -> int:
    """Bit pattern of a number (eight bytes) as an integer."""
    word = np.float64(number).view(np.int64) if isinstance(number, float) else np.int64(number)
    return int(word)
