"""What tests of commands share: an engine file whose meshes take seconds."""

import pytest
from engine_texts import coarse_text


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """Path of the six's file with the coarse mesh of the other tests."""
    path = tmp_path_factory.mktemp("coarse") / "coarse.toml"
    path.write_text(coarse_text("diesel_i6", 25), "utf-8")
    return path
