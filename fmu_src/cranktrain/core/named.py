"""Objects that a register refers to by name, ``package.module:name``, loaded at first use.

So a register does not import the modules that its rows name. In an FMU the package has another name.
"""

from collections.abc import Callable
from importlib import import_module
from operator import attrgetter
from typing import Any

from cranktrain.core.sources import PACKAGE

Named = str | Callable[..., Any]
"""A function, or its location as ``package.module:name``."""


def resolve(reference: Named) -> Any:
    """Object that ``reference`` names."""
    if not isinstance(reference, str):
        return reference
    module, _, name = reference.partition(":")
    top, dot, rest = module.partition(".")
    return attrgetter(name)(import_module(f"{PACKAGE if top == 'cranktrain' else top}{dot}{rest}"))
