"""Standard streams that are closed or lack characters: a verb does its work and ends as it would otherwise."""

import os
import subprocess
import sys

import pytest

import cranktrain as ct
from cranktrain.core.errors import InputError


def engines(closed="", **environment):
    """Run ``cranktrain modal`` of a torsional crank, whose table has a dash, with a shell's redirections."""
    command = f'"{sys.executable}" -m cranktrain modal diesel_i6 --crank torsional {closed}'
    return subprocess.run(command, shell=True, capture_output=True, env={**os.environ, **environment}, check=False)


@pytest.mark.skipif(sys.platform == "win32", reason="redirections of a POSIX shell")
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&- <&-"])
def test_closed_streams_take_nothing_and_change_no_exit_code(closed):
    assert engines(closed).returncode == 0


@pytest.mark.parametrize("encoding", ["cp437", "latin-1", "ascii", "cp1252"])
def test_characters_that_an_encoding_lacks_are_spelled_out(encoding):
    ended = engines(PYTHONIOENCODING=encoding)
    assert ended.returncode == 0, ended.stderr
    shown = ended.stdout.decode(encoding)
    assert "free crankshaft" in shown
    assert "?" not in shown


@pytest.mark.parametrize("value", [10**400, -(10**400), 10**5000], ids=["large", "negative", "without text"])
@pytest.mark.parametrize("keyword", ["speed_rpm", "cycles", "load", "step_deg"])
def test_numbers_beyond_double_precision_are_refused(keyword, value):
    with pytest.raises(InputError, match=keyword):
        ct.simulate("diesel_i6", **{"speed_rpm": 2000, keyword: value})


def test_an_engine_refuses_a_number_beyond_double_precision():
    with pytest.raises(InputError, match=r"pulley\.polar_inertia"):
        ct.load_engine("diesel_i6").with_({"pulley.polar_inertia": 10**400})
