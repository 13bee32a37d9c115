"""Frequencies of a crank level compared with those of the solid crank, mode by mode.

Modes are compared by their shapes at the interfaces (modal assurance criterion; rotations count with the throw's
radius): each mode of the solid is paired with the most similar mode of the level, and with none if the criterion is
below a half. A torsional crank has twists only, so it is compared in its rotations, for modes of the solid that are
mostly torsion.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.types import Array
from cranktrain.engine.levels import crank_level
from cranktrain.engine.model import Engine
from cranktrain.results.tables import NOTHING, SAME_SHAPE, Table
from cranktrain.structure.crank.level import bare_crank, complete_crank
from cranktrain.structure.crank.modal import (
    KINDS,
    cranktrain_matrices,
    energy_shares,
    free_modes,
    listed_to,
    pulley_answers,
    torsional_frequencies,
)
from cranktrain.structure.crank.reduction import complete_crankshaft

_Modes = tuple[Array, Array, Array, Array]
"""Elastic modes: frequencies (k,) Hz, energy fractions (k, 3), pulley answers (k,), interface shapes (m, 6, k)."""


def level_frequencies(
    engine: Engine, level: str, solid: ReducedBody | None, own: ReducedBody | None = None
) -> dict[str, Any]:
    """Modes of the free complete crankshaft and of the cranktrain, at ``level`` and at level ``solid``; JSON-able.

    Returns ``level``, whether it was ``compared_with_solid`` and, for ``crankshaft_free`` and ``cranktrain``, the
    ``modes`` of the solid to 1000 Hz or its named ones (``solid_hz``, ``shape``, and ``hz``, ``deviation_percent``,
    ``mac`` where the level has it), and ``first_torsional`` and ``second_torsional`` likewise, None where no mode has
    the name. ``solid`` is the bare solid body. Without it the modes are those of the level alone (``hz``, ``shape``).
    ``own`` is the bare body of the level; without it the level makes its own.
    """
    row = crank_level(level)
    own = bare_crank(engine, level, solid if row.needs_solid(engine) else None) if own is None else own
    bodies = [] if solid is None else [complete_crankshaft(engine, solid)]
    bodies.append(complete_crank(engine, level, own))
    result: dict[str, Any] = {"level": level, "compared_with_solid": solid is not None}
    for name, rods in (("crankshaft_free", False), ("cranktrain", True)):
        found = [_modes(engine, body, rods) for body in bodies]
        hz, shares, answers, _ = found[0]
        highest = listed_to(torsional_frequencies(hz, shares, answers, engine.reduction.running_cutoff_hz))
        rows = np.flatnonzero(hz <= highest)
        if solid is None:
            listed = [{"hz": float(hz[k]), "shape": KINDS[int(np.argmax(shares[k]))]} for k in rows]
        else:
            listed = _compared(found, rows, engine.crankshaft.throw, twists=not row.bends)
        result[name] = {"modes": listed, **_torsional(engine, found)}
    return result


def _compared(found: list[_Modes], rows: NDArray[np.intp], radius: float, twists: bool) -> list[dict[str, Any]]:
    """Modes of the solid, each paired with the level's mode of the same shape; ``found`` has the modes of both."""
    (solid_hz, shares, _, shapes), (hz, _, _, moved) = found
    alike = _alike(shapes, moved, radius, twists)
    listed = []
    for k in rows:
        one = {"solid_hz": float(solid_hz[k]), "shape": KINDS[int(np.argmax(shares[k]))]}
        same = int(np.argmax(alike[k])) if alike.shape[1] else -1
        torsional = one["shape"] == "torsional"
        mutual = same >= 0 and alike[k, same] >= SAME_SHAPE and int(np.argmax(alike[:, same])) == k
        if mutual and (torsional or not twists):
            one |= _beside(solid_hz[k], hz[same]) | {"mac": float(alike[k, same])}
        listed.append(one)
    return listed


def level_tables(engine: Engine, report: dict[str, Any]) -> list[Table]:
    """Tables that compare the frequencies of a crank level with those of the solid crank."""
    level = report["level"]
    titles = {
        "crankshaft_free": f"{engine.name}, free crankshaft, no rods",
        "cranktrain": f"{engine.name}, cranktrain at rest",
    }
    compared = report["compared_with_solid"]
    header = ("solid / Hz", "shape", f"{level} / Hz", "deviation", "MAC") if compared else (f"{level} / Hz", "shape")

    def texts(row: dict[str, Any]) -> tuple[str, ...]:
        if not compared:
            return f"{row['hz']:.1f}", row["shape"]
        found = 3 * (NOTHING,)
        if "hz" in row:
            found = f"{row['hz']:.1f}", f"{row['deviation_percent']:+.1f} %", f"{row['mac']:.2f}"
        return f"{row['solid_hz']:.1f}", row["shape"], *found

    return [Table(title, header, tuple(map(texts, report[name]["modes"]))) for name, title in titles.items()]


def _modes(engine: Engine, crankshaft: ReducedBody, rods: bool) -> _Modes:
    """Elastic modes: frequencies (k,) Hz, energy fractions (k, 3), pulley answers (k,), interface shapes (m, 6, k)."""
    if not rods:
        return *free_modes(engine, crankshaft), crankshaft.shapes[:, :, 6:]
    squares, modes = eigh(*cranktrain_matrices(engine, crankshaft))
    squares, modes = squares[1:], modes[:, 1:]  # without the rigid rotation, the first mode
    shares = energy_shares(engine, crankshaft, modes, rods=True)
    answers = pulley_answers(engine, crankshaft, modes, squares)
    return np.sqrt(squares) / (2.0 * np.pi), shares, answers, crankshaft.shapes @ modes


def _alike(left: Array, right: Array, radius: float, twists: bool) -> Array:
    """Modal assurance criterion (k, l) of shapes (m, 6, k) and (m, 6, l)."""
    weights = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0]) if twists else np.array([1.0, 1.0, 1.0, radius, radius, radius])
    a, b = ((shapes * weights[:, None]).reshape(6 * shapes.shape[0], -1) for shapes in (left, right))
    sizes = np.outer(np.einsum("ij,ij->j", a, a), np.einsum("ij,ij->j", b, b))
    return np.asarray((a.T @ b) ** 2 / np.maximum(sizes, np.finfo(float).tiny))


def _beside(solid: float, own: float) -> dict[str, float]:
    return {"hz": float(own), "deviation_percent": 100.0 * float(own / solid - 1.0)}


def _torsional(engine: Engine, found: list[_Modes]) -> dict[str, dict[str, float] | None]:
    """First and second torsional frequency of the solid and of the level; None if a body has no such mode.

    ``found`` is of the solid and the level, or of the level alone.
    """
    highest = engine.reduction.running_cutoff_hz
    *solid, own = (torsional_frequencies(hz, shares, answers, highest) for hz, shares, answers, _ in found)
    names = ("first_torsional", "second_torsional")
    if not solid:
        return {name: None if hz is None else {"hz": hz} for name, hz in zip(names, own, strict=True)}
    result: dict[str, dict[str, float] | None] = {}
    for name, full, level in zip(names, solid[0], own, strict=True):
        both = {} if full is None or level is None else _beside(full, level)
        result[name] = both | ({} if full is None else {"solid_hz": full}) or None
    return result
