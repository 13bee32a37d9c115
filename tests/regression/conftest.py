"""What tests of commands share: an engine file whose meshes take seconds, and what a call prints as JSON."""

import json

import pytest
from engine_texts import coarse_text

from cranktrain.cli.main import main


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """Path of the six's file with the coarse mesh of the other tests."""
    path = tmp_path_factory.mktemp("coarse") / "coarse.toml"
    path.write_text(coarse_text("diesel_i6", 25), "utf-8")
    return path


@pytest.fixture
def run_json(capsys):
    """A function that runs a call with ``--json`` and returns what is printed."""

    def run(*arguments):
        assert main([*arguments, "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    return run
