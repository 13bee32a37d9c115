"""The SSP in other people's masters: installed on demand, run to the end, close to the reference master."""

import math

import pytest
from benchmarks.foreign_masters import OUTPUTS, SPEED, differences, export, reference
from benchmarks.masters.environment import MASTERS, NotHere, run

from cranktrain.coupling.virtual_engine import Partners, virtual_engine
from cranktrain.fmu.build import build_fmu

STEP, COUNT = math.radians(1.0) / SPEED, 720 * 10
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def coupled(fmu, tmp_path_factory):
    """The SSP and what the reference master makes of it."""
    folder = tmp_path_factory.mktemp("ssp")
    partners = Partners(fmu, build_fmu("combustion_i6", folder), {})
    engine = virtual_engine(partners, SPEED, "gauss-seidel", "own")
    return export(engine, folder / "VirtualEngineI6.ssp", COUNT * STEP), reference(engine, STEP, COUNT)


@pytest.mark.parametrize("name", MASTERS)
def test_the_ssp_in_another_master(coupled, name):
    """After ten cycles, when what they start with differently has died away: within half a percent of torsion."""
    ssp, truth = coupled
    try:
        rows = run(name, ssp, STEP, COUNT, OUTPUTS)
    except NotHere as reason:
        pytest.skip(str(reason))
    found = differences(rows, truth)
    assert found["torsion"] < 5e-3
    assert abs(found["imep"]) < 1e-3
