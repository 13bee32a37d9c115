"""Families of choices, each a function that lists the entries to measure in one scene.

Families: ``integrators`` over their steps; ``adaptive`` against fixed steps; ``modes`` of the crank; ``ladder`` of the
crank and the block; ``bearings`` with table and grid; ``coupling`` to a master that sends the pressures; ``schemes`` of
one that couples the combustion; ``mesh`` of the solid crank; ``pressure``, the resolution of the trace.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from cranktrain.dynamics.model.settings import RECONSTRUCTIONS, Settings, keeps_peaks
from cranktrain.dynamics.time.integrators import integrator
from cranktrain.engine.levels import BLOCKS, CRANKS
from cranktrain.engine.model import Engine
from cranktrain_lab.coupling.modules import OWN, STAGES
from cranktrain_lab.tradeoff.case import Case
from cranktrain_lab.tradeoff.level_points import bearing_levels, level_case, numerical_entries, reference_case
from cranktrain_lab.tradeoff.measure import Entry
from cranktrain_lab.tradeoff.point import INPUT, MODEL, NUMERICAL, TOP
from cranktrain_lab.tradeoff.runs import has_combustion

Entries = list[Entry]

ALL_MODES = 1.0e6
"""Cut-off (Hz) above all stored modes."""


@dataclass(frozen=True)
class StudyScene:
    """Engine at one speed (rad/s) for comparing choices; ``settings`` are the values that are not varied.

    ``cutoff_hz`` is the cut-off of the crank's modes; None for that of the engine file.
    """

    name: str
    engine: Engine
    speed: float
    settings: Settings
    cutoff_hz: float | None = None

    @property
    def case(self) -> Case:
        """Return the case with default integrator and step in this scene."""
        return self.at(self.settings)

    def at(self, settings: Settings) -> Case:
        """Return the scene with other fidelity levels."""
        return level_case(self.engine, self.speed, settings, self.cutoff_hz)


ADAPTIVE_TOLERANCES = (1e-2, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)
ADAPTED = ("esdirk4", "esdirk5", "generalised-alpha:0.6")
LONGEST_DEG = (6.0, 12.0)
FIXED_DEG = (6.0, 4.0, 3.0, 2.5, 2.0, 1.0, 0.5, 0.25)
CUTOFFS_HZ = (500.0, 700.0, 1000.0, 1500.0, 2000.0, 3000.0, 4500.0, 6000.0, 9000.0)
MESHES = (0.030, 0.025, 0.018, 0.014, 0.011)
"""Largest element edges, m. The mesh with the last edge is the reference."""
FILM_GRIDS = ((24, 6), (32, 8), (48, 8), (64, 12))
COUPLED_DEG = (0.5, 1.0, 2.0, 4.0, 6.0, 12.0)
COUPLED_REFERENCE_DEG = 0.125
WAYS = (
    ("gauss-seidel", OWN), ("jacobi", OWN), ("jacobi", "hold"), ("jacobi", "linear"), ("jacobi", "quadratic"),
    ("gauss-seidel", "hold"), ("gauss-seidel", "linear"), ("iterative", OWN), ("iterative", "linear"),
)  # fmt: skip
"""Pairs of scheme and pressure reconstruction of the co-simulation master."""
TRACES_DEG = (0.1, 0.5, 1.0, 2.0)
TRACE_STEP_DEG = 0.25
"""Step of runs that compare pressure traces, fine enough for the orders that a coarse trace distorts."""


def integrators(scene: StudyScene, quick: bool) -> Entries:
    """Return entries of the stage solver's integrators at several steps."""
    return numerical_entries(scene.case, quick)


def adaptive(scene: StudyScene, quick: bool) -> Entries:
    """Return entries of fixed steps, and of adaptive steps as parts of a long step."""
    case = scene.case
    reference = reference_case(case, quick)
    entries: Entries = []

    def add(label: str, step: float, more: dict[str, Any], **choices: Any) -> None:
        settings = replace(_stepped(case, step), **choices)
        entries.append(Entry("adaptive", label, replace(case, settings=settings), reference, NUMERICAL, more))

    own = case.levels.integrator
    suited = [name for name in ADAPTED if keeps_peaks(name, case.levels, case.engine)]
    for name in [own] if quick else [name for name in dict.fromkeys((own, *suited)) if integrator(name).embedded]:
        for step in FIXED_DEG[1:6:2] if quick else FIXED_DEG:
            add(f"{name} {step:g}°", step, {"control": "fixed step"}, integrator=name)
        for longest in LONGEST_DEG[:1] if quick else LONGEST_DEG:
            for tolerance in ADAPTIVE_TOLERANCES[1:7:2] if quick else ADAPTIVE_TOLERANCES:
                more = {"control": f"adaptive, {longest:g}° at most", "tolerance": tolerance}
                label = f"{name} adaptive {tolerance:g}, {longest:g}° at most"
                add(label, longest, more, integrator=name, control="adaptive", tolerance=tolerance)
    return entries


def modes(scene: StudyScene, quick: bool) -> Entries:
    """Return entries of the crank's elastic modes up to a cut-off, compared with all stored modes."""
    case, more = scene.case, {"against": "all modes"}
    reference = replace(case, cutoff_hz=ALL_MODES)
    return [
        Entry("modes", f"{cutoff:g} Hz", replace(case, cutoff_hz=cutoff), reference, TOP, more)
        for cutoff in (CUTOFFS_HZ[::2] if quick else CUTOFFS_HZ)
    ]


def ladder(scene: StudyScene, quick: bool) -> Entries:
    """Return entries of crank levels, each compared with the top level and with the next finer level of the crank."""
    case = scene.case
    # Settings start from the scene's settings, because the default bearing level depends on the crank level.
    entries = _ladder(scene, "ladder", "crank", list(CRANKS), lambda level: replace(scene.settings, crank=level))
    if quick or scene.engine.block is None:
        return entries
    blocks = _ladder(
        scene, "ladder", "block", list(BLOCKS), lambda level: replace(case.settings, block=level, pistons="auto")
    )
    return entries + blocks


def bearings(scene: StudyScene, quick: bool) -> Entries:
    """Return entries of bearing levels, compared with the top and next finer level, and of table and film grids."""
    plain = not scene.engine.rollers_only
    levels = bearing_levels(scene.engine)
    if quick and plain:
        levels = levels[:3]
    case = scene.case
    entries = _ladder(scene, "bearings", "bearings", levels, lambda level: replace(case.settings, bearings=level))
    if quick or not plain:
        return entries
    solved = scene.at(replace(case.settings, bearings="reynolds"))
    finest = replace(solved, film_grid=FILM_GRIDS[-1])
    tabled = scene.at(replace(case.settings, bearings="table"))
    tabled = replace(tabled, cycles=solved.cycles)
    tables = {f"table, {name}": replace(tabled, table=name) for name in ("coarse", "default", "fine")}
    grids = {f"reynolds {m}x{n}": replace(solved, film_grid=(m, n)) for m, n in FILM_GRIDS[:-1]}
    more = {"against": "reynolds 64x12"}
    return entries + [Entry("bearings", label, own, finest, TOP, more) for label, own in (tables | grids).items()]


def coupling(scene: StudyScene, quick: bool) -> Entries:
    """Return entries of communication steps of a master that sends pressures, and of the pressures' reconstruction."""
    base = scene.case
    fine = replace(base.settings, step=math.radians(COUPLED_REFERENCE_DEG), reconstruction="linear")
    reference = replace(base, settings=fine, coupled_deg=COUPLED_REFERENCE_DEG, interval_deg=1.0)
    steps = COUPLED_DEG[1:5] if quick else COUPLED_DEG
    return [
        Entry(
            "coupling", f"{rule} {step:g}°",
            replace(base, settings=replace(base.settings, reconstruction=rule), coupled_deg=step),
            reference, INPUT,
        )
        for rule in RECONSTRUCTIONS
        if rule != STAGES
        for step in steps
    ]  # fmt: skip


def schemes(scene: StudyScene, quick: bool) -> Entries:
    """Return entries of scheme, reconstruction and communication step of the master coupled with the combustion."""
    if not has_combustion(scene.engine):
        return []
    base = scene.case

    def coupled(scheme: str, exchange: str, step: float, **choices: Any) -> Case:
        rule = "polytropic" if exchange == OWN else "hold"
        settings = replace(base.settings, reconstruction=rule)
        return replace(base, settings=settings, scheme=scheme, exchange=exchange, coupled_deg=step, **choices)

    reference = coupled("gauss-seidel", OWN, COUPLED_REFERENCE_DEG, interval_deg=1.0)
    ways = WAYS[:3] if quick else WAYS
    steps = COUPLED_DEG[1:4] if quick else COUPLED_DEG[:5]
    return [
        Entry("schemes", f"{scheme}, {exchange} {step:g}°", coupled(scheme, exchange, step), reference, INPUT)
        for scheme, exchange in ways
        for step in steps
    ]


def mesh(scene: StudyScene, quick: bool) -> Entries:
    """Return entries of the solid crank's mesh, compared with the finest mesh. Meshing is slow if nothing is cached."""
    if quick:
        return []
    case = scene.case

    def meshed(size: float) -> Case:
        crank = replace(scene.engine.crankshaft, mesh_size=size)
        return replace(case, engine=replace(scene.engine, crankshaft=crank))

    finest = meshed(MESHES[-1])
    return [
        Entry("mesh", f"{1e3 * size:g} mm", meshed(size), finest, TOP, {"mesh_size_mm": round(1e3 * size, 6)})
        for size in MESHES[:-1]
    ]


def pressure(scene: StudyScene, quick: bool) -> Entries:
    """Return entries of sampled and interpolated pressure traces, compared with the trace itself."""
    case = replace(scene.case, settings=_stepped(scene.case, TRACE_STEP_DEG), interval_deg=1.0)
    return [
        Entry(
            "pressure", f"{rule} {spacing:g}°", replace(case, trace_deg=spacing, trace_rule=rule), case, INPUT
        )
        for rule in ("spline", "linear")
        for spacing in (TRACES_DEG[2:] if quick else TRACES_DEG)
    ]  # fmt: skip


FAMILIES: dict[str, Callable[[StudyScene, bool], Entries]] = {
    "integrators": integrators,
    "adaptive": adaptive,
    "modes": modes,
    "ladder": ladder,
    "bearings": bearings,
    "coupling": coupling,
    "schemes": schemes,
    "mesh": mesh,
    "pressure": pressure,
}


def _ladder(
    scene: StudyScene, family: str, kind: str, levels: Sequence[str], settings: Callable[[str], Settings]
) -> Entries:
    """Return entries of each level, compared with the top level and, if different, with the next finer level."""
    cases = [scene.at(settings(level)) for level in levels]
    entries = []
    for k, level in enumerate(levels[:-1]):
        for place, error_kind in ((len(levels) - 1, TOP), (k + 1, MODEL)):
            pair = cases[k], cases[place]
            cycles, interval = min(case.cycles for case in pair), max(case.kept_deg for case in pair)
            own, other = (replace(case, cycles=cycles, interval_deg=interval) for case in pair)
            label = level if error_kind == TOP else f"{level} against {levels[place]}"
            more = {"ladder": kind, "against": levels[place]}
            entries.append(Entry(family, label, own, other, error_kind, more))
    return entries


def _stepped(case: Case, step_deg: float) -> Settings:
    return replace(case.settings, step=math.radians(step_deg))
