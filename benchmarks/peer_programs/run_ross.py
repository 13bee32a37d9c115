"""A plain journal bearing with two axial grooves in ROSS: JOB; a request names a grid and how many of the job's speeds.

Answers are turned into axes along the load (−y there) and 90° on in the sense of rotation (x there).
"""

import json
import sys
import time
import warnings
from importlib.metadata import version

import numpy as np
from ross.bearings.plain_journal import PlainJournal


def solved(job, speeds, around, across, through):
    """Bearing and processor seconds; isothermal, rigid, laminar, and the same viscosity at all temperatures."""
    viscosity = float(job["viscosity"])
    oil = {
        "liquid_viscosity1": viscosity, "liquid_viscosity2": viscosity * (1.0 - 1e-9), "temperature1": 313.15,
        "temperature2": 373.15, "liquid_density": 860.0, "liquid_specific_heat": 2000.0,
        "liquid_thermal_conductivity": 0.13,
    }  # fmt: skip
    began = time.process_time()
    bearing = PlainJournal(
        n=0, pad_axial_length=float(job["width"]), journal_diameter=float(job["diameter"]),
        radial_clearance=float(job["clearance"]), n_pads=2, pad_arc=np.pi - float(job["groove"]),
        oil_supply_temperature=353.15, speed=speeds, fxs_load=0.0, fys_load=-float(job["load"]), lubricant=oil,
        oil_flow_v=1e-2, thermal_type=None, deform_type=None, re_laminar=1e5, re_turbulent=2e5,
        initial_position=(0.3, -0.6), total_ex_film=around, total_ez_film=across, total_ey_film=through,
        total_ey_pad=2,
    )  # fmt: skip
    return bearing, time.process_time() - began


def turn(job, request):
    speeds = job["speeds"][: request["speeds"]]
    bearing, seconds = solved(job, speeds, *request["grid"])
    matrices = {}
    for name in "kc":
        xx, xy, yx, yy = (np.array(getattr(bearing, name + axes)) for axes in ("xx", "xy", "yx", "yy"))
        rows = np.array([[yy, -yx], [-xy, xx]])
        matrices["stiffness" if name == "k" else "damping"] = rows.transpose(2, 0, 1).tolist()
    places = [float(out["eccentricity"][0]) for out in bearing._results.outputs]
    return {"seconds": seconds / len(speeds), "eccentricity": places, **matrices}


def main():
    warnings.simplefilter("ignore")
    with np.load(sys.argv[1]) as archive:
        job = dict(archive)
    solved(job, job["speeds"][:1], 8, 4, 4)  # compiled before any clock starts
    print("\nTURN", json.dumps({"version": version("ross-rotordynamics")}), flush=True)
    for line in sys.stdin:
        print("\nTURN", json.dumps(turn(job, json.loads(line))), flush=True)


main()
