"""Crank level ``beam``: a crankshaft of Timoshenko beams from its dimensions, reduced like the solid crankshaft.

Nose, main journals, pins and flange are circular beams, webs are members of
:mod:`cranktrain.structure.crank.web_member`. They meet at the middle planes of the webs, on the main axis and on the
pin axis. Where a journal enters a web, or a thin piece a thicker one, stress spreads at 45°, so the thicker piece is
only as stiff as a cone on the thinner one (rule for stepped rotors, sources in that module). Fillets add stiffness and
mass; oil holes are left out. Counterweights add mass to the web. The part of a web beyond an axis moves with that axis;
the part between the axes moves with both.

There is no mesh, and six cylinders make 500 degrees of freedom. The reduction to constraint and fixed-interface modes
is that of the solid crankshaft.
"""

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from hashlib import sha256
from itertools import pairwise

import numpy as np

from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.rigid_slices import Slices
from cranktrain.core.types import Array
from cranktrain.engine.model import Engine
from cranktrain.engine.parts import Crankshaft
from cranktrain.structure.crank.sections import fillet_rise, interface_places, web_strips
from cranktrain.structure.crank.shape import pin_centre, shaping, stations, webs_of
from cranktrain.structure.crank.torsional import sections
from cranktrain.structure.crank.web_member import web_arm, web_flexibility
from cranktrain.structure.fem.frame import Frame, Section, circular

_STRIPS = 16
"""Number of mass slices along a web."""
_DETAIL = 40
"""Number of points at which the diameter along a beam element is sampled."""


def beam_body(engine: Engine, progress: Callable[[str], None] | None = None) -> ReducedBody:
    """Bare crankshaft of beams in all its Craig–Bampton modes, from the engine's dimensions alone.

    Parameters
    ----------
    engine : only its material, crankshaft, thrust position and number of fixed-interface modes matter here
    progress : called with the name of each stage before it starts
    """
    frame, nodes = crank_frame(engine)
    content = [asdict(engine.material), shaping(engine.crankshaft), engine.thrust.main, engine.reduction.fixed_modes]
    digest = sha256(json.dumps(["beam", *content], sort_keys=True).encode()).hexdigest()
    say = progress or (lambda stage: None)
    body = frame.reduced(f"{engine.name} crankshaft, beams", digest, nodes, engine.reduction.fixed_modes, say)
    # A beam has no thrust faces, so the thrust bearing acts on the axis in the middle of its main journal.
    at = body.index(f"main[{engine.thrust.main}]")
    return replace(
        body,
        interfaces=(*body.interfaces, "thrust"),
        positions=np.concatenate((body.positions, body.positions[at : at + 1])),
        shapes=np.concatenate((body.shapes, body.shapes[at : at + 1])),
        records=sections(engine),
    )


def crank_frame(engine: Engine) -> tuple[Frame, dict[str, int]]:
    """Frame of the bare crankshaft, and its interface nodes by name in the solid body's order, without ``thrust``."""
    c, material = engine.crankshaft, engine.material
    frame = Frame(material.youngs_modulus, material.youngs_modulus / (2.0 * (1.0 + material.poisson_ratio)))
    at = stations(c)
    places = interface_places(c, engine.thrust.main)
    planes = [0.5 * sum(span) for span in at.webs]
    found: dict[str, int] = {}
    # Each web gets two nodes in its middle plane: one on each of the two journal axes that the web joins.
    low, high = [], []
    for web, z in zip(at.joins, planes, strict=True):
        first = (0.0, 0.0) if web.main else pin_centre(c, web.pins[0])[:2]
        low.append(frame.node((*first, z)))
    for web, z in zip(at.joins, planes, strict=True):
        high.append(frame.node((*pin_centre(c, web.pins[-1])[:2], z)))
    # Row of the web in front of each main journal (``before``) and of the web behind it (``behind``).
    before = {web.main: j for j, web in enumerate(at.joins) if web.main and not web.front}
    behind = {web.main: j for j, web in enumerate(at.joins) if web.main and web.front}

    for i in range(1, len(at.mains) + 1):
        pieces = [(*at.mains[i - 1], c.main_diameter)]
        stops = [places[f"main[{i}]"][2], *at.mains[i - 1]]
        if i == 1:
            pieces.insert(0, (*at.nose, c.nose_diameter))
            stops += [*at.nose, places["pulley"][2]]
        else:
            pieces.insert(0, (planes[before[i]], at.mains[i - 1][0], 0.0))
        if i == len(at.mains):
            pieces.append((*at.flange, c.flange_diameter))
            stops += list(at.flange)
        else:
            pieces.append((at.mains[i - 1][1], planes[behind[i]], 0.0))
        ends = (low[before[i]] if i > 1 else None, low[behind[i]] if i < len(at.mains) else None)
        line = _line(engine, frame, (0.0, 0.0), pieces, stops, ends)
        found[f"main[{i}]"] = line[places[f"main[{i}]"][2]]
        if i == 1:
            found["pulley"] = line[places["pulley"][2]]
        if i == len(at.mains):
            found["flywheel"] = line[at.flange[1]]
    for i, span in enumerate(at.pins, 1):
        front, rear = (number - 1 for number in webs_of(c, i))
        # The pin's axis: half the front web, the pin, half the rear web. A web of zero thickness adds no length.
        pieces = [(planes[front], span[0], 0.0), (*span, c.pin_diameter), (span[1], planes[rear], 0.0)]
        pieces = [piece for piece in pieces if piece[1] > piece[0]]
        middle = places[f"pin[{i}]"][2]
        ends = (high[front], low[rear] if at.joins[rear].main == 0 else high[rear])
        line = _line(engine, frame, pin_centre(c, i)[:2], pieces, [middle, *span], ends)
        found[f"pin[{i}]"] = line[middle]
    for j in range(len(at.webs)):
        _add_web(engine, frame, j + 1, low[j], high[j])
    return frame, {name: found[name] for name in places if name != "thrust"}


def _line(
    engine: Engine,
    frame: Frame,
    axis: tuple[float, float],
    pieces: list[tuple[float, float, float]],
    stops: list[float],
    ends: tuple[int | None, int | None],
) -> dict[float, int]:
    """Add beams along one axis through ``pieces`` (start, end, diameter or 0 in a web); return the nodes by z.

    ``ends`` are the nodes at both ends of the line; None makes a new node.
    """
    c = engine.crankshaft
    z = sorted({pieces[0][0], pieces[-1][1], *stops})
    nodes = [frame.node((*axis, place)) for place in z[1:-1]]
    first = frame.node((*axis, z[0])) if ends[0] is None else ends[0]
    last = frame.node((*axis, z[-1])) if ends[1] is None else ends[1]
    nodes = [first, *nodes, last]
    stiff = _spread(c, pieces)
    for k, (start, end) in enumerate(pairwise(z)):
        inner = start + (end - start) * (np.arange(_DETAIL) + 0.5) / _DETAIL
        heavy = _diameter(c, pieces, inner)
        frame.beam(nodes[k], nodes[k + 1], _mean_section(engine, stiff(inner), heavy))
    return dict(zip(z, nodes, strict=True))


def _diameter(c: Crankshaft, pieces: list[tuple[float, float, float]], z: Array) -> Array:
    """Diameter (p,), m, for the mass at positions z along the axis, fillets included; 0 within a web."""
    result = np.zeros_like(z)
    for k, (start, end, diameter) in enumerate(pieces):
        inside = (z >= start) & (z <= end)
        if diameter == 0.0:
            continue
        fillet = np.zeros_like(z)
        for other, edge in ((k - 1, start), (k + 1, end)):
            # A journal has a fillet where it meets a web or a thicker piece.
            if 0 <= other < len(pieces) and (pieces[other][2] == 0.0 or pieces[other][2] > diameter):
                fillet += fillet_rise(c, np.abs(z - edge))
        result = np.where(inside, diameter + 2.0 * fillet, result)
    return result


def _spread(c: Crankshaft, pieces: list[tuple[float, float, float]]) -> Callable[[Array], Array]:
    """Function z ↦ diameter for stiffness, where a cone of 45° limits steps to thicker pieces; webs count as round."""
    full = [(start, end, diameter or 2.0 * c.web_main_radius) for start, end, diameter in pieces]

    def stiff(z: Array) -> Array:
        own = _diameter(c, pieces, z)
        result = np.where(own > 0.0, own, 2.0 * c.web_main_radius)
        for start, end, diameter in full:
            distance = np.maximum(np.maximum(start - z, z - end), 0.0)
            result = np.where(distance > 0.0, np.minimum(result, diameter + 2.0 * distance), result)
        return np.asarray(result)

    return stiff


def _mean_section(engine: Engine, stiff: Array, heavy: Array) -> Section:
    """Section of an element of varying diameter, with the mean compliance and the mean mass over its length."""
    material = engine.material

    def mean(power: float) -> float:
        return float(np.mean(stiff**-power)) ** (-1.0 / power)

    bent, pulled = (circular(mean(p), material.density, material.poisson_ratio, 0.0) for p in (4.0, 2.0))
    weight = material.density * 0.25 * np.pi
    return Section(
        area=pulled.area,
        shear=pulled.shear,
        bending=bent.bending,
        torsion=bent.torsion,
        mass=weight * float(np.mean(heavy**2)),
        rotary=weight * float(np.mean(heavy**4)) / 16.0,
    )


def _add_web(engine: Engine, frame: Frame, number: int, first: int, second: int) -> None:
    """Add a web (numbered from 1) between its nodes on the two axes that it joins."""
    material, arm = engine.material, web_arm(engine.crankshaft, number)
    outline, thickness = arm.outline, arm.thickness
    angle = outline.angle
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    both = np.kron(np.eye(2), turn)
    flexibility = both @ web_flexibility(arm, material) @ both.T
    eta, areas = web_strips(outline, _STRIPS)
    moments = np.zeros((eta.size, 4, 4))
    moments[:, :3, :3] = areas * thickness
    moments[:, 3, 3] = areas[:, 0, 0] * thickness**3 / 12.0
    whole = np.eye(4)
    whole[1:, 1:] = turn
    moments = material.density * whole @ moments @ whole.T
    places = frame.positions[first] + eta[:, None] * turn[:, 1]
    share = np.clip(eta / outline.apart, 0.0, 1.0)
    share = share**2 * (3.0 - 2.0 * share)
    frame.flexible_link(first, second, flexibility, Slices(places, moments), share)
