"""Documentation page of the engine library, made from the shipped files.

python docs/engine_library_page.py docs/engines.md
"""

import sys
import warnings
from pathlib import Path

import numpy as np
from engine_library import ROWS, SHIP

from cranktrain.engine.file import load_engine
from cranktrain.engine.firing import firing_text
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.crank.level import crank_body
from cranktrain.structure.crank.modal import cranktrain_modes, torsional_frequencies
from cranktrain.studies.design.balance import cylinder_places, largest

HEAD = """\
# Engines that ship

`cranktrain engines` lists them, and every verb takes their names: `cranktrain modal v6_split`. `diesel_i6` and
`diesel_v8` are the [reference's engines](diesel_i6.md). The others are one of each usual layout. Bore, stroke and power
are a maker's published figures where the last column says so; all other sizes follow from the rules of
[`cranktrain new`](how-to/new_engine.md), and no other data of these engines are in the files.

Free forces are those of the oscillating masses in closed form: first order in m r ω², second order in λ m r ω², moments
besides in the distance of neighbouring throws, of neighbouring pairs of split pins, or of the cylinders of a single
throw. `tests/properties/test_engine_library.py` compares the free forces and moments of a run's summary with them
within 0.1 %, and firing intervals exactly. `tests/properties/test_articulated_rods.py` compares forces of rods in a run
with their momentum within 2e-5, and forced torsion in time with that of the frequency domain within 1e-4. The torsional
frequency is that of the cranktrain at rest (level `beam`), the mean effective pressure that of the built-in trace at
full load.

"""
COLUMNS = (
    "name", "engine", "displacement", "firing", "free force, order 1; 2", "free moment, order 1; 2", "first torsion",
    "indicated pressure", "from",
)  # fmt: skip
TAIL = """
`four_petrol` has two balancer shafts against its second order ([added bodies](how-to/added_bodies.md)) and a dual-mass
flywheel whose bow springs rub; `generator_four` a rubber coupling that stiffens with torque, and its generator's load;
`two_stroke_six` shafting, a propeller and its load over speed ([drive line](how-to/drive_line.md)).

This page is made by `python docs/engine_library_page.py docs/engines.md`, the files by
`python docs/engine_library.py`.
"""


def page() -> str:
    """Text of the documentation page of the engine library."""
    table = f"| {' | '.join(COLUMNS)} |\n|{' --- |' * len(COLUMNS)}\n"
    return HEAD + table + "".join(_row(name) for name in (*ROWS, SHIP)) + TAIL


def _row(name: str) -> str:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        engine = load_engine(name)
    whole = engine.without_additions
    hz = torsional_frequencies(*cranktrain_modes(whole, crank_body(whole, "beam")))[0]
    source = ROWS[name].source if name in ROWS else "chosen in usual proportions"
    places = cylinder_places(engine).along
    banks, firing = np.array(engine.cylinders.bank_angles), np.array(engine.firing_angles)
    along = np.stack((-np.sin(banks), np.cos(banks)), axis=1)
    found = [
        [largest((weight * np.exp(-1j * order * firing)) @ along) for order in (1, 2)]
        for weight in (np.ones_like(places), places)
    ]
    forces, moments = ("; ".join(f"{round(value, 6) + 0.0:.3g}" for value in pair) for pair in found)
    litres = 1e3 * engine.displacement
    cells = (
        f"`{name}`", engine.title, f"{litres:.3g} l" if litres < 1000.0 else f"{engine.displacement:.3g} m³",
        firing_text(engine).removeprefix("Fires "), forces, moments, "–" if hz is None else f"{hz:.4g} Hz",
        f"{1e-5 * GasTrace.from_engine(engine).imep:.3g} bar", source,
    )  # fmt: skip
    return f"| {' | '.join(cells)} |\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8")
