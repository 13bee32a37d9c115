"""Foreign FMUs that misbehave, and hostile archives: one line each, in time, and nothing beside the folder."""

import os
import shutil
import tempfile
from contextlib import closing, nullcontext
from functools import partial
from pathlib import Path

import pytest
from odd_units import DESCRIBED, ENTRIES, MADE, System, hostile, odd_unit

from cranktrain.core.errors import CranktrainError, InputError, StoreError
from cranktrain_lab.coupling.connections import Connection
from cranktrain_lab.coupling.fmu3_unit import open_fmu
from cranktrain_lab.coupling.fmu_unit import FmuUnit
from cranktrain_lab.coupling.master import Exchange
from cranktrain_lab.coupling.run import Steps
from cranktrain_lab.coupling.supervised import ROWS, Limits, run_supervised
from cranktrain_lab.coupling.unit import UnitError

pytestmark = [pytest.mark.skipif(os.name == "nt" or shutil.which("cc") is None, reason="no C compiler")]
LIMIT = 3.0


def system(path):
    units = {name: open_fmu(path, name) for name in ("one", "two")}
    return System(units, [Connection(("one", "out"), ("two", "in"))], Exchange(), {"two": ["out"]}, [])


@pytest.fixture(scope="module", params=list(DESCRIBED))
def odd(request, tmp_path_factory):
    return odd_unit(tmp_path_factory.mktemp("odd"), request.param)


def ran(odd, monkeypatch, mode, size=0.1):
    """The run in steps of a size, or the error that ended it, which is one short line."""
    monkeypatch.setenv("ODD", mode)
    try:
        return run_supervised(partial(system, odd), 1.0, Steps(size), Limits(LIMIT, LIMIT))
    except CranktrainError as error:
        assert str(error).isprintable() and len(str(error)) < 1500
        return error


def test_a_negative_status_is_no_success(odd, monkeypatch):
    """FMI knows 0 to 5; FMPy and a comparison with 1 take -1 as good."""
    for call in ("step", "get", "set", "setup", "enter"):
        found = ran(odd, monkeypatch, f"{call}:status -1")
        assert isinstance(found, UnitError) and "-1" in str(found), call


CALLS = ("instantiate", "setup", "enter", "exit", "set", "get", "step")
ENDINGS = (
    "signal 11", "signal 6", "signal 9", "signal 15", "signal 40", "signal 64", "exit 0", "exit 3", "_exit 0",
    "_exit 255", "abort", "divide", "stack", "free twice", "hang", "spin", "stop", "fork and crash", "fork and exit",
    "thread crashes", "close files", "close and exit", "no memory", "no files", "log nothing", "log bytes",
    "log long", "log much",
)  # fmt: skip
STATUSES = tuple(f"status {number}" for number in (2, 3, 4, 5, 6, -1, -2147483648, 2147483647))
WAITED = ("step:hang", "step:spin", "step:stop")
VALUES = ("value:nan", "value:inf")
MODES = (
    *(f"step:{mode}" for mode in (*ENDINGS, *STATUSES)), *(f"{call}:signal 11" for call in CALLS[:-1]),
    *(f"{call}:status 3" for call in CALLS[1:-1]), *VALUES,
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES)
def test_a_mode_costs_one_line_and_the_run_is_kept(odd, monkeypatch, mode):
    """Only a unit that neither ends nor returns is waited for until its limit."""
    found = ran(odd, monkeypatch, mode)
    assert isinstance(found, CranktrainError), found
    assert ("did not return" in str(found)) == (mode in WAITED), found
    if mode.startswith(("step:", "value:")):
        assert found.found.steps in (4, 5)


def test_a_full_disk_is_told_when_the_next_points_need_room(odd, monkeypatch):
    """Room is taken for ROWS points at once, so these are kept."""
    found = ran(odd, monkeypatch, "step:no room", 1.0 / (2 * ROWS))
    assert isinstance(found, StoreError) and "temporary folder" in str(found)
    assert found.found.steps == ROWS - 1


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["step:print", "step:elsewhere", "terminate:status 3", "free:signal 11", "value:huge"])
def test_a_mode_that_costs_nothing(odd, monkeypatch, mode):
    with pytest.warns(UserWarning, match="the run itself") if mode.startswith("free") else nullcontext():
        found = ran(odd, monkeypatch, mode)
    assert found.steps == 10


@pytest.mark.slow
@pytest.mark.parametrize("name", [*ENTRIES, *MADE])
def test_a_hostile_archive_is_refused_before_it_fills_anything(tmp_path, monkeypatch, name):
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    path = hostile(name, tmp_path / "hostile.fmu")
    before = set(tmp_path.iterdir())
    refused = pytest.raises((InputError, UnitError), match=r"hostile\.fmu")
    with refused as caught, closing(FmuUnit(path, "one")) as unit:
        unit.link([], ["out"])
        unit.initialize(0.0)
    assert str(caught.value).isprintable() and len(str(caught.value)) < 1500
    assert set(tmp_path.iterdir()) == before and not list((tmp_path / "temporary").iterdir())
    assert not Path("/escaped").exists() and not (tmp_path.parent / "escaped").exists()
