"""Rows of ``tests/data/refused_files.toml``: texts of files, and what is refused of them."""

import tomllib
from functools import cache
from pathlib import Path


@cache
def refused_files():
    """Tables of the file: text of a kind of file, its rows."""
    return tomllib.loads((Path(__file__).parent / "data" / "refused_files.toml").read_text("utf-8"))


def text_of(kind):
    """Text of a kind of file that is read."""
    return refused_files()[kind]["text"]
