"""The ladder of a scene: which pairs of crank and bearing level may serve it, from the lowest to the highest.

Without wishes a scene climbs rigid crank on films, torsional crank held in its mains, beam, then the solid crank under
ever finer bearings. Next above a pair stands the one with the next finer crank and the next finer bearings.
"""

from __future__ import annotations

from cranktrain.levels import BEARINGS, CRANKS, highest_frequency, lowest_levels
from cranktrain.studies.scene import STRESS, Scene

Pair = tuple[str, str]

DEAREST = "ehd"
ROLLERS = ("held", "linear", "roller")


def bearing_levels(scene: Scene) -> tuple[str, ...]:
    """Levels of the engine's main bearings, from the lowest to the highest."""
    return ROLLERS if scene.engine.main_roller is not None else BEARINGS


def film(scene: Scene) -> str:
    """Lowest level of the mains that moves as the engine's own bearings do: roller, or oil film."""
    return "roller" if scene.engine.main_roller is not None else "impedance"


def candidates(scene: Scene) -> list[Pair]:
    """Pairs that a plan chooses from: they answer the outputs up to the frequency, and are what the scene fixes.

    Elastic films take a hundred times as long as others: only a scene with a budget, or one that names them, gets them.
    """
    levels, usual = bearing_levels(scene), film(scene)
    films = tuple(level for level in levels[levels.index(usual) :] if level != DEAREST or scene.budget is not None)
    if scene.bearings is not None:
        chain = [(crank, scene.bearings) for crank in CRANKS if scene.crank in (None, crank)]
    elif scene.crank is not None:
        turning = ("held",) if scene.crank in ("rigid", "torsional") else ()
        chain = [(scene.crank, level) for level in (*turning, *films)]
    else:
        chain = [("rigid", usual), ("torsional", "held"), ("beam", usual), *(("solid", level) for level in films)]
    return [pair for pair in chain if answers(scene, pair)]


def every_pair(scene: Scene, with_ehd: bool) -> list[Pair]:
    """Pairs of the ladder report, the lowest first; those that the scene's outputs do not allow left out."""
    usual = film(scene)
    chain = [("rigid", usual), ("torsional", "held"), ("beam", usual)]
    chain += [("solid", level) for level in bearing_levels(scene)[1:] if with_ehd or level != "ehd"]
    return [pair for pair in chain if answers(scene, pair, by_frequency=False)]


def answers(scene: Scene, pair: Pair, by_frequency: bool = True) -> bool:
    """Whether a pair of levels answers all outputs of a scene, up to its frequency."""
    crank, bearings = pair
    rollers = scene.engine.main_roller is not None
    lowest = lowest_levels((*scene.outputs, STRESS) if scene.stress else scene.outputs, rollers)
    levels = bearing_levels(scene)
    wanted = lowest.bearings if lowest.bearings in levels else levels[-1]
    if scene.block == "flexible" and (crank == "rigid" or bearings == "held"):
        return False  # a block that moves asks for a crank and bearings that follow it
    if bearings == "held" and scene.big_ends != "rigid":
        return False  # films on the pins of a crank that does not move across would carry nothing
    high_enough = CRANKS.index(crank) >= CRANKS.index(lowest.crank) and levels.index(bearings) >= levels.index(wanted)
    return high_enough and (not by_frequency or scene.frequency <= highest_frequency(scene.engine, crank))


def next_pair(scene: Scene, pair: Pair, crank: bool = True, bearings: bool = True) -> Pair | None:
    """Pair with the next finer crank and the next finer bearings; None where neither is left.

    ``crank`` and ``bearings`` say which of the two may change. Held mains belong to a crank that turns only: a finer
    one runs on the engine's own.
    """
    if pair == ("rigid", "held"):
        return ("torsional", "held") if crank else ("rigid", film(scene)) if bearings else None
    levels, usual = bearing_levels(scene), film(scene)
    finer_crank = {"rigid": "beam", "torsional": "beam", "beam": "solid"}.get(pair[0], pair[0]) if crank else pair[0]
    finer = pair[1]
    if pair[1] in ("held", "linear") and (bearings or (pair[1] == "held" and finer_crank != pair[0])):
        finer = usual
    elif bearings and levels.index(pair[1]) + 1 < len(levels):
        finer = levels[levels.index(pair[1]) + 1]
    return (finer_crank, finer) if (finer_crank, finer) != pair else None
