"""Noise of an engine in its flexible block at one or several speeds."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.core.threads import one_thread
from cranktrain.core.types import Progress
from cranktrain.engine.model import Engine
from cranktrain.loads.gas_pressure import Gas
from cranktrain.results.pictures.skin import creased
from cranktrain.structure.assembly import Assembly, assemble
from cranktrain.structure.block.shape import BlockPlan, block_plan
from cranktrain.structure.fem.own_body import is_body
from cranktrain.studies.constant_speed import Request
from cranktrain_lab.noise.own_panels import PanelTable, body_panels, with_thicknesses
from cranktrain_lab.noise.radiation import critical_frequency
from cranktrain_lab.noise.recording import recorded
from cranktrain_lab.noise.result import STEPS, NoiseResult, Panels
from cranktrain_lab.noise.surface import Surface, block_surface

CUTOFF_HZ = 3000.0
"""Default frequency up to which the block keeps its modes, Hz."""
LONGEST_DEG = 1.0
"""Longest default step, degrees of crank angle."""


def default_step(speed_rpm: float, cutoff_hz: float) -> float:
    """Default step, deg: ``STEPS`` steps in a period of the highest frequency, at most ``LONGEST_DEG``."""
    return min(LONGEST_DEG, 6.0 * speed_rpm / (STEPS * cutoff_hz))


def for_vibration(made: Assembly, asked: str | None) -> Assembly:
    """Parts with an integrator that resolves the block's vibration, where the run leaves it open (``asked`` None).

    The third-order method that suits elastic films leaves 3.8 dB in a band with four steps a period; ``esdirk4`` takes
    1.4 times as long and leaves 0.06 dB (``python -m benchmarks.noise_steps diesel_i6 ehd``).
    """
    if asked is not None or made.settings.integrator != "esdirk3":
        return made
    return replace(made, settings=replace(made.settings, integrator="esdirk4"))


def noise_assembly(
    engine: Engine, request: Request, cutoff_hz: float, own: Mapping[str, PanelTable], say: Progress
) -> tuple[Assembly, Panels]:
    """Parts of the runs, with the block's modes up to ``cutoff_hz``, and the panels of its surface; ``InputError``.

    ``own`` are the tables of a panels file.
    """
    assert engine.block is not None
    finer = replace(engine, block=replace(engine.block, running_cutoff_hz=cutoff_hz))
    settings, mesh = request.settings(finer), request.block_mesh
    reduced = mesh is not None and is_body(mesh)
    if reduced and not own:
        raise InputError(f"{mesh}: a reduced block has no surface; state areas of its interfaces by --panels FILE.toml")
    # Before the run, because a repeated reduction may make the kept block anew.
    surface = None if reduced else block_surface(engine, mesh, say)
    made = for_vibration(
        assemble(finer, settings, say=say, crank_mesh=request.mesh, block_mesh=mesh), request.integrator
    )
    assert made.parts.block is not None
    say("panels of the block")
    plan = block_plan(engine)
    if surface is None:
        return made, body_panels(made.parts.block, own, plan.block.material, plan.block.wall_thickness)
    return made, with_thicknesses(panels_of(surface, made.parts.block, plan), own, plan.block.material)


def noise_result(
    made: Assembly, panels: Panels, request: Request, gas: Gas | None, speeds_rpm: Sequence[float],
    cutoff_hz: float, check_step: bool, say: Progress,
) -> NoiseResult:  # fmt: skip
    """Run at each speed and record the block. Raises ``SolverError`` if a step fails.

    Parameters
    ----------
    check_step : also run with half the step
    """
    runs, finer = [], []
    for rpm in sorted(speeds_rpm):
        at_speed = replace(request, speed_rpm=rpm)
        step = request.step_deg or default_step(rpm, cutoff_hz)
        say(f"{rpm:g} rev/min")
        runs.append(recorded(made, at_speed, gas, step, lambda text: None))
        if check_step:
            say(f"{rpm:g} rev/min with half the step")
            finer.append(recorded(made, at_speed, gas, 0.5 * step, lambda text: None))
    attributes = {"engine": made.engine.name, "title": made.engine.title, **request.attributes(made)}
    return NoiseResult(panels, tuple(runs), cutoff_hz, tuple(finer), attributes)


def panels_of(surface: Surface, block: ReducedBody, plan: BlockPlan) -> Panels:
    """Panels in the modes of a running block, with thicknesses from the plan."""
    with one_thread():
        own = surface.in_modes(block.basis)
        products = own.products()
    nodes = own.facets.nodes
    a, b, c, ab, bc, ca = nodes.T
    split = np.vstack([np.column_stack(t) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    origin, triangles = creased(own.facets.points, split.astype(np.int32))
    points = own.facets.points[origin]
    across = np.cross(
        points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
    )
    normals = np.zeros_like(points)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], across)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    moved = np.einsum("mpx,px->mp", own.modes[:, origin], normals, optimize=True)
    critical = [critical_frequency(thickness(plan, name), plan.block.material) for name in own.names]
    return Panels(
        own.names, own.areas(), own.lengths(), np.array(critical), products, points, triangles, moved.astype(np.float32)
    )


def thickness(plan: BlockPlan, name: str) -> float:
    """Thickness of a panel's plate, m: of cover, deck or bulkheads, else of the walls."""
    b = plan.block
    kinds = {"cover": b.cover_thickness, "deck": b.deck_thickness, "front": b.bulkhead_thickness,
             "rear": b.bulkhead_thickness, "mounts": b.pad_size}  # fmt: skip
    return kinds.get(name.split(" ")[0], b.wall_thickness)
