"""Mutated files and arguments end in an answer within declared ranges or in one line: no traceback, crash or hang."""

import os
import queue
import subprocess
import sys
import threading
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "mutated_input.py"
SEED, FAST, ALL = 18, 300, 3000
LONGEST_CASE = 300.0
"""Seconds without a line after which a case counts as hanging: a thousand times what one takes."""


def verdicts(first, count):
    """(kind, verdict) of each case, from a process of its own; fails with the case that hangs or ends the process."""
    process = subprocess.Popen(
        [sys.executable, str(SCRIPT), "--seed", str(SEED), "--first", str(first), "--count", str(count)],
        stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONHASHSEED": "0"},
    )  # fmt: skip
    lines: queue.Queue = queue.Queue()
    threading.Thread(target=lambda: [*map(lines.put, process.stdout), lines.put("")], daemon=True).start()
    found = []
    try:
        while len(found) < count and (line := lines.get(timeout=LONGEST_CASE)):
            number, kind, *text = line.split(maxsplit=2)
            found.append((int(number), kind, text[0].strip()))
    except queue.Empty:
        pytest.fail(f"case {first + len(found)} of seed {SEED} hangs")
    finally:
        process.kill()
        process.wait()
    assert len(found) == count, f"case {first + len(found)} of seed {SEED} ended the process"
    return found


def check(found):
    """No case failed, and the mutations leave some inputs whole."""
    failed = [line for line in found if line[1] == "FAILED"]
    assert not failed, f"python tests/mutated_input.py --seed {SEED} --only {failed[0][0]}: {failed}"
    for kind in ("engine", "pressure", "scene", "targets", "chain", "film_table", "superelement"):
        assert {verdict for _, own, verdict in found if own == kind} == {"accepted", "refused"}, kind


def test_strangers_input_is_answered_or_refused_in_one_line():
    check(verdicts(0, FAST))


@pytest.mark.slow
def test_all_strangers_input_is_answered_or_refused_in_one_line():
    check(verdicts(FAST, ALL - FAST))
