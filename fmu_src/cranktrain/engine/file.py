"""Engine files: TOML in which every value states its unit and where it comes from.

One table per dataclass of :mod:`cranktrain.engine.model`; an entry reads

    throw = { value = 60, unit = "mm", origin = "derived", note = "half the stroke" }

``value`` may be a list. ``origin`` is *chosen*, *derived*, *calibrated* or *published*; the last two need a note that
says to which number. Everything is converted to SI here, once, and checked. Keys and tables whose field has a
default may be left out.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import fields
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from cranktrain.core.errors import InputError, nearest
from cranktrain.engine.checks.block import check_block, check_mounts
from cranktrain.engine.checks.crankshaft import check_balance_weights, check_crankshaft, in_mm
from cranktrain.engine.checks.cylinder import Rule, cylinder_rules
from cranktrain.engine.checks.damper import damper_rules
from cranktrain.engine.model import Engine, optional_fields
from cranktrain.engine.parts import Oil, PlainBearing
from cranktrain.engine.quantities import Quantity
from cranktrain.engine.roller_bearing import check_rollers

GROOVES = ("none", "circumferential")
VISCOSITY_LAWS = ("vogel", "walther")
TORSIONAL_SOURCES = ("solid", "solid-on-bearings", "ker-wilson", "carter")
PRESSURE_LAWS = ("none", "barus", "roelands")
ORIGINS = ("chosen", "derived", "calibrated", "published")
ENTRY = ("value", "unit", "origin", "note")
TEXTS = ("name", "title")

# unit: (dimension, factor to SI, offset in SI); frequencies stay in Hz
UNITS: dict[str, tuple[str, float, float]] = {
    "1": ("1", 1.0, 0.0),
    "%": ("1", 0.01, 0.0),
    "m": ("length", 1.0, 0.0),
    "mm": ("length", 1e-3, 0.0),
    "um": ("length", 1e-6, 0.0),
    "rad": ("angle", 1.0, 0.0),
    "deg": ("angle", math.pi / 180.0, 0.0),
    "m/s": ("velocity", 1.0, 0.0),
    "kg": ("mass", 1.0, 0.0),
    "g": ("mass", 1e-3, 0.0),
    "kg m^2": ("inertia", 1.0, 0.0),
    "kg/m^3": ("density", 1.0, 0.0),
    "Pa": ("pressure", 1.0, 0.0),
    "kPa": ("pressure", 1e3, 0.0),
    "bar": ("pressure", 1e5, 0.0),
    "MPa": ("pressure", 1e6, 0.0),
    "GPa": ("pressure", 1e9, 0.0),
    "N/m": ("stiffness", 1.0, 0.0),
    "N/mm": ("stiffness", 1e3, 0.0),
    "N s/m": ("damping", 1.0, 0.0),
    "N m/rad": ("torsional stiffness", 1.0, 0.0),
    "N m s/rad": ("torsional damping", 1.0, 0.0),
    "Pa s": ("viscosity", 1.0, 0.0),
    "mPa s": ("viscosity", 1e-3, 0.0),
    "m^2/s": ("kinematic viscosity", 1.0, 0.0),
    "mm^2/s": ("kinematic viscosity", 1e-6, 0.0),
    "1/Pa": ("pressure coefficient", 1.0, 0.0),
    "1/GPa": ("pressure coefficient", 1e-9, 0.0),
    "J/(kg K)": ("heat capacity", 1.0, 0.0),
    "K": ("temperature", 1.0, 0.0),
    "degC": ("temperature", 1.0, 273.15),
    "rad/s": ("speed", 1.0, 0.0),
    "rev/min": ("speed", math.pi / 30.0, 0.0),
    "Hz": ("frequency", 1.0, 0.0),
    "1/s": ("rate", 1.0, 0.0),
    "s": ("time", 1.0, 0.0),
    "ms": ("time", 1e-3, 0.0),
    "us": ("time", 1e-6, 0.0),
    "m^2": ("area", 1.0, 0.0),
    "cm^2": ("area", 1e-4, 0.0),
    "W/(m^2 K)": ("heat transfer", 1.0, 0.0),
    "W/m^2": ("heat flux", 1.0, 0.0),
    "kW/m^2": ("heat flux", 1e3, 0.0),
    "J": ("energy", 1.0, 0.0),
    "kJ": ("energy", 1e3, 0.0),
}


def engine_folder() -> Path:
    """Folder of the engines that ship with the package."""
    return Path(__file__).with_name("data")


def engine_names() -> list[str]:
    """Names of the engines that ship with the package."""
    return sorted(path.stem for path in engine_folder().glob("*.toml"))


def engine_path(name_or_path: str | Path) -> Path:
    """Path of an engine file, by path or by the name of one that ships with the package."""
    text = str(name_or_path)
    if text.endswith(".toml"):
        path = Path(text)
        if not path.is_file():
            raise InputError(f"{path}: no such engine file; shipped engines: {', '.join(engine_names())}")
        return path
    if text not in engine_names():
        raise InputError(
            f"unknown engine '{text}': {nearest(text, engine_names())} (or give the path of a .toml engine file)"
        )
    return engine_folder() / f"{text}.toml"


def load_engine(name_or_path: str | Path) -> Engine:
    """Read and check an engine file.

    Parameters
    ----------
    name_or_path : name of an engine that ships with the package (``diesel_i6``) or path of a ``.toml`` file

    Raises
    ------
    InputError
        one line with file, table and key, for anything unknown, missing, in a wrong unit or impossible
    """
    path = engine_path(name_or_path)
    document = _document(path)
    tables: dict[str, Any] = {}
    hints = get_type_hints(Engine)
    _same_names(set(hints), optional_fields(Engine), set(document), path.name, "table")
    for name, hint in hints.items():
        if name not in document:
            continue
        where = f"{path.name}: {name}"
        kind = get_args(hint)[0] if isinstance(hint, UnionType) else hint
        if name in TEXTS:
            if not isinstance(document[name], str):
                raise InputError(f'{where}: must be plain text, e.g. {name} = "diesel_i6"')
            tables[name] = document[name]
            continue
        if not isinstance(document[name], dict):
            raise InputError(f"{where}: must be a table [{name}]")
        entries = get_type_hints(kind, include_extras=True)
        _same_names(set(entries), optional_fields(kind), set(document[name]), where, "key")
        keys = [entry.name for entry in fields(kind) if entry.name in document[name]]
        tables[name] = kind(**{key: _si(document[name][key], entries[key], f"{where}.{key}") for key in keys})
    engine = Engine(**tables)
    try:
        check_engine(engine)
    except InputError as error:
        raise InputError(f"{path.name}: {error}") from None
    return engine


def engine_provenance(name_or_path: str | Path) -> list[tuple[str, Any, str, str, str]]:
    """Every value of an engine file as it is written: (``table.key``, value, unit, origin, note)."""
    path = engine_path(name_or_path)
    load_engine(path)
    return [
        (f"{table}.{key}", entry["value"], entry.get("unit", "1"), entry["origin"], entry.get("note", ""))
        for table, entries in _document(path).items()
        if table not in TEXTS
        for key, entry in entries.items()
    ]


def _document(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path.name}: not a TOML file: {error}") from None
    except OSError as error:
        raise InputError(f"{path.name}: cannot be read: {error.strerror}") from None


def _same_names(known: set[str], optional: set[str], found: set[str], where: str, noun: str) -> None:
    if unknown := sorted(found - known):
        raise InputError(f"{where}: unknown {noun} '{unknown[0]}'; {nearest(unknown[0], sorted(known))}")
    if missing := sorted(known - optional - found):
        raise InputError(f"{where}: {noun} '{missing[0]}' is missing; add it as in engine/data/diesel_i6.toml")


def _si(entry: Any, hint: Any, where: str) -> Any:
    """Value of one entry in SI, of the type its field wants."""
    if not isinstance(entry, dict) or "value" not in entry:
        raise InputError(f'{where}: write it as {{ value = ..., unit = "...", origin = "chosen" }}')
    if unknown := sorted(set(entry) - set(ENTRY)):
        raise InputError(f"{where}: unknown entry '{unknown[0]}'; {nearest(unknown[0], ENTRY)}")
    origin = entry.get("origin")
    if origin not in ORIGINS:
        raise InputError(f"{where}: origin '{origin}' is not known; {nearest(str(origin), ORIGINS)}")
    if origin in ("calibrated", "published") and not entry.get("note"):
        raise InputError(f"{where}: a value of origin '{origin}' needs a note that says to or from which number")
    many = get_origin(hint) is tuple
    kind = get_args(hint)[0] if many else hint
    quantity = get_args(kind)[1] if get_origin(kind) is Annotated else None
    scale, shift = _unit(entry.get("unit", "1"), quantity, where)
    values = entry["value"]
    if isinstance(values, list) != many:
        raise InputError(f"{where}: {'a list of values' if many else 'a single value'} is wanted, got {values!r}")
    if not many:
        return _number(values, kind, quantity, scale, shift, where)
    return tuple(_number(v, kind, quantity, scale, shift, f"{where}[{i}]") for i, v in enumerate(values, start=1))


def _unit(unit: Any, quantity: Quantity | None, where: str) -> tuple[float, float]:
    dimension = quantity.dimension if quantity else "1"
    difference = dimension == "temperature difference"
    valid = [
        name
        for name, (measured, _, shift) in UNITS.items()
        if measured == ("temperature" if difference else dimension) and not (difference and shift)
    ]
    if unit not in valid:
        raise InputError(f"{where}: unit '{unit}' does not measure its {dimension}; use one of: {', '.join(valid)}")
    return UNITS[unit][1:]


def _number(value: Any, kind: Any, quantity: Quantity | None, scale: float, shift: float, where: str) -> Any:
    if quantity is None:
        if type(value) is not kind:
            wanted = {bool: "true or false", int: "a whole number", str: "a text"}[kind]
            raise InputError(f"{where}: {value!r} is not {wanted}")
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{where}: {value!r} is not a finite number")
    number = float(value) * scale + shift
    if (quantity.sign == "positive" and number <= 0.0) or (quantity.sign == "zero" and number < 0.0):
        raise InputError(f"{where}: {value} must {'be positive' if quantity.sign == 'positive' else 'not be negative'}")
    return number


def check_engine(engine: Engine) -> None:
    """Refuse an engine whose parts do not fit together.

    Raises
    ------
    InputError
        one line that starts with ``table.key``
    """
    check_crankshaft(engine.crankshaft)
    if engine.balance_weights is not None:
        check_balance_weights(engine.balance_weights, engine.crankshaft)
    damper = damper_rules(engine.damper) if engine.damper else []
    for key, holds, text in (*cylinder_rules(engine), *_bearing_rules(engine), *_other_rules(engine), *damper):
        if not holds:
            raise InputError(f"{key}: {text}")
    if engine.main_roller is not None:
        check_rollers(engine.main_roller, engine.crankshaft)
    engine.firing_angles  # noqa: B018  raises where the throws cannot fire in the stated order
    if engine.block is not None:
        check_block(engine, engine.block)
    if engine.mounts is not None:
        check_mounts(engine.mounts)


def _film_rules(table: str, film: PlainBearing, journal: str, diameter: float, narrowest: float) -> list[Rule]:
    """Rules of one plain bearing around a ``journal`` of ``diameter``, the narrowest of which is so wide."""
    return [
        (
            f"{table}.diameter",
            abs(film.diameter - diameter) <= 0.01 * diameter,
            f"{in_mm(film.diameter)} does not fit the {journal}, {in_mm(diameter)}",
        ),
        (
            f"{table}.width",
            film.width <= narrowest,
            f"{in_mm(film.width)} is wider than the narrowest {journal}, {in_mm(narrowest)}",
        ),
        (
            f"{table}.clearance",
            film.clearance < 0.01 * film.diameter,
            f"{in_mm(film.clearance)} is more than 1 % of the diameter; it is the radial clearance, often given in um",
        ),
        (
            f"{table}.contact_height",
            film.contact_height < film.clearance,
            f"{in_mm(film.contact_height)} is not less than the clearance, {in_mm(film.clearance)}",
        ),
        (
            f"{table}.groove",
            film.groove in GROOVES,
            f"unknown groove '{film.groove}'; {nearest(film.groove, GROOVES)}",
        ),
        (
            f"{table}.roughness",
            6.0 * film.roughness < film.clearance,
            f"six of {1e6 * film.roughness:.4g} um bridge the clearance, {1e6 * film.clearance:.4g} um; "
            f"it is the standard deviation of the heights, a fraction of a micrometre",
        ),
        (f"{table}.asperity_factor", film.asperity_factor < 1.0, "must lie below 1; usual surfaces have 0.03 to 0.05"),
        (f"{table}.asperity_ratio", film.asperity_ratio < 1.0, "must lie below 1; usual surfaces have 0.0001 to 0.01"),
        (
            f"{table}.boundary_friction",
            film.boundary_friction < 1.0,
            f"{film.boundary_friction} is not below 1; lubricated surfaces have 0.08 to 0.15",
        ),
    ]


def _bearing_rules(engine: Engine) -> list[Rule]:
    crank, thrust, big_end = engine.crankshaft, engine.thrust, engine.big_end_bearing
    mains = len(crank.main_widths)
    main = engine.main_bearing
    big_ends = (
        _film_rules("big_end_bearing", big_end, "crank pin", crank.pin_diameter, crank.pin_width) if big_end else []
    )
    journal = ("main journal", crank.main_diameter, min(crank.main_widths))
    plain = _film_rules("main_bearing", main, *journal) if main else []
    return [
        (
            "main_bearing",
            (main is None) != (engine.main_roller is None),
            f"{'stands beside [main_roller]; keep one of the two' if main else 'is missing'}; the mains are plain "
            "bearings ([main_bearing]) or roller bearings ([main_roller])",
        ),
        *plain,
        *big_ends,
        ("thrust.main", 1 <= thrust.main <= mains, f"{thrust.main} is not one of the main journals 1..{mains}"),
        (
            "thrust.inner_diameter",
            thrust.inner_diameter < thrust.outer_diameter,
            f"{in_mm(thrust.inner_diameter)} is not less than outer_diameter {in_mm(thrust.outer_diameter)}",
        ),
        (
            "thrust.inner_diameter",
            thrust.inner_diameter >= crank.main_diameter,
            f"{in_mm(thrust.inner_diameter)} is less than the main journal it surrounds, {in_mm(crank.main_diameter)}",
        ),
        ("thrust.pads", thrust.pads >= 1, f"{thrust.pads} pads; at least one is needed"),
        ("thrust.pad_fraction", 0.0 < thrust.pad_fraction <= 1.0, "must lie in (0, 1]"),
        (
            "thrust.contact_height",
            2.0 * thrust.contact_height < thrust.clearance,
            f"two of {in_mm(thrust.contact_height)} leave nothing of the clearance, {in_mm(thrust.clearance)}",
        ),
    ]


def _oil_rules(oil: Oil) -> list[Rule]:
    walther, vogel = oil.law == "walther", oil.law == "vogel"
    warm, cold = oil.walther_temperatures, oil.walther_viscosities
    two = len(warm) == len(cold) == 2
    laws = [("oil.law", oil.law in VISCOSITY_LAWS, f"unknown law '{oil.law}'; {nearest(oil.law, VISCOSITY_LAWS)}")]
    missing = [
        (f"oil.{key}", getattr(oil, key) > 0.0 or not vogel, "is missing; law vogel needs vogel_a, vogel_b and vogel_c")
        for key in ("vogel_a", "vogel_b", "vogel_c")
    ]
    return [
        *laws,
        *missing,
        (
            "oil.vogel_c",
            oil.vogel_c < min(oil.temperatures, default=0.0) or not vogel,
            "must lie below every oil temperature",
        ),
        (
            "oil.walther_viscosities",
            two or not (walther or warm or cold),
            f"{len(cold)} viscosities at {len(warm)} walther_temperatures; Walther's law takes two points",
        ),
        (
            "oil.walther_viscosities",
            not two or (warm[0] < warm[-1] and cold[0] > cold[-1]),
            "temperatures must increase and viscosities decrease from point to point",
        ),
        (
            "oil.pressure_law",
            oil.pressure_law in PRESSURE_LAWS,
            f"unknown law '{oil.pressure_law}'; {nearest(oil.pressure_law, PRESSURE_LAWS)}",
        ),
        (
            "oil.pressure_viscosity",
            0.0 < oil.pressure_viscosity < 1e-6 or oil.pressure_law not in PRESSURE_LAWS[1:],
            f"{oil.pressure_viscosity:.4g} 1/Pa does not suit pressure_law {oil.pressure_law}; mineral oils have "
            f"15 to 25 1/GPa",
        ),
        ("oil.heat_share", oil.heat_share <= 1.0, "is a part of the friction power; give at most 1"),
    ]


def _other_rules(engine: Engine) -> list[Rule]:
    oil, burn, damping, published = engine.oil, engine.combustion, engine.damping, engine.published
    half_turn = math.pi
    kinds = ("modal", "rayleigh")
    inertia = [
        (
            f"{name}.polar_inertia",
            part.polar_inertia <= 2.0 * part.diametral_inertia * (1.0 + 1e-9),
            "is more than twice diametral_inertia, which no body has",
        )
        for name, part in (("flywheel", engine.flywheel), ("pulley", engine.pulley), ("clutch", engine.clutch))
        if part is not None
    ]
    return [
        *inertia,
        ("material.poisson_ratio", 0.0 < engine.material.poisson_ratio < 0.5, "must lie in (0, 0.5)"),
        (
            "oil.temperatures",
            len(oil.temperatures) == len(oil.temperature_speeds) > 0,
            f"{len(oil.temperatures)} temperatures for {len(oil.temperature_speeds)} speeds; give one for each",
        ),
        (
            "oil.temperature_speeds",
            all(a < b for a, b in zip(oil.temperature_speeds, oil.temperature_speeds[1:], strict=False)),
            "must increase",
        ),
        *_oil_rules(oil),
        ("damping.kind", damping.kind in kinds, f"unknown kind '{damping.kind}'; {nearest(damping.kind, kinds)}"),
        ("damping.ratio", damping.ratio < 1.0, f"{damping.ratio} is overcritical; give a ratio below 1"),
        ("combustion.duration", burn.duration > 0.0, "must be positive"),
        ("combustion.wiebe_a", burn.wiebe_a > 0.0, "must be positive"),
        ("combustion.best_speed", burn.best_speed > 0.0, "must be positive"),
        (
            "combustion.intake_closes",
            -1.5 * half_turn < burn.intake_closes < min(burn.start, 0.0),
            "must lie before the start of combustion, in (-270, 0) deg after firing dead centre",
        ),
        (
            "combustion.exhaust_opens",
            burn.start + burn.duration <= burn.exhaust_opens < 1.5 * half_turn,
            "must lie after the end of combustion, below 270 deg after firing dead centre",
        ),
        (
            "reduction.torsional_source",
            engine.reduction.torsional_source in TORSIONAL_SOURCES,
            "BICERA's method reads charts, there is no closed form of it; use ker-wilson, carter or solid"
            if engine.reduction.torsional_source.lower().startswith("bicer")
            else f"unknown source '{engine.reduction.torsional_source}'; "
            f"{nearest(engine.reduction.torsional_source, TORSIONAL_SOURCES)}",
        ),
        ("reduction.fixed_modes", engine.reduction.fixed_modes >= 1, "at least one fixed-interface mode is needed"),
        (
            "published.measured_hz",
            len(published.cranktrain_hz) == len(published.cranktrain_shapes) == len(published.measured_hz),
            "cranktrain_hz, cranktrain_shapes and measured_hz must be equally long; 0 where nothing was measured",
        ),
        (
            "published.critical_speeds",
            len(published.critical_orders) == len(published.critical_speeds) == len(published.measured_critical_speeds),
            "critical_orders, critical_speeds and measured_critical_speeds must be equally long",
        ),
    ]
