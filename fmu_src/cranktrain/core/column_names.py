"""Columns of text tables recognised by their names, in English and German.

A kind of column has words of its own. A name is of a kind if it consists of such a word, numbers and signs aside.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from cranktrain.core.text_header import plain_name

WORDS: Mapping[str, tuple[str, ...]] = {
    "angle": (
        "angle", "crankangle", "crankangledeg", "crankshaftangle", "ca", "cad", "cadeg", "degca", "deg", "degree",
        "degrees", "phi", "theta", "alpha", "kw", "°kw", "°ca", "kwdeg", "winkel", "kurbelwinkel", "kurbelwellenwinkel",
        "kwwinkel", "grad", "gradkw", "phikw", "alphakw", "crank", "cadegrees", "rotation", "phideg",
    ),
    "pressure": (
        "pressure", "p", "pcyl", "pcylinder", "cylinderpressure", "cylpressure", "pz", "pzyl", "pzylinder", "druck",
        "zylinderdruck", "zyldruck", "pcylbar", "pbar", "pressurebar", "druckbar", "pind", "indicatedpressure",
        "gaspressure", "gasdruck", "brennraumdruck", "combustionpressure", "incylinderpressure", "pcomb", "cyl",
        "cylinder", "zyl", "zylinder", "pmean", "pavg", "meanpressure",
    ),
    "volume": ("v", "volume", "cylindervolume", "volumen", "zylindervolumen", "vcyl", "vzyl", "hubvolumen"),
    "speed": (
        "speedrpm", "speed", "rpm", "n", "enginespeed", "crankspeed", "drehzahl", "motordrehzahl", "nrpm", "nmot",
        "rotationalspeed", "speedrevmin", "speed1min", "drehzahlrpm", "drehzahl1min", "umin",
    ),
    "order": ("order", "ordnung", "motorordnung", "engineorder", "harmonic", "harmonische", "ord", "eo"),
    "amplitude": (
        "amplitude", "amp", "a", "value", "wert", "magnitude", "amplitudedeg", "level", "pegel", "betrag", "peak",
    ),
    "unit": ("unit", "units", "einheit", "dim", "dimension"),
    "load": ("load", "last", "loadfraction", "lastanteil"),
    "file": ("file", "datei", "filename", "dateiname", "path", "pfad", "trace"),
}  # fmt: skip


def kind_of(name: str, kinds: Sequence[str] = tuple(WORDS)) -> str:
    """Kind of a column by its name, of ``kinds``; empty where it is none of them."""
    plain = plain_name(name)
    short = re.sub(r"\d+$", "", plain)
    for own in (plain, short):
        found = [kind for kind in kinds if own in WORDS[kind]]
        if found:
            return found[0]
    return ""


def columns_of(names: Sequence[str], kinds: Sequence[str]) -> dict[str, list[int]]:
    """Columns of each of ``kinds``, by name."""
    found: dict[str, list[int]] = {kind: [] for kind in kinds}
    for k, name in enumerate(names):
        if kind := kind_of(name, kinds):
            found[kind].append(k)
    return found
