"""Radiated power and surface velocity against closed forms: a baffled piston, a simply supported plate, the bands.

Piston: radiation resistance ρ c S (1 − J₁(2ka)/(ka)) (Rayleigh, *Theory of Sound*, § 302). Plate under a point force:
sum over Kirchhoff's modes (Cremer, Heckl, Petersson, *Structure-Borne Sound*, 2005, section 5.5). Efficiency of plates:
mean of the modes' efficiencies by Rayleigh's integral (Wallace, J. Acoust. Soc. Am. 51 (1972) 946).
"""

import numpy as np
import pytest
from scipy.special import j1
from solids import STEEL, block, frequencies, round_bar

from cranktrain.structure.fem.elasticity import component_dofs, finite_elements, sample
from cranktrain.structure.fem.reduction import surface_triangles
from cranktrain_lab.noise.panels import Facets, six_node_facets
from cranktrain_lab.noise.radiation import (
    DENSITY,
    SPEED,
    a_weighting,
    critical_frequency,
    plate_efficiency,
    third_octaves,
)
from cranktrain_lab.noise.recording import Recorded
from cranktrain_lab.noise.result import NoiseResult, Panels
from cranktrain_lab.noise.surface import chosen

A, B, THICK = 0.5, 0.4, 0.005
LOSS = 0.05
FORCE_AT = 0.125, 0.1125  # a node


def on_face(model, modes, face):
    """Surface of the facets of a mesh's boundary whose corners all have the largest z, as one panel."""
    whole = Facets(np.ascontiguousarray(model.mesh.doflocs.T), six_node_facets(surface_triangles(model.mesh)))
    z = whole.points[whole.nodes[:, :3], 2]
    panel = np.where((np.abs(z - z.max()) < 1e-9).all(axis=1), 0, -1)
    return chosen(whole, panel, (face,), model, modes)


def noise_of(surface, run, highest):
    """Result of one run of a surface, with efficiency 1."""
    empty = np.empty((0, 3))
    panels = Panels(
        surface.names, surface.areas(), surface.lengths(), np.array([1000.0]), surface.products(), empty,
        empty.astype(int), np.empty((len(surface.modes), 0)),
    )  # fmt: skip
    return NoiseResult(panels, (run,), highest)


def test_a_piston_at_high_frequency_radiates_the_equivalent_power():
    """At ka from 10 on the equivalent radiated power is within 2 % of the closed form; below it is larger."""
    radius, speed = 0.1, 1e-3
    model = finite_elements(round_bar(radius, 0.02, 3, 1), STEEL)
    lift = sample(model, lambda x: np.array([[0.0], [0.0], [1.0]]) + 0.0 * x)
    surface = on_face(model, lift[:, None], "piston")
    ka = np.array([0.2, 0.5, 1.0, 10.0, 12.0, 17.0, 25.0])
    exact = 1.0 - j1(2.0 * ka) / ka
    for one, resistance in zip(ka, exact, strict=True):
        period = 2.0 * np.pi * radius / (one * SPEED)
        run = Recorded(3000.0, period, speed * np.cos(2.0 * np.pi * np.arange(16) / 16)[:, None])
        ours = noise_of(surface, run, np.inf).power_lines(run, "one").sum()
        closed = 0.5 * DENSITY * SPEED * resistance * np.pi * radius**2 * speed**2
        assert ours == pytest.approx(closed, rel=0.02) if one >= 10.0 else ours > 1.5 * closed


def plate_modes(count, cells=(40, 32)):
    """Modes of a plate of one layer of solid elements on hard simple supports: no motion across or along its edges."""
    model = finite_elements(block((A, B, THICK), (*cells, 1)), STEEL)
    x, y, _ = model.positions
    at_x, at_y = np.abs(np.abs(x) - 0.5 * A) < 1e-9, np.abs(np.abs(y) - 0.5 * B) < 1e-9
    c = model.components
    free = np.flatnonzero(~((c == 2) & (at_x | at_y) | (c == 1) & at_x | (c == 0) & at_y))
    hz, own = frequencies(model.stiffness[free][:, free], model.mass[free][:, free], count, 40.0)
    modes = np.zeros((model.basis.N, count))
    modes[free] = own
    return model, hz, modes


def kirchhoff(frequency, most):
    """Mean square velocity over force squared (f,), by all modes up to number ``most`` along both edges."""
    stiffness = STEEL.youngs_modulus * THICK**3 / (12.0 * (1.0 - STEEL.poisson_ratio**2))
    mass, omega = STEEL.density * THICK, 2.0 * np.pi * frequency
    found = np.zeros(frequency.size)
    for m in range(1, most + 1):
        for n in range(1, most + 1):
            own = stiffness / mass * ((m * np.pi / A) ** 2 + (n * np.pi / B) ** 2) ** 2
            shape = np.sin(m * np.pi * FORCE_AT[0] / A) * np.sin(n * np.pi * FORCE_AT[1] / B)
            found += (4.0 * shape * omega / (mass * A * B)) ** 2 / np.abs(own * (1.0 + 1j * LOSS) - omega**2) ** 2 / 8.0
    return found


@pytest.fixture(scope="module")
def plate():
    """Bands of the plate's mean square velocity by closed form, and a function of ours with fewer or all modes."""
    period = 0.5
    frequency = np.arange(1, 1500) / period
    # Force of amplitude 1 N at all lines.
    model, hz, modes = plate_modes(20)
    nodes = component_dofs(model.basis)
    place = np.array([FORCE_AT[0] - 0.5 * A, FORCE_AT[1] - 0.5 * B, 0.5 * THICK])
    node = int(np.linalg.norm(model.mesh.doflocs.T - place, axis=1).argmin())
    at = model.mesh.doflocs[:2, node] + 0.5 * np.array([A, B])
    assert at == pytest.approx(FORCE_AT, abs=1e-6)
    bands = third_octaves(100.0, 570.0)

    def ours(count):
        surface = on_face(model, modes[:, :count], "plate")
        own, omega = (2.0 * np.pi * hz[:count]) ** 2, 2.0 * np.pi * frequency[:, None]
        lines = 1j * omega * modes[nodes[2, node], :count] / (own * (1.0 + 1j * LOSS) - omega**2)
        whole = np.vstack((np.zeros(count), lines, np.zeros(count)))
        velocity = np.fft.irfft(0.5 * 2 * (len(whole) - 1) * whole, axis=0)
        run = Recorded(240.0, period, velocity)
        result = noise_of(surface, run, 1e4)
        assert run.lines == pytest.approx(lines, abs=1e-12 + 1e-9 * np.abs(lines).max())
        return bands.sums(frequency, result.velocity_lines(run))[0]

    return bands.sums(frequency, kirchhoff(frequency, 40)), ours


def test_a_plate_under_a_point_force_moves_as_kirchhoffs(plate):
    exact, ours = plate
    assert ours(20) == pytest.approx(exact, rel=0.02)


def test_more_modes_approach_the_plates_motion(plate):
    exact, ours = plate
    errors = [np.abs(ours(count) / exact - 1.0).max() for count in (2, 4, 20)]
    assert errors[0] > 0.05 and errors[0] > errors[1] > errors[2]


def rayleigh(frequency, modes, cells=(60, 48)):
    """Mean radiation efficiency of modes (m, n) of a baffled plate at a frequency, by elementary radiators."""
    x, y = ((np.arange(n) + 0.5) * s / n for n, s in zip(cells, (A, B), strict=True))
    X, Y = (values.ravel() for values in np.meshgrid(x, y, indexing="ij"))
    apart = np.hypot(X[:, None] - X, Y[:, None] - Y)
    k, area = 2.0 * np.pi * frequency / SPEED, A * B / X.size
    kernel = np.sinc(k * apart / np.pi) * k**2 * area / (2.0 * np.pi)
    shapes = np.array([np.sin(m * np.pi * X / A) * np.sin(n * np.pi * Y / B) for m, n in modes])
    return float(np.mean(np.einsum("mi,ij,mj->m", shapes, kernel, shapes) / (shapes**2).sum(axis=1)))


@pytest.mark.parametrize("thickness", [0.002, 0.003])
def test_the_efficiency_of_a_plate_is_the_mean_of_its_modes(thickness):
    """Within 3 dB in every third octave with five resonant modes or more, the one at f_c left out."""
    stiffness = STEEL.youngs_modulus * thickness**2 / (12.0 * (1.0 - STEEL.poisson_ratio**2)) / STEEL.density
    critical = critical_frequency(thickness, STEEL)
    assert critical == pytest.approx(SPEED**2 / (2.0 * np.pi) / np.sqrt(stiffness), rel=1e-9)
    numbers = [(m, n) for m in range(1, 40) for n in range(1, 40)]
    hz = np.array([np.sqrt(stiffness) * np.pi / 2.0 * ((m / A) ** 2 + (n / B) ** 2) for m, n in numbers])
    bands = third_octaves(400.0, 1.6 * critical)
    tried = 0
    for low, high in zip(bands.low, bands.high, strict=True):
        inside = [pair for pair, own in zip(numbers, hz, strict=True) if low <= own < high]
        middle = np.sqrt(low * high)
        if len(inside) < 5 or (low < critical * 10.0**0.05 and high > critical * 10.0**-0.05):
            continue
        ours = plate_efficiency(np.array([middle]), critical, (A, B))[0]
        assert abs(10.0 * np.log10(ours / rayleigh(middle, inside))) < 3.0, middle
        tried += 1
    assert tried > 3


def test_bands_are_those_of_iec_61260():
    bands = third_octaves(16.0, 3000.0)
    assert bands.nominal[[0, 1, 8, 18, -1]].tolist() == pytest.approx([16.0, 20.0, 100.0, 1000.0, 2500.0])
    assert (bands.low[18], bands.high[18]) == pytest.approx((891.251, 1122.018), rel=1e-6)
    assert bands.high[:-1] == pytest.approx(bands.low[1:])
    assert third_octaves(16.0, bands.high[-1]).nominal[-1] == pytest.approx(2500.0)
    values = np.random.default_rng(2).random((2, 400))
    frequency = np.linspace(bands.low[0], bands.high[-1] * (1 - 1e-9), 400)
    assert bands.sums(frequency, values).sum(axis=1) == pytest.approx(values.sum(axis=1))


def test_a_weighting_is_that_of_iec_61672():
    hz = 1000.0 * 10.0 ** (np.array([-20, -15, -10, -5, 0, 6, 9]) / 10.0)
    assert 10.0 * np.log10(a_weighting(hz)) == pytest.approx([-70.4, -39.4, -19.1, -6.6, 0.0, 1.0, -1.1], abs=0.06)


def test_far_above_its_critical_frequency_a_plate_radiates_with_efficiency_one():
    critical = critical_frequency(0.01, STEEL)
    assert critical == pytest.approx(1200.0, rel=0.05)  # the usual 12 m/s over the thickness
    found = plate_efficiency(critical * np.array([2.0, 30.0]), critical, (0.8, 0.3))
    assert found == pytest.approx([np.sqrt(2.0), 1.0], rel=0.02), found
