"""The Python FMU carries machine code of its kernels and starts with it: without numba, and to the bit as with it."""

import zipfile

import pytest
from some import some

from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import OFF, SEAL, code_digest, is_whole, this_platform
from cranktrain.fmu import archive
from cranktrain.fmu.build import build_fmu
from cranktrain.modules.register import module_files

RUN = """
unit = Unit(sys.argv[1], "mine")
unit.start({"crank.level": "rigid", "bearing.level": "linear"} if "crank.level" in unit.reference else {})
unit.run(20)
print("numba" in sys.modules, *unit.bits())
"""
PLACE = "/fmu/native/lib/"
MODULES = [name for name in module_files() if name.endswith("_i6")]


def carried(fmu):
    """Libraries and seal of an FMU, by their places behind ``PLACE``."""
    with zipfile.ZipFile(fmu) as files:
        return {name.partition(PLACE)[2]: files.read(name) for name in files.namelist() if PLACE in name}


@pytest.fixture
def libraries(shipped):
    """Those of an FMU; skips where none could be made, and native FMUs, which are their machine code."""
    with zipfile.ZipFile(shipped) as files:
        if "resources/native.bin" in files.namelist():
            pytest.skip("a native FMU has no kernels for Python")
    found = carried(shipped)
    if not any(name.startswith(this_platform()) for name in found):
        pytest.skip("libraries were not made here; make native does")
    return found


def test_an_fmu_carries_the_library_of_its_kind_and_the_digest_of_its_sources(libraries, tmp_path):
    digests = dict(line.split() for line in libraries[SEAL].decode().splitlines())
    path, first = tmp_path / "library", next(iter(digests))
    path.write_bytes(
        next(content for name, content in libraries.items() if name.startswith(f"{this_platform()}/{first}"))
    )
    for kind, digest in some(digests.items()):
        assert digest == code_digest(kind) and is_whole(path, digest)


# Numba compiles all kernels of the cranktrain for minutes; those of the modules are the quick check.
@pytest.mark.parametrize("shipped", [pytest.param("cranktrain", marks=pytest.mark.slow), *MODULES], indirect=True)
def test_an_fmu_starts_without_numba_and_gives_numba_s_bits(shipped, libraries, script, cache):
    numba, *bits = script(RUN, shipped).stdout.split()
    assert numba == "False"
    assert script(RUN, shipped, **{OFF: "1"}).stdout.split() == ["True", *bits]
    package = next(path for path in cache.glob("fmu/cranktrain_*") if (path / PLACE[1:]).is_dir())
    assert {path.name for path in (package / PLACE[1:]).rglob("*.*")} >= {SEAL}


def test_a_library_that_was_changed_in_the_cache_is_not_loaded(shipped, libraries, script, tmp_path):
    """It is taken from the FMU again, as the code is."""
    expected = script(RUN, shipped).stdout
    assert script(RUN, shipped, cache=tmp_path).stdout == expected
    (copy,) = tmp_path.glob(f"fmu/cranktrain_*{PLACE}{this_platform()}/*")
    content = copy.read_bytes()
    copy.write_bytes(content[:5000])
    assert script(RUN, shipped, cache=tmp_path).stdout == expected
    assert copy.read_bytes() == content


def test_without_a_compiler_an_fmu_is_built_that_compiles_at_its_first_start(tmp_path, monkeypatch):
    def none(kind, platform, say, emit):
        raise InputError("no C compiler was found")

    monkeypatch.setattr(archive, "library", none)
    said = []
    plain = build_fmu("valvetrain_i6", tmp_path, platforms=(), say=said.append)
    assert carried(plain) == {}
    assert sum("kernels are compiled at the first start there: no C compiler was found" in line for line in said) == 2
    monkeypatch.undo()
    whole = build_fmu("valvetrain_i6", tmp_path / "whole", platforms=(), say=said.append)
    guids = [zipfile.ZipFile(path).read("modelDescription.xml").partition(b'guid="')[2][:38] for path in (plain, whole)]
    assert guids[0] == guids[1]
