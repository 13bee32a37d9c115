"""A chain of discs and shafts under given torques in openTorsion: JOB; each request runs all speeds of the job."""

import json
import sys
import time
from importlib.metadata import version

import numpy as np
from opentorsion import Assembly, Disk, Shaft


def assembled(job):
    """Shafts that carry the inertia between neighbours, discs with the rest, and one behind them that nothing moves."""
    between = job["between"]
    rest = job["inertia"] - 2.0 * (np.pad(between, (1, 0)) + np.pad(between, (0, 1)))
    discs = [Disk(k, inertia) for k, inertia in enumerate(rest)]
    last = len(discs)
    shafts = [Shaft(k, k + 1, k=job["shafts"][k], I=between[k]) for k in range(last - 1)]
    shafts.append(Shaft(last - 1, last, k=float(job["shaft"]), c=float(job["shaft_damping"])))
    return Assembly(shafts, disk_elements=[*discs, Disk(last, 1e12)])


def turn(job, chain, damping):
    found = []
    began = time.process_time()
    for torques, omegas in zip(job["torques"], job["omegas"], strict=True):
        found.append(chain.ss_response(torques, omegas, C=damping)[0])
    seconds = time.process_time() - began
    motion = np.array(found)[:, :-1]
    return {"seconds": seconds, "real": motion.real.tolist(), "imaginary": motion.imag.tolist()}


def main():
    with np.load(sys.argv[1]) as archive:
        job = dict(archive)
    chain = assembled(job)
    damping = np.array(chain.C)
    damping[:-1, :-1] += job["damping"]
    matrices = {"mass": chain.M[:-1, :-1].tolist(), "stiffness": chain.K[:-1, :-1].tolist()}
    job["torques"] = np.pad(job["torques"], ((0, 0), (0, 1), (0, 0)))
    print("TURN", json.dumps({"version": version("opentorsion"), **matrices}), flush=True)
    for _ in sys.stdin:
        print("TURN", json.dumps(turn(job, chain, damping)), flush=True)


main()
