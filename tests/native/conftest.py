"""The mock's FMU, compiled once, and instances of it."""

import zipfile

import mock_unit
import pytest
import real_unit
from raw_unit import Raw, instances


@pytest.fixture(scope="session")
def mock(tmp_path_factory):
    """The mock's FMU."""
    if mock_unit.compiler() is None:
        pytest.skip("needs a C compiler: gcc or clang")
    folder = tmp_path_factory.mktemp("mock")
    return mock_unit.pack(folder, mock_unit.library(folder))


@pytest.fixture(scope="session")
def unpacked(mock):
    """Its folder."""
    folder = mock.with_suffix("")
    with zipfile.ZipFile(mock) as archive:
        archive.extractall(folder)
    return folder


@pytest.fixture(scope="session")
def binary(unpacked):
    return unpacked / "binaries" / "linux64" / f"{mock_unit.MODEL}.so"


@pytest.fixture
def unit(unpacked, binary):
    """A function that makes instances of the mock."""
    place = unpacked / "resources"
    yield from instances(
        lambda name="unit", guid=mock_unit.GUID, resources=place, **options: Raw(
            binary, resources, guid, name, **options
        )
    )


@pytest.fixture(scope="session", params=["combustion_i6", "valvetrain_i6"])
def real(request, tmp_path_factory):
    """The native FMU of a module, in its folder."""
    return real_unit.unpacked(request.param, tmp_path_factory.mktemp(request.param))
