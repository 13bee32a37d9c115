"""Published and independently derived values of tests/data, by file and the id of their case."""

import json
from pathlib import Path

DATA = Path(__file__).parent / "data"


def data(name):
    """What the file of a name holds."""
    return json.loads((DATA / f"{name}.json").read_text("utf-8"))


def cases(name):
    """Cases of a file by their id: inputs, what is expected, notes."""
    return {case["id"]: case for case in data(name)}
