"""What strangers may give the program: mutated files and arguments, from a seed, each with what must hold of it.

    python tests/mutated_input.py --seed 14 --count 3000        # a line for each case; exit code 1 where one failed
    python tests/mutated_input.py --seed 14 --only 271          # one case again, with its traceback

A case ends well where its input is accepted and lies within the ranges that the program declares, or is refused with
one printable line. Long work is replaced by a refusal: what is tried is reading and checking, not dynamics.
"""

import argparse
import contextlib
import importlib
import io
import math
import os
import random
import re
import shutil
import sys
import tempfile
import traceback
import warnings
from dataclasses import is_dataclass, replace
from pathlib import Path
from unittest.mock import patch

import h5py
import numpy as np
from damaged_files import FOLDER_HARMS, HARMS, archive_of
from odd_units import ENTRIES, LIBRARY, MADE, PLAIN, hostile, packed
from superelements import matrix_input, shaft, write_superelement

from cranktrain.cli.main import main as command_line
from cranktrain.core.errors import CranktrainError, InputError
from cranktrain.engine.file import engine_folder, load_engine
from cranktrain.engine.quantities import OFFSETS, UNITS, kinds
from cranktrain.engine.torsional_chain import read_chain
from cranktrain.film.table.database import FilmTable, TableSettings, table_axes
from cranktrain.film.table.interpolation import UNTILTED, TableArrays
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.pressure_map import read_gas
from cranktrain.modules.register import module_files, module_of
from cranktrain.results.export import export
from cranktrain.results.orders.measured import read_measured_orders
from cranktrain.results.run_up.run_up import AXIAL, TORSION, RunUp
from cranktrain.results.views.loaded import load_run
from cranktrain.store.bodies import export_body, import_body
from cranktrain.store.film_tables import DATASETS, load_film_table, save_film_table
from cranktrain.store.hdf5 import write_result
from cranktrain.structure.crank.chain import chain_modes
from cranktrain.structure.crank.torsional import rigid_crank
from cranktrain.structure.fem.own_body import read_body
from cranktrain.studies.scene import load_scene
from cranktrain_lab.calibration.targets import load_targets
from cranktrain_lab.coupling.fmu_unit import described
from cranktrain_lab.harness.file import load_harness
from cranktrain_lab.variants.study import load_study
from cranktrain_lab.watch.recordings import read_recordings
from cranktrain_lab.wear.schedule import block_at, read_schedule

ROOT = Path(__file__).parents[1]
SIX = load_engine("diesel_i6")
TABLE = TableSettings(0.5, tilt=False)

NUMBERS = (
    "0", "-0.0", "-1", "1e300", "-1e300", "1e-300", "1e308", "1e400", "nan", "inf", "-inf", "1" + 400 * "0", 5000 * "9",
    "0x" + 400 * "f", "1_000", "1,5", "0.1", "3", "7e9", "true", "1979-05-27", "12:30:00",
)  # fmt: skip
WORDS = (
    "", " ", "a" * 300, "../../x", "/", ".", "/dev/null", "/dev/zero", "[/x]", "$x_{$", "{}", "{0}", "%s", "\u202ex",
    "\x1b[31m", "ü", "none", "None", "ground", "'", '"', "\\", "#", "a b", "9" * 300, "\ufeff", "x.toml", "~",
)  # fmt: skip
VALUES = (
    *NUMBERS, "[]", "{}", '""', '"x"', '["x"]', "[[1]]", "[1, 2]", 3000 * "[", 200 * "[" + 200 * "]", "{a = {b = 1}}"
)  # fmt: skip
NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"


class Accepted(InputError):
    """In place of long work."""


class Nonsense(Exception):
    """What was accepted and should not have been."""


def spoilt(rng, text, values=VALUES):
    """Text with one to three mutations."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        text = rng.choice(MUTATIONS)(rng, text, values)
    return text


def _number(rng, text, values):
    """Another value for one of the numbers, often the same number in another size."""
    places = list(re.finditer(NUMBER, text))
    if not places:
        return text
    place = rng.choice(places)
    if rng.random() < 0.5:
        new = f"{float(place[0]) * rng.choice((-1.0, 0.0, 1e-3, 1e3, 1e-6, 1e6, 1e30, 0.5, 2.0)):.12g}"
    else:
        new = rng.choice(values)
    return text[: place.start()] + new + text[place.end() :]


def _lines(rng, text, values):
    """A line less, twice, elsewhere, cut, or one of nonsense."""
    lines = text.split("\n")
    k, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    action = rng.randrange(6)
    if action == 0:
        del lines[k]
    elif action == 1:
        lines.insert(k, lines[k])
    elif action == 2:
        lines[k], lines[other] = lines[other], lines[k]
    elif action == 3:
        lines[k] = lines[k][: rng.randrange(len(lines[k]) + 1)]
    elif action == 4:
        new = (f"x = {rng.choice(values)}", f"[{rng.choice(WORDS)}]", rng.choice(WORDS), '"a\\nb" = 1')
        lines.insert(k, rng.choice(new))
    else:
        lines[k:other] = []
    return "\n".join(lines)


def _characters(rng, text, values):
    """Characters less, changed, or from elsewhere; the text cut, or of other line ends."""
    if not text:
        return rng.choice(WORDS)
    k = rng.randrange(len(text))
    before, after = text[:k], text[k + 1 :]
    strange = chr(rng.choice((0, 7, 10, 34, 91, 125, 160, 0x2028, 0x1F600)))
    return rng.choice(
        (
            before + after, before + strange + after, before, after, before + rng.choice(WORDS) + after,
            text.replace("\n", "\r\n"), "\ufeff" + text, text.replace("=", ":"), before + after[:60][::-1] + after[60:],
        )
    )  # fmt: skip


def _word(rng, text, values):
    """Another word in quotes, or another value behind an equals sign."""
    places = list(re.finditer(r'"[^"\n]*"|(?<== )[^,}\n]+', text))
    if not places:
        return text
    place = rng.choice(places)
    words = [found[0] for found in places]
    new = rng.choice((f'"{rng.choice(WORDS)}"', rng.choice(values), rng.choice(words)))
    return text[: place.start()] + new + text[place.end() :]


MUTATIONS = (_number, _number, _number, _word, _lines, _characters)


def engine(rng, folder):
    """An engine file: accepted, all its numbers lie in their ranges, its gas is finite, its crank has a mass."""
    name = rng.choice(("diesel_i6", "diesel_v8"))
    path = written(folder / "own.toml", spoilt(rng, (engine_folder() / f"{name}.toml").read_text("utf-8")))
    check_ranges(found := load_engine(path))
    gas = GasTrace.from_engine(found)
    holds(np.isfinite(gas.fired).all() and gas.fired.min() > 0.0, f"gas of {gas.fired.min()} to {gas.peak} Pa")
    holds(0.0 < rigid_crank(found).mass < 1e8, "mass of the crank")


def check_ranges(found):
    """Every number of an engine lies in its field's range."""
    for table, part in vars(found).items():
        for key, (_, many, rule) in kinds(part.__class__).items() if is_dataclass(part) else ():
            value, default = getattr(part, key), getattr(part.__class__, key, None)
            if not hasattr(rule, "low") or value == default:
                continue
            unit = rule.unit or next(iter(UNITS[rule.dimension]))
            for one in value if many else (value,):
                shown = (one - OFFSETS.get(unit, 0.0)) / UNITS[rule.dimension][unit]
                inside = rule.low - 1e-6 * abs(rule.low) <= shown <= rule.high * (1.0 + 1e-6)
                holds(inside, f"{table}.{key} = {shown} {unit}")


def pressure(rng, folder):
    """A pressure file: accepted, it is a positive pressure with the peak of an engine."""
    angle = np.arange(0.0, 720.0, rng.choice((1.0, 2.0, 5.0)))
    bar = 3.0 + 130.0 * np.exp(-(((angle - 370.0) / 25.0) ** 2))
    header = rng.choice(("", "deg;bar", "angle;p [bar]", "angle_deg;pressure_bar", "Angle;Pressure\ndeg;bar"))
    text = "\n".join([header, *(f"{a:g};{p:.4f}" for a, p in zip(angle, bar, strict=True))])
    path = written(folder / "p.csv", spoilt(rng, text, (*NUMBERS, "", ";", "x", "1;2;3", "°")))
    unit = rng.choice((None, None, None, "bar", "bar", "psi", "barg", rng.choice(WORDS)))
    centre = rng.choice((None, None, None, 360.0, 360.0, 0.0, rng.choice((math.nan, 1e300))))
    trace = GasTrace.from_csv(path, SIX, unit, centre)
    holds(np.isfinite(trace.fired).all() and trace.fired.min() > 0.0, "pressure below zero")
    holds(0.2e6 < trace.peak < 70e6, f"peak of {trace.peak} Pa")
    holds(np.isfinite(trace.motored).all() and math.isfinite(trace.imep), "motored pressure")


SCENES = (ROOT / "examples" / "scene.toml", *sorted((ROOT / "tests" / "data" / "scenes").glob("*.toml")))


def scene(rng, folder):
    """A scene: accepted, its numbers lie in the ranges that its page states."""
    found = load_scene(written(folder / "own.toml", spoilt(rng, rng.choice(SCENES).read_text("utf-8"))))
    holds(all(rpm * (1.0 + 1e-9) >= 100.0 and rpm <= 20000.0 * (1.0 + 1e-9) for rpm in found.speeds_rpm), "speeds")
    holds(1e-6 <= found.accuracy <= 0.5 and 0.0 < found.frequency <= 1e5, "accuracy or frequency")
    holds(0.0 <= found.load <= 2.0, "load")
    holds(found.cycles is None or 2 <= found.cycles <= 10000, "cycles")
    holds(found.step is None or 0.001 <= math.degrees(found.step) <= 30.0 + 1e-9, "step")


HARNESS = ROOT / "examples" / "harness.toml"


def harness(rng, folder):
    """A harness file: accepted, times lie within their scenarios and what is expected is finite."""
    found = load_harness(written(folder / "own.toml", spoilt(rng, HARNESS.read_text("utf-8"))))
    for one in found.scenarios:
        stop = one.way.stop * (1.0 + 1e-6)
        holds(0.0 < one.way.steps.size < math.inf and stop / one.way.steps.size < 2e7, "steps")
        holds(all(0.0 <= c.begin <= c.end <= stop for c in one.changes), "changes")
        holds(all(0.0 <= e.begin < e.end for e in (*one.noises, *one.dropouts)), "noise, drop-outs")
        limits = [v for a in one.assertions for v in vars(a.bounds).values() if v is not None]
        holds(all(math.isfinite(v) for v in limits), "bounds")


def module(rng, folder):
    """A module file: accepted, its values are finite and a simulation can be made of them."""
    text = rng.choice(list(module_files().values())).read_text("utf-8")
    path = written(folder / "own.toml", spoilt(rng, text))
    found = module_of(path).read(path)
    holds(all(math.isfinite(v) for v in found.starts.values() if isinstance(v, float)), "starts")
    data = folder / "model.bin"
    data.write_bytes(found.data)
    running = importlib.import_module(module_of(path).running)
    running.simulation(running.read_model(data), {}, {})


def targets(rng, folder):
    """A targets file: accepted, its bounds are finite and in order, its targets positive."""
    text = (engine_folder() / "diesel_i6.targets.toml").read_text("utf-8")
    task = load_targets(written(folder / "own.toml", spoilt(rng, text)), SIX)
    holds(all(-1e15 < p.low < p.high < 1e15 for p in task.parameters), "bounds")
    holds(all(0.0 < t.hz <= 1e5 and 0.0 < t.tolerance < 1.0 for t in task.targets), "targets")


CHAIN = """\
[[disc]]
name = "pulley"
inertia = 0.05
[[disc]]
name = "gear"
inertia = 0.2
damping = 0.1
[[disc]]
name = "wheel"
inertia = 2.0
[[shaft]]
between = ["pulley", "gear"]
stiffness = 1e5
loss_factor = 0.02
[[shaft]]
between = ["gear", "wheel"]
ratio = -2.0
"""


CHAIN_LINES = """\
disc,inertia,damping,to,stiffness,shaft_damping,loss_factor,ratio
pulley,0.05,0,,1e5,2.0,,
gear,0.2,0.1,wheel,,,,-2.0
wheel,2.0,,,,,,
"""


def chain(rng, folder):
    """A table of discs: accepted, its frequencies are finite."""
    name, text = rng.choice((("own.toml", CHAIN), ("own.csv", CHAIN_LINES)))
    modes = chain_modes(read_chain(written(folder / name, spoilt(rng, text))))
    holds(np.isfinite(modes.omega).all() and np.isfinite(modes.shapes).all(), "modes")


MEASURED = """\
speed_rpm, order, amplitude, unit
2380, 6, 0.21, deg
1900, 4.5, 85, um
2000, 4.5, 81, um
"""


def measured(rng, folder):
    """Measured orders: accepted, their speeds do not fall (one may be measured twice), their amplitudes are finite."""
    text = spoilt(rng, MEASURED, (*NUMBERS, "", ",", "deg", "1, 2", "mm"))
    for by_order in read_measured_orders(written(folder / "own.csv", text)).values():
        for order, (speeds, amplitudes) in by_order.items():
            holds(order > 0.0 and np.all(np.diff(speeds) >= 0.0) and speeds[0] > 0.0, "speeds or orders")
            holds(np.isfinite(amplitudes).all() and np.all(amplitudes >= 0.0), "amplitudes")


STUDY = (ROOT / "examples" / "damper_study.toml").read_text("utf-8")
STUDIES = (
    STUDY,
    STUDY.replace("[vary]", '[vary]\n"load" = { distribution = "normal", mean = 0.9, deviation = "3 %", low = 0.5 }'),
    """model = "two-mass"
outputs = ["amplification", "peak_frequency"]
[vary]
frequency_ratio = { distribution = "triangular", low = 0.9, mode = 1.0, high = 1.1 }
[design]
method = "sobol"
n = 16
""",
)


def study(rng, folder):
    """A study: accepted, the variants of its design and the ends of its distributions are finite."""
    found = load_study(written(folder / "own.toml", spoilt(rng, rng.choice(STUDIES))))
    holds(all(math.isfinite(end) for one in found.distributions for end in one.ends if abs(end) != math.inf), "ends")
    holds(all(math.isfinite(one) and one > 0.0 for one in found.speeds), "speeds")
    if found.aim is not None:
        holds(not any(math.isnan(end) for one in found.aim.limits for end in (one.at_least, one.at_most)), "limits")
        holds(all(one.at_least <= one.at_most for one in found.aim.limits), "limits in order")
    small = replace(found.design, n=min(found.design.n, 8), levels=min(found.design.levels, 3))
    if found.varied:
        holds(np.isfinite(np.asarray(small.values(found.distributions), dtype=float)).all(), "variants")


SCHEDULE = "hours,speed_rpm,load\n0.5,1000,0.25\n2,1600,1.0\n1.5,2200,0.8\n"


def schedule(rng, folder):
    """A schedule of running in: accepted, its times, speeds and loads are an engine's."""
    text = spoilt(rng, SCHEDULE, (*NUMBERS, "", ";", "x", "h", "%"))
    blocks = read_schedule(written(folder / "own.csv", text))
    holds(
        all(0.0 < one.duration < 1e10 and 0.0 < one.speed < 1e4 and 0.0 <= one.load <= 2.0 for one in blocks), "block"
    )
    block_at(blocks, rng.choice((0.0, 1.0, 3600.0, 1e5, 1e9)))


INDEX = "speed_rpm,load,file\n1000,1,1000.csv\n2000,0.5,2000_50%.csv\n2000,1,2000_full.csv\n"


def write_map(place):
    """A map of pressures with its index file, in place of what was there; the traces' texts by their names."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    angle, texts = np.arange(0.0, 720.0, 10.0), {}
    for name, peak in (("1000.csv", 60.0), ("2000_50%.csv", 90.0), ("2000_full.csv", 130.0)):
        bar = 3.0 + peak * np.exp(-(((angle - 370.0) / 25.0) ** 2))
        texts[name] = "\n".join(["deg;bar", *(f"{a:g};{p:.4f}" for a, p in zip(angle, bar, strict=True))])
        written(place / name, texts[name])
    written(place / "index.csv", INDEX)
    return texts


def load_map(rng, folder):
    """A map of pressures, by its index file or the names of its files: accepted, its traces are an engine's."""
    place = folder / "map"
    for name, table in write_map(place).items():
        (place / name).unlink()
        wrong = rng.random() < 0.3
        if rng.random() >= 0.8:
            name = rng.choice(("1e9.csv", "-5.csv", "nan.csv", "1000_0%.csv", "0.csv", "a.csv"))
        written(place / name, spoilt(rng, table, (*NUMBERS, "", ";", "x")) if wrong else table)
    written(place / "index.csv", spoilt(rng, INDEX, (*NUMBERS, "", "..", "index.csv", "1000.csv")))
    if rng.random() < 0.5:
        (place / "index.csv").rename(folder / "index.csv")
        found = read_gas(place, SIX)
    else:
        found = read_gas(place / "index.csv", SIX)
    for point in getattr(found, "points", ()):
        holds(0.0 < point.speed < 1e4 and 0.0 <= point.load <= 2.0, "place of a trace")
        holds(np.isfinite(point.trace.fired).all() and point.trace.fired.min() > 0.0, "pressure below zero")
    trace = found.at(rng.choice((50.0, 150.0, 1e3)), rng.choice((0.0, 0.7, 1.5)))
    holds(np.isfinite(trace.fired).all(), "trace between")


RECORDING = "speed_rpm,order,amplitude,unit,phase_deg,band,output,signal,wheel\n" + "\n".join(
    f"{rpm},{order},0.0{k + 3},deg,{10 * k},0.001,pulley.torsion,a,60-2"
    for k, rpm in enumerate((1000, 1500, 2000)) for order in (3, 6)
)  # fmt: skip


def recordings(rng, folder):
    """Recordings to watch: accepted, all orders of all recordings are finite."""
    files = []
    for k in range(3):
        text = RECORDING.replace("0.03", f"0.03{k}")
        if rng.random() < 0.6:
            text = spoilt(rng, text, (*NUMBERS, "", ",", "deg", "mm", "twist"))
        files.append(written(folder / f"{k}.csv", text))

    def model(place):
        return np.ones((place.speeds.size, place.orders.size), dtype=complex)

    output = rng.choice(("pulley.torsion", "pulley.torsion", "twist", rng.choice(WORDS)))
    found = read_recordings(SIX, files[:1], files[1:], output, rng.choice(((), (3.0,), (1e300,))), model)
    holds(np.isfinite(found.watched).all() and np.isfinite(found.healthy).all(), "orders")


def superelement(rng, folder):
    """A superelement of which one file was changed: accepted, its modes are finite and its mass is positive."""
    frame = shaft(2)
    write_superelement(folder, frame, {"a": 1, "b": 3})
    files = ["super.toml", "super.mtx"]
    if rng.random() < 0.5:
        for kind, matrix in zip(("stiffness", "mass"), frame.matrices(), strict=True):
            matrix_input(folder / f"{kind}.mtx", (1, 2, 3), matrix)
        text = (folder / "super.toml").read_text("utf-8")
        text = text.replace('matrices = "super.mtx"', 'stiffness = "stiffness.mtx"\nmass = "mass.mtx"')
        (folder / "super.toml").write_text(text, "utf-8")
        files = ["super.toml", "stiffness.mtx", "mass.mtx"]
    changed = folder / rng.choice(files)
    if rng.random() < 0.8:
        written(changed, spoilt(rng, changed.read_text("utf-8"), (*NUMBERS, "", ",", "1, 2", "*", "**")))
    body = read_body(folder / "super.toml")
    holds(np.isfinite(body.omega).all() and np.isfinite(body.shapes).all(), "modes")
    holds(body.mass > 0.0 and np.isfinite(body.mass), "mass")


def run_up_file(rng, folder):
    """A run-up's file that was changed: accepted, its arrays fit together."""
    path = folder / "up.h5"
    write_run_up(path)
    damaged(rng, path)
    found = RunUp.load(path)
    shape = (found.speeds.size, found.orders.size)
    holds(all(one.shape == shape for one in found.amplitudes.values()), "amplitudes")
    holds(np.all(np.diff(found.speeds) > 0.0) and np.isfinite(found.speeds).all(), "speeds")


def result_file(rng, folder):
    """A result file of which one array is something else, or whose bytes were changed: a whole table, or refused."""
    path, table = folder / "run.h5", folder / f"table.{rng.choice(('csv', 'npz'))}"
    for place in (path, table):
        place.unlink(missing_ok=True)
    time = 1e-3 * np.arange(50.0)
    names = {"time": "s", "angle": "rad", "pulley.torsion": "rad", "unit/out": "m"}
    write_result(path, {name: (time, unit) for name, unit in names.items()}, {"engine": "diesel_i6", "scheme": "any"})
    if rng.random() < 0.4:
        damaged(rng, path)
    else:
        rng.choice(HARMS)(path, rng.choice(list(names)))
    found = export(path, table)
    holds(found["columns"] >= 1 and found["rows"] >= 1, "table")
    export(path, table)  # replaces its own table
    found = load_run(path)
    holds(np.all(np.diff(found.time) > 0.0), "time")


def harmed_run_up(rng, folder):
    """A run-up's file of which one array is something else: accepted, its speeds rise."""
    path = folder / "up.h5"
    write_run_up(path)
    rng.choice(HARMS)(path, rng.choice(("speeds", "orders", "amplitudes", "extremes", "cycles", "left")))
    found = RunUp.load(path)
    holds(np.all(np.diff(found.speeds) > 0.0) and np.isfinite(found.speeds).all(), "speeds")


def stored_body(rng, folder):
    """A reduced body as a folder or an archive that was changed: accepted, it has mass and finite modes."""
    form = rng.choice(("body", "body.npz", "body.h5"))
    write_superelement(folder, shaft(2), {"a": 1, "b": 3})
    path = export_body(folder / form, read_body(folder / "super.toml"))
    if form == "body":
        if rng.random() < 0.5:
            rng.choice(FOLDER_HARMS)(path)
        else:
            changed = rng.choice(sorted(path.iterdir()))
            written(changed, spoilt(rng, changed.read_text("utf-8"), (*NUMBERS, "", ",", "1 2", "%")))
    elif form == "body.npz" and rng.random() < 0.5:
        archive_of(path, rng.choice(("(1 << 40,)", "(10995116277760,)", "(-1,)", "()", "(0,)", "'x'")))
    else:
        damaged(rng, path)
    try:
        body = import_body(path)
        holds(np.isfinite(body.omega).all() and 0.0 < body.mass < math.inf, "body")
    finally:
        shutil.rmtree(folder / "body", ignore_errors=True)


def foreign_fmu(rng, folder):
    """An archive that is no FMU of a partner, or one that is hostile: refused, or its description is read."""
    path = folder / "foreign.fmu"
    small = [name for name in ENTRIES if name not in ("bomb", "large description", "many entries")]
    if rng.random() < 0.5:
        hostile(rng.choice([*small, *MADE]), path)
    else:
        packed(path, {"modelDescription.xml": spoilt(rng, PLAIN), LIBRARY: b"x"})
        if rng.random() < 0.3:
            damaged(rng, path)
    described(path)


def write_run_up(path):
    """A small run-up of the six."""
    rows = np.full((3, 12), 1e-3 + 1e-4j)
    path.unlink(missing_ok=True)
    RunUp(
        speeds=np.array([100.0, 110.0, 120.0]), orders=0.5 * np.arange(1, 13), amplitudes={TORSION: rows, AXIAL: rows},
        extremes={TORSION: np.array(3 * [[-1.0, 0.0, 1.0]])}, cycles=np.full(3, 4), repeats=np.ones(3, dtype=int),
        left=np.full(3, 1e-4), attributes={"engine": "diesel_i6", "crank": "solid"},
    ).save(path)  # fmt: skip


def damaged(rng, path):
    """Cut a file, put another in its place, or change some of its bytes."""
    content = bytearray(path.read_bytes())
    action = rng.randrange(3)
    if action == 0:
        content = content[: rng.randrange(len(content))]
    elif action == 1:
        content = rng.choice((b"", b"x", b"\x89HDF\r\n\x1a\n", bytes(5000)))
    else:
        for _ in range(rng.randrange(1, 20)):
            content[rng.randrange(min(rng.choice((5000, len(content))), len(content)))] = rng.randrange(256)
    path.write_bytes(content)


def film_table(rng, folder):
    """A film table whose file was changed: accepted, all that kernels read has its shape and is finite."""
    path = folder / "table.h5"
    path.unlink(missing_ok=True)
    arrays = TableArrays(np.zeros((4, 51, 99)), UNTILTED, table_axes(TABLE))
    save_film_table(path, FilmTable(TABLE, arrays, np.zeros((48, 96)), np.empty((0, 0, 0, 0))))
    if rng.random() < 0.6:
        damaged(rng, path)
    else:
        with h5py.File(path, "r+") as file:
            data, name = file["data"], rng.choice(DATASETS)
            values = data[name][()]
            action = rng.randrange(6)
            if action == 0 and values.size:
                values.flat[rng.randrange(values.size)] = rng.choice((math.nan, math.inf, -math.inf))
            changed = (
                values, values.astype(np.float32), values.astype(int), values.ravel(), values[:-1],
                np.array([b"x"]), np.zeros((0,)), np.zeros((2, *values.shape)),
            )  # fmt: skip
            del data[name]
            if action < 4:
                data.create_dataset(name, data=values if action == 0 else rng.choice(changed)).attrs["unit"] = "1"
            elif action == 4:
                file.attrs[rng.choice(list(file.attrs))] = rng.choice(("x", 7, 1e300))
    table = load_film_table(path, TABLE)
    for array, shape in ((table.arrays.aligned, (4, 51, 99)), (table.aligned_error, (48, 96))):
        holds(array.shape == shape and np.isfinite(array).all(), "shape or values of the table")


CALLS = (ROOT / "tests" / "data" / "right_calls.txt").read_text("utf-8").splitlines()
"""Calls that are right; those that would take long are cut short."""

LONG_WORK = (
    "cranktrain.structure.assembly.assemble", "cranktrain.structure.crank.reduction.reduced_crankshaft",
    "cranktrain.structure.block.reduction.reduced_block", "cranktrain.studies.modal.reduced_crankshaft",
    "cranktrain.structure.assembly.elastic_bore", "cranktrain.store.film_tables.film_table",
    "cranktrain_lab.stability.kept_maps.maps", "cranktrain_lab.calibration.calibrate._fitted",
    "cranktrain.structure.assembly.running_crank", "cranktrain_lab.tradeoff.study.study",
    "cranktrain.studies.planning.scene_model.SceneModel", "cranktrain.structure.block.roller_ring.ring_compliance",
    "cranktrain_lab.watch.watch.TorsionalAnswers",
)  # fmt: skip


def command(rng, folder):
    """Arguments: exit code 0, or 2 with one line of error."""
    written(folder / "chain.toml", CHAIN)
    written(folder / "scene.toml", SCENES[0].read_text("utf-8"))
    written(folder / "own.csv", MEASURED)
    write_run_up(folder / "up.h5")
    write_superelement(folder, shaft(2), {"a": 1, "b": 3})
    written(folder / "study.toml", STUDIES[2])
    aim = '[optimize]\nminimize = "amplification"\nevaluations = 20\n'
    written(folder / "optimum.toml", STUDIES[2].partition("[design]")[0] + aim)
    written(folder / "hours.csv", SCHEDULE)
    for k in range(4):
        written(folder / f"{k}.csv", RECORDING.replace("0.03", f"0.03{k}"))
    write_map(folder / "map")
    arguments = rng.choice(CALLS).split()
    for _ in range(rng.choice((1, 1, 2, 3))):
        k, new = rng.randrange(len(arguments)), rng.choice((*NUMBERS, *WORDS))
        action = rng.randrange(8)
        if action < 5 and len(arguments) > 1:
            arguments[rng.randrange(1, len(arguments))] = new
        elif action == 5 and len(arguments) > 1:
            del arguments[k]
        elif action == 6:
            arguments.insert(k, arguments[k])
        else:
            arguments.insert(k + 1, rng.choice((new, "--json", "--help", "--speed", "--load", "-x", "--")))
    replaced = contextlib.ExitStack()
    out, err = io.StringIO(), io.StringIO()
    with replaced:
        for name in LONG_WORK:
            replaced.enter_context(patch(name, side_effect=Accepted("accepted")))
        replaced.enter_context(contextlib.redirect_stdout(out))
        replaced.enter_context(contextlib.redirect_stderr(err))
        try:
            code = command_line(arguments)
        except SystemExit as ended:
            code = ended.code or 0
    lines = [line for line in err.getvalue().splitlines() if line.startswith("cranktrain: ")]
    errors = [line for line in lines if not line.startswith("cranktrain: warning: ")]
    said = f"{arguments}: exit code {code}: {err.getvalue()[-300:]}"
    holds(code in (0, 2) and "Traceback" not in said, said)
    holds(code == 0 or len(errors) == 1, said)
    check_line(errors[0] if code else "accepted")
    return "refused" if code else "accepted"


KINDS = (
    engine, engine, engine, engine, pressure, pressure, scene, scene, command, command, command, targets, chain,
    film_table, measured, superelement, run_up_file, module, harness, result_file, harmed_run_up, stored_body,
    foreign_fmu, study, study, schedule, load_map, recordings,
)  # fmt: skip


def written(path, text):
    """Path of a file with this text; characters that UTF-8 cannot hold become a byte that it does not know."""
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    return path


def holds(condition, text):
    """Raise ``Nonsense`` unless something holds."""
    if not condition:
        raise Nonsense(text)


def check_line(text):
    """A refusal is one printable line of a length that one reads."""
    holds(text and text.isprintable() and len(text) < 1500, f"refused by {text[:200]!r}")


def tried(number, seed, folder):
    """Name of a case's kind, and what became of it: accepted, refused; raises what should not have happened."""
    rng = random.Random(f"{seed} {number}")
    case = rng.choice(KINDS)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return case.__name__, case(rng, folder) or "accepted"
        except CranktrainError as refusal:
            check_line(str(refusal))
            return case.__name__, "refused"


def main():
    """Try the cases of a seed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=14)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=3000)
    parser.add_argument("--only", type=int)
    options = parser.parse_args()
    numbers = range(options.first, options.first + options.count) if options.only is None else (options.only,)
    failed = 0
    with tempfile.TemporaryDirectory(prefix="cranktrain-mutated-") as folder:
        os.chdir(folder)
        for number in numbers:
            try:
                line = " ".join(tried(number, options.seed, Path(folder)))
            except Exception as wrong:
                failed += 1
                line = f"FAILED {type(wrong).__name__}: {str(wrong)[:400]!r}"
                if options.only is not None:
                    traceback.print_exc()
            print(number, line, flush=True)
        os.chdir(ROOT)
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
