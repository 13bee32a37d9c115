"""A linear structure under loads from tables, in Exudyn: JOB; a request names the integrator and the steps of a cycle.

M z̈ + D ż + K z = f₀ + f(t): generic second-order coordinates, the first of which carry loads. A load is a symbolic
user function, which the library keeps as an expression and evaluates without Python: a tree of comparisons that finds
the piece of a periodic cubic spline. Symbols must outlive the function, so all are kept.
"""

import json
import sys
import time
import warnings

sys.exudynFast = True  # no checks of ranges
import exudyn  # noqa: E402
import numpy as np  # noqa: E402
from exudyn.utilities import (  # noqa: E402
    CreateSymbolicUserFunction,
    LoadCoordinate,
    MarkerNodeCoordinate,
    NodeGenericODE2,
    ObjectGenericODE2,
    SensorNode,
)

symbols = exudyn.symbolic
KEPT = []


def kept(symbol):
    KEPT.append(symbol)
    return symbol


def piece(first, last, at, spline):
    """The polynomial of the piece that ``at`` lies in, of those from ``first`` to before ``last``."""
    if last - first == 1:
        inside = kept(at - float(first))
        value = kept(symbols.Real(float(spline[0, first])))
        for coefficient in spline[1:, first]:
            value = kept(kept(value * inside) + float(coefficient))
        return value
    middle = (first + last) // 2
    sides = piece(first, middle, at, spline), piece(middle, last, at, spline)
    return kept(symbols.IfThenElse(kept(at < float(middle)), *sides))


def loaded(mbs, node, coordinate, spline, period):
    count = spline.shape[1]

    def load(mbs, t, load):
        KEPT.extend((t, load))
        at = kept(symbols.mod(kept(t * (count / period)), kept(symbols.Real(float(count)))))
        return piece(0, count, at, spline)

    marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
    number = mbs.AddLoad(LoadCoordinate(markerNumber=marker, load=0.0))
    function = kept(CreateSymbolicUserFunction(mbs, load, "loadUserFunction", number))
    mbs.SetLoadParameter(number, "loadUserFunction", function)


def assembled(job):
    system = exudyn.SystemContainer()
    mbs = system.AddSystem()
    n = len(job["mass"])
    node = mbs.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * n, initialCoordinates=job["start"].tolist(),
            initialCoordinates_t=job["start_rate"].tolist(), numberOfODE2Coordinates=n,
        )
    )  # fmt: skip
    matrices = {f"{name}Matrix": job[name] for name in ("mass", "stiffness", "damping")}
    mbs.AddObject(ObjectGenericODE2(nodeNumbers=[node], forceVector=job["steady"], **matrices))
    for coordinate, spline in enumerate(job["loads"]):
        loaded(mbs, node, coordinate, spline, float(job["period"]))
    kind = exudyn.OutputVariableType.Coordinates
    sensor = mbs.AddSensor(SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
    mbs.Assemble()
    KEPT.append(system)
    return mbs, sensor


def run(mbs, sensor, job, request):
    end = float(job["period"]) * int(job["cycles"])
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = request["steps"] * int(job["cycles"])
    settings.timeIntegration.endTime = end
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = float(job["period"]) / int(job["samples"])
    kind = exudyn.DynamicSolverType.GeneralizedAlpha
    if request["integrator"] == "trapezoidal":
        kind = exudyn.DynamicSolverType.TrapezoidalIndex2
    else:
        settings.timeIntegration.generalizedAlpha.spectralRadius = request["radius"]
    began = time.process_time()
    mbs.SolveDynamic(settings, solverType=kind)
    seconds = time.process_time() - began
    rows = np.array(mbs.GetSensorStoredData(sensor))
    cycle = rows[-int(job["samples"]) :, 1:] @ job["output"]
    return {"seconds": seconds / int(job["cycles"]), "values": cycle.tolist(), "end": float(rows[-1, 0])}


def main():
    warnings.simplefilter("ignore")
    with np.load(sys.argv[1]) as archive:
        job = dict(archive)
    mbs, sensor = assembled(job)
    print("TURN", json.dumps({"version": exudyn.__version__}), flush=True)
    for line in sys.stdin:
        print("TURN", json.dumps(run(mbs, sensor, job, json.loads(line))), flush=True)


main()
