"""WAV file of the normal velocity of a point of the surface."""

import math
import struct
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.user_file import ending
from cranktrain.store.whole_file import check_place, marked, whole_file
from cranktrain_lab.noise.result import NoiseResult

RATE = 48_000
"""Samples per second."""
SECONDS = 2.0
"""Least duration of each speed, s; speeds follow each other in whole periods."""
FULL = 32767
SOUND = marked("sound of cranktrain", "cranktrain noise")


class Sound(NamedTuple):
    """Written sound: ``place`` (3,) m of its point, ``full_scale`` m/s of the largest sample, duration in s."""

    place: Array
    full_scale: float
    seconds: float


def check_sound(path: Path) -> None:
    """Refuse a path of another ending, or an existing file that is no sound of this program; ``InputError``."""
    if ending(path) != ".wav":
        raise InputError(f"{path}: a sound is a .wav file; name it {path.with_suffix('.wav').name}")
    check_place(path, SOUND)


def save_sound(path: Path, result: NoiseResult, place: Array | None) -> Sound:
    """Write the normal velocity of the surface's point nearest to a place (3,), m, at each speed, as 16 bit samples.

    The default is the point with the largest velocity of all speeds. Lines beyond the kept modes are left out. The full
    scale, a round number, is in the file's comment.
    """
    points = result.panels.points
    amplitudes = [np.where(run.frequency[:, None] <= result.highest, run.lines, 0.0) for run in result.runs]
    if place is None:
        squares = [(np.abs(lines @ result.panels.normal) ** 2).sum(axis=0) for lines in amplitudes]
        node = int(np.max(squares, axis=0).argmax())
    else:
        node = int(np.linalg.norm(points - place, axis=1).argmin())
    parts = []
    for run, lines in zip(result.runs, amplitudes, strict=True):
        repeats = math.ceil(SECONDS / run.period)
        t = np.arange(round(repeats * run.period * RATE)) / RATE
        spectrum = lines @ result.panels.normal[:, node]
        own = np.zeros(t.size)
        for hz, one in zip(run.frequency.tolist(), spectrum.tolist(), strict=True):
            if one:
                own += (one * np.exp(2j * math.pi * hz * t)).real
        parts.append(own)
    velocity = np.concatenate(parts)
    scale = _rounded_up(float(np.abs(velocity).max()) or 1.0)
    text = f"cranktrain noise: normal velocity, full scale {scale:g} m/s, point {_text(points[node])} mm"
    with whole_file(path, SOUND) as temporary:
        temporary.write_bytes(wave_bytes(np.rint(FULL * velocity / scale).astype("<i2"), text))
    return Sound(points[node], scale, velocity.size / RATE)


def wave_bytes(samples: NDArray[np.int16], comment: str) -> bytes:
    """WAV file (RIFF, PCM of 16 bit, one channel) with a comment (INFO chunk ICMT) before its samples."""
    text = comment.encode("ascii", "replace") + b"\0"
    text += b"\0" * (len(text) % 2)
    info = b"INFOICMT" + struct.pack("<I", len(text)) + text
    form = struct.pack("<HHIIHH", 1, 1, RATE, 2 * RATE, 2, 16)
    data = samples.tobytes()
    chunks = b"".join(
        name + struct.pack("<I", len(own)) + own for name, own in ((b"fmt ", form), (b"LIST", info), (b"data", data))
    )
    return b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WAVE" + chunks


def _rounded_up(value: float) -> float:
    """Smallest of 1, 2 or 5 times a power of ten that is not below a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(next(one * power for one in (1.0, 2.0, 5.0, 10.0) if one * power >= value * (1.0 - 1e-12)))


def _text(place: Array) -> str:
    return ", ".join(f"{1e3 * x:.0f}" for x in place)
