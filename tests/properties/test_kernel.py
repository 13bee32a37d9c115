"""Compiled kernels: kept where the user's cache is, found again, never stale, never needed."""

import inspect
import io
import os
import shutil
import subprocess
import sys
import tokenize
from pathlib import Path

import pytest
from some import some

import cranktrain
from cranktrain.core import sources
from cranktrain.core.machine_code import OFF
from cranktrain.core.sources import rests_on
from cranktrain_lab.stability import oil_whirl
from cranktrain_lab.tradeoff import measure

SOURCES = Path(cranktrain.__file__).parent
RUN = "from cranktrain.engine.lubricant import vogel_viscosity\nprint(vogel_viscosity(350.0, 1e-4, 800.0, 180.0))"


@pytest.fixture
def install(tmp_path):
    """A copy of the package of its own."""
    shutil.copytree(SOURCES, tmp_path / "lib" / "cranktrain", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path / "lib"


def run(install, cache, text=RUN):
    # Python's own byte code tells a file of equal length only a second later.
    own = {"PYTHONPATH": str(install), "PYTHONDONTWRITEBYTECODE": "1"}
    environment = {**os.environ, **own, "CRANKTRAIN_CACHE": str(cache), OFF: "1"}
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, env=environment, timeout=3600)
    assert done.returncode == 0, done.stderr[-3000:]
    return float(done.stdout)


def kept(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*.nb?")}


def test_second_process_finds_the_kernels_of_the_first_and_an_install_without_a_cache_still_runs(install, tmp_path):
    """A file where the cache should be, and files where numba would put kernels beside the sources."""
    first = run(install, tmp_path / "cache")
    compiled = kept(tmp_path)
    assert compiled and all(path.is_relative_to(tmp_path / "cache" / "kernels") for path in compiled)
    assert run(install, tmp_path / "cache") == first and kept(tmp_path) == compiled
    occupied = tmp_path / "file"
    occupied.write_text("")
    for folder in (install / "cranktrain", *(p for p in (install / "cranktrain").iterdir() if p.is_dir())):
        (folder / "__pycache__").write_text("")
    assert run(install, occupied) == first and not kept(install)


def test_a_kernel_rests_on_what_its_file_imports_wherever_that_lies(install, tmp_path):
    """What numba alone would miss: it looks at the file of the kernel only. An edit elsewhere compiles nothing anew."""
    loads = install / "cranktrain" / "loads"
    (loads / "inner" / "deep").mkdir(parents=True)
    for folder in (loads / "inner", loads / "inner" / "deep"):
        (folder / "__init__.py").write_text('"""Folder."""\n')
    taker = (
        "from cranktrain.core.kernel import kernel\nfrom {} import VALUE\n\n\n@kernel\ndef taken():\n    return VALUE\n"
    )
    (loads / "taker.py").write_text(taker.format("cranktrain.loads.inner.deep.given"))
    text = "from cranktrain.loads.taker import taken\nprint(taken())"
    for value in (1.0, 2.0):
        (loads / "inner" / "deep" / "given.py").write_text(f"VALUE = {value}\n")
        assert run(install, tmp_path / "cache", text) == value
    before = kept(tmp_path)
    (loads / "other.py").write_text("VALUE = 5.0\n")
    assert run(install, tmp_path / "cache", text) == 2.0 and kept(tmp_path) == before
    (loads / "inner" / "deep" / "given.py").rename(loads / "inner" / "given.py")
    (loads / "taker.py").write_text(taker.format("cranktrain.loads.inner.given"))
    (loads / "inner" / "given.py").write_text("VALUE = 3.0\n")
    assert run(install, tmp_path / "cache", text) == 3.0


def test_a_record_of_another_folder_is_read_whole_and_troubles_no_later_process(install, tmp_path):
    """Equal arrays are as many structures; a class that one process alone can import stays out of common kernels."""
    text = """
from typing import NamedTuple
import numpy as np
from cranktrain.core.kernel import keep_record, kernel, record_reader

{0} = NamedTuple("{0}", [(name, np.ndarray) for name in "abcd"])
read = record_reader({0}(*np.zeros((4, 1))))

@kernel
def last(address):
    own = read(address)
    return own.a[0] + own.d[-1]

owner = np.zeros(1)
"""
    for name in ("mine", "yours"):
        (tmp_path / name).mkdir()
        (tmp_path / name / f"{name}.py").write_text(text.format(name.title()))
        text_of_run = f"import sys\nsys.path.insert(0, {str(tmp_path / name)!r})\nfrom {name} import *\n"
        text_of_run += f"kept = [keep_record({name.title()}(*np.full((4, 3), 2.0)), owner) for _ in range(200)]\n"
        assert run(install, tmp_path / "cache", text_of_run + "print(sum(map(last, kept)))") == 800.0


def test_a_kept_kernel_whose_record_s_class_has_moved_is_compiled_anew(install, tmp_path):
    """Its own file, and so its digest, need not know the class: an upgrade must not end in an import error."""
    loads = install / "cranktrain" / "loads"
    (loads / "taker.py").write_text(
        "from cranktrain.core.kernel import kernel\n\n\n@kernel\ndef taken(shape):\n    return shape.size\n"
    )
    (loads / "shape.py").write_text("from typing import NamedTuple\n\n\nclass Shape(NamedTuple):\n    size: float\n")
    text = "from cranktrain.loads.taker import taken\nfrom cranktrain.loads.{} import Shape\nprint(taken(Shape(2.0)))"
    assert run(install, tmp_path / "cache", text.format("shape")) == 2.0
    (loads / "shape.py").rename(loads / "form.py")
    assert run(install, tmp_path / "cache", text.format("form")) == 2.0
    before = kept(tmp_path)
    assert run(install, tmp_path / "cache", text.format("form")) == 2.0 and kept(tmp_path) == before


def test_kept_maps_and_points_rest_on_all_that_their_modules_import():
    """In whatever folder: the digests of the studies follow imports, those inside functions as well."""
    maps = {path.name for path in rests_on(Path(inspect.getfile(oil_whirl)), deferred=True)}
    assert {"oil_whirl.py", "integrators.py", "impedance.py", "stability_map.py"} <= maps
    assert not {"draw.py", "cold_start.py", "kept_maps.py"} & maps
    points = {path.name for path in rests_on(Path(inspect.getfile(measure)), deferred=True)}
    assert {"measure.py", "case.py", "runs.py", "master.py", "beam.py"} <= points


def _tokens(content):
    """Tokens of a source by type and text, without comments, layout and docstrings."""
    layout = {tokenize.COMMENT, tokenize.NL, tokenize.INDENT, tokenize.DEDENT, tokenize.ENCODING, tokenize.ENDMARKER}
    found, line = [], []
    for one in tokenize.tokenize(io.BytesIO(content).readline):
        if one.type != tokenize.NEWLINE:
            line += [] if one.type in layout else [(one.type, one.string)]
        else:
            found += [] if len(line) == 1 and line[0][1].startswith('"""') else line
            line = []
    return found + line


def test_a_digest_changes_with_all_code_and_with_code_alone(tmp_path, monkeypatch):
    """It counts every token of every source but docstrings, comment lines and empty lines."""
    files = [path for name in ("cranktrain", "cranktrain_lab") for path in (sources.ROOT.parent / name).rglob("*.py")]
    for path in some(files):
        assert _tokens(sources.code_of(path)) == _tokens(path.read_bytes()), path
    monkeypatch.setattr(sources, "ROOT", tmp_path)

    def digest(text):
        sources.code_of.cache_clear()
        (tmp_path / "law.py").write_text(text)
        return sources.digest_of([tmp_path / "law.py"])

    text = '"""A law."""\n\n# Why.\ndef force(x):\n    """Force."""\n    return """F = """ + x\n'
    own = digest(text)
    assert digest(text.replace("A law.", "A force law,\nin words.").replace("# Why.\n", "")) == own
    assert digest(text.replace("F = ", "F: ")) != own
    assert digest(f'{text}QUOTES = \'"""\'\n') != own  # an odd number of them: the source counts as it is
    assert digest(text.replace("+ x", "+ x  # a remark in a line of code counts")) != own
