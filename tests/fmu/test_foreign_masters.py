"""The SSP in other people's masters: installed on demand, run to the end, close to the reference master."""

import math

import pytest
from benchmarks.foreign_masters import OUTPUTS, SPEED, differences, export, reference
from benchmarks.masters.environment import MASTERS, NotHere, run
from coarse_engines import built

from cranktrain.core.errors import InputError
from cranktrain.fmu.build import build_fmu
from cranktrain_lab.coupling.virtual_engine import Partners, virtual_engine

STEP, COUNT = math.radians(1.0) / SPEED, 720 * 10
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=["python", "native"])
def coupled(request, model, tmp_path_factory):
    """The SSP, what the reference master makes of it, and whether its units are native."""
    folder, platforms = tmp_path_factory.mktemp("ssp"), ("linux64",) if request.param == "native" else ()
    try:
        partner = build_fmu("combustion_i6", folder, platforms=platforms)
        partners = Partners(built(model, folder, platforms), partner, {})
    except InputError as error:
        pytest.skip(str(error))
    engine = virtual_engine(partners, SPEED, "gauss-seidel", "own")
    ssp = export(engine, folder / "VirtualEngineI6.ssp", COUNT * STEP)
    return ssp, reference(engine, STEP, COUNT), bool(platforms)


@pytest.mark.parametrize("name", MASTERS)
def test_the_ssp_in_another_master(coupled, name):
    """After ten cycles, when what they start with differently has died away: within half a percent of torsion."""
    ssp, truth, native = coupled
    try:
        rows = run(name, ssp, STEP, COUNT, OUTPUTS, native=native)
    except NotHere as reason:
        pytest.skip(str(reason))
    found = differences(rows, truth)
    assert found["torsion"] < 5e-3
    assert abs(found["imep"]) < 1e-3
