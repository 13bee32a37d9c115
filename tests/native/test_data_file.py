"""native.bin as the C side takes it: wherever it lies, and whatever is wrong with it."""

import os
import shutil
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import mock_unit
import numpy as np
import pytest
from mock_unit import DIGEST, GUID, REFERENCE
from raw_unit import ERROR

from cranktrain.fmu.native import file_format as ff

WHOLE = mock_unit.native_bin()


def resources(folder, data=WHOLE):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "native.bin").write_bytes(data)
    return folder


@pytest.mark.parametrize("name", ["plain", "with spaces", "Größe ü 漢字", "100%", "%41", "a#b?c", "file:x"])
@pytest.mark.parametrize("slash", ["", "/"])
def test_a_folder_may_have_any_name(unit, tmp_path, name, slash):
    folder = resources(tmp_path / name / "resources")
    assert unit(resources=folder.as_uri() + slash).start().run(3).component


@pytest.mark.parametrize("form", ["file://{0}", "file:{0}", "FILE://localhost{0}", "file:///{0}", "{0}"])
def test_hosts_write_a_location_in_many_ways(unit, tmp_path, form):
    """Also without percent-encoding."""
    folder = resources(tmp_path / "mit Größe" / "resources")
    assert unit(resources=form.format(folder)).start().component


def test_a_long_path_is_one(unit, tmp_path):
    folder = tmp_path
    for _ in range(12):
        folder = folder / ("d" * 100)
    assert unit(resources=resources(folder)).start().component


@pytest.mark.parametrize(
    ("location", "words"),
    [
        ("", "no fmuResourceLocation"),
        ("http://example.org/resources", "is no file of this machine; it must be like file:///path/resources"),
        ("file://server/share", "is no file of this machine"),
        ("file:///no%00where", "is no file of this machine"),
        ("file:///no/where", "/no/where/native.bin is missing"),
        ("file:", "native.bin is missing"),
    ],
)
def test_a_place_without_data_is_named(unit, location, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    one = unit(resources=location)
    [(status, category, text)] = one.log
    assert one.component is None and (status, category) == (ERROR, "logStatusError") and words in text, text


def test_what_is_no_file_is_named(unit, tmp_path):
    (tmp_path / "native.bin").mkdir()
    one = unit(resources=tmp_path)
    assert one.component is None and "is empty or cannot be mapped" in one.log[-1][2]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read_is_named(unit, tmp_path):
    (resources(tmp_path) / "native.bin").chmod(0)
    one = unit(resources=tmp_path)
    assert one.component is None and "cannot be read" in one.log[-1][2]


def other(digest=DIGEST, guid=GUID, **tables):
    return ff.to_bytes(ff.NativeFile(digest, guid, {**mock_unit.tables(), **tables}))


def fitting(place, *values, form="<I"):
    """The data with other numbers from a byte on, and sums of the file that fit them."""
    data = bytearray(WHOLE)
    struct.pack_into(form, data, place, *values)
    words = np.frombuffer(bytes(data[96:]), dtype="<u8")
    weighted = words * np.arange(1, words.size + 1, dtype=np.uint64)
    struct.pack_into("<QQ", data, 80, zlib.crc32(data[96:]), int(weighted.sum(dtype=np.uint64)))
    return bytes(data)


SECTIONS, FIRST = 96, 104  # place of the number of sections, and of the first one's entry: name, offset, bytes, rows
(TEXTS,) = struct.unpack_from("<Q", WHOLE, FIRST + 16)
WRONG = [
    (fitting(SECTIONS, 16), "has not the sections that it must have"),
    (fitting(SECTIONS, 18), "has not the sections that it must have"),
    (fitting(FIRST + 32, WHOLE[FIRST : FIRST + 8], form="<8s"), "has not the sections that it must have"),
    (fitting(FIRST + 8, FIRST + 32 * 17 + 4, form="<Q"), "has a section that does not fit into it"),
    (fitting(FIRST + 16, len(WHOLE) - 8, len(WHOLE) - 8, form="<QQ"), "has a section that does not fit into it"),
    (fitting(FIRST + 24, TEXTS - 1, form="<Q"), "has a section that does not fit into it"),
    (fitting(FIRST + 24, TEXTS + 1, form="<Q"), "has a section that does not fit into it"),
    (mock_unit.native_bin(films="0123"), "is for other machine code than this binary"),
    (b"", "is empty or cannot be mapped"),
    (WHOLE[:7], "is not the data of a native FMU of cranktrain"),
    (WHOLE[:100], "is not the data of a native FMU of cranktrain"),
    (b"PK" + WHOLE[2:], "is not the data of a native FMU of cranktrain"),
    (WHOLE[:104], "is cut short"),
    (WHOLE[:-8], "is cut short"),
    (WHOLE[:-3], "is cut short"),
    (WHOLE + bytes(8), "is cut short, or longer than it says"),
    (WHOLE[:8] + b"\2" + WHOLE[9:], "is of another version"),
    (WHOLE[:12] + WHOLE[15:11:-1] + WHOLE[16:], "is of another order of bytes"),
    (WHOLE[:-20] + bytes([WHOLE[-20] ^ 4]) + WHOLE[-19:], "has changed since it was written"),
    (WHOLE[:40] + b"x" * 40 + WHOLE[80:], "has no GUID"),
    (other(digest="f" * 16), "is for other machine code than this binary"),
    (other(guid="{0}"), "is not this FMU's, {0}"),
    (other(NAME=ff.table("NAME", [])), "lacks an array that the FMU's variables are in"),
    (other(LEVL=ff.table("LEVL", [0, 1])), "has choices that lead nowhere"),
    (other(OPTN=ff.table("OPTN", [{"text": 1, "value": 2}] * 9)), "has choices that lead nowhere"),
    (other(FIXU=ff.table("FIXU", [])), "has an array that does not fit into it"),
    (other(LEAF=ff.table("LEAF", [])), "has a variant that does not fit into it"),
    (other(FAMS=ff.table("FAMS", [9] * 6)), "has a variable that leads nowhere"),
]


@pytest.mark.parametrize(("data", "words"), WRONG)
def test_data_that_are_not_ours_are_refused(unit, tmp_path, data, words):
    one = unit(resources=resources(tmp_path, data))
    [(_, category, text)] = one.log
    assert one.component is None and category == "logStatusError" and words in text, text


def test_any_length_and_any_changed_byte_is_noticed(unit, tmp_path):
    rng = np.random.default_rng(5)
    for k in range(300):
        place = int(rng.integers(len(WHOLE)))
        data = WHOLE[:place] if k % 2 else WHOLE[:place] + bytes([WHOLE[place] ^ 1 << k % 8]) + WHOLE[place + 1 :]
        assert unit(resources=resources(tmp_path, data)).component is None, place


@pytest.mark.parametrize("apart", [2, 4, 10])
def test_two_sign_bits_at_an_even_distance_are_noticed(unit, tmp_path, apart):
    """Sums of words, and of words times their number, modulo 2⁶⁴, are blind to them."""
    words = np.frombuffer(mock_unit.native_bin(), dtype="<u8").copy()
    places = [len(words) - 3 - apart, len(words) - 3]
    words[places] ^= np.uint64(1 << 63)
    one = unit(resources=resources(tmp_path, words.tobytes()))
    assert one.component is None and "has changed since it was written" in one.log[-1][2]


MUTATED = """
import sys, zlib
from pathlib import Path
import numpy as np
import mock_unit
from raw_unit import Raw

binary, folder, seed = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
whole = np.frombuffer(mock_unit.native_bin(), dtype="<u4")
rng = np.random.default_rng(seed)
odd = np.array([0, 1, 2, 7, 100, 2**31 - 1, 2**31, 2**32 - 2, 2**32 - 1], dtype=np.uint32)
taken = 0
for _ in range(2000):
    words = whole.copy()
    for place in rng.integers(24, len(words), rng.integers(1, 4)):
        words[place] = rng.choice(odd) if rng.random() < 0.7 else words[place] ^ np.uint32(1 << rng.integers(32))
    body = words[24:].view("<u8")
    counts = np.arange(1, body.size + 1, dtype=np.uint64)
    words[20:22] = np.array([zlib.crc32(body.tobytes())], dtype="<u8").view("<u4")
    words[22:24] = np.array([(body * counts).sum(dtype=np.uint64)]).view("<u4")
    (folder / "native.bin").write_bytes(words.tobytes())
    one = Raw(binary, folder, mock_unit.GUID)
    if one.component is None:
        assert len(one.log) == 1, one.log
        continue
    taken += 1
    one.free()
print(taken)
"""


@pytest.mark.parametrize("seed", [1, 2])
def test_tables_that_lead_nowhere_crash_no_host(binary, tmp_path, seed):
    """Changed at random, with checksums that fit: refused, or such that an instance can be made and freed."""
    path = os.pathsep.join([str(Path(mock_unit.__file__).parent), *sys.path])
    command = [sys.executable, "-c", MUTATED, str(binary), str(tmp_path), str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path}, timeout=600)
    assert done.returncode == 0, done.stderr[-2000:]
    assert 0 < int(done.stdout) < 2000


def test_instances_share_the_file_and_need_it_no_more(unit, tmp_path):
    """The file may be removed while instances live; each has its own values."""
    folder = resources(tmp_path / "resources")
    one, two = unit(resources=folder), unit(resources=folder)
    shutil.rmtree(folder)
    one.set("Real", {REFERENCE["force"]: 20.0})
    first, second = (each.start().run(3).one("Real", REFERENCE["position"]) for each in (one, two))
    assert first > second
