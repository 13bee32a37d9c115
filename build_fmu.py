"""Build the FMU of an engine, ``python build_fmu.py diesel_i6 [-o dist]``, or of a scene: ``… scene.toml``.

Engine file, reduced crankshaft (from its cache, or made), interface and running model go into one archive. Equal inputs
give equal bytes: the GUID is a digest of interface, code and data, the archive has sorted names and one date. A scene's
FMU carries the levels that its plan chose, their data and the variables that they answer, and no more. The last line
printed is the FMU's path.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import importlib.metadata
import json
import os
import re
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parent
SOURCES = ROOT / "fmu_src"
DESCRIPTION = ROOT / "modelDescription"
if str(SOURCES) not in sys.path:
    sys.path.insert(0, str(SOURCES))

from cranktrain import __version__  # noqa: E402
from cranktrain.core.errors import CranktrainError, InputError  # noqa: E402
from cranktrain.core.reduced_body import ReducedBody  # noqa: E402
from cranktrain.engine.file import load_engine  # noqa: E402
from cranktrain.engine.model import Engine  # noqa: E402
from cranktrain.film.laws.ehd import SHAPES  # noqa: E402
from cranktrain.fmu import flat  # noqa: E402
from cranktrain.fmu.description import Interface, Variable, complete, expand, plain, read_interface, variable_table  # noqa: E402
from cranktrain.studies.scene import Scene, load_scene  # noqa: E402

RUNNING = ("cranktrain.dynamics.simulation", "cranktrain.fmu.flat")
FOREIGN = {"numpy", "numba", "llvmlite"} | set(sys.stdlib_module_names)
PLATFORMS = ("linux64", "win64")


def main(arguments: list[str] | None = None) -> int:
    """Build from the command line; 2 where the input cannot be used."""
    parser = argparse.ArgumentParser(description="Build the FMU of an engine, or of a scene.")
    parser.add_argument("engine", help="name of an engine (diesel_i6), or path of an engine file or a scene")
    parser.add_argument("-o", "--output", default="dist", metavar="FOLDER", help="where the FMU goes (default: dist)")
    parser.add_argument(
        "--description", action="store_true", help="rewrite modelDescription/modelDescription.xml instead of building"
    )
    parser.add_argument(
        "--no-film-table",
        dest="film_table",
        action="store_false",
        help="leave out the film table: a smaller FMU, made sooner, without bearing.level = table",
    )
    parser.add_argument(
        "--no-block",
        dest="block",
        action="store_false",
        help="leave out the block: an FMU made minutes sooner, without block.level = flexible",
    )
    parser.add_argument(
        "--reference", action="store_true", help="also simulate the FMU and write its cross-check files beside it"
    )
    chosen = parser.parse_args(arguments)
    try:
        if is_scene(chosen.engine):
            if chosen.description or not (chosen.film_table and chosen.block):
                raise InputError("--description, --no-film-table and --no-block belong to an engine, not to a scene")
            path = build_scene(load_scene(chosen.engine), Path(chosen.output), _say)
            if chosen.reference:
                write_reference(path, _say)
            print(path)
            return 0
        engine = load_engine(chosen.engine)
        if chosen.description:
            path = DESCRIPTION / "modelDescription.xml"
            _write(path, model_description(engine))
        else:
            body = reduced_body(engine, _say)
            if not chosen.block:
                engine = replace(engine, block=None)
            data = structure_data(engine, _say) | film_data(engine, chosen.film_table, _say)
            path = build(engine, body, Path(chosen.output), _say, **data)
            if chosen.reference:
                write_reference(path, _say)
    except CranktrainError as error:
        print(f"build_fmu: {error}", file=sys.stderr)
        return 2
    print(path)
    return 0


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def reduced_body(engine: Engine, say: Callable[[str], None]) -> ReducedBody:
    """Reduced crankshaft with flywheel and pulley, cut down to what the running model carries."""
    from cranktrain.structure.crank.reduction import running_body

    say(f"{engine.name}: reduced crankshaft")
    return running_body(engine, progress=say)


def structure_data(engine: Engine, say: Callable[[str], None]) -> dict[str, Any]:
    """Block, and crankshaft with the damper's housing, where the engine has them."""
    from cranktrain.loads.damper import with_damper_housing
    from cranktrain.structure.block.reduction import running_block
    from cranktrain.structure.crank.reduction import running_body

    data: dict[str, Any] = {}
    if engine.block is not None and engine.mounts is not None:
        say(f"{engine.name}: reduced block")
        data["block"] = running_block(engine, progress=say)
    if engine.damper is not None:
        data["damped_body"] = running_body(with_damper_housing(engine), progress=say)
    return data


def film_data(engine: Engine, table: bool, say: Callable[[str], None]) -> dict[str, Any]:
    """Elastic bores, and where asked for the film tables of mains and big ends; from the cache or made now.

    On ground the bore is a saddle's, which moves as a whole; in a flexible block it is the block's own.
    """
    from cranktrain.film.table.database import TableSettings
    from cranktrain.store.film_tables import film_table
    from cranktrain.structure.block.bore import block_bore_compliance
    from cranktrain.structure.block.saddle import bore_compliance

    if engine.main_roller is not None:
        return {}
    data: dict[str, Any] = {"bore": bore_compliance(engine, SHAPES, with_motion=True, progress=say)}
    if engine.block is not None and engine.mounts is not None:
        data["block_bore"] = block_bore_compliance(engine, SHAPES, progress=say)
    if table:
        bearing = engine.plain_mains
        settings = TableSettings(bearing.width / bearing.diameter, bearing.groove)
        say(f"{engine.name}: film table of L/D {settings.length_ratio:.4g}")

        def shown(done: int, count: int) -> None:
            if 10 * done // count > 10 * (done - 1) // count:
                say(f"film table: {100 * done // count} %")

        data["table"], _, _ = film_table(settings, progress=shown, say=say)
        if engine.big_end_bearing is not None:
            bearing = engine.big_end_bearing
            settings = TableSettings(bearing.width / bearing.diameter, bearing.groove, tilt=False)
            data["big_end_table"], _, _ = film_table(settings, say=say)
    return data


def is_scene(name: str) -> bool:
    """Whether a name is the path of a scene: TOML that names its engine."""
    path = Path(name)
    if path.suffix != ".toml" or not path.is_file():
        return False
    try:
        return isinstance(tomllib.loads(path.read_text(encoding="utf-8")).get("engine"), str)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError):
        return False


def build_scene(scene: Scene, folder: Path, say: Callable[[str], None]) -> Path:
    """Plan a scene and write its FMU into ``folder``; returns its path. Says what it carries and how large it is."""
    from cranktrain.core.reduced_body import rigid
    from cranktrain.fmu.scene_interface import carried_engine, fixed_settings, scene_interface, scene_suffix
    from cranktrain.studies.planning.planning import plan
    from cranktrain.studies.planning.scene_model import SceneModel

    if scene.pressure is not None:
        say(f"{scene.name}: the trace of [gas] stays outside; give it to the FMU through cylinder[i].pressure")
    model = SceneModel(scene, say)
    made = plan(scene, model=model)
    parts, engine = model.parts(made.case), carried_engine(made)
    body = rigid(model.body(made.case)) if made.case.crank == "rigid" else model.body(made.case)
    data: dict[str, Any] = {"table": parts.table, "big_end_table": parts.big_end_table, "block": parts.block}
    data["block_bore" if scene.block == "flexible" else "bore"] = parts.bore
    if scene.damper == "fitted":
        data["damped_body"] = body
    interface = scene_interface(read_interface(DESCRIPTION), made, model, family_counts(engine))
    say(f"{scene.name}: {made.case}, {made.modes} modes; predicted error {made.predicted_error:.2g}")
    return build(
        engine, body, folder, say, interface=interface, fixed=fixed_settings(made, model), suffix=scene_suffix(made),
        **data,
    )  # fmt: skip


def build(
    engine: Engine,
    body: ReducedBody,
    folder: Path,
    say: Callable[[str], None],
    interface: Interface | None = None,
    fixed: Mapping[str, Any] | None = None,
    suffix: str = "",
    **data: Any,
) -> Path:
    """Write the FMU of ``engine`` with ``body`` into ``folder``; returns its path and says how large it is.

    ``interface`` defaults to the full one, ``fixed`` are settings that no variable of it changes, ``suffix`` ends the
    model's name. ``data`` may hold what levels of it need: ``block``, ``damped_body``, ``bore``, ``block_bore``,
    ``table`` and ``big_end_table``.

    The file appears whole or not at all. ``InputError`` where the interface or the code cannot go into an FMU.
    """
    interface = interface or read_interface(DESCRIPTION)
    contents = _contents(engine, interface, flat.to_bytes(flat.FlatModel(engine, body, **data)), fixed or {}, suffix)
    say(f"{engine.name}: {contents.model} {contents.guid}")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{contents.model}.fmu"
    files = _wrapped(contents)
    root = ElementTree.fromstring(files["modelDescription.xml"])
    complete(root, interface, contents.variables, contents.guid)
    files["modelDescription.xml"] = _xml(root)
    files.update(_accompanying(interface, engine))
    archive = _archive(files)
    _write(path, archive)
    say(f"{path.name}: {1e-6 * len(archive):.2f} MB, model data {1e-6 * len(contents.resources['model.bin']):.2f} MB")
    return path


def model_description(engine: Engine) -> bytes:
    """The model description of an engine's FMU; the GUID is that of an FMU without data, there being no FE model."""
    interface = read_interface(DESCRIPTION)
    contents = _contents(engine, interface, b"")
    root = ElementTree.fromstring(_wrapped(contents)["modelDescription.xml"])
    complete(root, interface, contents.variables, contents.guid)
    return _xml(root)


def write_reference(path: Path, say: Callable[[str], None]) -> None:
    """Write NAME_in.csv, NAME_ref.csv and NAME_ref.opt beside an FMU: the default experiment at its start values."""
    from fmpy import read_model_description, simulate_fmu

    say(f"{path.stem}: reference results of the default experiment")
    description = read_model_description(str(path))
    experiment = description.defaultExperiment
    start, stop, step = (float(getattr(experiment, name)) for name in ("startTime", "stopTime", "stepSize"))
    speed = next(v.start for v in description.modelVariables if v.name == "speed")
    rows = [["time", "speed"], [repr(start), speed], [repr(stop), speed]]  # no pressures: the gas stays built in
    result = simulate_fmu(str(path), output_interval=step)
    options = f"StartTime, {start!r}\nStopTime, {stop!r}\nStepSize, {step!r}\nRelTol, 0.0001\n"
    table = [list(result.dtype.names or ())] + [[repr(value) for value in row.tolist()] for row in result]
    _write(path.with_name(f"{path.stem}_in.csv"), _csv(rows))
    _write(path.with_name(f"{path.stem}_ref.csv"), _csv(table))
    _write(path.with_name(f"{path.stem}_ref.opt"), options.encode())


def _csv(rows: list[list[str]]) -> bytes:
    return "\n".join(",".join(row) for row in rows).encode()


# ---------------------------------------------------------------- contents


@dataclass(frozen=True)
class Contents:
    """What goes into resources/: names, and bytes by name."""

    model: str
    guid: str
    slave: str
    variables: tuple[Variable, ...]
    resources: dict[str, bytes]


def _contents(
    engine: Engine, interface: Interface, data: bytes, fixed: Mapping[str, Any] | None = None, suffix: str = ""
) -> Contents:
    code = running_code()
    package = f"cranktrain_{_digest(code)[:12]}"
    files = {f"{package}/{name}": _renamed(text, package) for name, text in code.items()}
    variables = expand(interface.variables, family_counts(engine))
    slave = (SOURCES / "cranktrain_slave.py").read_bytes()
    about = {
        "model": interface.prefix + "".join(part.capitalize() for part in engine.name.split("_")) + suffix,
        "package": package,
        "author": "Cranktrain contributors",
        "license": "BSD-3-Clause",
        "version": __version__,
        "reals": sum(v.type == "Real" for v in variables),
        "integers": sum(v.type == "Integer" for v in variables),
        "variables": [plain(v) for v in variables],
        "fixed": dict(fixed or {}),
    }
    table = json.dumps(about, sort_keys=True).encode()
    units = json.dumps([interface.units, [repr(v) for v in variables]], sort_keys=True).encode()
    digest = _digest({**files, "slave": slave, "variables": table, "units": units, "model": data})
    about["digest"] = digest
    files["variables.json"] = json.dumps(about, sort_keys=True, indent=1).encode()
    files["model.bin"] = data
    name = f"cranktrain_slave_{digest[:12]}"
    files[f"{name}.py"] = slave
    guid = "{" + "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])) + "}"
    return Contents(str(about["model"]), guid, name, variables, files)


def family_counts(engine: Engine) -> dict[str, int]:
    """How many members each family of interface.toml has for an engine."""
    mounts = len(engine.mounts.x) if engine.mounts is not None else 0
    return {"cylinders": engine.n_cylinders, "main_bearings": len(engine.crankshaft.main_widths), "mounts": mounts}


def running_code() -> dict[str, bytes]:
    """Source of every module that a running model imports, by path inside the package.

    Follows module-level imports from the simulation and the data reader; refuses what an FMU cannot carry.
    """
    found: dict[str, bytes] = {}
    waiting = list(RUNNING)
    while waiting:
        module = waiting.pop()
        place = SOURCES / Path(*module.split("."))
        file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
        if not file.is_file():
            raise InputError(f"{module}: no such module; the running model imports it")
        name = file.relative_to(SOURCES / "cranktrain").as_posix()
        if name in found:
            continue
        found[name] = file.read_bytes()
        waiting += [".".join(module.split(".")[:n]) for n in range(1, module.count(".") + 1)]
        for imported in _imports(found[name], module):
            top = imported.split(".")[0]
            if top == "cranktrain":
                waiting.append(imported)
            elif top not in FOREIGN:
                raise InputError(f"{module} imports {top}; the FMU carries numpy and numba only, import it where used")
    return dict(sorted(found.items()))


def _imports(source: bytes, module: str) -> Iterator[str]:
    """Modules imported at module level; names imported from a package count where they are modules."""
    blocks: list[ast.stmt] = list(ast.parse(source).body)
    while blocks:
        node = blocks.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.If | ast.Try | ast.With):
            blocks += [child for child in ast.walk(node) if isinstance(child, ast.Import | ast.ImportFrom)]
        elif isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.startswith("cranktrain") and alias.asname is None:
                    raise InputError(f"{module}: write 'import {alias.name} as ...'; the FMU renames the package")
                yield alias.name
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                raise InputError(f"{module}: relative import; name the package in full")
            yield str(node.module)
            for alias in node.names:
                inside = SOURCES / Path(*str(node.module).split(".")) / alias.name
                if inside.is_dir() or inside.with_suffix(".py").is_file():
                    yield f"{node.module}.{alias.name}"


def _renamed(source: bytes, package: str) -> bytes:
    """Source with its imports of cranktrain pointed to the package of this FMU."""
    return re.sub(rb"(?m)^(\s*(?:from|import)\s+)cranktrain\b", rb"\1" + package.encode(), source)


def _digest(files: dict[str, bytes]) -> str:
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(f"{name}\0{len(files[name])}\0".encode() + files[name])
    return digest.hexdigest()


# ---------------------------------------------------------------- archive


def _wrapped(contents: Contents) -> dict[str, bytes]:
    """Files of the FMU as the wrapping library builds it, by name in the archive."""
    from pythonfmu import FmuBuilder

    with tempfile.TemporaryDirectory(prefix="cranktrain_fmu_") as temporary:
        source, built = Path(temporary) / "resources", Path(temporary) / "built"
        for name, data in contents.resources.items():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes(data)
        path, modules = list(sys.path), set(sys.modules)
        sys.path.insert(0, str(source))
        try:
            fmu = FmuBuilder.build_FMU(
                source / f"{contents.slave}.py",
                dest=built,
                project_files=[p for p in source.iterdir() if p.name != f"{contents.slave}.py" and p.name[0] != "_"],
                canGetAndSetFMUstate=True,
                canSerializeFMUstate=True,
            )
        finally:
            sys.path[:] = path
            for name in set(sys.modules) - modules:
                if name.startswith("cranktrain_slave_"):
                    del sys.modules[name]
        with zipfile.ZipFile(fmu) as archive:
            return {
                name: archive.read(name)
                for name in archive.namelist()
                if not name.startswith("binaries/") or name.split("/")[1] in PLATFORMS
            }


def _accompanying(interface: Interface, engine: Engine) -> dict[str, bytes]:
    """Documentation, licences and icon."""
    page = (DESCRIPTION / "documentation" / "index.html").read_text(encoding="utf-8")
    page = page.replace("<!-- title -->", engine.title)
    page = page.replace("<!-- variables -->", variable_table(interface, family_counts(engine)))
    files = {"documentation/index.html": page.encode(), "model.png": (DESCRIPTION / "model.png").read_bytes()}
    files["documentation/externalDependencies.txt"] = (DESCRIPTION / "externalDependencies.txt").read_bytes()
    files["documentation/licenses/license.txt"] = (ROOT / "LICENSE").read_bytes()
    for file in importlib.metadata.files("pythonfmu") or ():
        if file.name == "LICENSE":
            files["documentation/licenses/pythonfmu.txt"] = file.read_binary()
    return files


def _xml(root: ElementTree.Element) -> bytes:
    for element in root.iter():  # the library's line breaks, to be set anew
        element.tail = None
        if element.text is not None and not element.text.strip():
            element.text = None
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _archive(files: dict[str, bytes]) -> bytes:
    import io

    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, files[name])
    return buffer.getvalue()


def _write(path: Path, data: bytes) -> None:
    handle, temporary = tempfile.mkstemp(prefix=path.name, dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


if __name__ == "__main__":
    sys.exit(main())
