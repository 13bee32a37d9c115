"""Tables of a native FMU's interface for the C side: variables, choices, statuses."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import prod
from types import MappingProxyType
from typing import Any

from cranktrain.core.errors import InputError
from cranktrain.fmu.description import Variable
from cranktrain.fmu.native import file_format as at
from cranktrain.fmu.native.file_format import Texts

TYPES = {"Real": at.REAL, "Integer": at.INTEGER, "String": at.STRING, "Enumeration": at.ENUMERATION}
CAUSALITIES = {"input": at.INPUT, "output": at.OUTPUT, "parameter": at.PARAMETER, "local": at.LOCAL}


@dataclass(frozen=True, kw_only=True)
class NativeModel:
    """Description of a product for its library.

    Attributes
    ----------
    kind : function that returns the kinds of kernels that the variants call, see
        :data:`cranktrain.core.machine_code.RESTS_ON`
    inputs, outputs : names in the run's order
    slots : index in ``run.numbers`` of each setting that a Real parameter sets; other parameters must stay at their
        start value
    options : for each String setting that is a number to the kernels, the slot and the number of each text
    levels : for each setting that selects the variant, its texts
    variant : function from a combination of levels, ``{setting: text}``, to its row; ``InputError`` if it is refused
    families : for each output in order, the rows of the output families to be evaluated for it
    statuses : texts of statuses, and True for a failed step (False for refused input)
    about : further entries of INFO: ``limited``, a place in the state, and ``told``, what to warn of if it is not 0
    leaves : function that returns the numbers of the leaves of a run that the C side uses, by its names for them
    tables : function that returns the sections of the variants, after ``variant`` was called for all of them
    """

    kind: Callable[[], str]
    inputs: Sequence[str]
    outputs: Sequence[str]
    slots: Mapping[str, int]
    options: Mapping[str, tuple[int, Mapping[str, float]]]
    levels: Mapping[str, Sequence[str]] = field(default_factory=dict)
    variant: Callable[[Mapping[str, str]], int]
    families: Sequence[Sequence[int]] = ()
    statuses: Mapping[int, tuple[bool, str]]
    about: Mapping[str, str] = field(default_factory=dict)
    leaves: Callable[[], Mapping[str, int]]
    tables: Callable[[], Mapping[str, Any]]


def interface_tables(
    model: NativeModel, variables: Sequence[Variable], texts: Texts, shown: Mapping[str, str] = MappingProxyType({})
) -> dict[str, list[Any]]:
    """Sections VARS, FAMS, CHOI, OPTN, LEVL, STAT and NAME of a model with these variables.

    ``shown`` has names that messages use instead of the variables' own.
    """
    tables: dict[str, list[Any]] = {name: [] for name in ("VARS", "FAMS", "CHOI", "OPTN", "LEVL")}
    levels: list[tuple[str, Sequence[str]]] = []
    for variable in sorted(variables, key=lambda v: v.reference):
        if variable.type in ("String", "Enumeration"):
            row = _choice(model, variable, texts, tables, levels)
        else:
            row = _number(model, variable, texts, tables["FAMS"])
        tables["VARS"].append(row | {"name": texts.at(shown.get(variable.name, variable.name))})
    tables["LEVL"] += [
        _variant(model, dict(zip([n for n, _ in levels], texts_of, strict=True)), texts)
        for texts_of in product(*(options for _, options in levels))
    ]
    assert len(tables["LEVL"]) == prod(len(options) for _, options in levels)
    tables["STAT"] = [
        {"code": code, "kind": int(failed), "text": texts.at(text)} for code, (failed, text) in model.statuses.items()
    ]
    tables["NAME"] = [{"name": texts.at(name), "leaf": leaf} for name, leaf in model.leaves().items()]
    return tables


def _number(model: NativeModel, variable: Variable, texts: Texts, families: list[int]) -> dict[str, Any]:
    """Row of section VARS for a Real variable, without its name."""
    row = _row(variable, texts)
    if variable.causality == "input":
        row["index"] = list(model.inputs).index(variable.name)
    elif variable.causality == "output":
        row["index"] = place = list(model.outputs).index(variable.name)
        row["first_family"] = len(families)
        families += model.families[place] if model.families else ()
        row["n_families"] = len(families) - row["first_family"]
    else:
        row["index"] = model.slots.get(str(variable.setting), at.NONE)
    return row


def _choice(
    model: NativeModel, variable: Variable, texts: Texts, tables: dict[str, list[Any]],
    levels: list[tuple[str, Sequence[str]]],
) -> dict[str, Any]:  # fmt: skip
    """Row of VARS for a String parameter or an enumeration, with its rows of CHOI and OPTN."""
    setting = str(variable.setting)
    choice = {"name": texts.at(variable.name), "first_option": len(tables["OPTN"])}
    if setting in model.levels:
        names = model.levels[setting]
        levels.append((setting, names))
        choice |= {"kind": at.LEVEL}
        options: list[dict[str, Any]] = [{"text": texts.at(name), "value": k} for k, name in enumerate(names)]
    else:
        slot, numbers = model.options[setting]
        choice |= {"kind": at.NUMBER, "index": slot}
        # Options have the order of the model description, because an enumeration's value is the number of its item.
        ordered = variable.choices if set(variable.choices) == set(numbers) else numbers
        options = [{"text": texts.at(name), "number": numbers[name]} for name in ordered]
    tables["OPTN"] += options
    row = _row(variable, texts) | {"index": len(tables["CHOI"])}
    tables["CHOI"].append(choice | {"n_options": len(options)})
    return row


def _row(variable: Variable, texts: Texts) -> dict[str, Any]:
    bounds = {
        "min": -at.LARGEST if variable.min is None else variable.min,
        "max": at.LARGEST if variable.max is None else variable.max,
    }
    start = variable.start
    row = {"start_text": texts.at(start)} if isinstance(start, str) else {"start": 0.0 if start is None else start}
    return {
        "type": TYPES[variable.type],
        "causality": CAUSALITIES[variable.causality],
        **row,
        **bounds,
        "nominal": variable.nominal or 0.0,
    }


def _variant(model: NativeModel, chosen: Mapping[str, str], texts: Texts) -> int:
    """Entry of section LEVL for a combination of levels: number of the variant, or REFUSED with a text."""
    try:
        return model.variant(chosen)
    except InputError as error:
        return at.REFUSED | texts.at(str(error))
