"""Objects that a register names, loaded when they are used: ``package.module:name``.

A register's rows thus rest on none of the modules that they name. In an FMU the package goes by another name.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from operator import attrgetter
from typing import Any

from cranktrain.core.sources import PACKAGE

Named = str | Callable[..., Any]
"""A function, or where it is: ``package.module:name``."""


def resolve(reference: Named) -> Any:
    """The object behind ``reference``."""
    if not isinstance(reference, str):
        return reference
    module, _, name = reference.partition(":")
    top, dot, rest = module.partition(".")
    return attrgetter(name)(import_module(f"{PACKAGE if top == 'cranktrain' else top}{dot}{rest}"))
