"""What a last bit of a parameter does to the combustion: no comparison within a step may hang on it.

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


def ended(unit, changed):
    """Outputs after a run with other Real parameters; not the counts of steps, nor balances, which are rounding."""
    one = unit.fresh(start=False)
    one.set("Real", changed)
    one.start().run(40, step=STEP)
    values = one.get("Real", *(unit.references[v.name] for v in outputs(unit)))
    one.free()
    return np.array(values)


def outputs(unit):
    made = (v for v in unit.about.modelVariables if v.causality == "output")
    return [v for v in made if not v.name.startswith(("solver.", "balance."))]


@pytest.mark.parametrize("name", PARAMETERS)
def test_last_bits_move_outputs_by_rounding(combustion, name):
    """A burn drops to 0 where a step ends: which side of it the step's last stage sees was up to rounding once."""
    start = next(float(v.start) for v in combustion.about.modelVariables if v.name == name)
    usual = ended(combustion, {})
    units = np.array([str(v.unit) for v in outputs(combustion)])
    largest = np.array([np.abs(usual[units == unit]).max() for unit in units])
    for bits in (4, 18):
        found = ended(combustion, {combustion.references[name]: start * (1.0 + bits * np.finfo(float).eps)})
        # Of a unit that only zeros have (deviations of volumes, which nothing gives here) they stay zeros.
        assert np.all(np.abs(found - usual) <= 1e-9 * largest), bits
