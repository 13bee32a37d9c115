"""Study of an engine on its mounts: modes, static loads, response by order over speed, start and stop."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.model import Engine
from cranktrain.results.free_forces import HIGHEST_ORDER, largest
from cranktrain_lab.mounts.body import RigidEngine, rigid_engine
from cranktrain_lab.mounts.excitation import ORDERS, Excitation, excitation
from cranktrain_lab.mounts.modes import NAMES, Mode, modes
from cranktrain_lab.mounts.response import Response, response
from cranktrain_lab.mounts.running import refuse_bad_fit
from cranktrain_lab.mounts.stiffness import GOOD, Complex, Support, support_of, with_states
from cranktrain_lab.mounts.transient import Transient, engine_force, states, steady, transient

STRONGEST = 6
"""Number of orders that are listed if none are asked for."""
NOTHING = 1e-9
"""Fraction of the largest force of all orders, below which an order is not listed."""
LARGEST_WAY, LARGEST_TURN = 0.01, 0.05
"""Displacement, m, and rotation, rad, of the centre beyond which a start or stop is told to be too large."""
COARSE, CYCLE = 160, 720
"""Speeds and crank angles at which the periodic motion beside a start or stop is evaluated."""
UNITS = ("um", "um", "um", "mrad", "mrad", "mrad")
SCALES = np.array([1e6, 1e6, 1e6, 1e3, 1e3, 1e3])
"""Displacements and rotations in the units of results, per m and rad."""
KEYS = tuple(f"{name.replace('-', '_')}_{unit}" for name, unit in zip(NAMES, UNITS, strict=True))


SHARES = tuple(f"share_{name.replace('-', '_')}" for name in NAMES)


class Passage(NamedTuple):
    """Start or stop in time, the greatest motion and forces of periodic cycles at its speeds, and its fit's error.

    Attributes
    ----------
    name, rate : ``start`` or ``stop``; rev/min per s
    run : in time
    speeds : (s,) of the periodic cycles, rad/s
    centre, mounts : (s, 6) and (s, j): largest displacements of a cycle, and forces of the mounts
    error : largest relative error of the mounts' fit to their tables; 0 without tables
    """

    name: str
    rate: float
    run: Transient
    speeds: Array
    centre: Array
    mounts: Array
    error: float


class Study(NamedTuple):
    """Engine on its mounts.

    Attributes
    ----------
    speeds, orders : (s,) rad/s and (o,) of ``response``
    forces : (s, o, 6) excitation of the centre
    """

    engine: Engine
    body: RigidEngine
    support: Support
    excitation: Excitation
    modes: list[Mode]
    speeds: Array
    orders: Array
    forces: Complex
    response: Response
    left_out: list[str]


def study(engine: Engine, speeds: Sequence[float] | Array, load: float, orders: Sequence[float] = ()) -> Study:
    """Modes and response at ``speeds`` (rad/s) with a fraction ``load`` of the full-load burn.

    Without ``orders`` the :data:`STRONGEST` with the largest forces on the frame are taken. Raises ``InputError`` for
    an engine without mounts or without a body on them, and for orders that are not excited.
    """
    if engine.mounts is None or not (engine.mounts.standing_mass or engine.block):
        lacking = "mounts" if engine.mounts is None else "block"
        raise InputError(
            f"engine '{engine.name}' has no [{lacking}]; add it, make the engine with cranktrain new --mounts, or "
            "state the standing body in [mounts] (standing_mass, standing_centre, standing_inertia)"
        )
    if orders and max(orders) > HIGHEST_ORDER:
        raise InputError(f"--orders {max(orders):g}: forces are computed up to order {HIGHEST_ORDER}")
    body = rigid_engine(engine)
    support = support_of(engine, body.centre)
    made, left_out = excitation(engine, body.centre)
    at, chosen = np.asarray(speeds, dtype=float), ORDERS[1:] if not orders else np.asarray(orders, dtype=float)
    rows = np.searchsorted(ORDERS, chosen)
    forces = np.array([made.at(speed, load)[rows] for speed in at])
    found = response(body, support, at, chosen, forces)
    if not orders:
        size = np.abs(found.mounts).max(axis=(0, 2, 3))
        kept = np.sort(np.argsort(-size)[:STRONGEST])
        kept = kept[size[kept] > NOTHING * size.max()]
        chosen, forces = chosen[kept], forces[:, kept]
        found = Response(found.centre[:, kept], found.mounts[:, kept], found.frame[:, kept])
    names = list(dict.fromkeys((*body.left_out, *left_out)))
    return Study(engine, body, support, made, modes(body, support), at, chosen, forces, found, names)


def passage(of: Study, rate: float, load: float) -> Passage:
    """Start (``rate`` > 0, rad/s²) to the engine's lowest speed, or motored stop from there, ``rate`` < 0.

    Raises ``InputError`` if a mount's table has no fit with states, as one that no passive mount has.
    """
    support, error = with_states(of.support)
    refuse_bad_fit(error)
    top = of.engine.speeds[0]
    load, first = (load, 0.0) if rate > 0.0 else (0.0, top)
    system = states(of.body, support)
    begin = steady(system, first, of.excitation.at(first, load))
    run = transient(system, engine_force(of.excitation, load), first, rate, top / abs(rate), begin)
    speeds = np.linspace(top / COARSE, top, COARSE)
    forces = np.array([of.excitation.at(speed, load) for speed in speeds])
    found = response(of.body, of.support, speeds, ORDERS, forces)
    turn = np.exp(1j * np.linspace(0.0, 4.0 * np.pi, CYCLE, endpoint=False)[:, None] * ORDERS)
    centre = np.array([np.abs((turn @ one).real).max(axis=0) for one in found.centre])
    pressed = np.array([
        np.linalg.norm(np.einsum("to,ojk->tjk", turn, one[:, :, :3]).real, axis=2).max(axis=0) for one in found.mounts
    ])  # fmt: skip
    return Passage("start" if rate > 0.0 else "stop", rate / RPM, run, speeds, centre, pressed, error)


def report(of: Study, passages: Sequence[Passage] = ()) -> dict[str, Any]:
    """Content of the verb's result; keys carry units, amplitudes are zero to peak."""
    own = of.body
    found: dict[str, Any] = {
        "engine": of.engine.name, "mass_kg": float(own.mass[0, 0]), "centre_mm": (1e3 * own.centre).tolist(),
        "inertia_kg_m2": own.mass[3:, 3:].tolist(), "spin_kg_m2": own.spin, "left_out": of.left_out,
        "modes": [
            {"name": one.name, "hz": one.hz, "damping_ratio": one.damping_ratio, "coupled": one.coupled}
            | dict(zip(SHARES, one.fractions.tolist(), strict=True))
            for one in of.modes
        ],
        "static": _static(of), "orders": _orders(of), "mounts": _mounts(of), "said": _said(of, passages),
    }  # fmt: skip
    return found | {one.name: _passage(one) for one in passages}


def _static(of: Study) -> list[dict[str, Any]]:
    """Forces of the mounts under the engine's weight, and under the largest mean torque of the speeds."""
    means = np.array([of.excitation.at(speed, 1.0)[0].real for speed in of.speeds])
    weight = np.zeros(6)
    weight[1] = -of.body.mass[0, 0] * Settings().gravity
    whole, each = of.support.whole(0.0).real, of.support.at(0.0).real
    loads = [weight, means[np.abs(means[:, 5]).argmax()]]
    found = [(each * (of.support.motion @ np.linalg.solve(whole, load))).reshape(-1, 6) for load in loads]
    return [
        {"mount": number}
        | {f"{noun}_{axis}_n": float(force[k]) for noun, force in zip(("weight", "torque"), pair, strict=True)
           for k, axis in enumerate("xyz")}
        for number, pair in enumerate(zip(*found, strict=True), start=1)
    ]  # fmt: skip


def _orders(of: Study) -> list[dict[str, Any]]:
    """Excitation, motion of the centre and forces on the frame, for each order and speed."""
    rows = []
    for o, order in enumerate(of.orders):
        for s, speed in enumerate(of.speeds):
            force, frame = np.abs(of.forces[s, o]).tolist(), np.abs(of.response.frame[s, o]).tolist()
            rows.append(
                {"order": float(order), "speed_rpm": float(speed / RPM), "excitation_x_n": force[0]}
                | {"excitation_y_n": force[1], "excitation_pitch_nm": force[3], "excitation_yaw_nm": force[4]}
                | {"excitation_roll_nm": force[5]}
                | dict(zip(KEYS, (SCALES * np.abs(of.response.centre[s, o])).tolist(), strict=True))
                | {f"frame_{axis}_n": frame[k] for k, axis in enumerate("xyz")}
                | {"frame_roll_nm": frame[5], "frame_n": largest(of.response.frame[s, o, :3])}
            )
    return rows


def _mounts(of: Study) -> list[dict[str, Any]]:
    """Forces of each mount on the frame, for each order and speed."""
    return [
        {"mount": j + 1, "order": float(order), "speed_rpm": float(speed / RPM)}
        | {f"{axis}_n": float(abs(of.response.mounts[s, o, j, k])) for k, axis in enumerate("xyz")}
        | {"force_n": largest(of.response.mounts[s, o, j, :3])}
        for j in range(of.response.mounts.shape[2])
        for o, order in enumerate(of.orders)
        for s, speed in enumerate(of.speeds)
    ]


def _passage(one: Passage) -> dict[str, Any]:
    """Peaks of a start or stop beside the largest of periodic cycles at its speeds."""
    rows = []
    mounts = np.linalg.norm(one.run.mounts[:, :, :3], axis=2)
    series = [(name, unit, SCALES[k] * np.abs(one.run.centre[:, k]), SCALES[k] * one.centre[:, k])
              for k, (name, unit) in enumerate(zip(NAMES, UNITS, strict=True))]  # fmt: skip
    series += [(f"mount {j + 1}", "N", mounts[:, j], one.mounts[:, j]) for j in range(mounts.shape[1])]
    for name, unit, run, cycles in series:
        n, s = int(run.argmax()), int(cycles.argmax())
        rows.append({
            "quantity": name, "unit": unit, "peak": float(run[n]), "speed_rpm": float(one.run.speed[n] / RPM),
            "periodic": float(cycles[s]), "periodic_rpm": float(one.speeds[s] / RPM),
        })  # fmt: skip
    return {"rate_rpm_per_s": one.rate, "fit_error": one.error, "peaks": rows}


def _said(of: Study, passages: Sequence[Passage]) -> list[str]:
    """Remarks on the validity of the result."""
    said = []
    if of.left_out:
        said.append(f"not in the rigid engine: {', '.join(of.left_out)} (elastic, or moving with a rod)")
    ends = [float(known[-1]) for known, _ in of.support.tables.values()]
    reach = float(of.speeds.max() * of.orders.max())
    if ends and reach > min(ends):
        table, wanted = (f"{one / (2.0 * np.pi):.4g} Hz" for one in (min(ends), reach))
        said.append(f"a table of mounts ends at {table}, orders reach {wanted}; beyond it the last stiffness is taken")
    if error := max((one.error for one in passages if one.error > GOOD), default=0.0):
        said.append(f"the mounts in time differ from a table by up to {100.0 * error:.1f} %")
    for one in passages:
        way, turn = (float(np.abs(part).max()) for part in (one.run.centre[:, :3], one.run.centre[:, 3:]))
        if way > LARGEST_WAY or turn > LARGEST_TURN:
            said.append(
                f"{one.name}: {1e3 * way:.0f} mm and {turn:.2f} rad are more than small motions and usual mounts "
                "allow; real starts burn less (--load), pass faster, or meet stops"
            )
    return said
