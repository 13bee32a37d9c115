"""Recognition of columns of text tables by their names, in English and German.

Each kind of column has a list of words. A name belongs to a kind if it is one of these words, apart from numbers and
signs.
"""

import re
from collections.abc import Mapping, Sequence

from cranktrain.core.text_header import plain_name
from cranktrain.core.units import is_unit

WORDS: Mapping[str, tuple[str, ...]] = {
    "angle": (
        "angle", "crankangle", "crankangledeg", "crankshaftangle", "ca", "cad", "cadeg", "degca", "deg", "degree",
        "degrees", "phi", "theta", "alpha", "kw", "°kw", "°ca", "kwdeg", "winkel", "kurbelwinkel", "kurbelwellenwinkel",
        "kwwinkel", "grad", "gradkw", "phikw", "alphakw", "crank", "cadegrees", "rotation", "phideg",
    ),
    "pressure": (
        "pressure", "p", "pc", "pcyl", "pcylinder", "cylinderpressure", "cylpressure", "pz", "pzyl", "pzylinder",
        "druck",
        "zylinderdruck", "zyldruck", "pcylbar", "pbar", "pressurebar", "druckbar", "pind", "indicatedpressure",
        "gaspressure", "gasdruck", "brennraumdruck", "combustionpressure", "incylinderpressure", "pcomb", "cyl",
        "cylinder", "zyl", "zylinder", "pmean", "pavg", "meanpressure", "pmpa", "pkpa", "ppa", "ppsi",
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
    "disc": ("disc", "disk", "mass", "name", "scheibe", "drehmasse", "masse", "element", "station"),
    "inertia": ("inertia", "j", "momentofinertia", "trägheit", "trägheitsmoment", "massenträgheit", "theta",
                "massenträgheitsmoment", "drehträgheit", "polarinertia"),
    "damping": ("damping", "discdamping", "absolutedamping", "dämpfung", "absolutdämpfung", "massendämpfung"),
    "to": ("to", "nach", "bis", "next", "zu"),
    "stiffness": ("stiffness", "k", "torsionalstiffness", "steifigkeit", "drehsteifigkeit", "torsionssteifigkeit",
                  "drehfedersteifigkeit"),
    "shaft_damping": ("shaftdamping", "relativedamping", "wellendämpfung", "relativdämpfung"),
    "loss_factor": ("lossfactor", "verlustfaktor"),
    "ratio": ("ratio", "gearratio", "übersetzung", "i"),
    "torques": ("torques", "drehmomente", "momente"),
    "twists": ("twists", "verdrehwinkel", "verdrehungen"),
    "frequencies": ("frequencies", "frequenzen"),
    "frequency": ("frequency", "frequenz"),
    "friction": ("friction", "reibung", "reibmoment"),
    "slip_speed": ("slipspeed",),
    "diameter": ("diameter", "durchmesser", "d"),
    "bore": ("bore", "bohrung"),
    "strength": ("strength", "festigkeit", "zugfestigkeit"),
    "section": ("section", "querschnitt"),
    "duration": ("hours", "hour", "duration", "durationhours", "timeh", "stunden", "dauer", "laufzeit"),
}  # fmt: skip


NEUTRAL = frozenset(
    ("at", "in", "of", "no", "nr", "mean", "avg", "average", "mittel", "mittelwert", "cyl", "cylinder", "zyl",
     "zylinder", "the", "for")
)  # fmt: skip
"""Words in a column name that do not show the kind of the column, such as "mean" or "cylinder"."""


def kind_of(name: str, kinds: Sequence[str] = tuple(WORDS)) -> str:
    """Kind of a column from its name, one of ``kinds``; empty if the name belongs to no kind."""
    parts = [plain_name(part) for part in re.split(r"[^\w°]+|_", name)]
    telling = [part for part in parts if part and part not in NEUTRAL and not part.isdigit()]
    without_unit = telling[:-1] if len(telling) > 1 and is_unit(telling[-1]) else []
    for own in (plain_name(name), "".join(telling), "".join(without_unit)):
        for plain in (own, re.sub(r"\d+$", "", own)):
            found = [kind for kind in kinds if plain in WORDS[kind]]
            if found:
                return found[0]
    return ""


def columns_of(names: Sequence[str], kinds: Sequence[str]) -> dict[str, list[int]]:
    """Indices of the columns that belong to each of ``kinds``, by kind."""
    found: dict[str, list[int]] = {kind: [] for kind in kinds}
    for k, name in enumerate(names):
        if kind := kind_of(name, kinds):
            found[kind].append(k)
    return found
