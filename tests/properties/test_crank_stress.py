"""Stresses by superposition: patch, rotating bar, static completeness, parts as point masses, features, a cycle."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from solids import STEEL, block

from cranktrain.core.reduced_body import truncate
from cranktrain.engine.file import load_engine
from cranktrain.structure.crank.reduction import complete_crankshaft, running_loads
from cranktrain.structure.fem.craig_bampton import craig_bampton
from cranktrain.structure.fem.elasticity import finite_elements
from cranktrain.structure.fem.interfaces import averaged_interfaces
from cranktrain.structure.stress.direct_solution import Instants, direct_solution, part_loads, point_masses
from cranktrain.structure.stress.features import surface_features
from cranktrain.structure.stress.nodal_stress import ACROSS, NodalStress, von_mises
from cranktrain.structure.stress.stress_modes import ShapedCrank, stress_modes, surface_stress_modes

SIX = load_engine("diesel_i6")
SHORT = {"throw_angles": (0.0,), "main_widths": (0.04, 0.04), "counterweights": (True, True), "mesh_size": 0.04}
ONE_THROW = replace(
    SIX, crankshaft=replace(SIX.crankshaft, **SHORT), thrust=replace(SIX.thrust, main=1),
    reduction=replace(SIX.reduction, fixed_modes=30),
)  # fmt: skip


@cache
def one_throw():
    shaped = ShapedCrank.of(ONE_THROW, None, lambda stage: None)
    return shaped, stress_modes(ONE_THROW, shaped=lambda: shaped)


def uniform(gradient):
    """Stress (6,) of a displacement gradient (3, 3) in steel, by Young's modulus and Poisson's ratio."""
    strain = 0.5 * (gradient + gradient.T)
    e, nu = STEEL.youngs_modulus, STEEL.poisson_ratio
    stress = e / (1 + nu) * (strain + nu / (1 - 2 * nu) * np.trace(strain) * np.eye(3))
    return np.array([stress[a, b] for a, b in ACROSS])


def test_linear_and_quadratic_fields_give_their_stress_and_a_rotation_none():
    """Straight elements hold bending by couples exactly: u = (x z, 0, −x²/2) κ has σ_xx = E' κ z."""
    mesh = block((0.05, 0.04, 0.06), (2, 2, 2))
    gradient, turn = np.random.default_rng(1).standard_normal((2, 3, 3))
    x, _, z = mesh.doflocs
    bending = np.stack((x * z, 0 * x, -0.5 * x * x))
    fields = np.stack((gradient @ mesh.doflocs, bending, (turn - turn.T) @ mesh.doflocs), axis=2)
    stretched, bent, turned = NodalStress.of(mesh, STEEL, np.arange(x.size))(fields)
    constant = uniform(gradient)[:, None]
    linear = np.array([uniform(np.array([[c, 0, a], [0, 0, 0], [-a, 0, 0]])) for a, c in zip(x, z, strict=True)]).T
    for found, wanted, size in ((stretched, constant, constant), (bent, linear, linear), (turned, 0.0, constant)):
        assert np.abs(found - wanted).max() < 1e-9 * np.abs(size).max()


def test_von_mises_is_deaf_to_pressure_and_to_turned_axes():
    rng = np.random.default_rng(2)
    tensor = rng.standard_normal((3, 3))
    tensor += tensor.T
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    others = (tensor, tensor + 5.0 * np.eye(3), turn @ tensor @ turn.T)
    values = [von_mises(np.array([[part[a, b]] for a, b in ACROSS]))[0] for part in others]
    assert values == pytest.approx([values[0]] * 3, rel=1e-12)
    assert von_mises(np.array([3.0, 0, 0, 0, 0, 0])) == 3.0
    assert von_mises(np.array([0, 0, 0, 1.0, 0, 0])) == pytest.approx(np.sqrt(3.0))


def test_a_bar_that_turns_about_its_middle_has_the_stress_of_its_centrifugal_load():
    """σ = ρ Ω² (l² − x²)/2 along a slender bar about z, half length l, whatever the modes hold of it."""
    half = 0.3
    mesh = block((2 * half, 0.02, 0.02), (20, 1, 1))
    near = 1e-4
    mesh = mesh.with_boundaries({"left": lambda p: p[0] < near - half, "right": lambda p: p[0] > half - near})
    model = finite_elements(mesh, STEEL)
    reduced = craig_bampton(model, averaged_interfaces(model), fixed_modes=2)
    surface = surface_stress_modes(model, reduced)
    for running in (reduced.body, truncate(reduced.body, 1000.0), truncate(reduced.body, 10.0)):
        modes = surface.of_running(reduced.body, running)
        position = np.zeros(running.n_modes)
        position[6:] = running.centrifugal_load[6:] / running.omega[6:] ** 2
        stress = np.append(position, 1.0) @ modes.reshape(len(modes), -1)
        x = surface.points[:, 0]
        exact = 0.5 * STEEL.density * (half**2 - x**2)
        inside = np.abs(x) < half - 0.03
        np.testing.assert_allclose(stress.reshape(6, -1)[0, inside], exact[inside], atol=2e-3 * exact.max())


def test_static_loads_in_the_modes_of_a_run_have_the_stress_of_a_direct_solution():
    """Rod and bearing forces, the flywheel's inertia and the centrifugal load of 2200 rev/min, within 2 %."""
    shaped, surface = one_throw()
    bare = shaped.reduced.body
    complete = complete_crankshaft(ONE_THROW, bare)
    running = truncate(complete, ONE_THROW.reduction.running_cutoff_hz, running_loads(ONE_THROW))
    loads = np.zeros((1, len(bare.interfaces), 6))
    loads[0, bare.index("pin[1]"), :2] = 2e4, -6e4
    loads[0, bare.index("main[1]"), :2] = -1e4, 2.9e4
    loads[0, bare.index("main[2]"), :2] = -1e4, 2.9e4
    speed = 230.0
    force = np.einsum("mc,mcr->r", loads[0], running.shapes) + speed**2 * running.centrifugal_load
    rigid = np.concatenate((force[:6], np.zeros(running.n_modes - 6)))
    position = np.concatenate((np.zeros(6), force[6:] / running.omega[6:] ** 2))
    # The crank hangs free: rigid acceleration is what the loads give it, elastic modes answer statically.
    at = Instants(
        np.zeros((1, bare.n_modes)), np.zeros((1, bare.n_modes)), (running.basis @ rigid)[None], loads,
        np.array([speed]), np.zeros(1), np.zeros((1, 3)),
    )  # fmt: skip
    displacement, taken = direct_solution(shaped, ONE_THROW, at)
    assert taken[0] < 1e-3, "the loads of parts are in balance with the crank's"
    operator, dofs = shaped.surface_stress
    direct = operator(displacement[dofs])[0]
    modes = surface.of_running(complete, running)
    superposed = (np.append(position, speed**2) @ modes.reshape(len(modes), -1)).reshape(6, -1)
    assert von_mises(superposed - direct).max() < 0.02 * von_mises(direct).max()


def test_point_masses_have_the_mass_and_the_inertia_of_a_part():
    inertia, offset = np.diag([0.4, 0.5, 0.8]), np.array([0.0, 0.01, -0.03])
    points, masses = point_masses(20.0, inertia, offset)
    assert masses.sum() == pytest.approx(20.0)
    np.testing.assert_allclose(masses @ points, 20.0 * offset, atol=1e-12)
    arms = points - offset
    about = np.einsum("p,pij->ij", masses, np.sum(arms**2, 1)[:, None, None] * np.eye(3)) - (masses * arms.T) @ arms
    np.testing.assert_allclose(about, inertia, atol=1e-12)


def test_parts_that_turn_steadily_weigh_and_a_weight_off_the_axis_pulls():
    """On the axis a part has its weight only; a balance weight pulls by m r Ω² along its radius."""
    shaped, _ = one_throw()
    body, n = shaped.reduced.body, shaped.reduced.body.n_modes
    still = np.zeros((1, n))
    at = Instants(
        still, still, still, np.zeros((1, len(body.interfaces), 6)), np.array([100.0]), np.zeros(1),
        np.array([[0.0, -9.81, 0.0]]),
    )  # fmt: skip
    loads = part_loads(ONE_THROW, body, at)[0]
    wheel = ONE_THROW.flywheel
    expected = [0.0, -9.81 * wheel.mass, 0.0, 9.81 * wheel.mass * wheel.offset, 0.0, 0.0]
    np.testing.assert_allclose(loads[body.index("flywheel")], expected, atol=1e-9 * 100.0**2 * wheel.polar_inertia)
    weights = load_engine("diesel_v8").balance_weights
    values = {k: getattr(weights, k)[:1] for k in ("masses", "radii", "angles", "offsets")}
    first = replace(weights, mains=(1,), **values)
    pull = part_loads(replace(ONE_THROW, balance_weights=first), body, at)[0] - loads
    size = first.masses[0] * first.radii[0] * 100.0**2
    angle = first.angles[0]
    weight = [0.0, -9.81 * first.masses[0]]
    np.testing.assert_allclose(
        pull[body.index("main[1]"), :2], size * np.array([-np.sin(angle), np.cos(angle)]) + weight, rtol=1e-9
    )


def test_every_fillet_of_the_surface_is_found_where_it_is():
    _, surface = one_throw()
    names, number = surface_features(ONE_THROW.crankshaft, surface.points)
    fillets = {name for name in names if name.endswith("fillet")}
    ends = ("pin[1] front", "pin[1] rear", "main[1] rear", "main[2] front", "main[2] rear")  # the last at the flange
    assert fillets == {f"{end} fillet" for end in ends}
    pin = surface.points[number == names.index("pin[1]")]
    across = np.hypot(pin[:, 0], pin[:, 1] - ONE_THROW.crankshaft.throw)
    assert across == pytest.approx(0.5 * ONE_THROW.crankshaft.pin_diameter, abs=1e-3)
    for name in fillets:
        own = surface.points[number == names.index(name)]
        assert np.ptp(own[:, 2]) == pytest.approx(ONE_THROW.crankshaft.fillet, rel=0.1)


def test_the_surface_is_seen_from_outside():
    """Volume by the divergence theorem over the triangles: positive, and that of the mass but for chords."""
    shaped, surface = one_throw()
    a, b, c = surface.points[surface.triangles].transpose(1, 0, 2)
    volume = np.einsum("ta,ta->", a, np.cross(b, c)) / 6.0
    assert volume == pytest.approx(shaped.reduced.body.mass / ONE_THROW.material.density, rel=0.02)
