"""Every script of ``benchmarks`` starts, at the shortest setting that it has.

``STARTS`` names arguments and constants for each; ``tests/shortened.py`` sets the constants. A script that is not in
the table fails the test. Figures of such short runs mean nothing and are not looked at.
"""

import ast
import importlib
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "benchmarks"
SCRIPTS = sorted(path.stem for path in FOLDER.glob("[!_]*.py"))


class Start(NamedTuple):
    """How a script is started.

    Attributes
    ----------
    words : its arguments
    constants : its module constants that make it short
    quick : whether it runs in ``make test``
    code : its exit code
    why : why it is not started whole
    """

    words: str = ""
    constants: Mapping[str, object] = MappingProxyType({})
    quick: bool = False
    code: int = 0
    why: str = ""


SIX_AT_1000 = "--engines diesel_i6 --blocks ground --speeds 1000"
STARTS = {
    "additions": Start("--discs 1 --rods 1 --laps 1", quick=True),
    "balance": Start(),
    "bearing_stiffness": Start(constants={"FACTORS": [1.0]}, quick=True),
    "block_bores": Start(constants={"SHAPES": 7, "AROUND": 36, "ACROSS": 3, "DIRECTIONS": 2}),
    "chain": Start(),
    "clients": Start("--help", quick=True, why="installs each client by pip into an environment of its own"),
    "code_variants": Start("linear", {"CYCLES": 2}),
    "collar": Start("--speeds 1000", {"BEFORE": 1, "AFTER": 1}, quick=True),
    "combustion_coupling": Start("torsional", {"STEPS_DEG": [4.0], "FINE_DEG": 2.0, "CYCLES": 2}, quick=True),
    "cost_law": Start(
        constants={
            "ROUNDS": 1,
            "DEAR_ROUNDS": 1,
            "CUTOFFS_HZ": [500.0, 1000.0],
            "CYLINDERS": [2, 3],
            "FILM_CYLINDERS": [2, 3],
            "GRIDS": [[24, 6], [32, 8]],
            "SPEED_COUNTS": [3, 5],
            "WORKER_COUNTS": [1, 2],
            "RUN_UP_SPEEDS": 3,
            "VARIANTS": 2,
        }
    ),
    "coupling": Start("torsional", {"STEPS_DEG": [6.0], "CYCLES": 2}, quick=True),
    "coupling_cost": Start(constants={"STEPS_DEG": [3.0], "BLOCKS": 2, "BLOCK": 20, "CYCLES": (1, 2)}),
    "cover_steps": Start("impedance", {"CYCLES": 1, "FINEST": 2.0, "CHOICES": [("esdirk4", 2.5)]}),
    "damper": Start("diesel_i6 6", {"CYCLES": 2}),
    "dense_output": Start(constants={"SHORT": 0.001, "LONG": 0.002, "TIMES": 1, "CYCLE": 0.002}),
    "digests": Start("digests.json --quick --only rigid", quick=True),
    "edges": Start("--speeds 1000 --cycles 0.005 --horizon 0.005 --bearings ehd"),
    "elastic_cost": Start(constants={"CYCLES": 2, "GRIDS": [[48, 8, 0.5]], "REPEATS": 1, "CALLS": 2}),
    "elastic_run_up": Start("--speeds 1000 1020", {"SETTLE": 0.3}),
    "explore_picture": Start("--engines single_petrol", quick=True),
    "fillet_stress": Start("1 'pin[1] front fillet'"),
    "film": Start(constants={"COUNT": 100, "REPEATS": 1}, quick=True),
    "film_cost": Start(
        "chart.png",
        {
            "SHAPE_COUNTS": [0, 1],
            "CUTOFFS_HZ": [500.0, 1000.0],
            "RIGID_GRIDS": [[24, 6]],
            "RIGID_FINEST": [32, 8],
            "ELASTIC_GRIDS": [[36, 6]],
            "ELASTIC_FINEST": [48, 8],
            "MOST_BEARINGS": 2,
            "REPEATS": 1,
            "ENGINE_REPEATS": 1,
        },
    ),
    "film_lanes": Start(constants={"CYCLES": 1}),
    "film_levels": Start(constants={"CYCLES": 0.01}),
    "film_methods": Start(constants={"CYCLES": 1, "PER_CYCLE": 4, "STEPS_DEG": [2.0]}),
    "film_modes": Start("1660"),
    "film_table": Start(
        constants={
            "ALIGNED_STATES": 20,
            "FINER_STATES": 2,
            "TILTED_STATES": 20,
            "ENGINE_STATES": 300,
            "COST_STATES": 20,
            "REPEATS": 3,
            "RATE_STATES": 3,
        }
    ),
    "first_start": Start(constants={"CRANKS": ["rigid"]}),
    "fmu_overhead": Start(constants={"BLOCKS": 2, "STEPS": 2}),
    "foreign_masters": Start(
        constants={"CYCLES": 2, "MASTERS": ["fmpy"]}, why="other masters are installed by pip into environments"
    ),
    "ground_springs": Start("diesel_i6"),
    "identify_trials": Start("--engines four_petrol --trials 1 --speeds 8 --decay 0.05 --signals", {"HIGHEST": 4.0}),
    "inherited_damping": Start("diesel_i6", {"SPEEDS": [1.0]}),
    "large_tables": Start("--megabytes 1 2"),
    "law_call": Start("--calls 1000", {"TIMES": 1, "CYCLES": 1}, quick=True),
    "level_cost": Start("torsional", {"ROUNDS": 1, "CYCLES": 2}),
    "level_steps": Start(
        "single_petrol",
        {"CYCLES": 1, "REPEATS": 1, "LEVELS": {"beam": "linear"}, "CHOICES": [("esdirk4", 2.5), ("esdirk47", 5.0)]},
    ),
    "long_run": Start("--speeds 1000 --tolerances 0.01 --cycles 2"),
    "measured_pulses": Start("--samples 3000000", quick=True),
    "misfire": Start("2000", {"CYCLES": 2}),
    "native_build": Start("combustion_i6"),
    "native_fmu": Start(constants={"STEPS": 100, "STARTS": 1}),
    "neighbours": Start(),
    "orbit_trials": Start("--engines single_petrol --trials 1"),
    "peers": Start(
        "nobody", quick=True, code=2, why="needs other people's programs, each in an environment of its own"
    ),
    "poincare": Start("--speeds 1000", {"BEFORE": 1, "CYCLES": 4, "LONGEST": 2}, quick=True),
    "ratio": Start("--laps 1 --bearings linear"),
    "run_up": Start("--from 1000 --to 1020 --workers 1 --repeats 1", {"SPEEDS": 2}, quick=True),
    "rupture_order": Start(
        constants={
            "STEPS": [90, 180],
            "FINE": 360,
            "METHODS": ["backward-euler", "sdirk2", "esdirk3"],
            "ENGINES": {"single_petrol": 3000.0},
            "ENGINE_STEPS": [90, 180],
            "ENGINE_FINE": 360,
            "GRIDS": [32],
        }
    ),
    "settling": Start(SIX_AT_1000, {"TOLERANCES": [0.3, 0.1], "EXACT": 0.01, "PLAIN": 6}),
    "step_crank": Start("--sizes-mm 30"),
    "step_work": Start("--levels linear --runs 1", {"CYCLES": 2}, quick=True),
    "torsional_run_up": Start("diesel_i6"),
    "tradeoff": Start("--quick"),
    "valve_train": Start(constants={"BLOCKS": 2, "STEPS": 4, "CYCLES": 2, "FINE_DEG": 1.0, "STEPS_DEG": [2.0]}),
    "variants": Start(
        "--engine single_petrol --torsional 2 --solid 0 --workers 1", {"SOBOL_ROWS": 64, "EVALUATIONS": 60}, quick=True
    ),
    "vector_kernels": Start("13", quick=True),
    "virtual_engine": Start(
        "2000", {"CYCLES": 2, "FINEST": 1.0, "STEPS_DEG": [3.0], "WAYS": ["gauss-seidel, own", "jacobi, late"]}
    ),
    "watch_trials": Start(
        "--engines single_petrol --crank torsional --picture watch.png",
        {
            "SPEEDS": 1,
            "HEALTHY": 3,
            "SETS": 1,
            "TRIALS": 2,
            "QUIET": 4,
            "SEVERITIES": {"misfire": [0.5], "damper": [0.5], "shaft": [0.5]},
        },
    ),
    "whole_engine": Start(constants={"ROUNDS": 1, "CYCLES": 2, "STEPS": [["generalised-alpha", 2.5]]}),
    "worst_film": Start("--cycles 1 --grids 48x8 48x12", {"PER_CYCLE": 36}),
}
NO_JSON = {"digests", "ground_springs", "vector_kernels", "whole_engine", "clients", "peers"}
"""Scripts that print lines or tables, or are not started whole."""


def started(name, folder, constants, words):
    """A script in a process of its own that works in ``folder``."""
    command = [
        sys.executable,
        ROOT / "tests" / "shortened.py",
        FOLDER / f"{name}.py",
        json.dumps(dict(constants)),
        *words,
    ]
    paths = os.pathsep.join([str(ROOT / "fmu_src"), str(ROOT)])
    return subprocess.run(command, cwd=folder, env=os.environ | {"PYTHONPATH": paths}, capture_output=True, text=True)


def check_start(name, folder):
    start = STARTS[name]
    if name == "code_variants" and not any(ROOT.glob("fmu_src/cranktrain/fmu/native/lib/*/cranktrain.*")):
        pytest.skip("compares machine code of the installation, which `make native` makes")
    done = started(name, folder, start.constants, shlex.split(start.words))
    assert done.returncode == start.code, done.stderr[-2000:]
    if name not in NO_JSON:
        assert json.loads(done.stdout)


def test_the_table_holds_every_script():
    assert list(STARTS) == SCRIPTS
    assert all(start.why for start in STARTS.values() if "--help" in start.words or start.code)


def syntax(name):
    return ast.parse((FOLDER / f"{name}.py").read_text("utf-8"))


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_script_is_imported_and_reads_its_arguments(name, monkeypatch, capsys):
    """Importing starts nothing. Where a parser reads the arguments it tells of itself, and takes those of the table."""
    monkeypatch.syspath_prepend(str(FOLDER))
    module = importlib.import_module(f"benchmarks.{name}")
    assert module.__doc__ and capsys.readouterr().out == ""
    for constant in STARTS[name].constants:
        assert hasattr(module, constant), f"{name} has no {constant}"
    if "argparse" not in {alias.name for node in ast.walk(syntax(name)) if isinstance(node, ast.Import)
                          for alias in node.names}:  # fmt: skip
        return
    monkeypatch.setattr(sys, "argv", [name, "--help"])
    with pytest.raises(SystemExit) as ended:
        module.main(*(["--help"] if name == "clients" else []))
    assert ended.value.code == 0 and "usage" in capsys.readouterr().out


@pytest.mark.parametrize("name", [name for name, start in STARTS.items() if start.quick])
def test_a_short_script_starts(name, tmp_path):
    check_start(name, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, start in STARTS.items() if not start.quick])
def test_a_long_script_starts(name, tmp_path):
    check_start(name, tmp_path)


def test_a_constant_that_is_not_there_is_refused(tmp_path):
    done = started("vector_kernels", tmp_path, {"NOBODY": 1}, ["13"])
    assert done.returncode == 1 and "vector_kernels.py has no constant 'NOBODY'" in done.stderr


def test_a_script_that_writes_into_the_documentation_is_stopped(tmp_path):
    script, page = tmp_path / "script.py", ROOT / "docs" / "nobody.json"
    script.write_text(f"PAGE = {str(page)!r}\n\nif __name__ == '__main__':\n    open(PAGE, 'w').write('x')\n")
    command = [sys.executable, ROOT / "tests" / "shortened.py", script, "{}"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1 and "nobody.json is part of the sources" in done.stderr and not page.exists()
