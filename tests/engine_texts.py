"""Texts of engine files in which single entries are written otherwise; an entry is named ``table.key``."""

import re

from cranktrain.engine.file import engine_path, load_engine

SIX, EIGHT = (engine_path(name).read_text(encoding="utf-8") for name in ("diesel_i6", "diesel_v8"))


def entry(text, name):
    """Span of the line of an entry."""
    table, key = name.split(".")
    return re.compile(rf"^{key} = .*$", re.MULTILINE).search(text, text.index(f"[{table}]")).span()


def with_line(text, name, line):
    """The text with another line for an entry, none if it is empty."""
    start, end = entry(text, name)
    return text[:start] + line + text[end:]


def with_value(text, name, value, unit=None):
    """The text with another value of an entry, and its unit if one is given."""
    start, end = entry(text, name)
    line = re.sub(r"value = (\[.*?\]|[^,}]*[^,} ])", f"value = {value}", text[start:end], count=1)
    return with_line(text, name, re.sub(r'unit = ".*?"', f'unit = "{unit}"', line) if unit else line)


def coarse_text(name, size, count=0):
    """Text of an engine file with elements of other edges, mm; of all bodies, or of so many, the crank first."""
    text = engine_path(name).read_text("utf-8")
    return re.sub(r"mesh_size = \{ value = [0-9.]+", f"mesh_size = {{ value = {size:g}", text, count=count)


def read(folder, text):
    """Engine of a text, from a file of its own."""
    path = folder / "own.toml"
    path.write_text(text, encoding="utf-8")
    return load_engine(path)
