"""Ladder of a scene: permitted pairs of crank and bearing level, from the lowest to the highest.

Without wishes a scene climbs rigid crank on films, torsional crank with its journals locked on their axis, beam, then
the solid crank under ever finer bearings. Next above a pair is the one with the next finer crank and the next finer
bearings.
"""

from cranktrain.dynamics.model.mains import mains_kind
from cranktrain.engine.levels import CRANKS, crank_level
from cranktrain.film.laws.register import DEAREST, bearing_law, usual_level
from cranktrain.studies.output_levels import bearing_ladder, lowest_levels
from cranktrain.studies.scene import STRESS, Scene

Pair = tuple[str, str]

SOLID = list(CRANKS)[-1]


def bearing_levels(scene: Scene) -> tuple[str, ...]:
    """Levels of the engine's main bearings, from the lowest to the highest."""
    return bearing_ladder(scene.engine.rollers_only)


def film(scene: Scene) -> str:
    """Lowest level of the mains with the physics of the engine's bearings: roller contacts or oil films."""
    return usual_level(mains_kind(scene.engine))


def candidates(scene: Scene) -> list[Pair]:
    """Pairs of levels for a plan: they provide the outputs up to the frequency and satisfy the scene's fixed choices.

    Elastic films take a hundred times as long as others, so they are included only for a scene with a budget, or one
    that names them.
    """
    levels, usual = bearing_levels(scene), film(scene)
    films = tuple(level for level in levels[levels.index(usual) :] if not dearest(level) or scene.budget is not None)
    if scene.bearings is not None:
        chain = [(crank, scene.bearings) for crank in CRANKS if scene.crank in (None, crank)]
    elif scene.crank is not None:
        turning = () if crank_level(scene.crank).bends else ("held",)
        chain = [(scene.crank, level) for level in (*turning, *films)]
    else:
        chain = [*_lower_cranks(scene), *((SOLID, level) for level in films)]
    return [pair for pair in chain if answers(scene, pair)]


def admits(scene: Scene, pair: Pair) -> bool:
    """True if a plan may choose a pair of levels, on the ladder or not, by the conditions of :func:`candidates`."""
    fixed = scene.crank in (None, pair[0]) and scene.bearings in (None, pair[1])
    cheap = not dearest(pair[1]) or scene.budget is not None or scene.bearings is not None
    return fixed and cheap and answers(scene, pair)


def every_pair(scene: Scene, with_ehd: bool) -> list[Pair]:
    """Pairs of levels for the ladder report that provide the scene's outputs, the lowest first."""
    levels = bearing_levels(scene)[1:]
    chain = [*_lower_cranks(scene), *((SOLID, level) for level in levels if with_ehd or not dearest(level))]
    return [pair for pair in chain if answers(scene, pair, by_frequency=False)]


def dearest(level: str) -> bool:
    """True if a bearing level has films that take about a hundred times as long as those of other levels."""
    return bearing_law(level).cost == DEAREST


def locked(level: str) -> bool:
    """True if a bearing level locks the journals on their axis, so that it has no bearings."""
    return not bearing_law(level).carries


def _lower_cranks(scene: Scene) -> list[Pair]:
    """Pairs of each crank level except the highest with its usual bearing level."""
    return [(crank, usual_level(crank, mains_kind(scene.engine))) for crank in CRANKS if crank != SOLID]


def answers(scene: Scene, pair: Pair, by_frequency: bool = True) -> bool:
    """True if a pair of levels provides all outputs of a scene up to its highest frequency."""
    crank, bearings = pair
    rollers = scene.engine.rollers_only
    lowest = lowest_levels((*scene.outputs, STRESS) if scene.stress else scene.outputs, rollers)
    levels = bearing_levels(scene)
    wanted = lowest.bearings if lowest.bearings in levels else levels[-1]
    if scene.block == "flexible" and (not CRANKS[crank].elastic or locked(bearings)):
        return False  # a moving block needs a crank and bearings that move with it
    if locked(bearings) and scene.big_ends != "rigid":
        return False  # big-end films need a crank whose pins move across the axis
    cranks = list(CRANKS)
    high_enough = cranks.index(crank) >= cranks.index(lowest.crank) and levels.index(bearings) >= levels.index(wanted)
    return high_enough and (not by_frequency or scene.frequency <= crank_level(crank).highest_frequency(scene.engine))


def next_pair(scene: Scene, pair: Pair, crank: bool = True, bearings: bool = True) -> Pair | None:
    """Pair with the next finer crank and the next finer bearings; None if both are the finest.

    ``crank`` and ``bearings`` say which of the two may change. Held mains belong to a crank that turns only: a finer
    one runs on the engine's own.
    """
    levels, usual = bearing_levels(scene), film(scene)
    higher = list(CRANKS.values())[list(CRANKS).index(pair[0]) + 1 :]
    if locked(pair[1]) and not CRANKS[pair[0]].elastic:
        return (higher[0].name, "held") if crank else (pair[0], usual) if bearings else None
    finer_crank = next((row.name for row in higher if row.bends), pair[0]) if crank else pair[0]
    finer = pair[1]
    if levels.index(pair[1]) < levels.index(usual) and (bearings or (locked(pair[1]) and finer_crank != pair[0])):
        finer = usual
    elif bearings and levels.index(pair[1]) + 1 < len(levels):
        finer = levels[levels.index(pair[1]) + 1]
    return (finer_crank, finer) if (finer_crank, finer) != pair else None
