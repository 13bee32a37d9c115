"""Stability map of internal damping, which rotates with the rotor and destabilises it above a threshold speed.

Laval's (Jeffcott's) rotor: a disc m on a shaft k, an outer damper c_e at rest on the disc, the shaft's own damping c_i
in the turning frame. In axes at rest m r̈ + (c_e + c_i) ṙ + (k − i c_i Ω) r = 0, unstable above Ω = ω_n (1 + c_e/c_i),
whirling forwards at ω_n. In the running model the crank's structural damping is such a c_i: it acts in the turning
frame with the modes.

The rotor goes through the running model as a reduced body: its shaft bends between the disc and two journals that
nearly rigid linear bearings hold; a third bearing at the disc is the outer damper. Found: eigenvalues of the model's
own matrices, and the matrix that one whole step of the running model applies. Theory for a method: its table on
Laval's rotor, which in the frame whirls at ω_n − Ω; that is the frequency that numerical damping acts on.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.linear import Equations, SmallMotions
from cranktrain.dynamics.model import slots
from cranktrain.dynamics.model.state import (
    MODAL_BLOCKS,
    OMEGA_REFERENCE,
    SHAFT_ANGLE,
    SHAFT_SPEED,
    STEP_LAST,
    STEP_REFERENCE,
)
from cranktrain.dynamics.simulation import Settings, Simulation
from cranktrain.dynamics.tangents import tangents_in_rotation
from cranktrain.dynamics.time.integrators import carried, integrator_table
from cranktrain.film.laws.parameters import C_X, C_Y, K_X, K_Y
from cranktrain_lab.stability.amplification import radius
from cranktrain_lab.stability.rotor import default_method, default_step, modal_places, rotor_body, rotor_engine
from cranktrain_lab.stability.stability_map import Axis, Onset, Progress, StabilityMap, curve, deviation, onset

DISC, NATURAL = 50.0, 2.0 * math.pi * 50.0
"""Mass (kg) and natural frequency (rad/s) of the map's rotor; the map depends only on ratios."""
OUTER = 0.02
"""Outer damping c_e over m ω_n, a damping ratio of 0.01."""
HOLD = 1e7
"""Ratio of the bearings' stiffness to the shaft's stiffness."""
USUAL_STEP, EULER_STEP = 2.5, 0.25
"""Steps in degrees of rotation: the usual step, and a step so small that backward Euler shows the instability."""
SLOWEST, FASTEST = 0.1, 40.0
"""Search range of a method's onset, as ratios of speed to ω_n."""
KICK = 1.0e-8
"""Displacement in modal units by which a step's matrix is taken: small, for the moments of forces at displaced journals
are of second order in it, and journals on stiff springs answer with large forces."""
LATERAL = [0, 1, 6, 7]
"""Lateral modes: translation, and bending of the disc against the journals."""


class Laval:
    """Laval rotor (disc on an elastic shaft) in the running model.

    Parameters
    ----------
    mass, natural : mass of the disc, kg, and its natural frequency on the shaft, rad/s
    outer, inner : dampers c_e and c_i, N s/m
    integrator : name of the integrator
    """

    def __init__(self, mass: float, natural: float, outer: float, inner: float, integrator: str = "auto") -> None:
        stiffness = mass * natural**2
        engine = rotor_engine(3)
        # Damping proportional to the stiffness of the shaft is the shaft's damper c_i.
        damping = replace(engine.damping, kind="rayleigh", alpha=0.0, beta=inner / stiffness)
        engine = replace(engine, damping=damping)
        body = rotor_body(engine, 2.0 * mass, journals=mass, stiffness=stiffness)
        settings = Settings(bearings="linear", integrator=integrator, gas_source="input", gravity=0.0)
        self.simulation = simulation = Simulation(engine, body, settings)
        simulation.inputs[0] = natural
        simulation.initialize()
        bearings = simulation.model.bearings
        for k, (spring, damper) in enumerate(((HOLD, 0.0), (0.0, outer), (HOLD, 0.0))):
            bearings[k, [K_X, K_Y]] = 0.5 * spring * stiffness
            bearings[k, [C_X, C_Y]] = damper
        self.natural, self._motions = natural, SmallMotions(simulation.model)
        self._start = simulation.state
        self._start[modal_places(simulation, LATERAL, list(range(MODAL_BLOCKS)))] = 0.0

    def eigenvalues(self, speed: float) -> NDArray[np.complex128]:
        """Return eigenvalues (8,) of lateral motions at a speed (rad/s), in the frame."""
        model = self.simulation.model
        laws = tangents_in_rotation(model, speed, range(len(model.bearings))).mean()
        lateral = (part[np.ix_(LATERAL, LATERAL)] for part in self._motions.equations(speed, laws))
        return np.asarray(np.linalg.eigvals(Equations(*lateral).first_order))

    def growth(self, speed: float) -> float:
        """Return the largest growth rate of lateral motions, 1/s."""
        return float(self.eigenvalues(speed).real.max())

    def step_radius(self, speed: float, step: float) -> float:
        """Return the spectral radius of one step (rad of crank angle) of the running model at a speed (rad/s)."""
        simulation, h = self.simulation, step / speed
        blocks = carried(simulation.model.stages)
        at = modal_places(simulation, LATERAL, [block for block, _ in blocks]).ravel()
        unit = np.repeat([KICK * max(self.natural, 1.0 / h) ** power for _, power in blocks], len(LATERAL))
        base = self._start.copy()
        base[SHAFT_ANGLE], base[SHAFT_SPEED], base[OMEGA_REFERENCE] = 0.0, speed, speed
        base[STEP_REFERENCE] = base[STEP_LAST] = -1.0
        simulation.inputs[0] = speed
        simulation.model.scalars[slots.STEP] = 1.01 * step
        simulation.work.key[:] = -1.0
        end = self._stepped(base, h)[at]
        columns = []
        for place, kick in zip(at, unit, strict=True):
            beside = base.copy()
            beside[place] += kick
            columns.append((self._stepped(beside, h)[at] - end) / unit)
        return float(np.abs(np.linalg.eigvals(np.array(columns))).max())

    def _stepped(self, state: Array, h: float) -> Array:
        self.simulation.state = state
        self.simulation.step(self.simulation.time + h)
        return self.simulation.state


def methods() -> list[tuple[str, float]]:
    """Return the integrators of the map with their steps: the default, generalised-α, backward Euler."""
    return [(default_method(), default_step()), ("generalised-alpha:0.6", USUAL_STEP), ("backward-euler", EULER_STEP)]


def threshold(outer: float, inner: float) -> float:
    """Return the ratio of speed to ω_n above which inner damping destabilises the rotor."""
    return 1.0 + outer / inner


def method_onset(method: str, step: float, outer: float, inner: float) -> Onset:
    """Return the ratio of speed to ω_n at which a method first shows instability; dampers over m ω_n."""

    def fails(speed: float) -> bool:
        # Spectral radius of a method's step (rad) on Laval's rotor in the frame, per unit mass.
        damping = complex(outer + inner, 2.0 * speed)
        stiffness = complex(1.0 - speed**2, outer * speed)
        return radius(integrator_table(method), step / speed, stiffness, damping) > 1.0

    return onset(fails, np.geomspace(1.01, FASTEST, 400), 1e-6, SLOWEST)


def compute(quick: bool, progress: Progress) -> StabilityMap:
    """Compute the map over speed and ratio of the dampers."""
    ratios = np.geomspace(0.2, 2.0, 6 if quick else 16)
    speeds = np.linspace(0.5, 8.0, 31 if quick else 76)
    outer, chosen = OUTER * NATURAL, methods()
    growth = np.empty((ratios.size, speeds.size))
    eigen = [Onset(math.inf)] * ratios.size
    theory = [[Onset(math.inf)] * ratios.size for _ in chosen]
    found = [list(row) for row in theory]
    for k, ratio in enumerate(ratios):
        progress(f"inner over outer damping {ratio:.2f}", k / ratios.size)
        inner = ratio * outer
        expected = threshold(outer, inner)
        rotor = Laval(DISC, NATURAL, DISC * outer, DISC * inner)
        growth[k] = [rotor.growth(s * NATURAL) / NATURAL for s in speeds]
        places = expected * np.array([0.5, 2.0])
        eigen[k] = onset(lambda s, r=rotor: r.growth(s * NATURAL) > 0.0, places, 1e-8, SLOWEST)  # type: ignore[misc]
        for i, (method, degrees) in enumerate(chosen):
            step = math.radians(degrees)
            theory[i][k] = found[i][k] = expected_by = method_onset(method, step, OUTER, ratio * OUTER)
            if expected_by.found:
                running = Laval(DISC, NATURAL, DISC * outer, DISC * inner, method)
                found[i][k] = onset(
                    lambda s, r=running, h=step: r.step_radius(s * NATURAL, h) > 1.0,  # type: ignore[misc]
                    expected_by * np.array([0.95, 1.05]), 1e-4, SLOWEST,
                )  # fmt: skip
    closed = np.array([threshold(1.0, ratio) for ratio in ratios])
    source = "the method's table on Laval's rotor in the turning frame: spectral radius 1"
    whole = "one step of the running model: spectral radius 1"
    progress("done", 1.0)
    return StabilityMap(
        name="rotating_damping",
        title="Inner damping drives a rotor above its threshold",
        rows=Axis("inner over outer damping", "", ratios, log=True),
        columns=Axis("speed over natural frequency", "", speeds),
        stable=growth < 0.0,
        measure=growth,
        measure_label="growth rate over natural frequency",
        theory=(
            curve("1 + outer over inner damping", closed, ratios, "closed form"),
            *(curve(f"{m}, {d:g} deg", theory[i], ratios, source) for i, (m, d) in enumerate(chosen) if i > 0),
        ),
        numerical=(
            curve("eigenvalues of the model", eigen, ratios, "the running model's own matrices"),
            *(curve(f"{m}, {d:g} deg", found[i], ratios, whole) for i, (m, d) in enumerate(chosen)),
        ),
        max_deviation=max(deviation(np.array(eigen), closed), deviation(np.array(found), np.array(theory))),
        explanation=_explanation(ratios, closed, np.array(found)),
        failure="the rotor whirls (eigenvalues)",
    )


def _explanation(ratios: Array, closed: Array, found: Array) -> str:
    """Return the explanation of the map, with its numbers."""
    late = np.where(np.isfinite(found[2]), found[2], math.nan) / closed
    exact = 100.0 * deviation(found[0], closed)
    seen = [math.isfinite(method_onset("backward-euler", math.radians(USUAL_STEP), OUTER, r * OUTER)) for r in ratios]
    at_usual = "in part of this map only" if any(seen) else "nowhere in this map"
    return (
        "A shaft's own damping turns with it: a rotor that whirls slower than it turns is pushed on by it, "
        "from ω_n (1 + c_e/c_i) on.\n"
        "In the turning frame the forward whirl moves at ω_n − Ω, fast where the rotor is fast: numerical damping "
        "acts on just that motion.\n"
        f"Backward Euler at {EULER_STEP:g} deg sees it at {np.nanmin(late):.3g} to {np.nanmax(late):.3g} times its "
        f"speed where it does, at {USUAL_STEP:g} deg {at_usual}; {default_method()} at {default_step():g} deg finds it "
        f"within {exact:.1g} %.\n"
        "Give structural damping with outer damping beside it, and judge supercritical speeds by a method of second "
        "order or higher."
    )
