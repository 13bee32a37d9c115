"""Exports of each share of the kernels: entry points of a run, and functions that kernels call by address."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.kernel import kernel_name
from cranktrain.core.machine_code import ENTRIES, share_of, shares_of
from cranktrain.core.named import resolve
from cranktrain.dynamics.outputs.register import FAMILIES as OUTPUT_FAMILIES
from cranktrain.dynamics.time.integrators import FAMILIES as INTEGRATOR_FAMILIES
from cranktrain.dynamics.topology.laws import CONNECTION_LAWS
from cranktrain.film.laws.films import NUMBERS, SIZE
from cranktrain.film.laws.register import forms
from cranktrain.modules.module_settings import from_bytes
from cranktrain.modules.register import MODULES, module_files, module_of


class Function(NamedTuple):
    """Kernel that other kernels call by address, and a function that returns its arguments for a given run."""

    kernel: Any
    arguments: Callable[[Any], tuple[Any, ...]]


class Exports(NamedTuple):
    """Exports of a share: a run with the types of the entries, the kernels of the entries, and functions by name.

    ``calls`` are further kernels that Python calls, with arguments; the rest have been called already.
    """

    run: Any
    entries: Mapping[str, Any]
    functions: Mapping[str, Function]
    calls: Iterable[tuple[Any, tuple[Any, ...]]] = ()


def exports(share: str) -> Exports:
    """Exports of a share, after calls of all kernels that Python calls when it makes runs."""
    if share in MODULES:
        package = MODULES[share].running.rpartition(".")[0]
        path = next(path for path in module_files().values() if module_of(path).name == share)
        settings = from_bytes(resolve(f"{package}.running:SETTINGS"), module_of(path).read(path).data)
        run = resolve(f"{package}.settings:make_run")(settings)
        return Exports(run, _entries(f"{package}.run_record", *ENTRIES), {})
    from cranktrain.fmu.native.typical_run import film_calls, stage_calls, typical_calls, typical_run

    run, module = typical_run(), "cranktrain.dynamics.run_record"
    own = {name: row for name, row in _named().items() if share_of(name) == share}
    if share == "films":
        film_calls()
        return Exports(run, {}, own)
    if share == "parts":
        typical_calls(run)
        return Exports(run, _entries(module, "prepare"), own)
    return Exports(run, _entries(module, "start", "advance", "observe"), own, stage_calls(run))


def _entries(module: str, *names: str) -> dict[str, Any]:
    return {name: resolve(f"{module}:{ENTRIES[name]}") for name in names}


def functions(kind: str) -> dict[str, Function]:
    """Functions that a library of this kind exports, by name, in their order in the library."""
    shares = [share for part in kind.split("+") for share in shares_of(part)]
    return {name: row for share in shares for name, row in _named().items() if share_of(name) == share}


def _named() -> dict[str, Function]:
    return {kernel_name(row.kernel): row for row in _functions()}


def _functions() -> Iterator[Function]:
    """Force laws, output families, integrator steps, and steps' differences from an embedded solution."""
    z = np.zeros
    of_law = (0, 0, 0, z(4), z(4), z(NUMBERS), z(1), z(SIZE))
    for form in forms():
        yield Function(resolve(form.kernel), lambda run: of_law)
    for law in CONNECTION_LAWS.values():
        if law.kernel is not None:
            yield Function(law.kernel, lambda run: of_law)
    for family in OUTPUT_FAMILIES.values():
        yield Function(resolve(family.kernel), lambda run: (run.model, run.work, z(1), 0, z(1)))
    for steps in INTEGRATOR_FAMILIES.values():
        yield Function(resolve(steps.step), lambda run: (run.model, run.work, z(1), 0, 0.0))
        if steps.difference:
            yield Function(resolve(steps.difference), lambda run: (run.model, run.work, 0.0))
