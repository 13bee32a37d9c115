"""FMU of a module other than the cranktrain: interface and documentation from a folder, data from a module file."""

from collections.abc import Callable, Sequence
from pathlib import Path

from cranktrain.core.named import resolve
from cranktrain.fmu.archive import DESCRIPTION, fmu_path, need_sources, write_fmu
from cranktrain.fmu.description import Interface, Product, read_interface
from cranktrain.fmu.engine_fmu import camel
from cranktrain.fmu.native.archive import write_native_fmu
from cranktrain.fmu.native.image import Images, leaf_numbers
from cranktrain.fmu.native.interface import NativeModel
from cranktrain.modules.module_settings import from_bytes
from cranktrain.modules.register import Module, module_of
from cranktrain.modules.statuses import FAILED

LEAVES = ("state", "inputs", "outputs", "numbers")
"""Names of the arrays of a run that the C side uses."""


def module_model(module: Module, product: Product) -> NativeModel:
    """Native model of a module's run, with the settings of a product's data and without levels."""
    package = module.running.rpartition(".")[0]
    settings = from_bytes(resolve(f"{module.running}:SETTINGS"), product.data, product.model)
    run = resolve(f"{package}.settings:make_run")(settings)
    names = {str(v.setting): v.name for v in product.variables if v.setting}
    made = resolve(f"{package}.simulation:native_interface")(settings, names)
    places = {name: slot for slot, name in enumerate(made.numbers)}
    images = Images({}, frozenset(made.constant).__contains__)
    images.add(run, dict(enumerate(run.numbers.tolist())))
    return NativeModel(
        kind=lambda: module.name,
        inputs=made.inputs,
        outputs=made.outputs,
        slots=places,
        options={name: (places[name], values) for name, values in made.choices.items()},
        variant=lambda chosen: 0,
        about=made.about,
        statuses={code: (kind == FAILED, text) for code, (kind, text) in made.statuses.items()},
        leaves=lambda: leaf_numbers(run, {name: name for name in LEAVES}),
        tables=images.sections,
    )


def module_product(path: str | Path) -> Product:
    """Description of the FMU of a module file; ``InputError`` if the file cannot be used."""
    module = module_of(Path(path))
    made = module.read(Path(path))
    interface = module_interface(module).of(made.variant)
    return Product(
        model=interface.prefix + camel(made.name),
        title=made.title,
        interface=interface,
        counts=made.counts,
        pages=module.folder,
        running=module.running,
        data=made.data,
        starts=made.starts,
    )


def module_interface(module: Module) -> Interface:
    """Interface of a module; its units are from the cranktrain's table."""
    need_sources()
    return read_interface(module.folder, DESCRIPTION)


def build_module(
    path: str | Path,
    folder: str | Path,
    say: Callable[[str], None] = lambda text: None,
    platforms: Sequence[str] = (),
    fmi: str = "2.0",
) -> Path:
    """Write the FMU of a module file into ``folder``; returns its path. It is written completely or not at all.

    With ``platforms`` it is a native FMU for these, of version ``fmi``, otherwise the Python FMU.
    """
    product = module_product(path)
    fmu_path(product, folder)
    if not platforms:
        return write_fmu(product, folder, say)
    return write_native_fmu(product, module_model(module_of(Path(path)), product), folder, platforms, say, fmi)
