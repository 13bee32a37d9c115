"""openTorsion: the torsional run-up of the six in the frequency domain, 300 speeds and 48 half orders.

Both solve the same chain of discs and shafts for each speed and order, directly: neither has an error to speak of.
Torques, dampings and the mean inertia of the rods are those of our model. Ours gives motions against a frame that
follows the crank; the frame's part is added to theirs.
"""

from __future__ import annotations

import math
import statistics
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from benchmarks.peer_programs.environment import Program, child

from cranktrain.core.reduced_body import Array
from cranktrain.dynamics.model import slots as at
from cranktrain.dynamics.model.arrays import build_model
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import GasTrace
from cranktrain.structure.crank.level import crank_body
from cranktrain.structure.crank.torsional import shaft_nodes
from cranktrain.studies.torsion.frequency_run_up import HARMONIC_BALANCE, LINEAR, frame_wobble, frequency_run_up
from cranktrain.studies.torsion.shaft_orders import ShaftOrders

PROGRAM = Program(("opentorsion==0.3.2",), "run_opentorsion.py")
SPEEDS = np.linspace(800.0, 2600.0, 300) * (math.pi / 30.0)
ORDERS = 0.5 * np.arange(1, 49)
SETTINGS = Settings(crank="torsional")
ROUNDS = 5


class Chain:
    """The crank as discs on a shaft, and what turns its results into ours."""

    def __init__(self, engine: Engine) -> None:
        self.engine, self.gas = engine, GasTrace.from_engine(engine)
        self.body = body = crank_body(engine, "torsional")
        settings = resolved(SETTINGS, engine)
        model = build_model(engine, body, settings, self.gas.best_speed, self.gas)
        structure = ShaftOrders(engine, body, settings, self.gas, float(ORDERS[-1]))
        own = slice(at.ROTATION, None)
        turns = np.array([body.shapes[body.index(name), 5, own] for name in shaft_nodes(engine)])
        self.to_modes = back = np.linalg.inv(turns)
        self.swing = model.scalars[at.RIGID_ROTATION] * back[0]
        pins = [f"pin[{k}]" for k in range(1, engine.n_cylinders + 1)]
        shares = np.array([body.shapes[body.index(name), 5, own] for name in pins]) @ back
        inertia = structure.inertia[0].real
        self.mass: Array = back.T @ back + shares.T @ (inertia[:, None] * shares)
        self.omegas: Array = SPEEDS[:, None] * ORDERS
        self.job = {
            "inertia": np.diag(self.mass), "between": np.diag(self.mass, 1), "shafts": body.records["shaft_stiffness"],
            "shaft": model.shaft_laws[0, 0], "shaft_damping": model.shaft_laws[0, 1],
            "damping": back.T @ (model.damping[own, None] * back), "omegas": self.omegas,
            "torques": np.einsum("skp,pn->snk", structure.known(SPEEDS)[:, 1:], shares),
        }  # fmt: skip
        self.stiffness: Array = back.T @ (model.omega2[own, None] * back)
        self.stiffness[-1, -1] += model.shaft_laws[0, 0]

    def own_turn(self, rule: str) -> tuple[float, Array]:
        """Processor seconds and the pulley's torsion, (s, o) rad."""
        began = time.process_time()
        found = frequency_run_up(self.engine, self.body, SETTINGS, SPEEDS, ORDERS, rule, self.gas)
        return time.process_time() - began, found.torsion

    def against_frame(self, motion: Array) -> Array:
        """Torsion of the pulley (s, o) of the discs' motion (s, n, o)."""
        wobble = frame_wobble(SPEEDS[:, None], self.omegas)
        return np.asarray(motion[:, 0] - wobble * np.einsum("n,sno->so", self.swing, motion))


def measured() -> dict[str, Any]:
    """Costs, and how far the results are apart."""
    engine = load_engine("diesel_i6")
    chain = Chain(replace(engine, reduction=replace(engine.reduction, torsional_source="ker-wilson")))
    costs: dict[str, list[float]] = {"linear": [], "balance": [], "other": []}
    with TemporaryDirectory() as folder:
        job = Path(folder) / "job.npz"
        np.savez(job, **chain.job)
        with child(PROGRAM, job) as other:
            apart = [
                np.abs(np.array(other.about[name]) - own).max() / np.abs(own).max()
                for name, own in (("mass", chain.mass), ("stiffness", chain.stiffness))
            ]
            for _ in range(ROUNDS):
                for name, rule in (("linear", LINEAR), ("balance", HARMONIC_BALANCE)):
                    seconds, torsion = chain.own_turn(rule)
                    costs[name].append(seconds)
                    if rule == LINEAR:
                        linear = torsion
                found = other.turn()
                costs["other"].append(found["seconds"])
            version = other.about["version"]
    theirs = chain.against_frame(np.array(found["real"]) + 1j * np.array(found["imaginary"]))
    largest = np.abs(torsion).max()
    own, balance, cost = (statistics.median(costs[name]) for name in ("linear", "balance", "other"))
    return {
        "program": f"openTorsion {version}",
        "compared": "torsional chain of the six, 300 speeds × 48 orders: torsion of the pulley",
        "cost": "processor time of the run-up",
        "difference_of_matrices": float(max(apart)),
        "difference_of_results": float(np.abs(theirs - linear).max() / largest),
        "own_s": own,
        "other_s": cost,
        "ratio": round(cost / own, 2),
        "own_with_varying_inertia_s": balance,
        "mean_inertia_against_varying": float(np.abs(linear - torsion).max() / largest),
        "not_comparable": "ours makes the torques within its time, openTorsion is given them; "
        "openTorsion has no inertia that varies with the crank's angle",
    }
