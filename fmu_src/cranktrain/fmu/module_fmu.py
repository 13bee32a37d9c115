"""FMU of a module other than the cranktrain: interface and documentation from a folder, data from a module file."""

from collections.abc import Callable, Sequence
from pathlib import Path

from cranktrain.fmu.archive import DESCRIPTION, Product, fmu_path, need_sources, write_fmu
from cranktrain.fmu.description import Interface, read_interface
from cranktrain.fmu.engine_fmu import camel
from cranktrain.fmu.native.archive import write_native_fmu
from cranktrain.fmu.native.module_model import module_model
from cranktrain.modules.register import Module, module_of


def module_product(path: str | Path) -> Product:
    """Description of the FMU of a module file; ``InputError`` if the file cannot be used."""
    module = module_of(Path(path))
    made = module.read(Path(path))
    interface = module_interface(module)
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
