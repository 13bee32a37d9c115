"""The verb ``roller``: one cylindrical roller bearing by its dimensions, or those of an engine's mains."""

import math
import warnings
from dataclasses import dataclass, replace
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cranktrain.cli.console import say, show_rows
from cranktrain.cli.functions import verb_alone
from cranktrain.core.errors import InputError, nearest
from cranktrain.core.typed_file import between
from cranktrain.engine.model import Engine
from cranktrain.engine.roller_bearing import (
    CONTACT_LAWS,
    RATED_PRESSURE,
    RollerBearing,
    check_roller_bearing,
    iso_profile,
    main_roller,
)
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question

if TYPE_CHECKING:
    from cranktrain.film.laws.roller_contacts import LoadedBearing

FILLED = 0.85
"""Ratio of roller diameter to roller spacing, used if no pitch diameter is given."""
OF_ENGINE = ("rollers", "length_mm", "roller_diameter_mm", "pitch_mm", "clearance_um")
"""Options for values that an engine file contains."""

DESCRIPTION = """\
Cylindrical roller bearing: deflection, roller loads, radial and tilting stiffness.

Under a radial load, rollers between rigid rings, Hertzian line contacts at both rings:
  palmgren   delta = 3.84e-5 Q^0.9/l^0.8 per contact (mm, N), two contacts in series (default)
  iso16281   Q = 35948 l^(8/9) delta^(10/9), both contacts together (ISO/TS 16281)

Clearance is the diametral radial clearance of the standards (ISO 5753), the whole play from side to side; negative:
preload. --profile none (straight rollers, default), iso16281 (logarithmic, by the standard's parameter) or that
parameter itself; a profile needs --roller-diameter-mm. --position: a roller on the load line (default), or two on
either side of it. The roller's length is the effective one. Without --roller-diameter-mm rollers are as thick as they
are long, without --pitch-mm they fill 85 % of their circle; both affect only pressure, travel and ring.

Results:
  deflection_um              of both contacts in series: the journal's displacement along the load less half the
                             clearance
  q_max_n                    load of the most loaded roller
  stiffness_n_per_mm         tangent dF/d delta along the load, at the load
  tilt_stiffness_nm_per_rad  derivative of the moment by the tilt in the plane of the load
  displacement_um            of the journal from the middle, including the free play
  tilt_mrad                  in the plane of the load, under --moment-nm
  loaded_rollers, load_factor Q_max Z/F (null without load), pressure_mpa (largest, Hertz, at the inner ring)
  travel_um                  approach of both contacts at the static load rating (ISO 76: 4000 MPa); half the clearance
                             may not exceed it
  stiffness_variation        relative change of the stiffness as the rollers move by half their pitch
  many_rollers               the same by Sjovall's integral: rollers infinitely close, straight, without moment

--ring adds "ring": radial and tilting stiffness with an elastic outer ring and housing (finite elements), the rollers
as linear springs with their stiffness at the load. With --engine the bearings are those of the engine's [main_roller],
each under the same load, with their rings; "mains" has one entry for each.

--engine with --speed instead of --load-n: the rollers in a run at full load in the engine's default block. Results are
their mean stiffness over a settled cycle, along and across the load, in axes that turn with the crank and in axes at
rest; and the stand-in springs for level linear, 'modal' and 'identify', which yield on average as the rollers do, in
series with the elastic stiffness of the free crankshaft at the journal. --output writes an engine file with them.
"""


@dataclass(frozen=True, kw_only=True)
class Roller(Question):
    """Question of :func:`roller`."""

    rollers: Annotated[int | None, Option("Z", "number of rollers, at least 3")] = None
    length_mm: Annotated[float | None, Option("MM", "effective length of a roller")] = None
    roller_diameter_mm: Annotated[float | None, Option("MM", "diameter of a roller (default: its length)")] = None
    pitch_mm: Annotated[float | None, Option("MM", "pitch diameter, on which the rollers' axes lie")] = None
    clearance_um: Annotated[float | None, Option("UM", "diametral radial clearance (default 0)")] = None
    engine: Annotated[
        words.File | Engine | None,
        Option("ENGINE", "bearings of this engine's [main_roller] instead of the options above"),
    ] = None
    load_n: Annotated[
        float | None,
        between(0.0, 1.0e9, "N; give its size, the direction does not count"),
        Option("N", "radial load, N", was="--load"),
    ] = None
    speed_rpm: Annotated[
        words.Rpm | None, Option("RPM", "with --engine instead of --load-n: speed of a run, rev/min", "--speed")
    ] = None
    output: Annotated[
        words.File | None,
        Option("FILE", "with --speed: new engine file with the stand-ins; nothing is overwritten", was="--out"),
    ] = None
    moment_nm: Annotated[float, Option("NM", "moment in the plane of the load (default 0)")] = 0.0
    law: Annotated[
        Literal["palmgren", "iso16281"] | None,
        Option("LAW", f"{' or '.join(CONTACT_LAWS)} (default palmgren, or the engine's)", words=tuple(CONTACT_LAWS)),
    ] = None
    profile: Annotated[str | None, Option("KIND", "none, iso16281 or a number (default none, or the engine's)")] = None
    position: Annotated[Literal["roller", "between"], Option("WHERE", "roller (default) or between")] = "roller"
    slices: Annotated[int, between(2, 500, "Gauss points"), Option("N", "Gauss points along a roller (default 30)")] = (
        30
    )
    ring: Annotated[bool, Option(help="also outer ring and housing in finite elements")] = False
    anew: Annotated[bool, Option(help="compute rings even where stored ones exist", was="--rebuild")] = False


@verb_alone(Roller, DESCRIPTION)
def roller(ask: Roller) -> VerbResult:
    """Solve one bearing, or the main bearings of an engine; ``InputError`` for impossible dimensions."""
    if ask.speed_rpm is not None:
        return _running(ask, ask.speed_rpm)
    if ask.output is not None:
        raise InputError("--output goes with --speed, which derives the values that it writes; leave it out")
    if ask.load_n is None:
        raise InputError("--load-n is missing; give the radial load in N, or --speed with --engine")
    if ask.engine is not None:
        return _mains(ask, ask.engine)
    bearing = _given(ask)
    title = f"Roller bearing, {bearing.rollers} rollers, contacts by {bearing.law}, {ask.load_n:g} N"
    return VerbResult.of(_solved(bearing, ask, ask.ring), "bearing roller", title=title)


def show(found: VerbResult) -> None:
    """Print the results of one bearing, or of several side by side."""
    _print(found.beside["title"], found.get("mains", [found]), _RUNNING if "periodic" in found else _ROWS)


def _running(ask: Roller, speed_rpm: float) -> VerbResult:
    """Roller bearings over a cycle of the running engine, and the stand-in springs derived from them."""
    from cranktrain.engine.file import load_engine
    from cranktrain.store.engine_text import new_path
    from cranktrain.studies.roller_stand_ins import running_rollers, with_stand_ins

    if ask.engine is None:
        raise InputError("--speed runs an engine; name it by --engine, or give --load-n instead of --speed")
    for name in (*OF_ENGINE, "load_n", "law", "profile"):
        if getattr(ask, name) is not None:
            raise InputError(f"--{name.replace('_', '-')}: the engine gives it; leave it or --speed out")
    new = None if ask.output is None else new_path(Path(ask.output))
    engine = load_engine(ask.engine)
    report = running_rollers(engine, speed_rpm, say=lambda stage: say(f"cranktrain: {stage}"))
    report["file"] = None if new is None else str(with_stand_ins(ask.engine, new, report))
    if not report["periodic"]:
        warnings.warn("the motion is not periodic at this speed; means are taken over one cycle", stacklevel=2)
    if new is not None:
        say(f"{new} written")
    title = f"{report['engine']}: main roller bearings at {speed_rpm:g} rev/min, full load"
    return VerbResult.of(report, "bearing roller", title=title)


def _given(ask: Roller) -> RollerBearing:
    """Bearing with the dimensions from the command line."""
    if ask.rollers is None or ask.length_mm is None:
        missing = "--rollers" if ask.rollers is None else "--length-mm"
        raise InputError(f"{missing} is missing; give --rollers and --length-mm, or --engine")
    if ask.rollers < 3:
        raise InputError(f"--rollers {ask.rollers} is too few to centre a journal; give at least 3")
    length = 1e-3 * ask.length_mm
    diameter = length if ask.roller_diameter_mm is None else 1e-3 * ask.roller_diameter_mm
    pitch = diameter / (FILLED * math.sin(math.pi / ask.rollers))
    bearing = RollerBearing(
        rollers=ask.rollers,
        length=length,
        diameter=diameter,
        pitch=pitch if ask.pitch_mm is None else 1e-3 * ask.pitch_mm,
        clearance=1e-6 * (ask.clearance_um or 0.0),
        law=ask.law or "palmgren",
    )
    bearing = _profiled(bearing, ask, ask.roller_diameter_mm is not None)
    names = {"rollers": "--rollers", "length": "--length-mm", "diameter": "--roller-diameter-mm", "pitch": "--pitch-mm",
             "clearance": "--clearance-um", "profile": "--profile"}  # fmt: skip
    try:
        check_roller_bearing(bearing)
    except InputError as error:
        key, text = str(error).split(": ", 1)
        raise InputError(f"{names.get(key, key)}: {text}") from None
    return bearing


def _profiled(bearing: RollerBearing, ask: Roller, diameter_known: bool) -> RollerBearing:
    """Bearing with the roller profile from the options, if one is given."""
    if ask.profile is None:
        return bearing
    if ask.profile == "none":
        return replace(bearing, profile=0.0)
    if not diameter_known:
        raise InputError(f"--profile {ask.profile} needs --roller-diameter-mm, on which the profile depends")
    if ask.profile == "iso16281":
        return replace(bearing, profile=iso_profile(bearing.length, bearing.diameter))
    try:
        return replace(bearing, profile=float(ask.profile))
    except ValueError:
        valid = ("none", "iso16281")
        raise InputError(
            f"--profile '{ask.profile}' is neither a number nor a known profile; {nearest(ask.profile, valid)}"
        ) from None


def _mains(ask: Roller, named: str | Path | Engine) -> VerbResult:
    """Results of an engine's main bearings; equal bearings are solved once."""
    from cranktrain.engine.file import load_engine
    from cranktrain.studies.roller_stand_ins import required_rollers

    for name in OF_ENGINE:
        if getattr(ask, name) is not None:
            raise InputError(f"--{name.replace('_', '-')}: the engine file gives it; leave it or --engine out")
    engine = load_engine(named)
    rollers = required_rollers(engine)
    solved: dict[RollerBearing, dict[str, Any]] = {}
    mains = []
    for i in range(len(rollers.rollers)):
        bearing = _profiled(main_roller(rollers, i), ask, True)
        if ask.law is not None:
            bearing = replace(bearing, law=ask.law)
        if bearing not in solved:
            check_roller_bearing(bearing)
            solved[bearing] = _solved(bearing, ask, True)
        linear = {
            "stiffness_n_per_mm": 1e-3 * rollers.stiffness[i],
            "tilt_stiffness_nm_per_rad": rollers.tilt_stiffness[i],
        }
        mains.append({"main": engine.roller_mains[i] + 1, **solved[bearing], "engine_file": linear})
    law = next(iter(solved)).law
    title = f"{engine.title}: main roller bearings, {ask.load_n:g} N on each, contacts by {law}"
    return VerbResult.of({"engine": engine.name, "load_n": ask.load_n, "mains": mains}, "bearing roller", title=title)


def _solved(bearing: RollerBearing, ask: Roller, with_ring: bool) -> dict[str, Any]:
    """All results of one bearing."""
    import numpy as np

    from cranktrain.film.laws.roller_contacts import equilibrium, many_rollers

    half, lever, load_n = math.pi / bearing.rollers, 0.5 * bearing.length, ask.load_n or 0.0
    load = np.array([load_n, 0.0, ask.moment_nm / lever, 0.0])
    first, other = (half, 0.0) if ask.position == "between" else (0.0, half)
    loaded = equilibrium(bearing, load, first, ask.slices)
    moved = equilibrium(bearing, load, other, ask.slices)
    free = max(0.5 * bearing.clearance, 0.0) / math.cos(first)
    deflection, q_max = max(float(loaded.place[0]) - free, 0.0), float(loaded.loads.max())
    stiffness = abs(float(loaded.stiffness[0, 0]))  # no load: not a negative zero
    many = many_rollers(bearing, load_n) if load_n > 0.0 else (0.0, 0.0)
    # Preloaded rollers have approached before the load comes.
    preload = min(0.5 * bearing.clearance, 0.0) if load_n > 0.0 else 0.0
    result: dict[str, Any] = {
        "deflection_um": 1e6 * deflection if load_n > 0.0 else 0.0,
        "q_max_n": q_max,
        "stiffness_n_per_mm": 1e-3 * stiffness,
        "tilt_stiffness_nm_per_rad": abs(float(loaded.stiffness[2, 2])) * lever**2,
        "displacement_um": 1e6 * float(loaded.place[0]),
        "tilt_mrad": 1e3 * float(loaded.place[2]) / lever if ask.moment_nm else 0.0,
        "loaded_rollers": int((loaded.loads > 1.0e-9 * q_max).sum()),
        "load_factor": q_max * bearing.rollers / load_n if load_n > 0.0 else None,
        "pressure_mpa": 1e-6 * loaded.pressure,
        "travel_um": 1e6 * bearing.travel,
        "stiffness_variation": float(moved.stiffness[0, 0]) / stiffness - 1.0 if stiffness > 0.0 else None,
        "many_rollers": {"deflection_um": 1e6 * (many[0] + preload), "q_max_n": many[1]},
    }
    if loaded.pressure > RATED_PRESSURE:
        warnings.warn(
            f"contact pressure {1e-6 * loaded.pressure:.0f} MPa is beyond the static rating, 4000 MPa: rollers would "
            "dent their tracks",
            stacklevel=2,
        )
    if with_ring:
        result["ring"] = _ring(bearing, loaded, first, ask)
    return result


def _ring(bearing: RollerBearing, loaded: "LoadedBearing", first: float, ask: Roller) -> dict[str, float]:
    """Stiffness of the bearing on its elastic outer ring, and the ring's mass."""
    from cranktrain.film.laws.roller_contacts import roller_slices, slice_stiffness
    from cranktrain.structure.block.roller_ring import elastic_ring_stiffness, ring_compliance, ring_for

    ring = ring_for(bearing)
    compliance = ring_compliance(ring, first, lambda stage: say(f"cranktrain: {stage}"), ask.anew)
    springs = slice_stiffness(bearing, loaded.place, first, ask.slices)
    stiffness = elastic_ring_stiffness(compliance, roller_slices(bearing, ask.slices)[0], springs, first)
    return {
        "stiffness_n_per_mm": 1e-3 * float(stiffness[0, 0]),
        "tilt_stiffness_nm_per_rad": float(stiffness[2, 2]) * (0.5 * bearing.length) ** 2,
        "ring_mass_kg": ring.ring_mass,
    }


def _print(title: str, results: list[dict[str, Any]], shown: "Rows") -> None:
    """Print the results of several bearings side by side: the rows of which the first bearing has a value."""
    rows = []
    for name, (key, *parts), form in shown:
        if key in results[0] and (key != "tilt_mrad" or any(result[key] for result in results)):
            values = [reduce(getitem, parts, result[key]) for result in results]
            rows.append((name, *("-" if value is None else format(value, form) for value in values)))
    heads = tuple(f"main {result['main']}" if "main" in result else "result" for result in results)
    show_rows(title, ("value", *heads), rows)


Rows = tuple[tuple[str, tuple[str, ...], str], ...]
_RADIAL, _TILTING = "stiffness_n_per_mm", "tilt_stiffness_nm_per_rad"
_ROWS: Rows = (
    ("deflection / um", ("deflection_um",), ".4g"),
    ("  many straight rollers / um", ("many_rollers", "deflection_um"), ".4g"),
    ("displacement / um", ("displacement_um",), ".4g"),
    ("most loaded roller / N", ("q_max_n",), ".4g"),
    ("  many straight rollers / N", ("many_rollers", "q_max_n"), ".4g"),
    ("loaded rollers", ("loaded_rollers",), ".4g"),
    ("largest pressure / MPa", ("pressure_mpa",), ".4g"),
    ("radial stiffness / (N/mm)", (_RADIAL,), ".6g"),
    ("  change by half a pitch", ("stiffness_variation",), "+.2%"),
    ("tilting stiffness / (N m/rad)", (_TILTING,), ".6g"),
    ("tilt / mrad", ("tilt_mrad",), ".4g"),
    ("radial, elastic ring / (N/mm)", ("ring", _RADIAL), ".6g"),
    ("tilting, elastic ring / (N m/rad)", ("ring", _TILTING), ".6g"),
    ("radial, engine file / (N/mm)", ("engine_file", _RADIAL), ".6g"),
    ("tilting, engine file / (N m/rad)", ("engine_file", _TILTING), ".6g"),
)
"""Rows of the table: title, key of the result, format."""
_TANGENT = "tangent_n_per_mm"
_RUNNING: Rows = (
    ("load / N: mean", ("load_n", "mean"), ".4g"),
    ("  largest", ("load_n", "largest"), ".4g"),
    ("fraction of the cycle under load", ("loaded_fraction",), ".3f"),
    ("radial tangent / (N/mm): mean", (_TANGENT, "mean"), ".6g"),
    ("  median", (_TANGENT, "median"), ".6g"),
    ("  along the load", (_TANGENT, "along_load"), ".6g"),
    ("  across the load", (_TANGENT, "across_load"), ".6g"),
    ("  turning with the crank, x", (_TANGENT, "turning", "x"), ".6g"),
    ("  turning with the crank, y", (_TANGENT, "turning", "y"), ".6g"),
    ("  at rest, x", (_TANGENT, "at_rest", "x"), ".6g"),
    ("  at rest, y", (_TANGENT, "at_rest", "y"), ".6g"),
    ("crankshaft there / (N/mm)", ("crank_n_per_mm",), ".6g"),
    ("stand-in, radial / (N/mm)", ("stand_in", _RADIAL), ".6g"),
    ("  engine file", ("engine_file", _RADIAL), ".6g"),
    ("tilting tangent / (N m/rad): mean", ("tilt_tangent_nm_per_rad", "mean"), ".6g"),
    ("stand-in, tilting / (N m/rad)", ("stand_in", _TILTING), ".6g"),
    ("  engine file", ("engine_file", _TILTING), ".6g"),
)
"""Rows of the table of bearings over a running cycle."""
