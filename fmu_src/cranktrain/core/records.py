"""Records of arrays as compiled kernels find them in memory: nested named tuples of arrays and numbers, flattened.

An array of d dimensions is numba's structure of 5 + 2d words: owner and parent, which native-safe kernels never look
at, number of values, bytes of each, address, shape, strides. A number is one word.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray


def leaves(record: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Arrays and numbers of a record, those of inner ones as well, in order, with their paths (``model.gas``)."""
    if not isinstance(record, tuple):
        yield path, record
        return
    names = getattr(record, "_fields", None) or [str(k) for k in range(len(record))]
    for name, value in zip(names, record, strict=True):
        yield from leaves(value, f"{path}.{name}" if path else name)


def record_image(record: Any) -> NDArray[np.int64]:
    """The words of a record, from whose address kernels read it as long as its arrays live.

    ``TypeError`` for members that are neither arrays nor numbers of eight bytes.
    """
    words: list[int] = []
    for path, leaf in leaves(record):
        if isinstance(leaf, np.ndarray):
            words += [0, 0, leaf.size, leaf.itemsize, leaf.ctypes.data, *leaf.shape, *leaf.strides]
        elif isinstance(leaf, int | float | np.integer) and not isinstance(leaf, bool):
            words.append(number_word(leaf))
        else:
            raise TypeError(f"'{path}' of {type(record).__name__} is a {type(leaf).__name__}, which no kernel reads")
    return np.array(words, dtype=np.int64)


def layout(record: Any) -> str:
    """What a record is made of, as text: dimensions and kind of value of each array, kind of each number, in order.

    Arrays whose values do not follow each other, or that cannot be written, are of kinds of their own.
    """
    kinds: list[str] = []
    _add_kinds(record, kinds)
    return " ".join(kinds)


def _add_kinds(record: Any, kinds: list[str]) -> None:
    if isinstance(record, tuple):
        for member in record:
            _add_kinds(member, kinds)
    else:
        kinds.append(_kind(record))


def _kind(leaf: Any) -> str:
    if isinstance(leaf, np.ndarray):
        flags = leaf.flags
        special = ("" if flags.c_contiguous else "strided") + ("" if flags.writeable else "constant")
        return f"{leaf.ndim}{leaf.dtype.kind}{leaf.itemsize}{special}"
    if isinstance(leaf, bool | np.bool_) or not isinstance(leaf, int | float | np.integer):
        return type(leaf).__name__
    return "float" if isinstance(leaf, float) else "int"


def number_word(number: int | float | np.integer[Any]) -> int:
    """The eight bytes of a number, as an integer."""
    word = np.float64(number).view(np.int64) if isinstance(number, float) else np.int64(number)
    return int(word)
