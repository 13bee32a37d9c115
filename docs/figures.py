"""Write the documents' measured tables and pictures anew: ``make figures``, or ``python docs/figures.py [PART …]``.

A part stands in its document between ``<!-- figures: PART -->`` and ``<!-- end -->`` and is what the function of that
name returns; other parts are whole pages or pictures, which their own commands write. Without names all parts run,
one after another, some for many minutes; each is written as it comes, so an interrupt keeps what is done.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import cranktrain as ct
from cranktrain.film.laws.ehd import FINE
from cranktrain.structure.crank.reduction import reduced_crankshaft
from cranktrain.studies.torsion.level_frequencies import level_frequencies

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
SHIPPED = ROOT / "fmu_src" / "cranktrain" / "studies" / "total_error" / "data"
TOTAL_PICTURES = {"diesel_i6": ("torsion", "forces", "film"), "diesel_v8": ("torsion", "axial")}
"""Families of outputs whose pictures the page of total errors shows."""
ENGINES = {"I6": "diesel_i6", "V8": "diesel_v8"}
LISTED = {"bending": 3, "torsional": 2, "axial": 1}
"""How many modes of each kind the tables of the free crankshaft list."""


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Markdown of a table of texts."""
    return "\n".join("| " + " | ".join(row) + " |" for row in [header, ["---"] * len(header), *rows])


def benchmark(name: str, *options: str) -> dict[str, Any]:
    """What one benchmark prints."""
    return dict(json.loads(python(f"benchmarks/{name}.py", *options)))


def python(*words: str) -> str:
    """Output of a Python command, run from the root."""
    return subprocess.run([sys.executable, *words], check=True, stdout=subprocess.PIPE, text=True, cwd=ROOT).stdout


def cranktrain(line: str) -> None:
    """Run ``cranktrain`` with these words from the root."""
    python("-c", "import sys; from cranktrain.cli.main import main; sys.exit(main(sys.argv[1:]))", *line.split())


# Parts of docs/ladder.md ----------------------------------------------------------------------------------------------


def beam_frequencies() -> str:
    """The beam beside the solid crank: free crankshaft, then cranktrain."""
    free, assembled = [], []
    for label, name in ENGINES.items():
        engine = ct.load_engine(name)
        report = level_frequencies(engine, "beam", reduced_crankshaft(engine))
        modes = report["crankshaft_free"]["modes"]
        for kind, count in LISTED.items():
            of_kind = [mode for mode in modes if mode["shape"] == kind][:count]
            numbers = ", ".join(str(k + 1) for k in range(len(of_kind)))
            free.append((f"{label} {kind} {numbers}", *_beside(of_kind)))
        for kind in ("torsional", "axial"):
            first = next(mode for mode in report["cranktrain"]["modes"] if mode["shape"] == kind)
            assembled.append((f"{label} {kind}", *_beside([first])))
    columns = ("solid / Hz", "beam / Hz", "deviation / %")
    return table(("free", *columns), free) + "\n\n" + table(("cranktrain", *columns), assembled)


def _beside(modes: list[dict[str, Any]]) -> tuple[str, str, str]:
    """Frequencies of the solid, of the level and deviations; a dash where the level has no such shape."""

    def listed(key: str, form: str) -> str:
        return ", ".join(format(mode[key], form) if key in mode else "–" for mode in modes)

    return listed("solid_hz", ".1f"), listed("hz", ".1f"), listed("deviation_percent", "+.1f")


def torsional_sources() -> str:
    """First torsional frequencies of the torsional crank by the source of its stiffnesses."""
    columns: list[list[str]] = []
    sources = ("solid", "solid-on-bearings", "solid-in-motion", "ker-wilson", "carter")
    for name in ENGINES.values():
        engine = ct.load_engine(name)
        solid = reduced_crankshaft(engine)
        found = []
        for source in sources:
            own = replace(engine, reduction=replace(engine.reduction, torsional_source=source))
            found.append(level_frequencies(own, "torsional", solid))
        for state in ("crankshaft_free", "cranktrain"):
            firsts = [report[state]["first_torsional"] for report in found]
            shipped = sources.index(engine.reduction.torsional_source) if state == "cranktrain" else -1
            texts = [f"{first['hz']:.1f} ({first['deviation_percent']:+.1f} %)" for first in firsts]
            texts = [f"**{text}**" if k == shipped else text for k, text in enumerate(texts)]
            columns.append([f"{firsts[0]['solid_hz']:.1f}", *texts])
    header = ["source", *(f"{label} {state} / Hz" for label in ENGINES for state in ("free", "cranktrain"))]
    names = ["solid crank itself", *(f"`{source}`" for source in sources)]
    return table(header, zip(names, *columns, strict=True))


RUNS = (
    ("rigid", "impedance"), ("torsional", "held"), ("torsional", "impedance"), ("beam", "impedance"),
    ("solid", "impedance"), ("solid", "table"), ("solid", "reynolds"),
)  # fmt: skip
ORDERS = (1.5, 4.5, 6.0)


def level_runs() -> str:
    """One run at every level: torsion and axial motion of the pulley, main bearing loads."""
    rows = []
    for crank, bearings in RUNS:
        run = ct.simulate("diesel_i6", speed_rpm=2000, crank=crank, bearings=bearings)
        torsion = run.last_cycle("pulley.torsion")[1]
        orders = run.orders("pulley.torsion")
        axial = 1e6 * _peak_to_peak(run.last_cycle("pulley.axial")[1]) if "pulley.axial" in run.outputs else 0.0
        loads = []
        for main in (1, 2, 4) if "bearing[1].force.x" in run.outputs else ():
            forces = [run.last_cycle(f"bearing[{main}].force.{axis}")[1] for axis in "xy"]
            loads.append(1e-3 * max(math.hypot(x, y) for x, y in zip(*forces, strict=True)))
        rows.append(
            (
                f"{crank}, {bearings}",
                f"{math.degrees(_peak_to_peak(torsion)):.3f}",
                ", ".join(f"{math.degrees(orders[order]):.3f}" for order in ORDERS),
                f"{axial:.0f}" if axial > 1e-6 else "–",
                ", ".join(f"{load:.0f}" for load in loads) if max(loads, default=0.0) > 0.0 else "–",
            )
        )
    listed = ", ".join(f"{order:g}" for order in ORDERS)
    header = ("crank, bearings", "torsion / deg peak to peak", f"orders {listed} / deg", "axial / um")
    return table((*header, "main 1, 2, 4 / kN"), rows)


def _peak_to_peak(values: Any) -> float:
    return float(values.max() - values.min())


# Parts of docs/benchmarks.md ------------------------------------------------------------------------------------------


def film_levels() -> str:
    """Real-time factor and errors of each level of film against itself at short steps."""
    rows = [
        (
            name,
            f"{row['real_time_factor']:.3g}",
            str(int(row["steps"])),
            f"{row['torsion_error']:.1e} / {row['axial_error']:.1e}",
            f"{max(abs(error) for error in row['least_film_error'] if error is not None):.1e}",
            f"{100.0 * row['outside_table']:.1f} %",
        )
        for name, row in benchmark("film_levels").items()
        if "real_time_factor" in row
    ]
    header = ("level", "real-time factor", "steps in two cycles", "torsion / axial", "least film", "outside the table")
    return table(header, rows)


def level_cost() -> str:
    """Cost and numerical error of each level."""
    rows = []
    for label, found in json.loads(python("-m", "benchmarks.level_cost")).items():
        level, step, method = re.fullmatch(r"(.*), ([\d.]+) deg(?:, (.*))?", label).groups()
        error, cost, ratio = found["error_of_torsion"], found["of_real_time"], found["over_impedance"]
        rows.append((level, f"{step}°", method or "usual", f"{error:.1e}", f"{cost:.4f}", f"{ratio:.2f}"))
    return table(
        ("level", "step", "integrator", "numerical error of torsion", "of real time", "over impedance, usual"), rows
    )


def elastic_cost() -> str:
    """What elastic films on all mains cost, their errors, and the parts of one film."""
    found = json.loads(python("-m", "benchmarks.elastic_cost"))
    rows = [
        (
            name,
            f"{row['of_real_time']:.1f}",
            str(row["steps"]),
            str(row["solutions"]),
            str(row["iterations"]),
            f"{row['us_per_solution']:.0f}",
            f"{100.0 * abs(row['error_of_least_gap']):.2f} / {100.0 * row['largest_error_of_least_gaps']:.2f} %",
            f"{100.0 * row['largest_error_of_pressures']:.1f} %",
            f"{100.0 * row['error_of_torsion']:.2f} %",
        )
        for name, row in {**found["cases"], **found["grids"]}.items()
    ]
    costs = ("of real time", "steps", "solutions", "Newton iterations", "µs a solution")
    errors = ("error of the least gap / of any main's", "of any main's largest pressure", "of torsion")
    fine, finest = found["reference"]["of_real_time"], found["finest grid"]["of_real_time"]
    note = f"The reference in time takes {fine:.0f} times, the finest grid {finest:.0f} times real time.\n\n"
    parts = table(("part of one film", "µs"), [(name, f"{us:.1f}") for name, us in found["parts"].items()])
    return table(("case", *costs, *errors), rows) + "\n\n" + note + parts


def film() -> str:
    """What a film costs from the impedance map and solved online."""
    found = benchmark("film")
    rows = (
        ("impedance map", f"{found['map_us']:.2f}", "1"),
        *(
            (f"solved online, {start}", f"{found[f'in_place_{key}_us']:.2f}", f"{found[f'ratio_{key}']:.0f}")
            for key, start in (("warm", "zone kept from the last state"), ("cold", "from nothing"))
        ),
    )
    error = found["force_error"]["scattered"]
    return (
        table(("film without tilt, with tangents", "µs", "ratio"), rows)
        + "\n\nForce from the map against the film solved online, eccentricities to 0.95 and any direction of squeeze: "
        + f"median {error['median']:.1e}, 95 % below {error['p95']:.1e}, worst {error['worst']:.1e}.\n"
        + f"Making the map takes {found['making_the_map_s']:.2g} s, once per start."
    )


def film_cost() -> str:
    """How the cost of films grows with grid, shapes, modes and bearings."""
    found = benchmark("film_cost", "docs/film_cost.png")
    grids, rows = found["grids"], []
    names = {"reynolds": "`reynolds`", "elastic_0_shapes": "mass-conserving, rigid bore"}
    for name in ("impedance", "table"):
        rows.append((f"`{name}`", "", *_cost(grids[name])))
    for name, cases in grids.items():
        if isinstance(cases, list):
            label = names[name] if name in names else f"mass-conserving, {name.split('_')[1]} bore shapes"
            for case in cases:
                size = "×".join(map(str, case["grid"])) + (" (in the loop)" if case["in_loop"] else "")
                rows.append((label, size, *_cost(case)))
    films = table(("film", "grid", "cost, µs", "force error", "moment error"), rows)
    shapes = {row["shapes"]: row["us"] for row in found["shapes"]}
    several = ", ".join(f"{row[-1] / row[0]:.2f} times one ({name})" for name, row in found["bearings"].items())
    levels = table(
        ("level", "integrator", "sub-steps", "evaluations", "real-time factor", "films", "rest"),
        (
            (
                *(str(value) for value in (name, row["integrator"], row["sub_steps"], row["evaluations_per_film"])),
                *(f"{row[key]:.2g}" for key in ("real_time_factor", "films", "rest")),
            )
            for name, row in found["levels"].items()
        ),
    )
    modes = table(
        ("crank modes", *(str(row["modes"]) for row in found["crank_modes"])),
        (
            (f"real-time factor, {level}", *(f"{row[level]:.2g}" for row in found["crank_modes"]))
            for level in ("impedance", "linear")
        ),
    )
    tabled = 100.0 * found["levels"]["table"].get("share_not_from_table", 0.0)
    return f"""{films}

`reynolds` counts intervals over the width, the others nodes between the ends. An elastic film on the loop's grid
costs {shapes[0]:.0f} µs with no shape of its bore, {shapes[7]:.0f} with 7 and {shapes[15]:.0f} with 15: right-hand
sides go in blocks of eight. Films of 7 equal bearings cost {several}.

The whole engine over a cycle at default settings, {found["crank_modes"][2]["modes"]} crank modes, processor seconds per
simulated second; evaluations of each film per cycle. Films called at an address are timed by a clock around their law,
the others are evaluations times cost.

{levels}

Of the films at level `table` {tabled:.1f} % lie outside the table and are solved online.

{modes}"""


def _cost(case: dict[str, Any]) -> tuple[str, str, str]:
    return f"{case['us']:.3g}", f"{case['force_error']:.2g}", f"{case['moment_error']:.2g}"


def chain() -> str:
    """Seconds from engine file to FMU, and of its first and second start."""
    found = benchmark("chain")
    stages = table(("stage", "s"), ((name, f"{seconds:.1f}") for name, seconds in found["stages_s"].items()))
    return f"""{found["usual_levels_s"]:.0f} s with an empty cache and the usual levels. With `--levels all`
{found["whole_s"]:.0f} s with an empty cache, {found["with_crankshaft_in_the_cache_s"]:.1f} s with all bodies
in it. The FMU reaches the end of its first step in {found["first_start_s"]:.3f} s, the second time in
{found["second_start_s"]:.3f} s.

{stages}"""


def fmu_overhead() -> str:
    """What a step costs through FMI beside the native one."""
    found = benchmark("fmu_overhead")
    rows = [
        (
            name,
            *(f"{found[case][key]:.0f}" for key in ("native_us", "fmu_us", "difference_us", "inputs", "outputs")),
            "yes" if found[case]["equal_to_the_bit"] else "no",
        )
        for name, case in (("on ground", "ground"), ("flexible block and damper", "whole"))
    ]
    header = ("six", "native step, µs", "through FMI, µs", "difference", "inputs", "outputs", "equal to the bit")
    start = f"A warm start reaches the end of its first step in {found['warm_start_to_first_step_s']:.2f} s."
    return f"{table(header, rows)}\n\n{start}"


def whole_engine() -> str:
    """What block, pistons and damper cost, and errors of the step."""
    return python("-m", "benchmarks.whole_engine")


def elastic_grid() -> str:
    """The second cycle of level ehd:fine on its grid and on one twice as fine both ways."""
    return elastic_grid_table(benchmark("edges", "--bearings", "ehd:fine", "--speeds", "2000", "--cycles", "1")["2000"])


def elastic_grid_table(found: dict[str, Any]) -> str:
    """What two grids give."""
    rows: list[tuple[str, ...]] = []
    for label, name, form in (
        ("torsion / mdeg peak to peak", "torsion_mdeg", ".1f"), ("least gap / um", "least_gap_um", ".2f"),
        ("largest film pressure / MPa", "film_pressure_mpa", ".0f"),
    ):  # fmt: skip
        rows.append((label, *(format(found[grid][name], form) for grid in ("loop", "fine"))))
    for label, name in (("largest force", "force_kn"), ("friction peak", "friction_nm")):
        unit = "kN" if name == "force_kn" else "N m"
        texts = [", ".join(f"{value:.3g}" for value in found[grid][name]) for grid in ("loop", "fine")]
        rows.append((f"{label} of each main / {unit}", *texts))
    grids = [f"{factor * FINE.n_phi} × {factor * FINE.n_z}" for factor in (1, 2)]
    return table(("second cycle, 2000 rev/min", *grids), rows)


def damper() -> str:
    """What the damper takes off at the V8's resonances."""
    rows = [
        (
            order.removeprefix("order "),
            f"{row['rpm']:.0f}",
            *(f"{value:.3g}" for value in row["run_deg"]),
            f"{row['run_ratio']:.4f}",
            f"{row['predicted_ratio']:.4f}",
            f"{100.0 * row['deviation']:+.2f} %",
            f"{row['power_w']:.0f}",
        )
        for order, row in benchmark("damper").items()
    ]
    header = ("order", "rev/min", "without, degrees", "with, degrees", "ratio in the run", "predicted", "deviation")
    return table((*header, "power, W"), rows)


def torsional_run_up() -> str:
    """Run-ups in the frequency domain."""
    rows = [
        (
            name,
            *(f"{row['processor_seconds'][rule]:.2f}" for rule in ("linear", "harmonic-balance")),
            f"{100.0 * row['difference']:.1f} %",
            f"{row['one_speed']:.0e}",
        )
        for name, row in benchmark("torsional_run_up").items()
    ]
    header = ("engine", "mean inertia, s", "harmonic balance, s", "difference", "from one speed alone")
    return table(header, rows)


LAWS = {
    "modes": ("a cycle", "modes of the solid crank, equal ports"),
    "ports": ("a cycle", "ports of in-line engines with equally many modes, springs as bearings"),
    "films": ("a cycle", "films solved online, engines likewise"),
    "grid": ("a cycle", "nodes of the six's films solved online"),
    "speeds": ("a run-up", "speeds"),
    "workers": ("a run-up", "workers: processor time of all"),
}
"""Of ``cost_law``: what costs, and against what."""


def cost_law() -> str:
    """How cost grows, and what 10,000 engine variants take."""
    return cost_law_text(json.loads(python("-m", "benchmarks.cost_law", "docs/cost_law.png")))


def cost_law_text(found: dict[str, Any]) -> str:
    """The tables of a run of ``benchmarks/cost_law.py``."""
    rows = []
    for name, (what, size) in LAWS.items():
        law = found[name]
        unit, scale = ("ms", 1e3) if what == "a cycle" else ("s", 1.0)
        error = "" if law["standard_error"] is None else f" ± {law['standard_error']:.2f}"
        left = "" if law["scatter"] is None else f"{100.0 * law['scatter']:.0f} %"
        sizes = ", ".join(f"{value:g}" for value in law["sizes"])
        costs = ", ".join(_digits(scale * value, 3) for value in law["seconds"])
        rows.append((size, sizes, f"{costs} {unit} {what}", f"{law['exponent']:.2f}{error}", left))
    laws = table(("against", "values", "processor time", "exponent", "left by the line"), rows)
    measured, hours = (found["variants"][key] for key in ("measured", "extrapolated"))
    structure = measured["structure"]
    each = []
    for name, row in hours.items():
        overhead, cluster = row["overhead"], row["hours_on_a_cluster_of_two"]
        each.append(
            (
                name, _digits(row["seconds_each"]), "–" if overhead is None else f"{100.0 * overhead:.0f} %",
                _digits(row["processor_hours"]), _digits(row["hours_on_one_machine_of_two"]),
                "–" if cluster is None else _digits(cluster),
                "–" if cluster is None else _digits(row["hours_on_a_cluster_of_a_hundred"]),
            )
        )  # fmt: skip
    header = ("variant", "s each", "overhead of Dask", "processor h of 10,000", "h, two processes", "h, two workers")
    variants = table((*header, "h, a hundred workers"), each)
    counts = {row["variants"] for name, row in measured.items() if name != "structure"}
    note = (
        f"Measured on {', '.join(map(str, sorted(counts)))} variants of each kind, a new solid crank "
        f"({structure['degrees_of_freedom']} degrees of freedom) once: {structure['seconds']:.0f} s."
    )
    return f"{laws}\n\n{variants}\n\n{note}"


def _digits(value: float, count: int = 2) -> str:
    """So many digits, or a whole number."""
    return f"{value:.{count}g}" if value < 10.0 ** (count - 1) else f"{value:.0f}"


def inherited_damping() -> str:
    """Resonances of torsional cranks beside those of the level above."""
    rows = []
    for name, found in benchmark("inherited_damping").items():
        above = found["beam"]["deg"]
        cases = (found[case] for case in ("beam", "torsional", "without"))
        rows.append(
            (
                f"{name}, {found['order']:g}",
                ", ".join(f"{100.0 * ratio:.1f}" for ratio in found["damping"]) + " %",
                *(
                    f"{case['deg']:.3g} at {case['rpm']:.0f} ({100.0 * (case['deg'] / above - 1.0):+.0f} %)"
                    for case in cases
                ),
            )
        )
    header = ("engine, order", "damping, modes 1 and 2", "beam", "torsional", "without inheritance")
    return table(header, rows)


# Parts of docs/fmu.md -------------------------------------------------------------------------------------------------


def coupling() -> str:
    """Errors of given pressures by rule, order and communication step."""
    found = benchmark("coupling")
    cases = {name: rows for name, rows in found.items() if name != "built-in"}
    steps = list(next(iter(cases.values())))
    rows = [
        (name, *(f"{100.0 * row['torsion']:.2g} % ({100.0 * row['mean_torque']:+.2g} %)" for row in by_step.values()))
        for name, by_step in cases.items()
    ]
    return table(("rule, order", *(f"{step}°" for step in steps)), rows)


def clients() -> str:
    """Our FMUs in other people's clients, and beside each other in one process."""
    found = benchmark("clients")
    both = [{k: row for k, row in found.items() if k.startswith("fmi3/") == new} for new in (False, True)]
    beside = benchmark("neighbours")
    ratios = ", ".join(f"{label} {row['six']:.2f} ({row['neighbour']:.2f})" for label, row in beside.items())
    note = (
        "Processor time of a step of the six with another FMU in the same process over that without, and in brackets\n"
        f"that of the other (`python benchmarks/neighbours.py`): {ratios}."
    )
    older, newer = map(_of_clients, both)
    return f"{older}\n\nFMUs of FMI 3.0 in the clients that read them:\n\n{newer}\n\n{note}"


def _of_clients(found: dict[str, dict[str, Any]]) -> str:
    """Rows of FMUs that run in the same clients."""
    names = [name for name in next(iter(found.values())) if name != "fmutool"]
    rows = []
    for fmu, row in found.items():
        cells = [f"{row[name]:.1g}" if isinstance(row[name], float) else _refusal(row[name]) for name in names]
        rows.append((f"`{fmu}`", "; ".join(row["fmutool"]) or "nothing", *cells))
    return table(("FMU", "`fmutool -check` finds", *names), rows)


def _refusal(said: str) -> str:
    """A client's last line, short where it asked for one value of an array."""
    return "refused" if "fmi3GetFloat64" in said or "Float64 not supported" in said else said


# Part of docs/combustion.md -------------------------------------------------------------------------------------------


def combustion() -> str:
    """The combustion module by itself, and its picture."""
    return python("examples/combustion.py", "docs/combustion.png")


def petrol() -> str:
    """Spark ignition of the four by itself, and its picture."""
    return python("examples/petrol.py", "docs/petrol.png")


def combustion_coupling() -> str:
    """Combustion beside the cranktrain: errors by scheme and communication step."""
    found = benchmark("combustion_coupling")
    schemes = {
        "jacobi": "both at once, angle turned on", "gauss-seidel": "cranktrain first", "late": "both at once, no turn",
    }  # fmt: skip
    steps = list(found["jacobi"])
    rows = [
        (label, *(f"{row['torsion']:.2g} ({row['mean_torque']:+.1g})" for row in found[name].values()))
        for name, label in schemes.items()
    ]
    factor = found["gauss-seidel"]["1"]["real_time_factor"]
    torque = found["reference"]
    note = (
        "Each cylinder has the volume that its own piston leaves:\n"
        f"the shaft's mean torque is {torque['mean_torque_nm']:.2f} N m where combustion indicates "
        f"{torque['indicated_nm']:.2f};\ncrank and shaft damp the rest. "
        f"Both together took {factor:.2f} s of processor time for a second at 1°, on a machine busy with other work."
    )
    return table(("scheme", *(f"{step}°" for step in steps)), rows) + "\n\n" + note


# Parts of docs/how-to/couple.md ---------------------------------------------------------------------------------------


def foreign_masters() -> str:
    """The SSP in other masters, beside the reference master."""
    found = benchmark("foreign_masters")
    rows = []
    for name, row in found.items():
        if "failed" in row:
            rows.append((name, row["failed"], *[""] * 3))
            continue
        rows.append((name, *(f"{row[what]:.1e}" for what in ("torsion", "axial", "mean_torque", "imep"))))
    header = ("master", "torsion", "axial motion", "mean shaft torque", "IMEP")
    return table(header, rows)


def coupling_cost() -> str:
    """Processor time of the coupled six by unit, in one process and supervised."""
    found = benchmark("coupling_cost")
    alone = found.pop("crank_alone")
    titles = {
        "one_process": "one process", "supervised": "supervised", "cranktrain": "cranktrain",
        "combustion": "combustion", "valvetrain": "valve train", "master": "master and record",
        "usual_method": "one process, `solver.integrator = auto`", "python": "one process, calls from Python",
        "fmi3": "one process, FMI 3.0", "fmi3_python": "one process, FMI 3.0, calls from Python",
        "intermediate": "one process, FMI 3.0, scheme `intermediate`",
        "intermediate_python": "the same, calls of the cranktrain from Python",
        "stages": "one process, FMI 3.0, scheme `stages`",
    }  # fmt: skip
    rows = [(title, *(f"{by_step[key]:.2f}" for by_step in found.values())) for key, title in titles.items()]
    note = f"The cranktrain alone with built-in gas, at communication steps of 5°: {alone:.2f}."
    return table(("processor time over simulated time", *(f"{step}°" for step in found)), rows) + "\n\n" + note


def virtual_engine() -> str:
    """Scheme and reconstruction of the reference master by communication step."""
    found = benchmark("virtual_engine")
    finest = found.pop("finest")
    steps = list(next(iter(found.values())))
    rows = [
        (
            name,
            *(
                f"{row['torsion']:.1e} ({100.0 * row['mean_torque']:+.1g} %), {row['real_time_factor']:.2f}"
                for row in by_step.values()
            ),
        )
        for name, by_step in found.items()
    ]
    swing, torque = finest["torsion_rms_mdeg"], finest["mean_torque"]
    note = f"RMS of torsion {swing:.0f} mdeg, mean torque of the shaft {torque:.0f} N m."
    return table(("scheme, reconstruction", *(f"{step}°" for step in steps)), rows) + "\n\n" + note


# Part of docs/valve_train.md ------------------------------------------------------------------------------------------


def valve_train() -> str:
    """The valve train by itself over the speed, and its picture."""
    return python("examples/valve_train.py", "docs/valve_train.png")


def valve_train_cost() -> str:
    """What the valve train's FMU costs beside the combustion's."""
    found = benchmark("valve_train")
    rows = [
        ("valve train, through FMI", f"{found['valvetrain_i6']['share_of_real_time']:.2f}"),
        ("valve train, called from Python", f"{found['native_share_of_real_time']:.2f}"),
        ("combustion, through FMI", f"{found['combustion_i6']['share_of_real_time']:.2f}"),
    ]
    coupled = found["coupled"]
    rows += [
        ("three FMUs coupled, crank torsional", f"{coupled['real_time_factor']:.2f}"),
        ("the same without valve train", f"{coupled['without']:.2f}"),
    ]
    steps = list(coupled["errors"]["jacobi"])
    errors = [
        (scheme, *(f"{row['torsion']:.2g} ({row['mean_torque']:+.1g})" for row in of_step.values()))
        for scheme, of_step in coupled["errors"].items()
    ]
    told = (
        "Of the three coupled: RMS error of the pulley's torsion over the RMS of its alternating part, in brackets\n"
        "that of the mean shaft torque, by communication step, against 0.125°. The drive rattles; its blows are what\n"
        "the steps sample."
    )
    costs = table(("the six", "processor time over simulated time"), rows)
    return f"{costs}\n\n{told}\n\n" + table(("scheme", *(f"{step}°" for step in steps)), errors)


# Part of docs/how-to/mounts.md ----------------------------------------------------------------------------------------


def mount_forces() -> str:
    """Forces of the mounts of the rigid engine beside those of a run in the flexible block, of a six and a new four."""
    from cranktrain.results.orders.harmonics import last_cycle, order_spectrum
    from cranktrain_lab.mounts.study import study

    four = ct.new_engine("four", layout="i4", bore_mm=82.0, stroke_mm=90.0, mounts=True)
    rows = []
    for engine, speeds in ((ct.load_engine("diesel_i6"), (1000.0, 1600.0)), (four, (2000.0, 4000.0))):
        for rpm in speeds:
            run = ct.simulate(engine, speed_rpm=rpm, crank="rigid", bearings="linear", block="flexible", load=1.0)
            made = study(engine, np.array([rpm * math.pi / 30.0]), 1.0)
            for o, order in enumerate(made.orders[:4]):
                rigid = np.abs(made.response.mounts[0, o, :, 1])
                found = []
                for j in range(rigid.size):
                    signal = last_cycle(run.angle, run.outputs[f"mount[{j + 1}].force.y"])
                    found.append(order_spectrum(signal, 12.0)[1][round(2.0 * order) - 1])
                pairs = (f"{rigid.min():.3g} to {rigid.max():.3g}", f"{min(found):.3g} to {max(found):.3g}")
                rows.append((engine.title, f"{rpm:.0f}", f"{order:g}", *pairs))
    return table(("engine", "rev/min", "order", "rigid engine / N", "flexible block / N"), rows)


# Whole pages and pictures ---------------------------------------------------------------------------------------------


def pages() -> None:
    """Pages that examples print."""
    for script, page in (("flexible_block", "flexible_block.md"), ("roller_stiffness", "roller_bearing.md")):
        (DOCS / page).write_text(python(f"examples/{script}.py"), "utf-8")


def pictures() -> None:
    """Pictures of demonstration, journal orbits, the start on the thrust bearing and on the mounts, and noise."""
    python("examples/demo.py")
    python("examples/thrust_start.py")
    options = "--bearings reynolds --big-ends impedance --plots out --output out/six.h5"
    cranktrain(f"simulate diesel_i6 --speed 2000 {options}")
    speeds = " ".join(map(str, range(800, 2401, 100)))
    cranktrain(
        f"noise diesel_i6 --speed {speeds} --output out/noise.h5 --plots docs --map docs/noise_map.png --at-hz 800"
    )
    for name, source in {
        "pulley.png": "pulley.png", "first_torsional_mode.png": "first_torsional_mode.png",
        "journal_orbits.png": "orbits.png",
    }.items():  # fmt: skip
        shutil.copyfile(ROOT / "out" / source, DOCS / name)
    python("examples/engine_mounts.py", "docs/examples/engine_mounts.png")
    cranktrain("mounts diesel_i6 --load 0.2 --start 300 --plots out/mounts")
    shutil.copyfile(ROOT / "out" / "mounts" / "mount_start.png", DOCS / "mount_start.png")


def studies() -> None:
    """Charts of accuracy against speed, and the stability maps."""
    python("benchmarks/tradeoff.py", "examples/six_at_2000.toml", "--output", "out/tradeoff")
    cranktrain("stability --output docs/stability --page docs/stability.md")
    for drawing in (DOCS / "stability").glob("*.svg"):
        drawing.unlink()  # the page shows the PNG
    for name in ("overall.png", "adaptive.png"):
        shutil.copyfile(ROOT / "out" / "tradeoff" / name, DOCS / "tradeoff" / name)


def first_screen() -> None:
    """The two pictures of README's first screen, from run-ups that go on where they stopped and total errors."""
    sys.path.insert(0, str(DOCS))
    import first_screen as drawn

    for name, (_, speeds) in drawn.RUN_UPS.items():
        target = drawn.result_file(ROOT, name)
        target.parent.mkdir(exist_ok=True)
        cranktrain(f"runup {name} {speeds} --output {target}")
    drawn.draw(ROOT)


# Part of docs/tradeoff.md ---------------------------------------------------------------------------------------------


def total_error() -> str:
    """What to take for a total error; ships the figures for plans and copies pictures of the last speed."""
    six, eight = ROOT / "out" / "total", ROOT / "out" / "total-v8"
    cranktrain(f"tradeoff --total --output {six}")
    cranktrain(f"tradeoff examples/v8.toml --total --output {eight}")
    return shipped_total_error(six, eight)


def shipped_total_error(*folders: Path) -> str:
    """The tables of the studies in folders, whose figures and pictures go to their places."""
    from cranktrain.studies.total_error.shipped import read

    SHIPPED.mkdir(exist_ok=True)
    tables = []
    for folder in folders:
        text = (folder / "total.json").read_text("utf-8")
        engine, (_, figures) = json.loads(text)["engine"], read(text)
        (SHIPPED / f"{engine}.json").write_text(text, "utf-8")
        last = figures.points[-1].scene.replace(" ", "-")
        for family in TOTAL_PICTURES[engine]:
            shutil.copyfile(folder / f"total-{family}-{last}.png", DOCS / "tradeoff" / f"total-{family}-{engine}.png")
        tables += total_tables(figures.points)
    return "\n\n".join(tables)


def total_tables(points: Sequence[Any]) -> list[str]:
    """What to take for an accuracy, and the default, scene by scene."""
    from cranktrain.studies.total_error.point import at_scene
    from cranktrain_lab.tradeoff.total_choice import HEADER, default_rows, rate, table_rows

    parts = []
    for scene in dict.fromkeys(point.scene for point in points):
        own = at_scene(points, scene)
        parts.append(table((scene, *HEADER[1:]), table_rows(own)))
        default = next((p for p in own if p.default), None)
        if default is not None:
            title = f"default: {default.label}, {rate(default.cost)}"
            header = (title, "total", "model", "numerical", "settling", "cheaper and at least as close")
            parts.append(table(header, default_rows(own)))
    return parts


# Part of docs/peers.md ------------------------------------------------------------------------------------------------


def peers() -> str:
    """Other people's programs beside ours."""
    return peers_text(json.loads(python("-m", "benchmarks.peers")))


def peers_text(found: dict[str, Any]) -> str:
    """The tables of a run of ``benchmarks/peers.py``."""
    rows, settings, notes = [], [], []
    for name, one in found.items():
        if "absent" in one:
            rows.append((name, f"absent: {one['absent']}", *[""] * 4))
            continue
        cases = one["at_equal_error"] if "at_equal_error" in one else [one | {"error": None}]
        for k, case in enumerate(cases):
            program = (f"**{one['program']}**", f"{one['compared']}; {one['cost']}") if k == 0 else ("", "")
            ratio = "–" if case["ratio"] is None else f"**{_digits(case['ratio'])}**"
            asked = "rounding" if case["error"] is None else f"{case['error']:g}"
            rows.append((*program, asked, *(_time(case[key]) for key in ("other_s", "own_s")), ratio))
        for side, label in (("other", one["program"]), ("own", f"ours beside {one['program'].split()[0]}")):
            points = one.get(side, [])
            texts = (f"{point['setting']}: {point['error']:.1e}, {_time(point['seconds'])}" for point in points)
            if points:
                settings.append((label, "; ".join(texts)))
        apart = "; ".join(
            f"{key.replace('_', ' ')} {one[key]:.1e}"
            for key in one
            if key.startswith(("difference", "mean_inertia", "torsion_under"))
        )
        notes.append(f"* **{one['program']}**: {one['not_comparable']}.{f' Measured: {apart}.' if apart else ''}")
        notes += [f"    * failed: {label}: {why}" for label, why in one.get("failed", {}).items()]
    header = ("program", "compared; cost", "error", "theirs", "ours", "theirs over ours")
    points = table(("", "settings: error, cost"), settings)
    return f"{table(header, rows)}\n\n{points}\n\n" + "\n".join(notes)


def _time(seconds: float | None) -> str:
    """With three digits and a unit; a dash where no setting is as good."""
    if seconds is None:
        return "–"
    for unit, scale in (("s", 1.0), ("ms", 1e3), ("µs", 1e6)):
        if seconds * scale >= 1.0 or unit == "µs":
            return f"{seconds * scale:.3g} {unit}"
    return ""


# Part of docs/native.md -----------------------------------------------------------------------------------------------


def native_fmu() -> str:
    """What a native FMU costs beside its kernels, and the Python FMU beside it."""
    return native_table(benchmark("native_fmu"))


def native_table(found: dict[str, Any]) -> str:
    """The table of a run of ``benchmarks/native_fmu.py``."""
    python, rows = found.pop("python_fmu", None), []
    processors = found.pop("processors")
    for name, row in found.items():
        steps = row["step_time_over_length"]["2.5 deg"]["wall"]
        rows.append(
            (
                f"`{name}`", f"{row['kernel_us']:.1f} µs", f"{100.0 * (row['step_over_kernel'] - 1.0):.1f} %",
                f"{row['set_get_us']:.2f} µs", f"{row['get_all_us']:.2f} µs ({row['outputs']:.0f})",
                f"{row['first_step_ms']:.0f} ms", f"{row['two_threads_over_one']:.2f}",
                ", ".join(f"{steps[key]:.2g}" for key in ("median", "of_ten_thousand", "largest")),
            )
        )  # fmt: skip
    header = (
        "FMU", "kernel of a 1° step", "doStep more than it", "set of 20 and get of 40 values",
        "get of all outputs", "load to first step", f"two threads over one, {processors} processors",
        "wall time of a 2.5° step over its length: median, 99.99 %, largest",
    )  # fmt: skip
    note = "" if python is None else (
        f"\n\nPython FMU of the six: set, step and get {python['fmu_us']:.0f} µs, of which "
        f"{python['difference_us']:.0f} µs beyond the simulation; {python['first_step_s']:.1f} s to the first step."
    )  # fmt: skip
    return table(header, rows) + note


def native_build() -> str:
    """Size of each native FMU, its variables, and how soon it is built once bodies are kept."""
    return native_build_table(benchmark("native_build"))


def native_build_table(found: dict[str, Any]) -> str:
    """The table of a run of ``benchmarks/native_build.py``."""
    rows = [
        (
            " ".join([f"`{row['file']}`", *(f"`{option}`" for option in name.split()[1:])]),
            f"{row['megabytes']:.1f} MB", *(str(row[f"{cause}s"]) for cause in ("input", "output", "parameter")),
            f"{row['binary_megabytes']:.2f} MB", f"{row['data_megabytes']:.2f} MB", f"{row['processor_seconds']:.1f} s",
        )
        for name, row in found.items()
    ]  # fmt: skip
    header = (
        "FMU", "size", "inputs", "outputs", "parameters", "binary, unpacked", "data, unpacked",
        "processor time of the build",
    )  # fmt: skip
    return table(header, rows)


# Part of docs/how-to/real_time.md -----------------------------------------------------------------------------------


def real_time() -> str:
    """Times of steps of a millisecond over their length, by engine and levels."""
    return real_time_table(benchmark("real_time"))


def real_time_table(found: dict[str, Any]) -> str:
    """The table of a run of ``benchmarks/real_time.py``."""
    rows, pause = [], found.pop("still")
    for name, of_engine in found.items():
        least, most = of_engine["speeds_rpm"]
        for title, one in ((key, value) for key, value in of_engine.items() if isinstance(value, dict)):
            label = f"limited to {one['limit']:.0f}" if "limit" in one else title
            own, wall = one["processor"], one["wall"]["largest"]
            cells = [f"{own[key]:.2f}" for key in ("median", "of_a_thousand", "of_ten_thousand", "largest")]
            holds = "yes" if own["largest"] <= 0.5 else "99.99 %" if own["of_ten_thousand"] <= 0.5 else "no"
            work = ", ".join(f"{one['iterations'][key]:.0f}" for key in ("median", "largest"))
            rows.append((f"`{name}`, {least} to {most}", label, *cells, f"{wall:.1f}", work, holds))
    header = (
        "engine, rev/min", "levels", "median", "99.9 %", "99.99 %", "largest", "largest, wall",
        "iterations: median, largest", "holds 1 kHz with a margin of two",
    )  # fmt: skip
    note = f"The longest pause of an empty loop in the time of 10⁵ steps was {pause:.1f} steps."
    return f"{table(header, rows)}\n\n{note}"


MADE: dict[str, tuple[str, Callable[[], str]]] = {
    "beam_frequencies": ("ladder.md", beam_frequencies),
    "torsional_sources": ("ladder.md", torsional_sources),
    "level_runs": ("ladder.md", level_runs),
    "level_cost": ("benchmarks.md", level_cost),
    "elastic_cost": ("benchmarks.md", elastic_cost),
    "film_levels": ("benchmarks.md", film_levels),
    "film": ("benchmarks.md", film),
    "film_cost": ("benchmarks.md", film_cost),
    "chain": ("benchmarks.md", chain),
    "fmu_overhead": ("benchmarks.md", fmu_overhead),
    "elastic_grid": ("benchmarks.md", elastic_grid),
    "whole_engine": ("benchmarks.md", whole_engine),
    "damper": ("benchmarks.md", damper),
    "torsional_run_up": ("benchmarks.md", torsional_run_up),
    "coupling": ("fmu.md", coupling),
    "clients": ("fmu.md", clients),
    "combustion": ("combustion.md", combustion),
    "combustion_coupling": ("combustion.md", combustion_coupling),
    "petrol": ("combustion.md", petrol),
    "foreign_masters": ("how-to/couple.md", foreign_masters),
    "coupling_cost": ("how-to/couple.md", coupling_cost),
    "virtual_engine": ("how-to/couple.md", virtual_engine),
    "valve_train": ("valve_train.md", valve_train),
    "valve_train_cost": ("valve_train.md", valve_train_cost),
    "total_error": ("tradeoff.md", total_error),
    "native_fmu": ("native.md", native_fmu),
    "native_build": ("fmu.md", native_build),
    "real_time": ("how-to/real_time.md", real_time),
    "cost_law": ("benchmarks.md", cost_law),
    "peers": ("peers.md", peers),
    "mount_forces": ("how-to/mounts.md", mount_forces),
    "inherited_damping": ("decisions/0021-modes-in-motion.md", inherited_damping),
}
"""Document and maker of each part that stands between marks."""
WHOLE: dict[str, Callable[[], None]] = {
    "pages": pages, "pictures": pictures, "studies": studies, "first_screen": first_screen
}  # fmt: skip
"""Makers of what is written as a whole."""


def put(document: Path, part: str, text: str) -> None:
    """Replace a part of a document; ``ValueError`` where its marks are missing."""
    before = document.read_text("utf-8")
    marks = re.compile(rf"(<!-- figures: {part} -->\n).*?(<!-- end -->)", re.DOTALL)
    after, count = marks.subn(lambda found: f"{found[1]}\n{text.strip()}\n\n{found[2]}", before)
    if count != 1:
        raise ValueError(f"{document.name} has {count} places marked '<!-- figures: {part} -->' to '<!-- end -->'")
    document.write_text(after, "utf-8")


def main(*parts: str) -> int:
    """Make the named parts, or all."""
    valid = [*MADE, *WHOLE]
    if unknown := [part for part in parts if part not in valid]:
        print(f"figures: part '{unknown[0]}' does not exist; valid: {', '.join(valid)}", file=sys.stderr)
        return 2
    for part in parts or valid:
        print(f"figures: {part}", file=sys.stderr, flush=True)
        if part in WHOLE:
            WHOLE[part]()
        else:
            document, make = MADE[part]
            put(DOCS / document, part, make())
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
