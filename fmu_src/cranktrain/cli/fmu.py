"""The verb ``fmu``: the FMU of an engine, a scene or a module; ``build_fmu.py`` of the repository calls it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cranktrain.cli.console import say
from cranktrain.cli.functions import Subject, verb
from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import this_platform
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.fmu.carried import ALL, BASIC, USUAL
from cranktrain.modules.register import module_files, module_of, module_path
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option
from cranktrain.studies.scene import Scene

DESCRIPTION = """\
Build the FMU of an engine, a scene, or a module.

Engine, reduced bodies (from the cache, or made), interface and machine code go into one archive, which needs no Python
where it runs; with --python the sources in place of machine code. A scene's FMU carries the levels that its plan chose,
their data and the variables that they answer, and no more. Modules beside the cranktrain have their own interface, data
and code. The last line printed is the FMU's path.
"""
SOURCE = Subject(
    "source",
    "SOURCE",
    f"name of an engine (diesel_i6) or module ({', '.join(module_files())}), or path of an engine file, scene or "
    "module file",
    ("Engine", "Scene"),
)
OF_ENGINES = ("description", "levels", "start", "film_table", "block", "body", "pressure", "drive_line")
DRIVEN = ("pressure", "pressure_unit", "pressure_tdc_deg", "drive_line")


@dataclass(frozen=True, kw_only=True)
class Fmu(words.DriveLine):
    """Question of :func:`fmu`."""

    apart = (("native", "python"),)
    output: Annotated[words.File, Option("FOLDER", "where the FMU goes (default: dist)", short="-o")] = "dist"
    description: Annotated[bool, Option(help="rewrite modelDescription/modelDescription.xml, build nothing")] = False
    levels: Annotated[
        str | None,
        Option(
            "LIST",
            f"levels that the FMU carries. {USUAL} (default): all but bearing.level and big_end.level table and "
            f"block.level flexible, whose data take minutes at the first build, unless the engine starts at one; "
            f"{BASIC}: all without films that are solved or read from a table; {ALL}; or table, flexible beside the "
            "usual ones, comma between them",
        ),
    ] = None
    start: Annotated[
        Sequence[str],
        Option(
            "NAME=VALUE",
            "start value of a parameter of an engine's FMU: the level of a part (crank.level=torsional), or a number "
            "in SI (flywheel.mass=40); may be given several times",
            repeated=True,
        ),
    ] = ()
    film_table: Annotated[bool, Option(help="all levels but table: without the film tables")] = True
    block: Annotated[bool, Option(help="all levels but block.level flexible")] = True
    body: Annotated[
        words.File | None,
        Option(
            "FILE",
            "own reduced crankshaft (.h5, .npz, folder of cranktrain reduce --output), or superelement (.toml), for "
            "the crank levels rigid, torsional and solid",
        ),
    ] = None
    pressure: Annotated[
        words.File | None,
        Option(
            "FILE",
            "measured pressures: a .csv file of crank angle in degrees and pressure, one column or one for each "
            "cylinder",
        ),
    ] = None
    pressure_unit: words.PressureUnit | None = None
    pressure_tdc_deg: words.DeadCentre | None = None
    native: Annotated[
        bool,
        Option(
            help="an FMU of machine code for this machine's platform, which needs no Python where it runs (default)"
        ),
    ] = False
    python: Annotated[
        bool, Option(help="an FMU of Python code, which needs Python with numpy and numba where it runs")
    ] = False
    platform: Annotated[
        str | None,
        Option("LIST", "platforms of a native FMU, comma between them: linux64, win64, aarch64-linux"),
    ] = None
    fmi: Annotated[
        Literal["2.0", "3.0"],
        Option(
            "VERSION",
            "version of FMI: 2.0 (default), or 3.0, whose FMUs are native and have arrays and enumerations",
        ),
    ] = "2.0"
    clocks: Annotated[
        bool,
        Option(
            help="with --fmi 3.0: an output clock for each cylinder of an engine or scene, which ticks at its firing "
            "dead centre; for clients that use event mode"
        ),
    ] = False
    reference: Annotated[bool, Option(help="also simulate the FMU and write its cross-check files beside it")] = False


@verb(Fmu, DESCRIPTION, SOURCE)
def fmu(source: str | Path | Engine | Scene, ask: Fmu) -> VerbResult:
    """Build the FMU, on request with reference results; or only write the model description again."""
    from cranktrain.fmu.archive import DESCRIPTION as FOLDER
    from cranktrain.fmu.archive import XML, write_reference, write_whole
    from cranktrain.fmu.build import build_fmu
    from cranktrain.fmu.engine_fmu import full_interface, model_description
    from cranktrain.fmu.module_fmu import module_interface

    starts = dict(map(_start, ask.start))
    module = None if isinstance(source, Engine | Scene) else module_path(source)
    _check(source, ask, module)
    if ask.description and not isinstance(source, Scene):
        path = FOLDER / "modelDescription.xml"
        write_whole(path, model_description(load_engine(source)), XML)
        return VerbResult.of({"file": str(path)}, "fmu")
    platforms = () if ask.python else None if ask.platform is None else _listed(ask.platform)
    path = build_fmu(
        source, ask.output, levels=ask.levels, film_table=ask.film_table, block=ask.block, body=ask.body, starts=starts,
        platforms=platforms, fmi=ask.fmi, clocks=ask.clocks, say=say, **{key: getattr(ask, key) for key in DRIVEN},
    )  # fmt: skip
    if ask.reference:
        write_reference(path, full_interface() if module is None else module_interface(module_of(module)), say)
    return VerbResult.of({"file": str(path)}, "fmu")


def show(found: VerbResult) -> None:
    """Print the path of the FMU."""
    print(found["file"])


def _check(source: str | Path | Engine | Scene, ask: Fmu, module: Path | None) -> None:
    """Refuse options that exclude each other or do not apply to the product; ``InputError``."""
    from cranktrain.fmu.build import is_scene

    usual = Fmu()
    given = next((name for name in OF_ENGINES if getattr(ask, name) != getattr(usual, name)), None)
    scene = isinstance(source, Scene) or (not isinstance(source, Engine) and is_scene(source))
    if given is not None and (module is not None or scene):
        option = {"film_table": "no-film-table", "block": "no-block"}.get(given, given.replace("_", "-"))
        raise InputError(f"--{option} belongs to an engine, not to a {'scene' if module is None else 'module'}")
    if ask.python and ask.platform is not None:
        raise InputError("--platform belongs to a native FMU; leave --python out, or --platform")
    if ask.fmi != usual.fmi and (ask.python or ask.description):
        raise InputError("--python and --description are of FMI 2.0; leave them out, or --fmi")
    if ask.clocks and ask.fmi == usual.fmi:
        raise InputError("--clocks are of FMI 3.0; add --fmi 3.0, or leave it out")
    if ask.reference and ask.platform and this_platform() not in _listed(ask.platform):
        raise InputError(f"--reference runs the FMU here; name {this_platform()} among the platforms")


def _start(text: str) -> tuple[str, str]:
    """Name and value of a start value, from the text ``NAME=VALUE``."""
    name, sign, value = text.partition("=")
    if not (sign and name.strip() and value.strip()):
        raise InputError(f"--start '{text}' is no NAME=VALUE; give e.g. crank.level=torsional")
    return name.strip(), value.strip()


def _listed(names: str) -> list[str]:
    """Names from a list, without repetition."""
    return list(dict.fromkeys(name.strip() for name in names.split(",")))
