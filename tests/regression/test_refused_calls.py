"""Calls that are refused, rows of ``tests/data/refused_calls.txt``: exit code 2 and one line, before any work."""

import json
import shlex
import shutil
from pathlib import Path

import build_fmu
import pytest
from one_line import says

from cranktrain.cli.main import main
from cranktrain.structure.fem.reduction import ReductionTask

ROOT = Path(__file__).parents[2]


def rows():
    """Calls, and the words of their errors in order."""
    common, found = {}, []
    for line in (ROOT / "tests" / "data" / "refused_calls.txt").read_text("utf-8").splitlines()[1:]:
        name, defined, words = line.partition(" := ")
        call, _, said = line.partition(" => ")
        first, *others = shlex.split(words if defined else call) or [""]
        whole = [*common.get(first, [first]), *others]
        if defined:
            common[name] = whole
        elif line:
            found.append(pytest.param(whole, said, id=call))
    return found


@pytest.mark.parametrize(("call", "said"), rows())
def test_a_wrong_call_is_refused_in_one_line_before_any_work(tmp_path, monkeypatch, capsys, call, said):
    def work(*_, **__):
        raise AssertionError("the work has begun")

    monkeypatch.setattr(ReductionTask, "model", work)
    monkeypatch.chdir(tmp_path)
    Path("notes.txt").write_text("ten years of work")
    shutil.copy(ROOT / "examples" / "scene.toml", "scene.toml")
    assert (build_fmu.main(call[1:]) if call[0] == "build_fmu.py" else main([*call, "--json"])) == 2
    captured = capsys.readouterr()
    if call[0] != "build_fmu.py":
        assert set(json.loads(captured.out)["error"]) == {"what", "where", "remedy"}
    beside = "cranktrain: warning: ", "compiling kernels"
    [line] = [one for one in captured.err.splitlines() if not one.startswith(beside)]
    assert says(line, said), line
    assert {path.name for path in Path().iterdir()} == {"notes.txt", "scene.toml"}
    assert Path("notes.txt").read_text() == "ten years of work"
