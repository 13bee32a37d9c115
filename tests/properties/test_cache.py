"""The cache: code is run from where nobody else may write only, and what cannot be kept is said before the work."""

import os
import stat
import sys
from pathlib import Path

import pytest
from test_kernel import kept, run

import cranktrain_slave
from cranktrain.cli.main import main
from cranktrain.core import cache
from cranktrain.core.cache import NotPrivateError, cache_folder, private_folder
from cranktrain.structure.fem.reduction import ReductionTask

posix = pytest.mark.skipif(os.name == "nt", reason="Windows keeps a user's folders for the user")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("CRANKTRAIN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


@posix
def test_the_cache_is_made_for_its_user_alone(folder):
    before = os.umask(0)
    try:
        made = private_folder("kernels", "a")
    finally:
        os.umask(before)
    assert made == folder / "kernels" / "a" and [mode(p) for p in (folder, made.parent, made)] == [0o700] * 3


@posix
@pytest.mark.parametrize("rights", [0o777, 0o775, 0o757])
@pytest.mark.parametrize("name", ["", "kernels", "kernels/a"])
def test_a_folder_that_others_may_write_is_not_used(folder, rights, name):
    private_folder("kernels", "a")
    (folder / name).chmod(rights)
    with pytest.raises(NotPrivateError, match="others may write to it"):
        private_folder("kernels", "a")


@posix
def test_a_folder_of_somebody_else_is_not_used(folder, monkeypatch):
    private_folder()
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    with pytest.raises(NotPrivateError):
        private_folder()


@posix
def test_kernels_are_not_loaded_from_a_folder_that_others_may_write(tmp_path):
    """They are compiled as if there were no cache, with one remark."""
    shared, own, lib = tmp_path / "shared", tmp_path / "own", Path(cache.__file__).parents[2]
    shared.mkdir()
    shared.chmod(0o777)
    assert run(lib, shared) == run(lib, own)
    assert kept(own) and not list(shared.iterdir())


@posix
def test_the_code_of_an_fmu_is_not_taken_from_a_folder_that_others_may_write(folder, tmp_path):
    source = tmp_path / "resources" / "package"
    (source / "core").mkdir(parents=True)
    (source / "core" / "cache.py").write_bytes(Path(cache.__file__).read_bytes())
    copy = cranktrain_slave._cached_copy(source)
    assert copy == folder / "fmu" / "package" and (copy / "core" / "cache.py").is_file()
    folder.chmod(0o777)
    assert cranktrain_slave._cached_copy(source) == source


def test_without_a_home_nobody_can_know_the_folder(monkeypatch):
    def nowhere():
        raise RuntimeError("no home")

    for name in ("CRANKTRAIN_CACHE", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(Path, "home", nowhere)
    first = cache_folder()
    assert first == cache_folder() and mode(first) & 0o077 == 0
    cache._folder_of_this_process.cache_clear()
    assert cache_folder() != first


@pytest.mark.parametrize(
    "arguments", [("reduce", "diesel_i6"), ("modal", "diesel_i6"), ("bearing", "table", "--length-ratio", "0.4")]
)
def test_a_cache_that_cannot_be_written_is_refused_before_the_work(folder, capsys, monkeypatch, arguments):
    def work(*given):
        raise AssertionError("the work has begun")

    monkeypatch.setattr(ReductionTask, "model", work)
    monkeypatch.setattr("cranktrain.store.film_tables.sample_slab", work)
    monkeypatch.setattr("cranktrain.store.film_tables.compile_sampling", work)
    folder.write_text("a file where the folder should be")
    assert main(list(arguments)) == 2
    assert "set CRANKTRAIN_CACHE to a folder of your own" in capsys.readouterr().err
