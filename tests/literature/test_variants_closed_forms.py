"""Variants and optima of two masses, of which all is known: Sobol indices by quadrature, Den Hartog's optima.

J. P. Den Hartog, Mechanical Vibrations (1956), section 3.3: for a damper on a spring, f = 1/(1 + μ),
ζ² = 3μ/(8 (1 + μ)³), amplification √(1 + 2/μ); his example has μ = 1/20. For a ring in a fluid, amplification
1 + 2/μ and peak frequency √(2/(2 + μ)). ζ = c/(2 m ω) with the damper's mass m.
"""

import math

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy import stats

import cranktrain as ct
from cranktrain_lab.variants.results.statistics import sobol_indices
from cranktrain_lab.variants.two_mass import two_mass_answer

pytest.importorskip("pyarrow")
SPANS = {"inertia_ratio": (0.15, 0.35), "frequency_ratio": (0.75, 0.95), "damping_ratio": (0.1, 0.3)}
FORCE, POINTS = 0.9, 24


def amplitude(mu, f, zeta, g):
    """From the equations of motion of both masses, not from the polynomial form."""
    spring, fluid = mu * f**2, 2.0 * mu * zeta
    link = spring + 1j * g * fluid
    return np.abs((link - mu * g**2) / ((1.0 - g**2 + link) * (link - mu * g**2) - link**2))


@pytest.mark.parametrize("values", [(0.05, 0.95, 0.127), (0.3, 0.0, 0.4), (1.0, 0.5, 0.05)])
def test_two_masses_move_as_their_equations_say(values):
    mu, f, zeta = values
    given = {"inertia_ratio": mu, "frequency_ratio": f, "damping_ratio": zeta}
    for g in (0.3, 0.9, 1.4):
        found = two_mass_answer({**given, "force_frequency": g})["amplitude"]
        assert found == pytest.approx(amplitude(mu, f, zeta, g), rel=1e-10)
    whole = two_mass_answer(given)
    everywhere = amplitude(mu, f, zeta, np.linspace(0.01, 3.0, 200_001))
    assert whole["amplification"] == pytest.approx(everywhere.max(), rel=1e-7)
    assert amplitude(mu, f, zeta, whole["peak_frequency"]) == pytest.approx(whole["amplification"], rel=1e-9)


def exact_indices():
    """First-order and total indices by Gauss's quadrature."""
    x, w = leggauss(POINTS)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    axes = np.meshgrid(*(low + (high - low) * x for low, high in SPANS.values()), indexing="ij")
    values = amplitude(*axes, FORCE)
    mean = np.einsum("i,j,k,ijk", w, w, w, values)
    variance = np.einsum("i,j,k,ijk", w, w, w, values**2) - mean**2
    first, total = [], []
    for k in range(3):
        moved = np.moveaxis(values, k, -1)
        alone, others = np.einsum("i,j,ijk->k", w, w, moved), moved @ w
        first.append((w @ alone**2 - mean**2) / variance)
        total.append(1.0 - (np.einsum("i,j,ij", w, w, others**2) - mean**2) / variance)
    return np.array(first), np.array(total)


def test_sobol_indices_of_two_masses():
    spans = {name: ("uniform", *span) for name, span in SPANS.items()}
    study = ct.vary(
        lambda v: {"a": float(amplitude(*(v[name] for name in SPANS), FORCE))}, spans, outputs=["a"], n=4096,
        method="sensitivity",
    )  # fmt: skip
    found = study.sensitivities()["a"]
    first, total = exact_indices()
    np.testing.assert_allclose([one["total"] for one in found], total, rtol=0.02)
    np.testing.assert_allclose([one["first"] for one in found], first, rtol=0.02)
    for one, exact in zip(found, total, strict=True):
        assert abs(one["total"] - exact) < 3.0 * one["total_error"] < 0.1


def test_indices_are_those_of_scipy():
    rng = np.random.default_rng(3)
    a, b, mixed = rng.random(64), rng.random(64), rng.random((3, 64))
    theirs = stats.sobol_indices(func={"f_A": a[None], "f_B": b[None], "f_AB": mixed[:, None]}, n=64)
    ours = sobol_indices(np.concatenate((a, b, mixed.ravel())), 64, 3)
    np.testing.assert_allclose(ours.first, np.ravel(theirs.first_order), rtol=1e-9)
    np.testing.assert_allclose(ours.total, np.ravel(theirs.total_order), rtol=1e-9)


def study(folder, mu, tuned):
    tuning = '"frequency_ratio" = { low = 0.3, high = 1.5 }\n' if tuned else ""
    fixed = "" if tuned else '"frequency_ratio" = { formula = "0 * damping_ratio" }\n'
    path = folder / "two.toml"
    path.write_text(
        'model = "two-mass"\noutputs = ["amplification", "peak_frequency"]\n'
        f'[vary]\n{tuning}"damping_ratio" = {{ low = 0.01, high = 2.0 }}\n'
        f'[derived]\n{fixed}"inertia_ratio" = {{ formula = "{mu} + 0 * damping_ratio" }}\n'
        '[optimize]\nminimize = "amplification"\nevaluations = 1200\n'
    )
    return path


def test_a_tuned_damper_is_den_hartogs(tmp_path):
    mu = 1.0 / 20.0
    found = ct.optimize(study(tmp_path, mu, True), output=tmp_path / "found", workers=1)
    values = {one["key"]: one["value"] for one in found["values"]}
    outputs = {one["output"]: one["value"] for one in found["outputs"]}
    assert outputs["amplification"] == pytest.approx(math.sqrt(1.0 + 2.0 / mu), rel=0.005)
    assert values["frequency_ratio"] == pytest.approx(1.0 / (1.0 + mu), rel=0.005)
    assert values["damping_ratio"] == pytest.approx(math.sqrt(3.0 * mu / (8.0 * (1.0 + mu) ** 3)), rel=0.005)


@pytest.mark.parametrize("mu", [0.05, 0.4, 1.0])
def test_a_ring_in_a_fluid_is_houdailles(tmp_path, mu):
    found = ct.optimize(study(tmp_path, mu, False), output=tmp_path / "found", workers=1)
    (damping,) = (one["value"] for one in found["values"])
    outputs = {one["output"]: one["value"] for one in found["outputs"]}
    assert outputs["amplification"] == pytest.approx(1.0 + 2.0 / mu, rel=1e-4)
    assert outputs["peak_frequency"] == pytest.approx(math.sqrt(2.0 / (2.0 + mu)), rel=1e-3)
    # The damper-optimum of the package states c/(2 M ω), M the main mass: μ times as much.
    assert mu * damping == pytest.approx(ct.damper_optimum(inertia_ratio=mu)["damping_ratio"], rel=0.005)
