"""The verb ``run-in``: the relief that an engine's shells wear."""

from __future__ import annotations

import argparse
from typing import Any

from cranktrain.cli.console import labelled_bar, number, say

DESCRIPTION = """\
Axial profile that the shells of the main bearings wear to at the lowest speed of full load.

Straight shells are run at level reynolds. Wherever the least gap over a cycle and all mains stays below half the
roughness, the shell is worn away; this is repeated. The relief of an engine file is fitted to the worn shape, and a new
engine file is written.

relief_depth_um     depth at the edge
relief_share        width of the relief, as a share of each half width
relief_exponent     exponent of the rise
fit_error_um        RMS difference of fitted and worn shape (zeta, worn_um)
least_gap_um        least gap of each pass, negative where an edge lies in the shell
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    from cranktrain.studies.run_in import CYCLES, PASSES

    add = parser.add_argument
    add("engine", metavar="ENGINE", help="name of a shipped engine or path of a .toml file")
    add("--out", metavar="FILE", help="engine file to write; an existing file is not overwritten")
    add("--speed", type=number(1.0, 20_000.0, "rev/min"), metavar="N", help="rev/min (default: lowest at full load)")
    add("--crank", default="solid", metavar="LEVEL", help="solid (default) or beam")
    add("--passes", type=number(1, 100, "", int), default=PASSES, metavar="N", help=f"wear passes (default {PASSES})")
    add("--cycles", type=number(1, 100, "", int), default=CYCLES, metavar="N", help=f"cycles a run (default {CYCLES})")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Wear, write the engine file, and print the figures unless JSON is wanted."""
    from cranktrain.studies.run_in import run_in

    with labelled_bar("run-in") as (tell, follow):
        found = run_in(
            options.engine, options.out, speed_rpm=options.speed, crank=options.crank, passes=options.passes,
            cycles=options.cycles, say=tell, follow=follow,
        )  # fmt: skip
    if not options.json:
        print(
            f"{found['engine']}, {found['speed_rpm']:g} rev/min: relief {found['relief_depth_um']:.2f} um over "
            f"{found['relief_share']:.2f} of each half width, exponent {found['relief_exponent']:.2f} "
            f"(fitted within {found['fit_error_um']:.2f} um)"
        )
        print("Least gap by pass: " + ", ".join(f"{gap:.2f}" for gap in found["least_gap_um"]) + " um")
        if found["file"]:
            say(f"{found['file']} written")
    return found
