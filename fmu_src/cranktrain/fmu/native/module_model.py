"""Data for the library of a module other than the cranktrain."""

from cranktrain.core.named import resolve
from cranktrain.fmu.archive import Product
from cranktrain.fmu.native.image import Images, leaf_numbers
from cranktrain.fmu.native.interface import NativeModel
from cranktrain.modules.module_settings import from_bytes
from cranktrain.modules.register import Module
from cranktrain.modules.statuses import FAILED

LEAVES = ("state", "inputs", "outputs", "numbers")
"""Names of the arrays of a run that the C side uses."""


def module_model(module: Module, product: Product) -> NativeModel:
    """Native model of a module's run, with the settings of a product's data and without levels."""
    package = module.running.rpartition(".")[0]
    settings = from_bytes(resolve(f"{module.running}:SETTINGS"), product.data, product.model)
    run = resolve(f"{package}.settings:make_run")(settings)
    names = {str(v.setting): v.name for v in product.variables if v.setting}
    made = resolve(f"{package}.native:native_interface")(settings, names)
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
        statuses={code: (kind == FAILED, text) for code, (kind, text) in made.statuses.items()},
        leaves=lambda: leaf_numbers(run, {name: name for name in LEAVES}),
        tables=images.sections,
    )
