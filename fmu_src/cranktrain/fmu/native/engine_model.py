"""Data of an engine for the cranktrain's library: one variant for each different combination of levels."""

from collections.abc import Callable, Mapping
from typing import Any

from cranktrain.core.errors import InputError
from cranktrain.core.machine_code import WHOLE
from cranktrain.dynamics.model.choices import GEOMETRY_SLOTS, NUMBER_SLOTS, option_slots
from cranktrain.dynamics.model.lumped_data import lumped_values
from cranktrain.dynamics.model.settings import resolved
from cranktrain.dynamics.model.state import EACH_POINT, LIMITED
from cranktrain.dynamics.outputs.register import families_of, output_counts, output_names
from cranktrain.dynamics.run_record import make_run
from cranktrain.dynamics.simulation import Simulation, input_names
from cranktrain.dynamics.time.status import FAILED, statuses
from cranktrain.fmu.description import Product
from cranktrain.fmu.flat import FlatModel
from cranktrain.fmu.native.exports import functions
from cranktrain.fmu.native.image import Images, leaf_numbers
from cranktrain.fmu.native.interface import NativeModel
from cranktrain.fmu.running import chosen_levels
from cranktrain.loads.gas_pressure import GasTrace

LEVELS = ("crank", "bearings", "big_ends", "block", "pistons", "damper", "boundary")
"""Settings on which the structure of a run depends."""
WARMTH = "film_temperature"
"""Setting whose values other than ``engine`` need runs before the start, which only a Python FMU can make."""
LEAVES = {
    "state": "state",
    "inputs": "inputs",
    "outputs": "outputs.values",
    "families": "outputs.families",
    "numbers": "numbers",
    "input_rates": "work.input_rates",
    "staged": "work.staged",
}
"""Paths, within ``Run``, of the arrays and numbers that the C side uses, by their names in C."""


def engine_model(model: FlatModel, product: Product, say: Callable[[str], None] = lambda text: None) -> NativeModel:
    """Native model with runs at all levels that a product's variables can choose.

    For combinations that are contradictory, or whose data are missing, the message of the refusal is stored.
    """
    variants = _Variants(model, product)
    say(f"{model.engine.name}: levels")
    counts = output_counts(model.engine)
    return NativeModel(
        kind=variants.kind,
        inputs=input_names(model.engine),
        outputs=output_names(counts),
        slots=NUMBER_SLOTS | GEOMETRY_SLOTS | {one.name: one.slot for one in lumped_values(model.engine)},
        options=option_slots(),
        levels={str(v.setting): v.choices for v in product.variables if v.setting in (*LEVELS, WARMTH)},
        variant=variants.row,
        families=families_of(counts),
        statuses={code: (kind == FAILED, text) for code, (kind, text) in statuses(input_names(model.engine)).items()},
        about={"limited": str(LIMITED), "told": Simulation.told, "each_point": str(EACH_POINT)},
        leaves=variants.leaves,
        tables=variants.tables,
    )


_LUMPS = "model.lumps."
_SCRATCH = tuple(_LUMPS + name for name in ("room", "vectors", "scratch"))


class _Variants:
    """Collection of variants, one for each different complete combination of levels."""

    def __init__(self, model: FlatModel, product: Product) -> None:
        self.model, self.fixed = model, dict(product.fixed)
        self.names = {str(v.setting): v.name for v in product.variables if v.setting}
        self.images = Images({name: k for k, name in enumerate(functions(WHOLE))}, is_constant)
        self.gas = model.gas or GasTrace.from_engine(model.engine)
        self.known: dict[tuple[str, ...], int] = {}
        self.films: dict[Any, Any] = {}
        self._leaves: dict[str, int] = {}

    def row(self, chosen: Mapping[str, str]) -> int:
        """Number of the variant for a combination of levels; ``InputError`` if the combination is refused."""
        if chosen.get(WARMTH, "engine") != "engine":
            raise InputError(
                f"'{self.names[WARMTH]}' is '{chosen[WARMTH]}', which needs runs before the start; a native FMU makes "
                "none: build the Python FMU with build_fmu.py --python, or choose 'engine'"
            )
        levels = chosen_levels(self.model, {**self.fixed, **chosen}, self.names)
        settings = resolved(levels.settings, levels.engine)
        key = tuple(str(getattr(settings, level)) for level in LEVELS)
        if key not in self.known:
            made = Simulation(*levels._replace(gas=self.gas))
            # Settings that no level determines follow from the integrator, which the FMU's parameters choose.
            run = make_run(made.engine, made.body, levels.settings, made.gas, made.parts, self.films)
            self.known[key] = self.images.add(run, dict(enumerate(run.numbers.tolist())))
            self._leaves = self._leaves or leaf_numbers(run, LEAVES)
        return self.known[key]

    def kind(self) -> str:
        """Kind of library whose kernels the variants made so far call."""
        own = WHOLE.partition("+")[0]
        return WHOLE if self.images.called - set(range(len(functions(own)))) else own

    def leaves(self) -> dict[str, int]:
        """Numbers of those leaves (arrays, numbers) of a run that the C side uses; equal in all variants."""
        return self._leaves

    def tables(self) -> dict[str, Any]:
        """Sections of native.bin for the variants made so far."""
        return self.images.sections()


def is_constant(path: str) -> bool:
    """True if no kernel writes an array of a run or of a law's record: film tables, constants of lumped data."""
    if path.startswith(_LUMPS):
        return path not in _SCRATCH
    return ".table." in path or path.endswith(".table")
