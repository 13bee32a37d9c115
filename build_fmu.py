"""Build the FMU of an engine, ``python build_fmu.py diesel_i6 [-o dist]``, of a scene or of a module.

Engine, reduced bodies (from the cache, or made), interface and machine code go into one archive, which needs no Python
where it runs; with ``--python`` the sources in place of machine code. A scene's FMU
carries the levels that its plan chose, their data and the variables that they answer, and no more. Modules beside the
cranktrain, ``combustion_i6``, have their own interface, data and code. The last line printed is the FMU's path.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

SOURCES = Path(__file__).resolve().parent / "fmu_src"
if str(SOURCES) not in sys.path:
    sys.path.insert(0, str(SOURCES))

from cranktrain.cli import streams  # noqa: E402
from cranktrain.cli.exit_codes import fault, one_line  # noqa: E402
from cranktrain.cli.parser import add_fields  # noqa: E402
from cranktrain.core.errors import CranktrainError, InputError  # noqa: E402
from cranktrain.core.machine_code import this_platform  # noqa: E402
from cranktrain.engine.file import load_engine  # noqa: E402
from cranktrain.fmu.archive import DESCRIPTION, XML, write_reference, write_whole  # noqa: E402
from cranktrain.fmu.build import build_fmu, checked_version, is_scene  # noqa: E402
from cranktrain.fmu.carried import ALL, BASIC, USUAL  # noqa: E402
from cranktrain.fmu.engine_fmu import full_interface, model_description  # noqa: E402
from cranktrain.fmu.module_fmu import module_interface  # noqa: E402
from cranktrain.modules.register import module_files, module_of, module_path  # noqa: E402
from cranktrain.studies.requests import words  # noqa: E402
from cranktrain.studies.requests.fields import Option  # noqa: E402

DRIVEN = ("pressure", "pressure_unit", "pressure_tdc_deg", "drive_line")


@dataclass(frozen=True, kw_only=True)
class Sources(words.Pressures):
    """Drive line and pressures that an FMU carries: a trace of its own, no map over speed and load."""

    pressure: Annotated[
        words.File | None,
        Option(
            "FILE",
            "measured pressures: a .csv file of crank angle in degrees and pressure, one column or one for each "
            "cylinder",
        ),
    ] = None


def main(arguments: list[str] | None = None) -> int:
    """Build from the command line; 2 where the input cannot be used, 70 after a fault of this program."""
    streams.prepare()
    chosen = _parser().parse_args(arguments)
    try:
        path = _described(chosen) if chosen.description else _built(chosen)
    except CranktrainError as error:
        _say(f"build_fmu: {one_line(str(error))}")
        return 2
    except KeyboardInterrupt:
        _say("build_fmu: interrupted; no FMU was written")
        return 130
    except Exception as error:
        _say(f"build_fmu: {fault(error)}")
        return 70
    print(path)
    return 0


def _parser() -> argparse.ArgumentParser:
    """Parser of the options."""
    parser = argparse.ArgumentParser(description="Build the FMU of an engine, a scene, or a module.")
    add = parser.add_argument
    modules = ", ".join(module_files())
    add(
        "engine",
        help=f"name of an engine (diesel_i6) or module ({modules}), or path of an engine file, scene or module file",
    )
    add("-o", "--output", default="dist", metavar="FOLDER", help="where the FMU goes (default: dist)")
    add("--description", action="store_true", help=f"rewrite {DESCRIPTION.name}/modelDescription.xml, build nothing")
    add(
        "--levels", metavar="LIST",
        help=f"levels that the FMU carries. {USUAL} (default): all but bearing.level and big_end.level table and "
        f"block.level flexible, whose data take minutes at the first build, unless the engine starts at one; {BASIC}: "
        f"all without films that are solved or read from a table; {ALL}; or table, flexible beside the usual ones, "
        "comma between them",
    )  # fmt: skip
    add(
        "--start", metavar="NAME=VALUE", action="append", type=_start, default=[],
        help="start value of a parameter of an engine's FMU: the level of a part (crank.level=torsional), or a number "
        "in SI (flywheel.mass=40); may be given several times",
    )  # fmt: skip
    add(
        "--no-film-table", dest="film_table", action="store_false",
        help="all levels but table: without the film tables",
    )  # fmt: skip
    add(
        "--no-block", dest="block", action="store_false",
        help="all levels but block.level flexible",
    )  # fmt: skip
    add(
        "--body", metavar="FILE",
        help="own reduced crankshaft (.h5, .npz, folder of cranktrain reduce --output), or superelement (.toml), for "
        "the crank levels rigid, torsional and solid",
    )  # fmt: skip
    add_fields(parser, Sources)
    form = parser.add_mutually_exclusive_group().add_argument
    form(
        "--native", action="store_true",
        help="an FMU of machine code for this machine's platform, which needs no Python where it runs (default)",
    )  # fmt: skip
    form(
        "--python", action="store_true",
        help="an FMU of Python code, which needs Python with numpy and numba where it runs",
    )  # fmt: skip
    add(
        "--platform", dest="platforms", metavar="LIST", type=_listed,
        help="platforms of a native FMU, comma between them: linux64, win64, aarch64-linux",
    )  # fmt: skip
    add(
        "--fmi", default="2.0", metavar="VERSION",
        help="version of FMI: 2.0 (default), or 3.0, whose FMUs are native and have arrays and enumerations",
    )  # fmt: skip
    add(
        "--clocks", action="store_true",
        help="with --fmi 3.0: an output clock for each cylinder of an engine or scene, which ticks at its firing dead "
        "centre; for clients that use event mode",
    )  # fmt: skip
    add("--reference", action="store_true", help="also simulate the FMU and write its cross-check files beside it")
    return parser


def _check(chosen: argparse.Namespace) -> None:
    """Refuse options that do not go with each other or with what is built; ``InputError``."""
    of_engines = chosen.description or chosen.body or chosen.start or chosen.levels is not None
    of_engines = of_engines or any(getattr(chosen, key) is not None for key in DRIVEN)
    module = module_path(chosen.engine)
    if (of_engines or not (chosen.film_table and chosen.block)) and (module is not None or is_scene(chosen.engine)):
        what = "scene" if module is None else "module"
        raise InputError(
            "--description, --levels, --start, --no-film-table, --no-block, --body, --pressure and --drive-line belong "
            f"to an engine, not to a {what}"
        )
    if chosen.python and chosen.platforms is not None:
        raise InputError("--platform belongs to a native FMU; leave --python out, or --platform")
    if checked_version(chosen.fmi) != "2.0" and (chosen.python or chosen.description):
        raise InputError("--python and --description are of FMI 2.0; leave them out, or --fmi")
    if chosen.clocks and chosen.fmi != "3.0":
        raise InputError("--clocks are of FMI 3.0; add --fmi 3.0, or leave it out")
    if chosen.reference and chosen.platforms and this_platform() not in chosen.platforms:
        raise InputError(f"--reference runs the FMU here; name {this_platform()} among the platforms")


def _described(chosen: argparse.Namespace) -> Path:
    """The model description, written anew."""
    _check(chosen)
    path = DESCRIPTION / "modelDescription.xml"
    write_whole(path, model_description(load_engine(chosen.engine)), XML)
    return path


def _built(chosen: argparse.Namespace) -> Path:
    """The FMU, with its reference results where they are asked for."""
    _check(chosen)
    parts = {"film_table": chosen.film_table, "block": chosen.block, "body": chosen.body, "levels": chosen.levels}
    target = {"platforms": () if chosen.python else chosen.platforms, "fmi": chosen.fmi, "clocks": chosen.clocks}
    driven = {key: getattr(chosen, key) for key in DRIVEN}
    path = build_fmu(chosen.engine, chosen.output, **parts, **driven, **target, starts=dict(chosen.start), say=_say)
    if chosen.reference:
        module = module_path(chosen.engine)
        write_reference(path, full_interface() if module is None else module_interface(module_of(module)), _say)
    return path


def _start(text: str) -> tuple[str, str]:
    """Name and value of ``NAME=VALUE``."""
    name, sign, value = text.partition("=")
    if not (sign and name.strip() and value.strip()):
        raise argparse.ArgumentTypeError(f"'{text}' is no NAME=VALUE; give e.g. crank.level=torsional")
    return name.strip(), value.strip()


def _listed(names: str) -> list[str]:
    """Names in a list, each once."""
    return list(dict.fromkeys(name.strip() for name in names.split(",")))


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
