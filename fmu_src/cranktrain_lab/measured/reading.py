"""Reading of measurement files of any kind: recognise the format by content and file extension, select channels."""

import gc
import logging
import math
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.core.named import resolve
from cranktrain.core.types import Array
from cranktrain.core.user_file import check_file, file_exists, user_path
from cranktrain_lab.measured.channels import TIME, Channel, Measurement, Reader

SOURCE = "cranktrain_lab.measured.formats"
TALKERS = ("nptdms", "nptdms.reader", "nptdms.tdms_segment", "nptdms.types", "nptdms.tdms", "asammdf", "canmatrix")
"""Names of the loggers of third-party packages that read files."""
CHECKED, ROUNDED = 4_000_000, 2.0**53
"""Number of values of a file that are checked on opening, and integer above which float64 rounds."""
EXTRA = "pip install cranktrain[measured]"


class Format(NamedTuple):
    """File format: name, module of the reader, file extensions, first bytes, and required package.

    The reader lists the channels of a file, and remarks: ``channels(path)`` of a module of :mod:`.formats`, or any
    function by ``module:function``.
    """

    name: str
    module: str
    endings: tuple[str, ...]
    begins: tuple[bytes, ...]
    package: str = ""


FORMATS = [
    Format("UFF 58", "uff", (".uff", ".unv", ".bunv", ".ufb"), (b"    -1\n    58", b"    -1\r\n    58"), "pyuff"),
    Format("MDF", "mdf", (".mf4", ".mdf", ".dat"), (b"MDF     ", b"UnFinMF "), "asammdf"),
    Format("TDMS", "tdms", (".tdms",), (b"TDSm",), "nptdms"),
    Format("WAV", "wav", (".wav",), (b"RIFF", b"RF64", b"RIFX")),
    Format("HDF5", "hdf", (".h5", ".hdf5", ".hdf"), (b"\x89HDF\r\n\x1a\n",)),
    Format("MATLAB", "matlab", (".mat",), (b"MATLAB 5.0", b"MATLAB 7.3")),
    Format("Parquet", "parquet", (".parquet", ".pq"), (b"PAR1",), "pyarrow"),
    Format("LVM", "lvm", (".lvm",), (b"LabVIEW Measurement",)),
    Format("text table", "text", (".csv", ".txt", ".asc", ".tsv", ".tab", ".prn", ".dat"), ()),
]
Listing = tuple[list[Channel], list[str]]


def register_format(row: Format) -> None:
    """Add a file format; text tables stay the last one, which takes what no other format does."""
    FORMATS.insert(-1, row)


def read_measured(*files: str | Path, channels: Sequence[str] | None = None) -> Measurement:
    """Open measurement files and return their channels; samples stay in the files until needed.

    Formats: UFF 58 and 58b, MDF, TDMS, WAV, HDF5, MATLAB, Parquet, LabVIEW text, text tables. Channels of equal
    name in several files are told apart by their file.

    Raises ``InputError`` for a missing file, an unknown or wrong format, a missing channel, or a missing package.

    Parameters
    ----------
    channels : names of the channels to keep, in this order; all by default
    """
    if not files:
        raise InputError("read_measured: no file is named; give one or more measurement files")
    found: list[Channel] = []
    remarks: list[str] = []
    for file in files:
        own, told = _read_file(user_path(file))
        found += own
        remarks += told
    found, told = _on_one_clock(found)
    remarks += told
    whole = Measurement(tuple(_told_apart(found)), tuple(remarks))
    return whole if channels is None else whole.chosen(channels)


def _on_one_clock(channels: list[Channel]) -> Listing:
    """Shift channels of files with start times to the earliest start, with a remark on each that began later."""
    stated = [channel for channel in channels if channel.began is not None and channel.abscissa == TIME]
    if not stated:
        return channels, []
    first = min(stated, key=lambda channel: channel.began or 0)
    lags = {id(one): 1e-9 * ((one.began or 0) - (first.began or 0)) for one in stated}
    remarks = [
        f"{one.where}: its time 0 is {lags[id(one)]:.9g} s behind that of channel {first.name} of "
        f"{first.source}, by the start times of the files; times count from the first"
        for one in stated
        if lags[id(one)]
    ]
    if remarks:
        remarks += [
            f"{one.where}: states no start time, so its time 0 is taken as that of {first.name}"
            for one in channels
            if one.began is None and one.abscissa == TIME
        ]
    return [one.later(lags[id(one)]) if lags.get(id(one)) else one for one in channels], remarks


def _read_file(path: Path) -> Listing:
    """Return the channels of one measurement file, and remarks."""
    kind = file_format(path)
    listing, wrong = None, ""
    with _quiet():
        try:
            own = kind.module if ":" in kind.module else f"{SOURCE}.{kind.module}:channels"
            reader: Callable[[Path], Listing] = resolve(own)
            listing = reader(path)
        except CranktrainError:
            raise
        except ImportError as error:
            if not kind.package or (error.name or "").partition(".")[0] != kind.package:
                raise
            wrong = f"{kind.name} files need {kind.package}: {EXTRA}"
        except MemoryError:
            wrong = "its sizes are beyond this machine's memory; the file is damaged"
        except Exception as error:  # third-party readers raise errors of many types for a damaged file
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            wrong = f"not a {kind.name} file, or a damaged one ({reason}); export it again"
        if listing is None:
            gc.collect()  # removes unfinished objects while their messages are suppressed
    if listing is None:
        raise InputError(f"{path.name}: {wrong}")
    channels, remarks = listing
    remarks = remarks + [
        f"{path.name}, channel {channel.name}: is empty and left out" for channel in channels if not channel.size
    ]
    channels = [replace(channel, read=_guarded(channel, kind)) for channel in channels if channel.size]
    remarks += _odd_values(channels)
    if not channels:
        told = f" ({remarks[0]})" if remarks else ""
        raise InputError(f"{path.name}: holds no channel of numbers{told}; export it again with its signals")
    return channels, remarks


def _odd_values(channels: Sequence[Channel]) -> list[str]:
    """Return remarks on NaN and on values that float64 rounds, in the first channels up to ``CHECKED`` values."""
    remarks, left = [], CHECKED
    for channel in channels:
        left -= channel.size
        if left < 0:
            break
        with suppress(CranktrainError):  # damage is reported when the samples are read
            values = np.abs(channel.read(0, channel.size))
            if lost := int(np.count_nonzero(~np.isfinite(values))):
                told = f"{lost} of {channel.size} values are not numbers"
            elif values.max() > ROUNDED and np.array_equal(values, np.rint(values)) and values.max() < 2.0**64:
                told = f"whole numbers up to {values.max():.4g} are rounded to the 53 bits of float64"
            else:
                continue
            remarks.append(f"{channel.where}: {told}")
    return remarks


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress the output of third-party readers, because faults of a file are reported in one line."""
    levels = {name: logging.getLogger(name).level for name in TALKERS}
    hook = sys.unraisablehook
    for name in TALKERS:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    sys.unraisablehook = lambda _: None  # unfinished objects may fail to close
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


def _guarded(channel: Channel, kind: Format) -> Reader:
    """Return a reader of a channel that reports damage within the file as one line when samples are read."""

    def read(first: int, last: int) -> Array:
        try:
            values = channel.read(first, last)
        except CranktrainError:
            raise
        except Exception as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise InputError(
                f"{channel.where}: samples {first} to {last} of a {kind.name} file cannot be "
                f"read ({reason}); the file is damaged, copy it again from where it is whole"
            ) from None
        if values.size != last - first:
            raise InputError(
                f"{channel.where}: {values.size} of the samples {first} to {last} are there; "
                "the file is damaged, copy it again from where it is whole"
            )
        return values

    return read


def file_format(path: Path) -> Format:
    """Return the format of a file by its first bytes, else by its extension (case-insensitive); ``InputError``."""
    try:
        check_file(path, f"{path}", "give a measurement file", most=sys.maxsize)
        if not file_exists(path):
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
        if ending in kind.endings and (not kind.begins or kind.module in ("uff", "matlab")):
            return kind
    if b"\0" not in begin or begin[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return FORMATS[-1]
    known = next((kind.name for kind in FORMATS if ending in kind.endings), "")
    if known:
        raise InputError(f"{path.name}: does not begin as a {known} file does; it is damaged or has another ending")
    listed = ", ".join(f"{kind.name} ({kind.endings[0]})" for kind in FORMATS)
    raise InputError(f"{path.name}: not a known measurement file; known: {listed}")


def _told_apart(channels: list[Channel]) -> list[Channel]:
    """Rename channels of equal name by their group or file, then by a number."""
    counts, seen = Counter(channel.name for channel in channels), Counter[str]()
    result = []
    for channel in channels:
        name = channel.name
        if counts[name] > 1:
            sources = {other.source for other in channels if other.name == name}
            mark = Path(channel.source).stem if len(sources) > 1 else channel.about
            name = f"{name} ({mark})" if mark else name
        seen[name] += 1
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
