"""Building an FMU of an engine with all its levels, of a scene with the levels of its plan, or of a module."""

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import this_platform
from cranktrain.core.types import Progress
from cranktrain.core.user_file import ending, read_toml
from cranktrain.dynamics.topology.bearings import film_parts
from cranktrain.engine.drive_line_chain import read_drive_line
from cranktrain.engine.file import load_engine
from cranktrain.engine.levels import CRANKS
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import LAWS, PLAIN
from cranktrain.fmu.archive import model_description
from cranktrain.fmu.carried import ALL, BASIC, USUAL, carried_levels, left_out_text, without_films
from cranktrain.fmu.description import Interface
from cranktrain.fmu.engine_fmu import (
    build,
    check_target,
    engine_interface,
    family_counts,
    full_interface,
    start_settings,
    with_starts,
)
from cranktrain.fmu.engine_fmu import model_description as engine_description
from cranktrain.fmu.flat import FlatModel
from cranktrain.fmu.module_fmu import build_module, module_product
from cranktrain.fmu.native.archive import FMI3, VERSIONS
from cranktrain.fmu.native.link import checked_platform
from cranktrain.fmu.native.platforms import PLATFORMS
from cranktrain.fmu.parallel_build import made_beside, make_block, make_bores
from cranktrain.fmu.scene_interface import carried_engine, fixed_settings, scene_interface, scene_suffix
from cranktrain.loads.damper import with_damper_housing
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.loads.pressure_map import read_gas
from cranktrain.modules.register import module_path
from cranktrain.store.waits import print_line, waits
from cranktrain.structure import assembly
from cranktrain.structure.additions import check_added, read_added
from cranktrain.structure.assembly import check_mesh
from cranktrain.studies.scene import Scene, load_scene


def build_fmu(
    source: str | Path | Engine | Scene,
    folder: str | Path = "dist",
    *,
    levels: str | Sequence[str] | None = None,
    film_table: bool = True,
    block: bool = True,
    body: str | Path | None = None,
    starts: Mapping[str, Any] | None = None,
    pressure: str | Path | None = None,
    pressure_unit: str | None = None,
    pressure_tdc_deg: float | None = None,
    drive_line: str | Path | None = None,
    platforms: Sequence[str] | None = None,
    fmi: str = "2.0",
    clocks: bool = False,
    say: Progress | None = None,
) -> Path:
    """Build the FMU of an engine, a scene or another module; returns its path.

    Raises ``InputError`` for input that cannot be read or built.

    Parameters
    ----------
    source : name of a shipped engine or module, path of an engine file, a scene or a module file, an engine, or a scene
    levels : levels of an engine that the FMU contains: ``usual``, all except those whose data take minutes and that its
        start values do not need; ``basic``, all without solved films; ``all``; or ``table``, ``flexible`` in addition
        to the usual ones, see :mod:`cranktrain.fmu.carried`. Default: usual, or all if ``film_table`` or ``block``
        leaves one out
    film_table : False leaves out the film tables of bearing and big-end level ``table``
    block : False leaves out the block of block level ``flexible``
    body : user's own reduced crankshaft, or its superelement, for the crank levels that are not made from dimensions
    starts : start values of an engine's parameters that differ from the usual ones, by name: levels as texts
        (``{"crank.level": "torsional"}``), numbers in SI (``{"flywheel.mass": 40.0}``)
    pressure : file of a measured pressure trace in place of the engine's built-in one, with its unit and the angle of
        its dead centre if the file does not state them, as for ``simulate``
    drive_line : table of discs and shafts in place of the engine's drive line
    platforms : platforms of a native FMU, which needs no Python (``linux64``, ``win64``); default this machine's; empty
        for the Python FMU
    fmi : version of FMI, ``2.0`` or ``3.0``; the latter for native FMUs, which then have arrays and enumerations
    clocks : True for an output clock for each cylinder in an engine's or a scene's FMU of FMI 3.0. It ticks at the
        cylinder's firing dead centre, for clients that use event mode
    say : receives the name of each stage of long work; by default stages longer than a second are printed on stderr
    """
    with waits() as told:
        measured = _Measured(pressure, pressure_unit, pressure_tdc_deg, drive_line)
        parts = _Parts(levels, film_table, block, body, starts or {}, measured)
        # Version of FMI after a check.
        if str(fmi) not in VERSIONS:
            raise InputError(f"FMI '{fmi}' is no version that FMUs are built for; take {' or '.join(VERSIONS)}")
        target = _Target(platforms, str(fmi), clocks)
        if target.clocks and target.fmi != FMI3:
            raise InputError(f"clocks are of FMI {FMI3}; build the FMU for it, or leave clocks out")
        return _built(source, Path(folder), parts, target, (say or told.tell, say or print_line))


class _Target(NamedTuple):
    """Target of a build: platforms (None: this machine's; empty: a Python FMU), version of FMI, and clocks if true."""

    platforms: Sequence[str] | None
    fmi: str
    clocks: bool = False

    def resolved(self, say: Progress) -> Sequence[str]:
        """Names of the platforms' folders, empty for a Python FMU; ``InputError`` for a Python FMU of FMI 3.0."""
        given = self.platforms
        usual = this_platform()
        if given is None and usual not in PLATFORMS:
            say(f"native FMUs do not exist for {usual}, so the Python FMU is built")
            given = ()
        found = [usual] if given is None else [checked_platform(name).folder for name in given]
        if not found:
            self.check_python("a Python FMU")
        return found

    def check_python(self, what: str) -> None:
        """Raise ``InputError`` if ``what``, a Python FMU, is requested for another version than FMI 2.0."""
        if self.fmi != VERSIONS[0]:
            raise InputError(f"{what} is of FMI {VERSIONS[0]}; build a native FMU for FMI {self.fmi}")


class _Measured(NamedTuple):
    """Files of measured gas pressure and drive line that replace those of the engine; None keeps the engine's."""

    pressure: str | Path | None = None
    unit: str | None = None
    dead_centre_deg: float | None = None
    drive_line: str | Path | None = None

    def with_line(self, engine: Engine) -> Engine:
        """Engine with the drive line of the file; ``InputError`` if the file cannot be used."""
        if self.drive_line is None:
            return engine
        return replace(engine, drive_line_chain=read_drive_line(self.drive_line))

    def gas(self, engine: Engine) -> GasTrace | None:
        """The measured trace, None without a file; ``InputError``, also for traces over speed and load."""
        if self.pressure is None:
            if self.unit is not None or self.dead_centre_deg is not None:
                raise InputError(
                    "unit and dead centre belong to measured pressures; give --pressure FILE, or leave them out"
                )
            return None
        gas = read_gas(self.pressure, engine, self.unit, self.dead_centre_deg)
        if not isinstance(gas, GasTrace):
            raise InputError(
                f"{Path(self.pressure).name}: has traces over speed and load, and an FMU carries one trace; give one "
                "of the files, or let a partner give the pressures as inputs"
            )
        return replace(gas, source=f"measured trace {Path(self.pressure).name}")


class _Parts(NamedTuple):
    """Arguments of :func:`build_fmu` that apply to an engine's FMU, but not to a scene's or module's."""

    levels: str | Sequence[str] | None
    film_table: bool
    block: bool
    body: str | Path | None
    starts: Mapping[str, Any]
    measured: _Measured = _Measured()

    @property
    def chosen(self) -> bool:
        """True if any of these arguments was given."""
        given = self.levels is not None or self.body is not None or bool(self.starts) or any(self.measured)
        return given or not (self.film_table and self.block)

    def carried(self, engine: Engine, say: Progress) -> dict[str, bool]:
        """Arguments for :func:`whole_model`. Levels that are left out without the user's choice are reported."""
        whole = self.film_table and self.block
        start = start_settings(engine_interface(engine), engine, self.starts)
        carried = carried_levels(engine, self.levels or (USUAL if whole else ALL), start)
        carried -= {level for level, kept in (("table", self.film_table), ("flexible", self.block)) if not kept}
        if whole and not self.basic and (text := left_out_text(engine, carried)):
            say(f"{engine.name}: {text}")
        carries = {"film_table": "table" in carried, "flexible": "flexible" in carried, "block": self.block}
        return carries | {"films": not self.basic}

    @property
    def basic(self) -> bool:
        """True if the FMU contains only levels whose bearings need no film, neither solved nor from a table."""
        return self.levels is not None and BASIC in self.levels

    def interface(self, interface: Interface) -> Interface:
        """Interface of an engine with the chosen start values and levels."""
        made = with_starts(interface, self.starts)
        return without_films(made) if self.basic else made


def _built(
    source: str | Path | Engine | Scene,
    folder: Path,
    parts: _Parts,
    target: _Target,
    lines: tuple[Progress, Progress],
) -> Path:
    """Build the FMU for :func:`build_fmu`; ``lines`` print stages of work, and messages that are never left out."""
    say, note = lines
    full_interface()
    platforms = target.resolved(say)
    module = module_path(source) if isinstance(source, str | Path) else None
    if module is not None:
        if parts.chosen:
            raise InputError(
                "levels, film table, block, body, starts, pressure and drive line belong to an engine's FMU, not to a "
                "module's"
            )
        if target.clocks:
            raise InputError("clocks tick at dead centres of an engine's or a scene's FMU; a module has none")
        return build_module(module, folder, say, platforms, target.fmi)
    if isinstance(source, str | Path) and is_scene(source):
        source = load_scene(source)
    if isinstance(source, Scene):
        if parts.body is not None:
            raise InputError("an own body can be built into an engine's FMU, not into a scene's; name the engine")
        if parts.chosen:
            raise InputError(
                "levels, film table, block, starts, pressure and drive line are chosen for an engine's FMU, not for a "
                "scene's"
            )
        check_target(folder, source.engine)
        return build_scene(source, folder, say, platforms, target.fmi, target.clocks)
    engine = parts.measured.with_line(load_engine(source))
    check_target(folder, engine)
    check_mesh(parts.body, "journal surfaces")
    parts.interface(engine_interface(engine, target.clocks))  # refuses wrong levels before any data are made
    gas = parts.measured.gas(engine)
    if gas is not None:
        peak, mean = 1e-5 * gas.peak, 1e-5 * gas.imep
        note(f"{engine.name}: {gas.source}, peak {peak:.4g} bar, mean effective pressure {mean:.4g} bar")
    model = whole_model(engine, **parts.carried(engine, note), body=parts.body, say=say)._replace(gas=gas)
    interface = parts.interface(engine_interface(model.engine, target.clocks))
    return build(model, folder, say, interface, platforms=platforms, fmi=target.fmi)


def describe_fmu(source: str) -> bytes:
    """Model description of the FMU of an engine or a module, without building it; ``InputError``.

    Its GUID is that of an FMU without data.
    """
    module = module_path(source)
    if module is not None:
        return model_description(module_product(module))
    return engine_description(load_engine(source))


def crank_levels(fitted: Engine, body: str | Path | None = None, say: Progress = lambda text: None) -> dict[str, Any]:
    """Running body of each crank level, by name. The user's ``body`` serves levels not made from dimensions alone."""
    return {
        level: assembly.running_crank(fitted, level, say=say, mesh=body if row.takes_mesh else None)
        for level, row in CRANKS.items()
    }


def whole_model(
    engine: Engine,
    *,
    film_table: bool = True,
    flexible: bool = True,
    block: bool = True,
    films: bool = True,
    body: str | Path | None = None,
    say: Progress = lambda text: None,
) -> FlatModel:
    """Engine with the data of all its levels, from the cache or computed; see :func:`build_fmu`.

    Without ``flexible`` the data of that block level are left out, without ``block`` the engine has no block, without
    ``films`` there are no elastic bores and eyes.
    """
    if not block:
        engine = replace(engine, block=None)

    check_added(engine, body is not None, own_block=False)
    data: dict[str, Any] = {"added": read_added(engine)}
    # Paths on the machine of the build are not stored in the FMU.
    engine = replace(engine, body=tuple(replace(one, file=Path(one.file).name) for one in engine.body))
    flexible = flexible and engine.block is not None and engine.mounts is not None
    bores = films and any("bore" in law.forms[PLAIN].parts for law in LAWS.values() if PLAIN in law.forms)
    make, what = (make_block, "block") if flexible else (make_bores, "elastic bores")
    with made_beside(make, engine, what, say) if flexible or bores else nullcontext(lambda: None) as wait:
        say(f"{engine.name}: crankshaft")
        data["cranks"] = crank_levels(engine, body, say)
        if engine.damper is not None:
            data["damped"] = crank_levels(with_damper_housing(engine), body, say)
        wait()
    if flexible:
        say(f"{engine.name}: block")
        data["block"] = assembly.running_block(engine, tilting=True, say=say, bore=not engine.rollers_only and bores)
    data["film_tables"] = assembly.film_tables_of(engine, say)
    added = [(table.film, table.ends) for table in engine.additions.connection if table.film is not None]
    eyes = any("big_end_bore" in film_parts(*one) for one in added)
    if eyes or (films and engine.big_end_bearing is not None and engine.rods_float):
        say(f"{engine.name}: elastic eyes of the rods")
        data["big_end_bore"] = assembly.big_end_bore(engine, say)
    if engine.rollers_only:
        return FlatModel(engine, **data)
    if bores:
        say(f"{engine.name}: elastic bores")
        data["bore"] = assembly.elastic_bore(engine, flexible=False, say=say)
        if flexible:
            data["block_bore"] = assembly.elastic_bore(engine, flexible=True, say=say)
    if film_table:
        say(f"{engine.name}: film tables")
        data["table"] = assembly.main_table(engine, say)
        if engine.big_end_bearing is not None:
            data["big_end_table"] = assembly.big_end_table(engine, say)
    return FlatModel(engine, **data)


def is_scene(name: str | Path) -> bool:
    """True if a name is the path of a scene, a TOML file that names its engine."""
    try:
        return ending(name) == ".toml" and isinstance(read_toml(name, "scene file", "").get("engine"), str)
    except InputError:
        return False


def build_scene(
    scene: Scene,
    folder: str | Path,
    say: Progress = lambda text: None,
    platforms: Sequence[str] = (),
    fmi: str = "2.0",
    clocks: bool = False,
) -> Path:
    """Plan a scene and write its FMU into ``folder``; returns its path. Prints its contents and size."""
    from cranktrain.studies.planning.planning import plan
    from cranktrain.studies.planning.scene_model import SceneModel

    if scene.film_temperature != "engine":
        _Target(platforms, fmi).check_python("the FMU of a scene whose film temperatures need runs before the start")
    if scene.pressure is not None:
        say(f"{scene.name}: the FMU does not contain the trace of [gas]; supply it through cylinder[i].pressure")
    model = SceneModel(scene, say)
    made = plan(scene, model=model)
    run, engine = model.assembly(made.case), carried_engine(made)
    crank = {made.case.crank: run.body}
    fitted = scene.damper == "fitted"
    flat = FlatModel(
        engine,
        {} if fitted else crank,
        crank if fitted else {},
        table=run.parts.table,
        big_end_table=run.parts.big_end_table,
        block=run.parts.block,
        bore=None if scene.block == "flexible" else run.parts.bore,
        block_bore=run.parts.bore if scene.block == "flexible" else None,
        added=run.parts.bodies or {},
        film_tables=run.parts.film_tables,
        big_end_bore=run.parts.big_end_bore,
    )
    if platforms and scene.film_temperature != "engine":
        say(f"{scene.name}: film temperatures by their friction need runs before the start, so the Python FMU is built")
        platforms = ()
    interface = scene_interface(engine_interface(engine, clocks), made, model, family_counts(engine))
    say(f"{scene.name}: {made.case}, {made.modes} modes; predicted error {made.predicted_error:.2g}")
    return build(flat, folder, say, interface, fixed_settings(made, model), scene_suffix(made), platforms, fmi)
