"""Measurement files of any kind: the format by content and ending, then the channels that are asked for."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.measured.channels import Channel, Measurement

SOURCE = "cranktrain.measured.formats"
EXTRA = "pip install cranktrain[measured]"


class Format(NamedTuple):
    """A file format: name, module that reads it, its endings, its first bytes, and the package that it needs."""

    name: str
    module: str
    endings: tuple[str, ...]
    begins: tuple[bytes, ...]
    package: str = ""


FORMATS = (
    Format("UFF 58", "uff", (".uff", ".unv", ".bunv", ".ufb"), (b"    -1\n    58", b"    -1\r\n    58"), "pyuff"),
    Format("MDF", "mdf", (".mf4", ".mdf", ".dat"), (b"MDF     ", b"UnFinMF "), "asammdf"),
    Format("TDMS", "tdms", (".tdms",), (b"TDSm",), "nptdms"),
    Format("WAV", "wav", (".wav",), (b"RIFF", b"RF64", b"RIFX")),
    Format("HDF5", "hdf", (".h5", ".hdf5", ".hdf"), (b"\x89HDF\r\n\x1a\n",)),
    Format("MATLAB", "matlab", (".mat",), (b"MATLAB 5.0", b"MATLAB 7.3")),
    Format("Parquet", "parquet", (".parquet", ".pq"), (b"PAR1",), "pyarrow"),
    Format("text table", "text", (".csv", ".txt", ".asc", ".tsv", ".tab", ".dat"), ()),
)
Listing = tuple[list[Channel], list[str]]


def read_measured(*files: str | Path, channels: Sequence[str] | None = None) -> Measurement:
    """Channels of measurement files, with their samples left in the files until they are asked for.

    Formats: UFF 58 and 58b, MDF, TDMS, WAV, HDF5, MATLAB, Parquet, text tables. Channels of equal name in several
    files are told apart by their file.

    Raises ``InputError``: no such file, a format that is not known or not the file's, a channel that is not there, a
    package that is missing.

    Parameters
    ----------
    channels : names of the channels to keep, in this order; all by default
    """
    if not files:
        raise InputError("read_measured: no file is named; give one or more measurement files")
    found: list[Channel] = []
    remarks: list[str] = []
    for file in files:
        own, told = _read_file(Path(file).expanduser())
        found += own
        remarks += told
    whole = Measurement(tuple(_told_apart(found)), tuple(remarks))
    return whole if channels is None else whole.chosen(channels)


def _read_file(path: Path) -> Listing:
    """Channels and remarks of one file."""
    kind = file_format(path)
    try:
        reader: Callable[[Path], Listing] = importlib.import_module(f"{SOURCE}.{kind.module}").channels
        channels, remarks = reader(path)
    except CranktrainError:
        raise
    except ImportError as error:
        if kind.package and (error.name or "").partition(".")[0] == kind.package:
            raise InputError(f"{path.name}: {kind.name} files need {kind.package}: {EXTRA}") from None
        raise
    except MemoryError:
        raise InputError(f"{path.name}: its sizes are beyond this machine's memory; the file is damaged") from None
    except Exception as error:  # readers of others raise whatever a damaged file makes them stumble over
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{path.name}: not a {kind.name} file, or a damaged one ({reason}); export it again") from None
    remarks = remarks + [
        f"{path.name}, channel {channel.name}: is empty and left out" for channel in channels if not channel.size
    ]
    channels = [channel for channel in channels if channel.size]
    if not channels:
        told = f" ({remarks[0]})" if remarks else ""
        raise InputError(f"{path.name}: holds no channel of numbers{told}; export it again with its signals")
    return channels, remarks


def file_format(path: Path) -> Format:
    """Format of a file by its first bytes, else by its ending in any case; ``InputError``."""
    try:
        if not path.is_file():
            raise InputError(f"{path}: no such measurement file; check its path")
        with path.open("rb") as file:
            begin = file.read(256)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({getattr(error, 'strerror', error)})") from None
    if not begin:
        raise InputError(f"{path.name}: is empty; copy it again from where it is whole")
    for kind in FORMATS:
        if any(begin.startswith(mark) for mark in kind.begins):
            return kind
    if begin.lstrip().startswith(b"-1"):
        return FORMATS[0]
    ending = path.suffix.lower()
    for kind in FORMATS:
        if ending in kind.endings and (not kind.begins or kind.module == "uff"):
            return kind
    if b"\0" not in begin or begin[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return FORMATS[-1]
    known = next((kind.name for kind in FORMATS if ending in kind.endings), "")
    if known:
        raise InputError(f"{path.name}: does not begin as a {known} file does; it is damaged or has another ending")
    listed = ", ".join(f"{kind.name} ({kind.endings[0]})" for kind in FORMATS)
    raise InputError(f"{path.name}: not a known measurement file; known: {listed}")


def _told_apart(channels: list[Channel]) -> list[Channel]:
    """Rename channels of equal name: by their group or file, then by a number."""
    counts: dict[str, int] = {}
    for channel in channels:
        counts[channel.name] = counts.get(channel.name, 0) + 1
    seen: dict[str, int] = {}
    result = []
    for channel in channels:
        name = channel.name
        if counts[name] > 1:
            sources = {other.source for other in channels if other.name == name}
            mark = Path(channel.source).stem if len(sources) > 1 else channel.about
            name = f"{name} ({mark})" if mark else name
        seen[name] = seen.get(name, 0) + 1
        if seen[name] > 1:
            name = f"{name} #{seen[name]}"
        result.append(channel if name == channel.name else replace(channel, name=name))
    return result


def described(measurement: Measurement) -> list[dict[str, object]]:
    """List the channels: name, unit, samples, sampling and file, for tables and JSON."""
    return [
        {
            "name": channel.name, "unit": channel.unit, "samples": channel.size, "over": channel.abscissa,
            "rate_hz": channel.rate if math.isfinite(channel.rate) else None, "start": channel.start,
            "duration": channel.duration, "file": channel.source, "about": channel.about,
        }
        for channel in measurement.channels
    ]  # fmt: skip
