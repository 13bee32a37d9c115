"""What the first solution of an elastic film at a stage begins with: the parabola of its nodes goes on."""

import numpy as np
import pytest

from cranktrain.film.elastic.grid import ElasticGrid
from cranktrain.film.laws.ehd import elastic_memory
from cranktrain.film.laws.films import ELAPSED, GAIN, STAGE
from cranktrain.film.laws.foresight import end_slopes, foresee, keep_stage

TIMES = (0.87e-4, 0.6e-4, 1.0e-4)
FULL, VOID, FILLS, RUPTURES, SWITCHED = range(5)


@pytest.fixture
def own():
    """Memory of one film after two stages, of which a few nodes follow parabolas."""
    memory = elastic_memory(ElasticGrid(12, 5).film(0.05, 0.02, 2e-5, 0.01), 1)
    memory.start[0] = values(0.0)
    solved(memory, 1, TIMES[0])
    solved(memory, 2, TIMES[1])
    return memory


def values(t):
    """Unknowns at a time: two that stay on their sides, two that are about to change them, one that did."""
    x = t / 1e-4
    found = np.full(12 * 5, 0.3)
    found[FULL] = 1.0 + 2.0 * x - 0.5 * x * x
    found[VOID] = -0.6 + 0.1 * x + 0.2 * x * x
    found[FILLS] = -0.3 + 0.1 * x + 0.22 * x * x
    found[RUPTURES] = 0.3 - 0.1 * x - 0.22 * x * x
    found[SWITCHED] = 0.2 if x == 0.0 else -0.2
    return found


def solved(memory, stage, t):
    """Keep a stage as it would be solved."""
    memory.unknowns[0] = values(t)
    keep_stage(memory, 0, numbers(stage, t))


def numbers(stage, t):
    found = np.zeros(14)
    found[[ELAPSED, GAIN, STAGE]] = t, 0.4e-4, stage
    return found


def test_nodes_go_where_their_parabola_goes(own):
    """A void that fills is full, at no pressure; a film whose pressure ends is void; what switched stays as it was."""
    foresee(own, 0, numbers(3, TIMES[2]))
    assert own.unknowns[0, [FULL, VOID]] == pytest.approx(values(TIMES[2])[[FULL, VOID]], rel=1e-12)
    foresee(own, 0, numbers(3, 1.3e-4))
    filled, ruptured, switched = own.unknowns[0, [FILLS, RUPTURES, SWITCHED]]
    assert filled == 0.0 and -1e-3 < ruptured < 0.0
    assert switched == -0.2


def test_the_next_step_begins_with_the_slope_at_the_end(own):
    """Of a parabola the slope is exact; a node that switched has none."""
    solved(own, 3, TIMES[2])
    own.unknowns[0] = values(TIMES[2])
    end_slopes(own, 0, 3)
    assert own.slopes[0, FULL] == pytest.approx((2.0 - 1.0) / 1e-4, rel=1e-12)
    assert own.slopes[0, SWITCHED] == 0.0
    own.start[0], own.times[0] = own.unknowns[0], 0.0
    foresee(own, 0, numbers(1, 0.2e-4))
    assert own.unknowns[0, FULL] == pytest.approx(values(TIMES[2])[FULL] + 0.2, rel=1e-12)
