"""Journal next to a file that can only be rewritten completely: rows of numbers finished since the last rewriting.

Adding a row takes a hundredth of the time of rewriting the file, and rows in the journal survive if the process is
killed. A row that was half-written when the process was killed ends the journal; it is cut off before the next row is
added. A mark ties the journal to the content of its file; for another content the journal is ignored.
"""

import struct
import zlib
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

import numpy as np

from cranktrain.core.errors import StoreError
from cranktrain.core.reduced_body import Array

FORMAT = b"cranktrain journal 1\n"
HEAD = struct.Struct("<II")
"""Header of each row in a journal: number of bytes of the row, and their CRC-32."""
_WHOLE: dict[Path, int] = {}
"""End of the last complete row in each journal to which this process has added."""


def journal_place(path: Path) -> Path:
    """Path of the journal of a file."""
    return path.with_name(f".{path.name}.journal")


def add_row(path: Path, tie: str, row: Array) -> None:
    """Add a row (n,) to the journal of a file whose content is identified by ``tie``. Raises ``StoreError``."""
    place, begin = journal_place(path), _begin(tie)
    content = np.ascontiguousarray(row, dtype="<f8").tobytes()
    try:
        end = _WHOLE.get(place) or (_rows(place.read_bytes(), begin)[1] if place.is_file() else 0)
        known = end > 0 and place.is_file() and _starts(place, begin)
        with place.open("r+b" if known else "wb") as file:
            if known:
                file.truncate(end)
                file.seek(end)
            file.write((b"" if known else begin) + HEAD.pack(len(content), zlib.crc32(content)) + content)
            _WHOLE[place] = file.tell()
    except OSError as error:
        raise StoreError(f"{place}: cannot be written ({error.strerror or error}); choose another place") from None


def journal_rows(path: Path, tie: str) -> list[Array]:
    """Rows (n,) in the journal of a file; empty if there is no journal, or it belongs to other content."""
    try:
        content = journal_place(path).read_bytes()
    except OSError:
        return []
    return _rows(content, _begin(tie))[0]


def drop_journal(path: Path) -> None:
    """Remove the journal of a file, once the file contains all rows of the journal."""
    _WHOLE.pop(journal_place(path), None)
    with suppress(OSError):
        journal_place(path).unlink()


def _rows(content: bytes, begin: bytes) -> tuple[list[Array], int]:
    """Rows in a journal's content, and the end of the last complete one; 0 if the journal belongs to another file."""
    found: list[Array] = []
    if not content.startswith(begin):
        return found, 0
    end = len(begin)
    while end + HEAD.size <= len(content):
        size, checksum = HEAD.unpack_from(content, end)
        row = content[end + HEAD.size : end + HEAD.size + size]
        if len(row) < size or size % 8 or zlib.crc32(row) != checksum:
            break
        found.append(np.frombuffer(row, dtype="<f8").astype(np.float64))
        end += HEAD.size + size
    return found, end


def _begin(tie: str) -> bytes:
    return FORMAT + sha256(tie.encode()).digest()


def _starts(place: Path, begin: bytes) -> bool:
    with place.open("rb") as file:
        return file.read(len(begin)) == begin
