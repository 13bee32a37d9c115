"""Order in time of films that rupture and fill again: ``python -m benchmarks.rupture_order [PICTURE.png]``.

* ``model``: a ring of nodes (``_rupture_film.py``) over a cycle, as a film on a given orbit and as one that carries a
  free journal. Sources of error are separated: full (no void, suction allowed: the motion alone), fixed (voids move, no
  node changes sides) and free (both), by voids from the start of the step and by those of the stages.
* ``plates``: two plates that part and close, whose rupture and reformation fronts have an exact solution.
* ``films``: elastic films of mains along their orbits in running engines, and how much oil a cycle makes or loses.

Errors are differences from fine steps of ``esdirk3`` by the stages, or from the exact solution; an order is the slope
through all steps. Prints one JSON object.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
from benchmarks._orbit_stages import StagedFilms, engine_orbits  # noqa: E402
from benchmarks._rupture_film import (  # noqa: E402
    FIXED_SIDES,
    FREE_SIDES,
    GAP,
    IMPULSE,
    LOWEST,
    MOBILE,
    PLATES,
    PRESCRIBED,
    STAGES_RULE,
    START,
    SWITCHED,
    Ring,
    State,
    advance,
    content,
    full_state,
)
from numpy.typing import NDArray  # noqa: E402
from scipy.integrate import solve_ivp  # noqa: E402

from cranktrain.film.elastic.grid import LIMITS, OIL, STEP_LIMIT  # noqa: E402

Array = NDArray[np.float64]
CYCLE = 4.0 * math.pi
STEPS = [90, 120, 180, 240, 360, 480, 720]
"""Of a cycle; FINE in each a whole number of times."""
FINE = 5760
ENGINE_STEPS, ENGINE_FINE = [90, 120, 180, 240, 360], 1440
METHODS = ["backward-euler", "sdirk2", "esdirk3"]
ENGINES = {"single_petrol": 3000.0, "diesel_i6": 2000.0, "v12_petrol": 5000.0}
CASES = [("given orbit", PRESCRIBED, "full"), ("given orbit", PRESCRIBED, "fixed"), ("given orbit", PRESCRIBED, "free"),
         ("free journal", MOBILE, "full"), ("free journal", MOBILE, "free")]  # fmt: skip
GRIDS = [32, 64, 128]
LIGHT = 0.5
"""Load of a journal in a full film."""
GROOVE = 0.1
"""Pressure at the ends of the plates."""


def order(steps: Sequence[int], errors: Sequence[float]) -> float | None:
    """Slope of errors over steps, or none where an error vanishes."""
    if min(errors) < 1e-13 or len(errors) < 2:
        return None
    return round(float(-np.polyfit(np.log(steps), np.log(errors), 1)[0]), 2)


def row(steps: Sequence[int], errors: Sequence[float]) -> dict[str, Any]:
    """Errors and their order."""
    return {"errors": [float(f"{error:.3g}") for error in errors], "order": order(steps, errors)}


def model(motion: int, sides: str) -> dict[str, Any]:
    """Errors of every method and rule on a ring; ``sides``: full, fixed or free."""
    # A film that may pull on a journal holds it at a small load only.
    ring = Ring(load=LIGHT) if sides == "full" else Ring()
    begin = full_state(ring, motion)
    kept = FREE_SIDES if sides == "free" else FIXED_SIDES
    advance(ring, begin, "esdirk3", FINE // 4, CYCLE, (motion, STAGES_RULE, kept if sides == "full" else FREE_SIDES))
    found: dict[str, Any] = {}
    exact = begin.copy()
    fine = advance(ring, exact, "esdirk3", FINE, CYCLE, (motion, STAGES_RULE, kept))
    for method in METHODS:
        for name, rule in (("start", START), ("stages", STAGES_RULE)):
            if method == "backward-euler" and rule == START:
                continue
            runs = [ring_errors(ring, begin, method, steps, (motion, rule, kept), (exact, fine)) for steps in STEPS]
            found[f"{method}, {name}"] = {
                **{key: row(STEPS, [run[key] for run in runs]) for key in ("oil", "impulse", "place", "least_film")},
                "switched_per_step": round(float(runs[-1]["switched"]), 3),
                "least_fill": round(min(float(run["fill"]) for run in runs), 3),
            }
    return found


def ring_errors(
    ring: Ring, begin: State, method: str, steps: int, way: tuple[int, int, int], exact: tuple[State, Array]
) -> dict[str, float]:
    """Errors of a cycle in ``steps`` against its end and rows in FINE steps."""
    state, (end, fine) = begin.copy(), exact
    found = advance(ring, state, method, steps, CYCLE, way)
    same = fine[FINE // steps - 1 :: FINE // steps]
    impulse = slice(IMPULSE, IMPULSE + 2)
    return {
        "oil": float(np.abs(content(state) - content(end)).sum() / content(end).sum()),
        "impulse": float(np.abs(found[:, impulse] - same[:, impulse]).max() / np.abs(same[:, impulse]).max()),
        "place": float(np.abs(found[:, :2] - same[:, :2]).max()),
        "least_film": float(np.abs(found[:, GAP] / same[:, GAP] - 1.0).max()),
        "switched": float(found[:, SWITCHED].mean()),
        "fill": float(1.0 + found[:, LOWEST].min()),
    }


def exact_plates(end: float) -> tuple[float, float]:
    """Oil between the plates at ``end`` and length of full film from an end then, both of the whole ring.

    The gap is H = 1 − 0.3 cos t. While the ruptured region grows, p = p′ = 0 at its front, s² = 2 p₀ H³/Ḣ, and it
    leaves M(s) = H of that time behind. From the least s on the front returns by (H − M(s)) ṡ = H³ p₀/s − ½ Ḣ s.
    """

    def gap(t: Any) -> Any:
        return 1.0 - 0.3 * np.cos(t)

    def rate(t: Any) -> Any:
        return 0.3 * np.sin(t)

    times = np.linspace(1e-4, math.pi, 200_001)
    front = np.sqrt(2.0 * GROOVE * gap(times) ** 3 / rate(times))
    least = int(front.argmin())
    inside = np.flatnonzero(front[: least + 1] <= math.pi)
    # Fronts from the widest to the least full film, with the content that each left.
    fronts, left = front[inside][::-1], gap(times[inside])[::-1]

    def speed(t: float, s: Array) -> Array:
        still = np.interp(s, fronts, left)
        return (gap(t) ** 3 * GROOVE / s - 0.5 * rate(t) * s) / np.maximum(gap(t) - still, 1e-9)

    begin = times[least] + 1e-3
    solved = solve_ivp(speed, (begin, end), [front[least] * (1.0 + 1e-6)], rtol=1e-10, atol=1e-12, method="LSODA")
    s = float(solved.y[0, -1])
    behind = fronts >= s
    oil = s * gap(end) + np.trapezoid(np.append(np.interp(s, fronts, left), left[behind]), np.append(s, fronts[behind]))
    return 2.0 * float(oil), s


def plates() -> dict[str, Any]:
    """Errors of the oil between plates while the front returns: steps and nodes refined together."""
    end = 3.3
    oil, front = exact_plates(end)
    found: dict[str, Any] = {"exact_oil": round(oil, 5), "exact_full_length": round(front, 4), "nodes": GRIDS}
    for method in METHODS:
        for name, rule in (("start", START), ("stages", STAGES_RULE)):
            errors = []
            for nodes in GRIDS:
                ring = Ring(nodes, 0.0, 0.0, GROOVE)
                state = full_state(ring, PLATES)
                advance(ring, state, method, nodes, end, (PLATES, rule, FREE_SIDES))
                errors.append(abs(2.0 * math.pi / nodes * content(state).sum() / oil - 1.0))
            found[f"{method}, {name}"] = row(GRIDS, errors)
    return found


def films(name: str, rpm: float) -> dict[str, Any]:
    """Errors of elastic films of all mains of an engine along their orbits in a cycle."""
    orbits = engine_orbits(name, rpm)
    orbits.bore.film.constants[STEP_LIMIT : STEP_LIMIT + 4] = LIMITS
    alone = StagedFilms(orbits)
    alone.cycle("esdirk3", ENGINE_STEPS[-1])
    start = alone.memory.copy(), alone.end
    oil = alone.bore.memory.out[:, OIL].copy()
    fine = alone.cycle("esdirk3", ENGINE_FINE)
    found: dict[str, Any] = {"thinnest_film_um": round(1e6 * float(fine.least.min()), 2)}
    cases: list[tuple[str, StagedFilms, str]] = [(method, alone, method) for method in METHODS]
    cases.append(("esdirk3, lanes", StagedFilms(orbits, lanes=True), "esdirk3"))
    for title, which, method in cases:
        errors, missing, switched = [], [], 0.0
        for steps in ENGINE_STEPS:
            which.memory[:], which.end = start
            run = which.cycle(method, steps)
            same = slice(ENGINE_FINE // steps - 1, None, ENGINE_FINE // steps)
            errors.append((
                np.abs(np.minimum(run.unknowns, 0.0) - np.minimum(fine.unknowns, 0.0)).mean(),
                np.abs(run.impulses - fine.impulses[same]).max() / np.abs(fine.impulses).max(),
                np.abs(run.least - fine.least[same]).mean() / np.abs(fine.least).mean(),
            ))  # fmt: skip
            missing.append(float(np.abs((run.content[-1] - oil - run.gained[-1]) / oil).max()))
            switched = run.switched
        columns = dict(zip(("fill", "impulse", "least_film"), zip(*errors, strict=True), strict=True))
        found[title] = {key: row(ENGINE_STEPS, column) for key, column in columns.items()}
        found[title] |= {"oil_missing": [float(f"{m:.1g}") for m in missing], "switched_per_step": round(switched, 2)}
    return found


def draw(found: dict[str, Any], path: Path) -> None:
    """Errors over the step: of the ring's oil, of a free journal's place, and of an engine's films."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from cranktrain.store.whole_file import whole_file

    figure, axes = plt.subplots(1, 3, figsize=(14.0, 4.5), layout="constrained")
    engine = next(iter(found["films"]))
    panels: list[tuple[str, dict[str, Any], str, Callable[[int], float], Sequence[int]]] = [
        ("Ring on a given orbit: oil", found["model"]["given orbit, free"], "oil", lambda n: 720.0 / n, STEPS),
        ("Ring with a free journal: place", found["model"]["free journal, free"], "place", lambda n: 720.0 / n, STEPS),
        (f"Elastic films of {engine}: fill", found["films"][engine], "fill", lambda n: 720.0 / n, ENGINE_STEPS),
    ]  # fmt: skip
    for ax, (title, rows, key, degrees, steps) in zip(axes, panels, strict=True):
        for name, figures in rows.items():
            if isinstance(figures, dict) and key in figures:
                line = "--" if name.endswith("start") else "-"
                ax.loglog([degrees(n) for n in steps], figures[key]["errors"], line, marker="o", ms=3, label=name)
        ax.set(title=title, xlabel="step, degrees", ylabel="error, relative")
        ax.grid(which="both", alpha=0.2)
        ax.legend(fontsize=7, frameon=False)
    with whole_file(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")
    plt.close(figure)


def main() -> int:
    """Print the figures; draw them where a path is given."""
    found: dict[str, Any] = {"steps": STEPS, "engine_steps": ENGINE_STEPS, "model": {}, "films": {}}
    for title, motion, sides in CASES:
        found["model"][f"{title}, {sides}"] = model(motion, sides)
    found["plates"] = plates()
    for name, rpm in ENGINES.items():
        found["films"][name] = films(name, rpm)
    if len(sys.argv) > 1:
        draw(found, Path(sys.argv[1]))
    print(json.dumps(found, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
