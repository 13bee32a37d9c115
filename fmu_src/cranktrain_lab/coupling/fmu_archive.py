"""Checks of foreign FMU archives before extraction: sizes, names, and a model description without entities.

The sizes in the archive's directory can be trusted, because Python's reader extracts no more bytes of an entry than
stated. An archive bomb therefore states its extracted size, in one entry or in several that share their bytes.
"""

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
"""Limit of the number of entries of an archive."""
MOST_BYTES = 4 << 30
"""Limit of the extracted size, bytes. The largest FMUs contain a game engine or a Python of 1 to 2 GiB."""
MOST_RATIO, FREE = 100, 64 << 20
"""Limit of the compression ratio, and extracted bytes allowed at any ratio. Usual are 2 to 5, of texts 10 to 30."""
LARGEST_DESCRIPTION = 64 << 20
"""Limit of the size of a model description, bytes. It suffices for some 300,000 variables."""
DEEPEST = 64
"""Limit of the nesting depth of elements in a model description. FMI needs 6."""
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Compression methods that FMI allows."""
DESCRIPTION = "modelDescription.xml"
LONGEST_NAME = 255
REMEDY = "use an FMU of a program that you trust"


def check_archive(path: Path) -> dict[str, str]:
    """Check an archive (or a description, .xml) and return the root attributes of its model description.

    Raises
    ------
    InputError
        no archive; too many or too large entries; entries outside the folder, or two that would be one file
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
    except Exception as error:  # archive readers raise errors of many types
        text = " ".join(str(error).split())[:300] or type(error).__name__
        raise InputError(f"{path}: not a readable FMU ({text}); use another one") from None


def check_room(path: Path) -> None:
    """Raise ``OSError`` if the temporary folder has no room for the extracted archive."""
    with zipfile.ZipFile(path) as archive:
        needed = sum(entry.file_size for entry in archive.infolist())
    place = tempfile.gettempdir()
    if needed > shutil.disk_usage(place).free:
        raise OSError(28, f"{path.name} needs {1e-6 * needed:.0f} MB")


def _check_entries(entries: list[zipfile.ZipInfo], size: int) -> None:
    """Raise ``InputError`` for invalid entries in the directory of an archive."""
    if len(entries) > MOST_ENTRIES:
        raise InputError(f"{len(entries)} entries, more than {MOST_ENTRIES}")
    total = sum(entry.file_size for entry in entries)
    if total > min(MOST_BYTES, FREE + MOST_RATIO * size):
        raise InputError(f"{1e-6 * total:.0f} MB would come out of {1e-6 * size:.3g} MB")
    files: dict[str, str] = {}
    for entry in entries:
        name = entry.orig_filename
        # Refuse a name that leads outside the folder or is not a valid file name.
        parts = name.removesuffix("/").split("/")
        leads = name.startswith("/") or "\\" in name or ":" in name or any(part in ("", ".", "..") for part in parts)
        if leads or not name.isprintable() or any(len(part.encode()) > LONGEST_NAME for part in parts):
            raise InputError(f"entry {_shown(name)} does not name a file in its folder")
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


def _shown(name: str) -> str:
    return repr(name if len(name) <= 80 else f"{name[:60]}…")


def _root(content: bytes) -> dict[str, str]:
    """Return the root attributes of a description; raises ``InputError`` for entities or deep nesting."""
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
