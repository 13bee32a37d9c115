"""Files with one thing wrong, rows of ``tests/data/refused_files.toml``, are refused with one line that names it."""

import re

import pytest
from engine_texts import EIGHT, SIX, with_line, with_value
from one_line import one_line
from refusals import refused_files

from cranktrain.engine.drive_line_chain import read_drive_line
from cranktrain.engine.file import load_engine
from cranktrain.engine.torsional_chain import read_chain
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.modules.register import module_files, module_of
from cranktrain.results.orders.measured import read_measured_orders
from cranktrain.studies.scene import load_scene
from cranktrain_lab.calibration.targets import load_targets
from cranktrain_lab.harness.file import load_harness
from cranktrain_lab.noise.own_panels import read_panels
from cranktrain_lab.wear.schedule import read_schedule

ENGINES = {"engine-i6": SIX, "engine-v8": EIGHT}
READERS = {
    "engine-i6": load_engine, "engine-v8": load_engine, "scene": load_scene, "harness": load_harness,
    "pressure": lambda path: GasTrace.from_csv(path, load_engine("diesel_i6")), "chain": read_chain,
    "measured-orders": read_measured_orders, "valve-train": lambda path: module_of(path).read(path),
    "combustion": lambda path: module_of(path).read(path), "drive-line": read_drive_line,
    "spark-ignition": lambda path: module_of(path).read(path),
    "targets": lambda path: load_targets(path, load_engine("diesel_i6")), "drive-line-csv": read_drive_line,
    "valve-trains": load_harness, "wear-schedule": read_schedule,
    "panels": read_panels,
}  # fmt: skip
TABLES = {"pressure", "measured-orders", "drive-line-csv", "wear-schedule"}
"""Kinds that are tables of columns, not TOML."""


def cases(form):
    return [pytest.param(kind, *row[:-1], row[-1], id=f"{kind}: {row[-1]}")
            for kind, table in refused_files().items() for row in table.get(form, ())]  # fmt: skip


def refused(folder, kind, text, said):
    """Read a text; its error begins with the file's name and has these words in their order."""
    path = folder / ("own.csv" if kind in TABLES else "own.toml")
    path.write_text(text, "utf-8")
    with one_line("" if "unknown engine" in said else "own.", said) as caught:
        READERS[kind](path)
    return str(caught.value)


@pytest.mark.parametrize(("kind", "key", "value", "said", "unit"), [
    pytest.param(kind, *row[:3], *(row[3:] or [None]), id=f"{kind}: {row[2]}")
    for kind in ENGINES for row in refused_files()[kind]["values"]
])  # fmt: skip
def test_a_value_of_an_engine_that_cannot_be_is_refused(tmp_path, kind, key, value, said, unit):
    """The line is about the entry that was changed, unless the row names another place."""
    line = refused(tmp_path, kind, with_value(ENGINES[kind], key, value, unit), said)
    elsewhere = re.match(r"\w+(\.\w+(\[\d\])?)?: ", said)
    assert line.startswith(f"own.toml: {said if elsewhere else key}") and len(line) < 300


@pytest.mark.parametrize(("kind", "key", "line", "said"), cases("lines"))
def test_a_line_of_an_engine_that_cannot_be_read_is_refused(tmp_path, kind, key, line, said):
    assert refused(tmp_path, kind, with_line(ENGINES[kind], key, line), said).startswith(f"own.toml: {said}")


@pytest.mark.parametrize(("kind", "changes", "said"), [
    pytest.param(kind, row[:-1], row[-1], id=f"{kind}: {row[-1]}")
    for kind, table in refused_files().items() for row in table.get("rows", ())
])  # fmt: skip
def test_a_change_that_a_file_cannot_take_is_refused(tmp_path, kind, changes, said):
    text = refused_files()[kind]["text"]
    text = module_files()[text].read_text("utf-8") if text in module_files() else text.lstrip("\n")
    for old, new in zip(changes[::2], changes[1::2], strict=True):
        assert old in text
        text = text.replace(old, new, 1)
    assert refused(tmp_path, kind, text, said)


@pytest.mark.parametrize(("kind", "text", "said"), cases("whole"))
def test_a_text_that_is_no_such_file_is_refused(tmp_path, kind, text, said):
    assert refused(tmp_path, kind, text, said)
