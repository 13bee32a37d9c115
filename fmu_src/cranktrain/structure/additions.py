"""Elastic bodies that an engine file adds: reduced bodies read from files, and shafts made of beams."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, replace
from hashlib import sha256
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from cranktrain.core.errors import InputError, nearest
from cranktrain.core.reduced_body import ReducedBody, attach, rigid_body, truncate
from cranktrain.core.user_file import file_exists, folder_exists
from cranktrain.dynamics.topology.bearings import film_parts, no_bore
from cranktrain.dynamics.topology.connection_arrays import at_main
from cranktrain.dynamics.topology.held import check_held
from cranktrain.dynamics.topology.tables import file_frames, topology_outputs, whole_topology
from cranktrain.dynamics.topology.values import End, Frame, Topology
from cranktrain.engine.additions import BodyTable, split_end
from cranktrain.engine.model import Engine
from cranktrain.loads.torsional_line import torsional_line

if TYPE_CHECKING:
    from cranktrain.structure.fem.frame import Section

FIXED_MODES = 40
"""Number of fixed-interface modes of a shaft before modes above its cut-off are removed."""
SHEAR = 5.0 / 6.0
"""Shear factor of a rectangle, used for sections that are given by area and second moment."""
SHORTEST = 1.0e-6
"""Distance, m, below which two neighbouring stations of a shaft are merged."""
OF_DIAMETER, OF_LENGTH = 0.5, 0.05
"""Largest length of a shaft's element, as multiple of its diameter and of the shaft's length; the larger one
counts."""


def check_added(engine: Engine, own_crank: bool, own_block: bool) -> None:
    """Refuse unsuitable laws, missing interfaces of crank or block, and bodies that nothing holds; ``InputError``.

    Interfaces of a user's ``own_crank`` and ``own_block`` are not checked here because these files are read later.
    """
    added = engine.additions.connection
    if not added and not engine.additions.body:
        return
    from cranktrain.structure.block.mesh import block_interface_names
    from cranktrain.structure.crank.shape import crank_interfaces

    topology_outputs(engine)
    for table in added:
        wanted = () if table.film is None else film_parts(table.film, table.ends)
        at_bore = not table.place and at_main([End(*split_end(text)) for text in table.ends])
        lacks = ("bore" in wanted and not at_bore) or ("big_end_bore" in wanted and engine.big_end_bearing is None)
        if table.film is not None and lacks:
            raise InputError(f"connection '{table.name}': {no_bore(table.film)}")
    mounts = len(engine.mounts.x) if engine.mounts is not None else 0
    block = block_interface_names(len(engine.crankshaft.main_widths), engine.n_cylinders, mounts)
    line = torsional_line(engine)
    turning = tuple(name for name, speed in zip(line.interfaces, line.speeds.tolist(), strict=True) if speed == 1.0)
    crank = (*crank_interfaces(engine.crankshaft), *turning)
    files = {body.name: _from_file(body) for body in engine.additions.body if body.file}
    known = {"crank": () if own_crank else crank, "block": () if own_block else block}
    known |= {name: tuple(body.interfaces) for name, body in files.items()}
    for table in added:
        for body, interface in map(split_end, table.ends):
            names = known.get(body, ())
            if table.slider_crank is not None and body == "block" and names:
                names = (*names, *(f"liner[{k + 1}]" for k in range(engine.n_cylinders)))
            if names and interface not in names:
                raise InputError(
                    f"connection '{table.name}': body '{body}' has no interface '{interface}'; "
                    f"{nearest(interface, list(names))}"
                )
    _check_held(engine, files)


def _check_held(engine: Engine, files: dict[str, ReducedBody]) -> None:
    """Refuse bodies that nothing holds, with stand-ins for crank and shafts and with bodies from ``files``."""
    bare, bodies = Topology(file_frames(engine)), engine.additions.body
    stand_ins = {"crank": {"": (0.0, 0.0, 0.0)}}
    for body in bodies:
        if body.stations:
            sense = bare.frame(body.frame).sense
            along = {name: (0.0, 0.0, sense * z) for name, z in zip(body.interfaces, body.held_at, strict=False)}
            rod = {name: (0.0, y, sense * body.z[0]) for name, y in zip(body.interfaces, body.y, strict=False)}
            stand_ins[body.name] = rod if body.along == "y" else along
    made = {name: rigid_body(name, 1.0, np.eye(3), (0, 0, 0), held) for name, held in stand_ins.items()}
    check_held(whole_topology(engine, made["crank"], None, made | files))


def read_added(engine: Engine) -> dict[str, ReducedBody]:
    """Elastic bodies that an engine file adds, by name; ``InputError`` if a file is missing or is no reduced body."""
    bare = Topology(file_frames(engine))
    return {
        table.name: _from_file(table) if table.file else shaft_body(table, bare.frame(table.frame))
        for table in engine.additions.body
        if table.made_of_files_or_elements
    }


def _from_file(table: BodyTable) -> ReducedBody:
    from cranktrain.structure.fem.own_body import is_body, read_body

    if not ((file_exists(table.file) or folder_exists(table.file)) and is_body(table.file)):
        raise InputError(f"body '{table.name}': {table.file} is not a reduced body; write one by 'cranktrain reduce'")
    return read_body(table.file)


def shaft_body(table: BodyTable, axes: Frame) -> ReducedBody:
    """Reduced body of a shaft or rod made of beams between its stations, with its discs, in axes of its frame."""
    from cranktrain.structure.fem.frame import Frame as Beams

    frame = Beams(table.youngs_modulus, table.youngs_modulus / (2.0 * (1.0 + table.poisson_ratio)))
    places = np.unique(np.round([*table.stations, *table.held_at], 9))
    places = places[np.append(True, np.diff(places) > SHORTEST)]
    at: list[float] = []
    for first, second in pairwise(places):
        thick = math.sqrt(_section(table, 0.5 * (first + second)).area / (0.25 * math.pi))
        longest = max(OF_DIAMETER * thick, OF_LENGTH * (places[-1] - places[0]))
        at += np.linspace(first, second, max(1, int(np.ceil((second - first) / longest))) + 1)[:-1].tolist()
    at.append(float(places[-1]))
    plane = axes.sense * table.z[0]
    nodes = [frame.node((0.0, place, plane) if table.along == "y" else (0.0, 0.0, axes.sense * place)) for place in at]
    for k, (first, second) in enumerate(pairwise(at)):
        frame.beam(nodes[k], nodes[k + 1], _section(table, 0.5 * (first + second)))
    nearest = [nodes[int(np.argmin(np.abs(np.array(at) - place)))] for place in table.held_at]
    held = dict(zip(table.interfaces, nearest, strict=True))
    digest = sha256(json.dumps([asdict(table), axes.sense], sort_keys=True).encode()).hexdigest()
    body = frame.reduced(table.name, digest, held, FIXED_MODES)
    none = (0.0,) * len(table.discs)
    columns = table.discs, table.disc_masses, table.disc_polar, table.disc_diametral
    for name, mass, polar, across, x, y in zip(*columns, table.disc_x or none, table.disc_y or none, strict=True):
        body = attach(body, name, mass, np.diag([across, across, polar]), axes.turned(np.array([x, y, 0.0])))
    body = truncate(body, table.cutoff_hz, [(name, k) for name in table.interfaces for k in range(6)])
    return replace(body, damping=2.0 * table.damping_ratio * body.omega)


def _section(table: BodyTable, place: float) -> Section:
    """Section of a shaft or rod at a position along its axis."""
    from cranktrain.structure.fem.frame import Section, circular

    k = max(0, int(np.searchsorted(table.stations, place)) - 1)
    if table.diameters:
        return circular(table.diameters[k], table.density, table.poisson_ratio)
    area, bending = table.areas[k], table.second_moments[k]
    return Section(area, SHEAR * area, bending, 2.0 * bending, table.density * area, table.density * bending)
