"""What a last bit of a parameter does to the combustion, whose error control compares numbers.

Another system has another mathematical library, which differs in last bits: the same happens between Linux and Windows.
"""

import numpy as np
import pytest
import real_unit
from real_unit import STEP

PARAMETERS = (
    "wall.factor",
    "wall.temperature",
    "intake.lift",
    "exhaust.lift",
    "burn.premixed_factor",
    "ignition.factor",
)


@pytest.fixture(scope="module")
def combustion(tmp_path_factory):
    return real_unit.unpacked("combustion_i6", tmp_path_factory.mktemp("combustion"))


def ended(unit, changed, tolerance):
    """Outputs after a run with other Real parameters, but for what counts the steps."""
    one = unit.fresh(start=False)
    one.set("Real", {unit.references["solver.tolerance"]: tolerance} | changed)
    one.start().run(40, step=STEP)
    names = [v.name for v in unit.about.modelVariables if v.causality == "output"]
    values = one.get("Real", *(unit.references[name] for name in names if not name.startswith("solver.")))
    one.free()
    return np.array(values)


@pytest.mark.parametrize(("tolerance", "least", "most"), [(1e-6, 1e-7, 1e-4), (1e-10, 0.0, 1e-8)])
def test_last_bits_move_outputs_by_what_the_tolerance_lets_them(combustion, tolerance, least, most):
    """At the usual tolerance some step is decided otherwise, at the finest that hardly counts."""
    about = {v.name: v for v in combustion.about.modelVariables}
    usual = ended(combustion, {}, tolerance)
    units = np.array([str(v.unit) for v in about.values() if v.causality == "output" and v.name[:7] != "solver."])
    largest = np.array([np.abs(usual[units == unit]).max() for unit in units])
    moved = []
    for name in PARAMETERS:
        for bits in (4, 18):
            value = float(about[name].start) * (1.0 + bits * np.finfo(float).eps)
            found = ended(combustion, {combustion.references[name]: value}, tolerance)
            moved.append(np.max(np.abs(found - usual) / largest))
    assert least <= max(moved) < most, moved
