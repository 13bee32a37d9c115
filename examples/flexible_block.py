"""What a flexible block changes in a cranktrain's frequencies.

``python examples/flexible_block.py > docs/flexible_block.md``; the first run makes the finite elements of both engines
and takes some minutes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from cranktrain.engine.file import load_engine
from cranktrain.results.tables import block_tables
from cranktrain.structure.block.modal import block_report
from cranktrain.structure.block.reduction import complete_block, reduced_block, running_block
from cranktrain.structure.crank.reduction import reduced_crankshaft

INTRODUCTION = """# The flexible block

Made by

    python examples/flexible_block.py > docs/flexible_block.md

and, for one engine and with all modes, `cranktrain modal diesel_i6 --block flexible`. The block of each engine file is
meshed from its table `[block]` (`cranktrain/structure/block/shape.py`) or read from a file with named surfaces
(`--block-mesh`), reduced by the crankshaft's path and put on the mounts of `[mounts]`. The engines are calibrated in
their blocks ([how](how-to/calibrate.md), [why](decisions/0022-calibration-and-stand-ins.md)). Linear main bearings join
journals and bores; the thrust bearing acts with collar and shells. On ground `main_bearing.block_stiffness_x`,
`block_stiffness_y` and `thrust.block_stiffness` stand in series for the block, which brings its own. Of the six, ground
holds torsion and axial motion to 2 %, bending to 7 %: it does not move against the crank. The V8's rollers have no such
share.

The table pairs modes by the shape of the crank (modal assurance criterion, MAC; a dash where it is below 0.5). The
rigid block has the same mass and the same mounts: from ground to it the bearings' feet begin to move, from it
to the flexible one they begin to give way.
"""


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Table of texts."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def figures(name: str) -> tuple[str, float]:
    """Section of one engine, and the frequency of its torsional mode in the flexible block, Hz."""
    engine = load_engine(name)
    tell = lambda stage: print(f"{name}: {stage}", file=sys.stderr, flush=True)  # noqa: E731
    body = reduced_crankshaft(engine, progress=tell)
    block = reduced_block(engine, progress=tell, checked=True)
    report: dict[str, Any] = block_report(engine, body, block)
    complete, running = complete_block(engine, block), running_block(engine, block)
    table = block_tables(report)[0]

    def stiffness(interface: str, component: int) -> float:
        row = complete.shapes[complete.index(interface), component, 6:] / complete.omega[6:]
        return 1e-9 / float(row @ row)

    mains = range(1, len(engine.crankshaft.main_widths) + 1)
    across, up = ([stiffness(f"bore[{i}]", k) for i in mains] for k in (0, 1))
    quality = report["reduction"]
    free = np.array(report["free_hz"])
    facts = (
        f"Block {block.mass:.0f} kg, with heads {report['mass_kg']:.0f} kg; first elastic modes with heads, free: "
        f"{', '.join(f'{hz:.0f}' for hz in free[:4])} Hz. On its mounts the engine moves as a whole at "
        f"{', '.join(f'{hz:.1f}' for hz in report['mounts_hz'])} Hz. {quality['dofs_full']} degrees of freedom, "
        f"{quality['modes']} modes, {running.n_modes} in the running model; reduced against full to 1000 Hz "
        f"{100.0 * quality['max_relative_error']:.2f} %.\n\nElastic stiffness of the free block, kN/um: bores across "
        f"{min(across):.2f} to {max(across):.2f}, upwards {min(up):.2f} to {max(up):.2f}, thrust faces along the axis "
        f"{stiffness('thrust', 2):.2f} (on ground {1e-9 * engine.thrust.block_stiffness:.2f})."
    )
    torsional = next(float(pair["hz"]) for pair in report["ground"] if pair["shape"] == "torsional")
    return f"## {engine.title}\n\n{facts}\n\n{markdown(table.header, table.rows)}\n", torsional


def main(*engines: str) -> dict[str, float]:
    """Print the page; returns the torsional frequency of each engine in its block, Hz."""
    print(INTRODUCTION)
    sections = {name: figures(name) for name in engines}
    print("\n".join(text for text, _ in sections.values()), end="")
    return {name: torsional for name, (_, torsional) in sections.items()}


if __name__ == "__main__":
    main("diesel_i6", "diesel_v8")
