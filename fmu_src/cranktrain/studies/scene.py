"""Scenes: TOML files that list the wanted outputs of an engine, not how it is modelled.

    engine = "diesel_i6"                 # a shipped engine, or the path of an engine file, from the scene's folder
    speeds_rpm = [2000]                  # or [run_up] with from, to (rev/min) and points
    outputs = ["pulley.torsion", "bearing.film_thickness_min"]
    frequency_hz = 600                   # highest frequency of interest
    accuracy = 0.01                      # relative, see below

    [run_up]                             # in place of speeds_rpm
    from = 1200
    to = 2400
    points = 13

    [gas]                                # a measured trace in place of the built-in one
    pressure_file = "trace.csv"
    pressure_unit = "bar"
    tdc_deg = 0
    encoder = "flywheel"                 # whose angle it belongs to; pin (default) or pulley

An output is named as the FMU names it; ``bearing.force.x`` without a number stands for those of all bearings, a name
followed by ``.orders`` for the same output (orders are part of every summary), ``stress`` for stresses of the crank,
which alone are judged by pulley torsion and the forces of the mains. Accuracy is the RMS of an output's error up to
``frequency_hz`` over the last cycle, divided by the RMS of its alternating part. Optional are ``title``,
``budget_real_time_factor`` (wall seconds per simulated second), ``cycles``, ``load`` (share of the full-load burn),
``damper`` and ``film_temperature`` (``engine``, ``heat-balance`` or ``adiabatic``, of the mains); and what is
otherwise chosen, by the outputs alone: ``block``, ``pistons`` and ``big_ends``; by the plan: ``crank``, ``bearings``,
``cutoff_hz`` (of the crank's modes), ``integrator`` and ``step_deg``. Numbers may be texts with a unit,
``frequency_hz = "0.6 kHz"``.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.text_table import split_columns
from cranktrain.core.typed_file import Table, between, measure, record
from cranktrain.core.units import RPM
from cranktrain.core.user_file import beside, ending, file_exists, folder_exists, read_toml, user_path
from cranktrain.engine.file import check_title, load_engine
from cranktrain.engine.levels import BLOCKS, CRANKS, ENCODERS, Levels
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain.studies.output_levels import bearing_ladder, lowest_levels, refuse_beyond

FINEST_ACCURACY = 1.0e-6
"""Best accuracy that can be requested: about the difference of runs with the finest step and half of it."""
COARSEST_ACCURACY = 0.5
STRESS = "stress"
"""Result that is not a time series of the running model; it requires the solid crank with all modes."""
STRESSING = ("pulley.torsion", "bearing.force.x", "bearing.force.y")
"""Outputs by which the accuracy of stresses is judged, if a scene names only ``stress``."""

_Rpm = Annotated[float, between(SLOWEST_RPM, FASTEST_RPM, "rev/min", "speed")]
_Hz = Annotated[float, measure("Hz", "frequency")]


class RunUpTable(Table, kw_only=True, rename={"first": "from", "last": "to"}):
    """Speeds of a run-up, rev/min, evenly spaced."""

    first: _Rpm
    last: _Rpm
    points: Annotated[int, between(2, 1000, "points")]

    remedy = "a run-up has from, to (rev/min) and points"


class GasTable(Table, kw_only=True):
    """A measured pressure trace in place of the built-in one."""

    pressure_file: str
    pressure_unit: str | None = None
    tdc_deg: Annotated[float, measure("deg", "angle")] | None = None
    encoder: Annotated[str, Meta(extra_json_schema={"enum": list(ENCODERS)})] = "pin"

    remedy = "[gas] names a measured trace, or is left out"


class SceneTable(Table, kw_only=True):
    """Wanted outputs of an engine; speeds by ``speeds_rpm`` or ``[run_up]``."""

    engine: str
    outputs: list[str]
    frequency_hz: _Hz
    accuracy: Annotated[
        float, measure("1", "1"), Meta(extra_json_schema={"minimum": FINEST_ACCURACY, "maximum": COARSEST_ACCURACY})
    ]
    title: str | None = None
    speeds_rpm: list[_Rpm] | None = None
    run_up: RunUpTable | None = None
    gas: GasTable | None = None
    budget_real_time_factor: Annotated[float, between(1e-4, 1e6, "wall seconds per simulated second")] | None = None
    cycles: Annotated[int, between(2, 10000, "cycles; the first ones carry the start")] | None = None
    load: Annotated[float, between(0.0, 2.0, "of the full-load burn", "1", "1")] = 1.0
    crank: Annotated[str, Meta(extra_json_schema={"enum": list(CRANKS)})] | None = None
    bearings: str | None = None
    cutoff_hz: _Hz | None = None
    integrator: str | None = None
    step_deg: Annotated[float, between(0.001, 30.0, "deg of crank angle", "angle", "deg")] | None = None
    big_ends: str | None = None
    block: Annotated[str, Meta(extra_json_schema={"enum": list(BLOCKS)})] | None = None
    pistons: str | None = None
    damper: bool = False
    film_temperature: str = "engine"

    remedy = "a scene needs engine, outputs, frequency_hz, accuracy and speeds_rpm or [run_up]"


@dataclass(frozen=True)
class Pressure:
    """Measured pressure trace of a scene: file, unit (None: by header or peak), firing dead centre (deg), encoder."""

    file: Path
    unit: str | None = None
    tdc_deg: float | None = None
    encoder: str = "pin"


@dataclass(frozen=True)
class Scene:
    """Wanted outputs of an engine (SI), checked.

    Attributes
    ----------
    name, title : the file's name without its ending, and a line for people
    path : the scene's file
    engine : the engine
    speeds : rad/s, one run each
    run_up : whether they are points of a run-up
    outputs : names of single outputs of the running model, in the order of the file
    stress : whether stresses of the crank are wanted too
    frequency : highest frequency of interest, Hz
    accuracy : allowed relative error
    budget : largest real-time factor, or None
    cycles : cycles of 720° per run, the last one is evaluated; None: until the outputs repeat
    load : fraction of the full-load burn
    crank, bearings, cutoff, integrator, step : choices of the plan fixed by the scene (Hz, rad), else None
    big_ends, block, pistons, damper : levels; those that the scene leaves open are the lowest that answer its outputs
    film_temperature : of the main bearings' films, by the engine's table or their heat balance
    pressure : measured trace, or None for the built-in one
    """

    name: str
    title: str
    path: Path
    engine: Engine
    speeds: tuple[float, ...]
    run_up: bool
    outputs: tuple[str, ...]
    stress: bool
    frequency: float
    accuracy: float
    budget: float | None = None
    cycles: int | None = None
    load: float = 1.0
    crank: str | None = None
    bearings: str | None = None
    cutoff: float | None = None
    integrator: str | None = None
    step: float | None = None
    big_ends: str = "rigid"
    block: str = "ground"
    pistons: str = "auto"
    damper: str = "none"
    film_temperature: str = "engine"
    pressure: Pressure | None = None

    @property
    def speeds_rpm(self) -> tuple[float, ...]:
        """Speeds in rev/min."""
        return tuple(speed / RPM for speed in self.speeds)


def load_scene(path: str | Path | Scene) -> Scene:
    """Read and check a scene; a :class:`Scene` is returned unchanged.

    Raises ``InputError``, one line with file and key, for anything unknown, missing, of a wrong type, or not available.
    """
    if isinstance(path, Scene):
        return path
    path = user_path(path)
    document = read_toml(path, "scene file", "give the path of a scene.toml")
    try:
        return _scene(path, document)
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(path.name) else f"{path.name}: {text}") from None


def _scene(path: Path, document: Mapping[str, Any]) -> Scene:
    """Scene of a TOML document, checked."""
    read = record(SceneTable, document)
    check_title(path.stem, "the file's name")
    title = path.stem if read.title is None else read.title
    check_title(title, "title")
    engine = load_engine(beside(path, read.engine) if ending(read.engine) == ".toml" else read.engine)
    outputs, stress = scene_outputs(engine, read.outputs)
    lowest = lowest_levels(outputs, rollers=engine.rollers_only)
    scene = Scene(
        name=path.stem,
        title=title,
        path=path,
        engine=engine,
        speeds=_speeds(read),
        run_up=read.run_up is not None,
        outputs=outputs,
        stress=stress,
        frequency=read.frequency_hz,
        accuracy=read.accuracy,
        budget=read.budget_real_time_factor,
        cycles=read.cycles,
        load=read.load,
        crank=read.crank,
        bearings=read.bearings,
        cutoff=read.cutoff_hz,
        integrator=read.integrator,
        step=None if read.step_deg is None else math.radians(read.step_deg),
        big_ends=lowest.big_ends if read.big_ends is None else read.big_ends,
        block=lowest.block if read.block is None else read.block,
        pistons=("auto" if lowest.pistons == "rigid" else lowest.pistons) if read.pistons is None else read.pistons,
        damper="fitted" if read.damper else "none",
        film_temperature=read.film_temperature,
        pressure=_pressure(path, read.gas),
    )
    _check_numbers(scene)
    _check_frequency(scene)
    _check_levels(scene)
    return scene


def _pressure(path: Path, gas: GasTable | None) -> Pressure | None:
    """Measured trace of a scene."""
    if gas is None:
        return None
    file = beside(path, gas.pressure_file)
    if not (file_exists(split_columns(file)[0]) or folder_exists(split_columns(file)[0])):
        raise InputError(f"gas.pressure_file: {file} does not exist; paths start at the scene's folder")
    return Pressure(file, gas.pressure_unit, gas.tdc_deg, gas.encoder)


def _speeds(read: SceneTable) -> tuple[float, ...]:
    """Speeds of a scene, rad/s."""
    if (read.speeds_rpm is None) == (read.run_up is None):
        both = "speeds_rpm and [run_up] exclude each other" if read.run_up else "no speeds"
        raise InputError(f"{both}; give one of them, e.g. speeds_rpm = [2000]")
    if read.run_up is None:
        speeds, where = read.speeds_rpm or [], "speeds_rpm"
        if not speeds:
            raise InputError("speeds_rpm: no speed in it; give at least one, rev/min")
    else:
        first, last, points, where = read.run_up.first, read.run_up.last, read.run_up.points, "run_up"
        if not first < last:
            raise InputError(f"run_up: from {first:g} must be less than to, {last:g} rev/min")
        speeds = [first + (last - first) * k / (points - 1) for k in range(points)]
    if len(set(speeds)) != len(speeds):
        raise InputError(f"{where}: a speed is given twice")
    return tuple(rpm * RPM for rpm in speeds)


def scene_outputs(engine: Engine, wanted: list[str]) -> tuple[tuple[str, ...], bool]:
    """Names of all single outputs of a scene's list, and True if the list contains stresses; ``InputError``."""
    from cranktrain.dynamics.outputs.register import output_counts, output_names

    known = tuple(name for name in output_names(output_counts(engine)) if not name.startswith("solver."))
    families: dict[str, list[str]] = {}
    for name in known:
        families.setdefault(re.sub(r"\[\d+\]", "", name), []).append(name)
    found: dict[str, None] = {}
    for entry in wanted:
        name = entry.removesuffix(".orders").replace("[*]", "")
        if name == STRESS:
            continue
        if name in families:
            found |= dict.fromkeys(families[name])
        elif name in known:
            found[name] = None
        else:
            raise InputError(f"outputs: {_unknown_output(engine, name, known, families)}")
    stress = STRESS in wanted
    if stress and not found:
        found = dict.fromkeys(name for family in STRESSING for name in families[family])
    if not found:
        raise InputError("outputs: is empty; name at least one, e.g. 'pulley.torsion'")
    return tuple(found), stress


def _unknown_output(engine: Engine, name: str, known: tuple[str, ...], families: Mapping[str, list[str]]) -> str:
    """Message for an output that does not exist."""
    plain = re.sub(r"\[\d+\]", "", name)
    if plain in families and "[" in name:
        members = families[plain]
        return f"'{name}' does not exist on engine '{engine.name}'; it has {members[0]} to {members[-1]}"
    return f"no output is named '{name}'; {nearest(name, (*families, *known, STRESS))}"


def _check_numbers(scene: Scene) -> None:
    """Raise ``InputError`` for numbers outside their bounds."""
    if scene.accuracy < FINEST_ACCURACY:
        raise InputError(
            f"accuracy: {scene.accuracy:g} cannot be reached: runs at the finest steps differ by about "
            f"{FINEST_ACCURACY:g} from each other; the nearest valid is {FINEST_ACCURACY:g}"
        )
    if scene.accuracy > COARSEST_ACCURACY:
        raise InputError(
            f"accuracy: {scene.accuracy:g} is more than 0.5; it is relative, 0.01 for one per cent; "
            "the nearest valid is 0.5"
        )
    lowest = 0.5 * min(scene.speeds) / (2.0 * math.pi)
    if scene.frequency < lowest:
        raise InputError(
            f"frequency_hz: {scene.frequency:g} lies below order 0.5 of {min(scene.speeds_rpm):g} rev/min; the nearest "
            f"valid is {math.ceil(100.0 * lowest) / 100.0:g}"
        )


def _check_frequency(scene: Scene) -> None:
    """Raise ``InputError`` for a frequency above the cut-off of the crank's modes."""
    kept = scene.engine.reduction.running_cutoff_hz
    if scene.cutoff is not None and not 0.0 < scene.cutoff <= kept:
        raise InputError(
            f"cutoff_hz: {scene.cutoff:g} is not within 0 to {kept:g} Hz, where engine '{scene.engine.name}' cuts its "
            "crank's modes; raise reduction.running_cutoff_hz (and fixed_modes) of its file for more"
        )
    cut = kept if scene.cutoff is None else scene.cutoff
    if scene.frequency > cut:
        if scene.frequency <= kept:
            remedy = f"or crank 'solid' with cutoff_hz = {scene.frequency:g}, which holds it"
        else:
            remedy = (
                f"or crank 'solid' with more modes: reduction.running_cutoff_hz = {scene.frequency:g} and more "
                f"fixed_modes than {scene.engine.reduction.fixed_modes} in an engine file of your own"
            )
        raise InputError(
            f"frequency_hz: {scene.frequency:g} is above the crank's cut-off; the nearest valid is {cut:g}, {remedy}"
        )


def _check_levels(scene: Scene) -> None:
    """Raise ``InputError`` for levels that do not exist, do not fit the engine, or do not provide the outputs."""
    from cranktrain.dynamics.model.settings import Settings, check_levels, resolved
    from cranktrain.dynamics.time.integrators import integrator_table
    from cranktrain.dynamics.warm_films import check_level

    rollers = scene.engine.rollers_only
    if scene.crank is not None and scene.crank not in CRANKS:
        raise InputError(f"crank: level '{scene.crank}' does not exist; {nearest(scene.crank, CRANKS)}")
    valid = tuple(bearing_ladder(rollers))
    if scene.bearings is not None and scene.bearings not in valid:
        hint = nearest(scene.bearings, valid)
        if scene.bearings in bearing_ladder(not rollers):
            hint = f"its mains are {'rollers' if rollers else 'plain bearings'}: {', '.join(valid)}"
        raise InputError(f"bearings: level '{scene.bearings}' does not exist on engine '{scene.engine.name}'; {hint}")
    settings = Settings(
        big_ends=scene.big_ends, block=scene.block, pistons=scene.pistons, damper=scene.damper,
        film_temperature=scene.film_temperature, encoder=scene.pressure.encoder if scene.pressure else "pin",
    )  # fmt: skip
    check_levels(resolved(settings, scene.engine), scene.engine)
    if scene.film_temperature != "engine":
        check_level(scene.bearings or valid[-1])
    levels = Levels(
        scene.crank or list(CRANKS)[-1], scene.bearings or valid[-1], scene.block, scene.big_ends, scene.pistons,
        scene.damper,
    )  # fmt: skip
    outputs = (*scene.outputs, STRESS) if scene.stress else scene.outputs
    refuse_beyond(levels, outputs, scene.frequency, scene.engine)
    if scene.integrator is not None:
        integrator_table(scene.integrator)
