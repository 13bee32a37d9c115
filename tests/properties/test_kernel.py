"""Compiled kernels: kept where the user's cache is, found again, never stale, never needed."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import cranktrain
from cranktrain.kernel import BELOW

SOURCES = Path(cranktrain.__file__).parent
RUN = "from cranktrain.lubricant import vogel_viscosity\nprint(vogel_viscosity(350.0, 1e-4, 800.0, 180.0))"


@pytest.fixture
def install(tmp_path):
    """A copy of the package of its own."""
    shutil.copytree(SOURCES, tmp_path / "lib" / "cranktrain", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path / "lib"


def run(install, cache, text=RUN):
    environment = {**os.environ, "PYTHONPATH": str(install), "CRANKTRAIN_CACHE": str(cache)}
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, env=environment, timeout=300)
    assert done.returncode == 0, done.stderr[-3000:]
    return float(done.stdout)


def kept(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*.nb?")}


def test_second_process_finds_the_kernels_of_the_first(install, tmp_path):
    first = run(install, tmp_path / "cache")
    compiled = kept(tmp_path)
    assert compiled and all(path.is_relative_to(tmp_path / "cache" / "kernels") for path in compiled)
    assert run(install, tmp_path / "cache") == first
    assert kept(tmp_path) == compiled


def test_read_only_install_without_a_cache_still_runs(install, tmp_path):
    """A file where the cache should be, and files where numba would put kernels beside the sources."""
    occupied = tmp_path / "file"
    occupied.write_text("")
    for folder in (install / "cranktrain", *(p for p in (install / "cranktrain").iterdir() if p.is_dir())):
        (folder / "__pycache__").write_text("")
    assert run(install, occupied) == run(install, tmp_path / "cache")
    assert not kept(install)


def test_kernel_is_compiled_anew_when_a_constant_it_takes_from_another_module_changes(install, tmp_path):
    """What numba alone would miss: it looks at the file of the kernel only."""
    (install / "cranktrain" / "loads" / "given.py").write_text("VALUE = 1.0\n")
    (install / "cranktrain" / "loads" / "taker.py").write_text(
        "from cranktrain.kernel import kernel\nfrom cranktrain.loads.given import VALUE\n\n\n"
        "@kernel\ndef taken():\n    return VALUE\n"
    )
    text = "from cranktrain.loads.taker import taken\nprint(taken())"
    assert run(install, tmp_path / "cache", text) == 1.0
    (install / "cranktrain" / "loads" / "given.py").write_text("VALUE = 2.0\n")
    assert run(install, tmp_path / "cache", text) == 2.0


def test_digest_of_the_sources_covers_all_that_a_kernel_s_module_imports():
    imported = {
        name
        for folder in ("film", "loads", "dynamics")
        for path in (SOURCES / folder).glob("*.py")
        for name in re.findall(r"(?m)^from cranktrain\.([a-z_]+) import", path.read_text())
    }
    assert imported <= set(BELOW)
