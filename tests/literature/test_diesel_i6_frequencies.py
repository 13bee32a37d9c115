"""The in-line six against the frequencies the reference publishes, through the whole structural chain."""

import numpy as np
import pytest

from cranktrain.engine.file import load_engine
from cranktrain.structure.crank.modal import modal_report
from cranktrain.structure.crank.reduction import reduced_crankshaft, running_body, surface_shape

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def engine():
    return load_engine("diesel_i6")


@pytest.fixture(scope="module")
def body(engine):
    return reduced_crankshaft(engine)


@pytest.fixture(scope="module")
def report(engine, body):
    return modal_report(engine, body)


def test_cranktrain_torsion_and_axial_motion(report):
    cranktrain = report["cranktrain"]
    assert cranktrain["first_torsional_hz"] == pytest.approx(238.0, rel=0.01)
    assert cranktrain["second_torsional_hz"] == pytest.approx(650.0, rel=0.05)
    assert cranktrain["first_axial_hz"] == pytest.approx(300.0, rel=0.05)


def test_free_crankshaft_torsion(report):
    first, second = report["crankshaft_free"]["torsional_hz"]
    assert first == pytest.approx(252.0, rel=0.02)
    assert second == pytest.approx(690.0, rel=0.05)


def test_critical_speeds(engine, report):
    published = np.array(engine.published.critical_speeds) * 30 / np.pi
    np.testing.assert_allclose([entry["rpm"] for entry in report["critical_speeds"]], published, rtol=0.01)


def test_shares_add_up_and_name_the_shape(report):
    for part in ("crankshaft_free", "cranktrain"):
        for mode in report[part]["modes"]:
            assert sum(mode["shares"].values()) == pytest.approx(1.0)
            assert mode["shares"][mode["shape"]] == max(mode["shares"].values())


def test_quality_of_the_reduction(body, report):
    reduction = report["reduction"]
    assert reduction["max_relative_error"] < 1e-3
    assert reduction["static_stiffness_error"] < 1e-6
    assert reduction["rigid_body_hz_before_replacement"] < 1e-2
    assert body.quality["tied_raises_first"] > 0.1


def test_running_body_keeps_the_low_modes(engine, body):
    running = running_body(engine, body)
    assert running.n_modes < 80
    points, triangles, displacement = surface_shape(engine, running, 10)
    assert displacement.shape == points.shape and triangles.max() == len(points) - 1
