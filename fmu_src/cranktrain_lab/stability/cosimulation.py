"""Stability map of co-simulation: longest stable communication step of two masses by mass ratio and coupling.

Theory is the spectral radius of the coupled step with slaves solved exactly. It is compared with the step at which the
motion of slaves with their own integrators, coupled by a minimal master, begins to grow
(:mod:`cranktrain_lab.stability.two_mass`).
"""

import math

import numpy as np

from cranktrain_lab.stability.stability_map import Axis, Progress, StabilityMap, curve, deviation
from cranktrain_lab.stability.two_mass import Coupling, TwoMass, critical_step, growth, simulated_onset

REFERENCE = Coupling("force/displacement", "jacobi", "hold")
"""Coupling whose stability the map's colours show."""
DRAWN = (
    REFERENCE,
    Coupling("force/displacement", "jacobi", "linear"),
    Coupling("force/displacement", "jacobi", "quadratic"),
    Coupling("force/displacement", "gauss-seidel 1-2", "hold"),
    Coupling("force/displacement", "gauss-seidel 1-2", "linear"),
    Coupling("force/displacement", "gauss-seidel 1-2", "quadratic"),
    Coupling("displacement/displacement", "jacobi", "hold"),
    Coupling("displacement/displacement", "gauss-seidel 1-2", "linear"),
)
LONGEST = 4.0
"""Longest communication step in the search, in units of √(m₁/c)."""
BRACKET = 1.04
"""Factor of the search range: from the theoretical onset divided by this factor to the onset times this factor."""
_EXPLANATION = """\
A slave that holds or extrapolates its inputs acts on the past: the coupling spring pushes about H/2 late, which \
feeds energy in like a damper of −c_c H/2. Where this outweighs the dampers the coupled motion grows, though each \
slave by itself is solved exactly: no smaller step inside a slave helps. (F/D: the second mass has the spring, \
hands over its force and takes the motion; D/D: both have it. GS 1-2: Gauss-Seidel, mass 1 first. Ground: F/D, \
Jacobi, hold.)
Of Jacobi the light mass should take the motion and the heavy one the force (m₂ < m₁): three times the step. At \
equal masses linear inputs allow half as long again (Jacobi) to twice the step (Gauss-Seidel); quadratic ones add \
a little there, and cost Jacobi steps where m₂ is small.
D/D with Gauss-Seidel is stable at every step with hold, and with linear inputs where its curve is missing: it \
damps instead, and stable is not accurate. What to do: stay well left of the curve, or exchange inputs more than \
once a step."""


def compute(quick: bool, progress: Progress) -> StabilityMap:
    """Compute the map of mass ratio over communication step."""
    ratios = np.geomspace(0.1, 10.0, 17 if quick else 49)
    steps = np.geomspace(0.1, LONGEST, 25 if quick else 81)
    every = 4 if quick else 2
    theory, found = [], []
    worst = 0.0
    for k, coupling in enumerate(DRAWN):
        name = label(coupling)
        progress(f"onset: {name}", k / (len(DRAWN) + 2.0))
        exact = [critical_step(TwoMass(m2=float(ratio)), coupling, LONGEST, 1.0e-7) for ratio in ratios]
        simulated = []
        for ratio, step in zip(ratios[::every], exact[::every], strict=True):
            low, high = (step / BRACKET, step * BRACKET) if math.isfinite(step) else (LONGEST / BRACKET, LONGEST)
            simulated.append(simulated_onset(TwoMass(m2=float(ratio)), coupling, low, high))
        worst = max(worst, deviation(np.array(simulated), np.array(exact[::every])))
        theory.append(curve(name, exact, ratios, "spectral radius 1 of the step with slaves solved exactly"))
        found.append(curve(name, simulated, ratios[::every], "growth of slaves that integrate, minimal master"))
    progress("ground: growth of the simulated motion", len(DRAWN) / (len(DRAWN) + 2.0))
    grown = np.array([[growth(TwoMass(m2=r), REFERENCE, h) for h in steps] for r in ratios])
    return StabilityMap(
        name="cosimulation",
        title="Co-simulation of two masses: mass ratio over communication step",
        rows=Axis("mass ratio m₂/m₁", "", ratios, log=True),
        columns=Axis("communication step H √(c/m₁)", "", steps, log=True),
        stable=grown < 0.0,
        measure=np.exp(np.minimum(grown, 0.0)),
        measure_label="growth per step (F/D, Jacobi, hold)",
        theory=tuple(theory),
        numerical=tuple(found),
        max_deviation=worst,
        explanation=_EXPLANATION,
        failure="coupled motion grows (F/D, Jacobi, hold)",
    )


def label(coupling: Coupling) -> str:
    """Return the short name of a coupling."""
    split = {"force/displacement": "F/D", "displacement/displacement": "D/D"}[coupling.decomposition]
    order = coupling.sequence.replace("jacobi", "Jacobi").replace("gauss-seidel", "GS")
    return f"{split}, {order}, {coupling.reconstruction}"
