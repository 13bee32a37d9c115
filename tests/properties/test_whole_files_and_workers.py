"""Files appear whole or not at all, and tasks give the same side by side as one after the other."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from cranktrain.core import sources
from cranktrain.store.journal import add_row, drop_journal, journal_place, journal_rows
from cranktrain.store.side_by_side import side_by_side
from cranktrain.store.whole_file import DAY, PREFIX, whole_file

WRITE = """
import sys
from cranktrain.store.whole_file import whole_file
with whole_file("a.txt") as temporary:
    temporary.write_text("half")
    print(temporary.name, flush=True)
    sys.stdin.read()
"""
with_locks = pytest.mark.skipif(os.name == "nt", reason="needs locks that any program may ignore")


def square(number, tell=None):
    """A task that may say how far it is."""
    if tell:
        tell(number, 1.0)
    return number**2


@pytest.mark.parametrize("workers", [1, 2])
def test_every_task_comes_with_its_result_and_is_heard(workers):
    told = []
    found = side_by_side(square, [(3,), (1,), (2,)], workers, lambda *report: told.append(report))
    assert sorted(found) == [((1,), 1), ((2,), 4), ((3,), 9)] and sorted(told) == [(1, 1.0), (2, 1.0), (3, 1.0)]
    with pytest.raises(TypeError):
        list(side_by_side(square, [("a",), ("b",), ("c",)], workers))


def test_a_broken_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "new" / "a.txt"
    with whole_file(path) as temporary:
        temporary.write_text("first")
    with pytest.raises(ValueError, match="broken"), whole_file(path) as temporary:
        temporary.write_text("second")
        raise ValueError("broken")
    assert path.read_text() == "first"
    assert [file.name for file in path.parent.iterdir()] == ["a.txt"]


ROW = """
import sys
import numpy as np
from pathlib import Path
from cranktrain.store.journal import add_row
add_row(Path("a.h5"), "tie", np.arange(float(sys.argv[1])))
"""


@pytest.mark.parametrize("cut", [1, 7, 9, 20])
def test_rows_added_after_a_half_written_one_are_read(tmp_path, cut):
    """A killed process leaves a row's begin; what the next one adds stands behind the last whole row."""

    def in_a_process(length):
        subprocess.run([sys.executable, "-c", ROW, str(length)], cwd=tmp_path, check=True)

    path = tmp_path / "a.h5"
    in_a_process(3)
    whole = journal_place(path).stat().st_size
    in_a_process(4)
    content = journal_place(path).read_bytes()
    journal_place(path).write_bytes(content[: whole + cut])
    in_a_process(5)
    in_a_process(6)
    assert [row.size for row in journal_rows(path, "tie")] == [3, 5, 6]
    assert journal_rows(path, "other") == []
    add_row(path, "other", np.zeros(2))
    assert [row.size for row in journal_rows(path, "other")] == [2] and journal_rows(path, "tie") == []
    drop_journal(path)
    add_row(path, "other", np.zeros(1))
    assert [row.size for row in journal_rows(path, "other")] == [1]


@with_locks
def test_what_a_killed_process_left_goes_with_the_next_write(tmp_path):
    """And what a living one writes stays, in this process as in another, until its file is whole."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    commands = [subprocess.Popen([sys.executable, "-c", WRITE], cwd=tmp_path, **pipes) for _ in range(2)]
    with commands[0] as killed, commands[1] as living:
        left, kept = (tmp_path / process.stdout.readline().strip() for process in (killed, living))
        with whole_file(tmp_path / "b.txt") as temporary:
            temporary.write_text("b")
            assert left.is_file() and kept.is_file()
            killed.send_signal(signal.SIGKILL)
            killed.wait()
            with whole_file(tmp_path / "c.txt") as other:
                other.write_text("c")
        assert not left.exists() and kept.is_file()
        living.stdin.close()
        assert living.wait() == 0
    assert {file.name: file.read_text() for file in tmp_path.iterdir()} == {"a.txt": "half", "b.txt": "b", "c.txt": "c"}


@with_locks
@pytest.mark.parametrize("jump", [-10 * 365 * DAY, -3600.0, 3600.0, 10 * 365 * DAY])
def test_a_clock_that_is_set_loses_no_file_and_hides_no_edit(tmp_path, monkeypatch, jump):
    """Ages of files are told by stamps of their folder; an edited source is seen by the old clock and the new one."""
    real, before = time.time, tmp_path / "before.py"
    before.write_text("")
    os.utime(before, (1.0, sources._BEGAN - abs(jump) - 2.0 * DAY))
    monkeypatch.setattr(time, "time", lambda: real() + jump)
    recent = tmp_path / ".cranktrain-00000000-recent00"
    recent.write_text("half")
    with whole_file(tmp_path / "a.txt") as temporary:
        temporary.write_text("a")
    assert recent.is_file() and (tmp_path / "a.txt").read_text() == "a"
    assert not sources.edited_meanwhile([before])
    for stamp in (real(), real() + jump):
        edited = tmp_path / "edited.py"
        edited.write_text("")
        os.utime(edited, (1.0, stamp - 1e-3))
        assert sources.edited_meanwhile([before, edited])


@with_locks
def test_only_temporary_files_of_our_own_are_removed(tmp_path):
    """No file of another name, no folder, no link's target; another machine's file not before a day has passed."""
    text, other = tmp_path / ".cranktrain-notes", ".cranktrain-00000000-"
    names = f"{other}recent00", f"{other}day_old0.h5", f"{PREFIX}killed00.h5"
    recent, old, left = (tmp_path / name for name in names)
    for file in (text, recent, old, left):
        file.write_text("half")
    os.utime(old, (1.0, old.stat().st_mtime - 1.1 * DAY))
    (tmp_path / f"{PREFIX}folder00").mkdir()
    (tmp_path / f"{PREFIX}link0000").symlink_to(text)
    os.mkfifo(tmp_path / f"{PREFIX}pipe0000")
    before = set(tmp_path.iterdir())
    with whole_file(tmp_path / "a.txt") as temporary:
        temporary.write_text("a")
    assert before - set(tmp_path.iterdir()) == {old, left}
