"""Register of terminals: variables exchanged between modules of the virtual engine, or equal in all of them.

Entries of an interface.toml name the terminals that they belong to.
"""

from dataclasses import dataclass

PLUG, BUS = "plug", "bus"
"""Matching rules of terminals: all members must be present (plug), or only some (bus)."""


@dataclass(frozen=True)
class Terminal:
    """A terminal: variables exchanged between two modules.

    Attributes
    ----------
    rule : ``plug`` if all members must be present, ``bus`` if some may be missing
    title : description of the terminal
    place : centre of its icon on the FMU's icon, which extends from −100 to 100 across and from −62.5 to 62.5 up
    colour : colour of its connections, red, green and blue from 0 to 255
    """

    rule: str
    title: str
    place: tuple[float, float]
    colour: tuple[int, int, int]


TERMINALS = {
    "gas": Terminal(
        BUS, "Cranktrain and combustion: crank's angle and speed, volumes, pressures and their angle", (-60, 62.5),
        (196, 78, 32),
    ),
    "valve_drive": Terminal(
        PLUG, "Cranktrain and valve train: the crank's angle and speed, torque of the drive", (-100, 0), (70, 84, 104),
    ),
    "valves": Terminal(PLUG, "Combustion and valve train: lifts of the valves", (60, 62.5), (44, 110, 170)),
    "geometry": Terminal(BUS, "Dimensions that modules of one engine have in common", (100, 0), (90, 130, 60)),
}  # fmt: skip
"""Terminals by name: one for each pair of modules, and one for the values that are equal in all modules."""
