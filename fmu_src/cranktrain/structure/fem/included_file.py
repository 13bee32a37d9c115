"""Files included by input decks of other programs: permitted folders and depth of inclusion.

A deck may come from an untrusted source. Its included files must therefore lie below its own folder, or below a folder
that the user names in the environment variable ``CRANKTRAIN_INCLUDES`` (several with the system's separator of paths).
"""

from __future__ import annotations

import os
from pathlib import Path

from cranktrain.core.errors import InputError, shown
from cranktrain.core.user_file import check_file, file_exists, user_path
from cranktrain.structure.fem.mesh_parts import Place

VARIABLE = "CRANKTRAIN_INCLUDES"
DEEPEST = 100
"""Largest number of nested inclusions."""


def included_file(place: Place, keyword: str, name: str, deck: Path) -> Path:
    """Path of a file named by a keyword, relative to the deck; ``InputError`` if it is not permitted or not there.

    ``deck`` is the main file that the user gave.
    """
    target = place.path.parent / name
    found = target.resolve()
    folders = [deck.parent, *(user_path(text) for text in os.environ.get(VARIABLE, "").split(os.pathsep) if text)]
    if not any(found.is_relative_to(folder.resolve()) for folder in folders):
        raise InputError(
            f"{place}: {keyword} names {shown(name)}, which is not below the deck's folder {deck.parent}; put it "
            f"there, or name its folder in the environment variable {VARIABLE}"
        )
    check_file(found, f"{place}: {keyword} names {shown(name)}, which", "put a file there")
    if not name or not file_exists(found):
        raise InputError(f"{place}: {keyword} names {shown(name)}, which is not in {place.path.parent}; put it there")
    return target


def check_depth(place: Place, target: Path, inside: tuple[Path, ...]) -> None:
    """Refuse a file that includes itself or is nested deeper than ``DEEPEST``; ``inside`` are the including files."""
    if target.resolve() in [one.resolve() for one in inside]:
        raise InputError(f"{place}: {target.name} includes itself, by {' -> '.join(one.name for one in inside)}")
    if len(inside) > DEEPEST:
        raise InputError(f"{place}: {DEEPEST} files include each other; join some of them")
