"""Checksum behind the end of an HDF5 file, because a damaged file may crash the HDF5 library or make it loop for ever.

HDF5 does not read beyond the end of its data, so other programs ignore the checksum. A program that changes the file
removes the checksum; a file without checksum is read without a check.
"""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import BinaryIO

MARK = b"\ncranktrain checksum "
SIZE = len(MARK) + 9
"""Size of a seal, bytes: a mark, the CRC-32 of the file before the seal (8 hexadecimal digits), and a newline."""
BLOCK = 1 << 20


def seal(path: Path) -> None:
    """Append the seal, which contains the file's checksum, to a file."""
    with path.open("r+b") as file:
        size = file.seek(0, 2)
        checksum = _checksum(file, size)
        file.seek(size)
        file.write(MARK + b"%08x\n" % checksum)


def check_seal(path: Path) -> None:
    """Raise ``OSError`` if a sealed file does not match its checksum."""
    with path.open("rb") as file:
        size = file.seek(0, 2) - SIZE
        if size < 0:
            return
        file.seek(size)
        found = file.read()
        if found.startswith(MARK) and found != MARK + b"%08x\n" % _checksum(file, size):
            raise OSError("checksum of the file does not match its content")


def _checksum(file: BinaryIO, size: int) -> int:
    """CRC-32 of the first ``size`` bytes of a file."""
    file.seek(0)
    checksum = 0
    while size > 0 and (block := file.read(min(size, BLOCK))):
        checksum, size = zlib.crc32(block, checksum), size - len(block)
    return checksum
