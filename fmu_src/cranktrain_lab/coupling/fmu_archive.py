"""Archives of foreign FMUs, checked before anything is extracted: sizes, names, and a description without entities.

What an archive states of its entries is enough: Python's reader takes no more bytes of an entry than it states. A bomb
states what it becomes, in one entry or in many that share their bytes.
"""

from __future__ import annotations

import shutil
import stat
import tempfile
import unicodedata
import zipfile
from pathlib import Path, PurePosixPath
from typing import Any
from xml.parsers import expat

from cranktrain.core.errors import InputError
from cranktrain.core.user_file import ending

MOST_ENTRIES = 20_000
"""Entries of an archive."""
MOST_BYTES = 4 << 30
"""Bytes of all entries, extracted: the largest FMUs carry a game engine or a Python of 1 to 2 GiB."""
MOST_RATIO, FREE = 100, 64 << 20
"""Bytes extracted for a byte of the archive, beyond some that are free: libraries give 2 to 5, texts 10 to 30."""
LARGEST_DESCRIPTION = 64 << 20
"""Bytes of a model description: some 300,000 variables."""
DEEPEST = 64
"""Elements of a description within one another; FMI has 6."""
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Compressions that FMI allows."""
DESCRIPTION = "modelDescription.xml"
LONGEST_NAME = 255
REMEDY = "use an FMU of a program that you trust"


def check_archive(path: Path) -> dict[str, str]:
    """Attributes of the model description's root, once an archive (or a description, .xml) may be read.

    Raises
    ------
    InputError
        no archive; more or larger entries than an FMU has; entries that lead elsewhere, or that two names share
    """
    try:
        if ending(path) == ".xml":
            if path.stat().st_size > LARGEST_DESCRIPTION:
                raise InputError(f"the description has {path.stat().st_size:.3g} bytes")
            return _root(path.read_bytes())
        with zipfile.ZipFile(path) as archive:
            _check_entries(archive.infolist(), path.stat().st_size)
            return _root(archive.read(DESCRIPTION))
    except InputError as error:
        raise InputError(f"{path}: {error}; {REMEDY}") from None
    except KeyError:
        raise InputError(f"{path}: not a readable FMU (it has no {DESCRIPTION}); use another one") from None
    except Exception as error:  # whatever a reader of archives says
        text = " ".join(str(error).split())[:300] or type(error).__name__
        raise InputError(f"{path}: not a readable FMU ({text}); use another one") from None


def check_room(path: Path) -> None:
    """Refuse an archive that the temporary folder has no room for; ``OSError``."""
    with zipfile.ZipFile(path) as archive:
        needed = sum(entry.file_size for entry in archive.infolist())
    place = tempfile.gettempdir()
    if needed > shutil.disk_usage(place).free:
        raise OSError(28, f"{path.name} needs {1e-6 * needed:.0f} MB")


def _check_entries(entries: list[zipfile.ZipInfo], size: int) -> None:
    """Refuse entries by what the archive states of them."""
    if len(entries) > MOST_ENTRIES:
        raise InputError(f"{len(entries)} entries, more than {MOST_ENTRIES}")
    total = sum(entry.file_size for entry in entries)
    if total > min(MOST_BYTES, FREE + MOST_RATIO * size):
        raise InputError(f"{1e-6 * total:.0f} MB would come out of {1e-6 * size:.3g} MB")
    files: dict[str, str] = {}
    for entry in entries:
        name = entry.orig_filename
        _check_name(name)
        if entry.flag_bits & 1 or entry.compress_type not in METHODS:
            raise InputError(f"entry {_shown(name)} is encrypted, or packed in a way that FMI has not")
        kind = stat.S_IFMT(entry.external_attr >> 16)
        if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
            raise InputError(f"entry {_shown(name)} is a link or a device")
        if name == DESCRIPTION and entry.file_size > LARGEST_DESCRIPTION:
            raise InputError(f"{DESCRIPTION} has {entry.file_size:.3g} bytes")
        key = unicodedata.normalize("NFKC", name.rstrip("/")).casefold()
        if key in files and not name.endswith("/"):
            raise InputError(f"entries {_shown(files[key])} and {_shown(name)} would be one file")
        if not name.endswith("/"):
            files[key] = name
    for key, name in files.items():
        for folder in PurePosixPath(key).parents:
            if str(folder) in files:
                raise InputError(f"entry {_shown(name)} lies in a file")


def _check_name(name: str) -> None:
    """Refuse a name that does not stay in the folder, or that a file cannot have."""
    parts = name.removesuffix("/").split("/")
    leads = name.startswith("/") or "\\" in name or ":" in name or any(part in ("", ".", "..") for part in parts)
    if leads or not name.isprintable() or any(len(part.encode()) > LONGEST_NAME for part in parts):
        raise InputError(f"entry {_shown(name)} does not name a file in its folder")


def _shown(name: str) -> str:
    return repr(name if len(name) <= 80 else f"{name[:60]}…")


def _root(content: bytes) -> dict[str, str]:
    """Attributes of the root of a description that declares no entities and is not nested deeply."""
    parser, depth, root = expat.ParserCreate(), 0, {}

    def begin(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth == 1:
            root.update(attributes)
        if depth > DEEPEST:
            raise InputError(f"{DESCRIPTION} has more than {DEEPEST} elements within one another")

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1

    def declare(*arguments: Any) -> None:
        raise InputError(f"{DESCRIPTION} declares a document type, which could hold entities")

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.StartDoctypeDeclHandler = declare
    parser.Parse(content, True)
    return root
