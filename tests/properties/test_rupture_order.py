"""Elastic films through a cycle in which most nodes rupture and fill again: order in time and conservation of oil.

A prescribed orbit presses the journal beyond its clearance into the elastic bore twice a cycle: both fronts pass around
it. Bearings are those of a short crank (one cylinder) and of a long one (twelve).
"""

import numpy as np
import pytest
from benchmarks._orbit_stages import StagedFilms, worst_orbit
from some import some

from cranktrain.film.elastic.grid import LIMITS, OIL, STEP_LIMIT

HIGHEST = 1.15
CASES = {"single_petrol": 3000.0, "v12_petrol": 5000.0}
FINE = 1440
STEPS = (90, 120, 180, 240, 360)
"""Of a cycle: 8 to 2 degrees; FINE in each a whole number of times."""


class Films:
    """Films alone and in lanes with a common start, and a cycle from there in fine steps."""

    def __init__(self, name):
        orbits = worst_orbit(name, CASES[name], HIGHEST)
        orbits.bore.film.constants[STEP_LIMIT : STEP_LIMIT + 4] = LIMITS
        self.alone, self.lanes = StagedFilms(orbits), StagedFilms(orbits, lanes=True)
        self.alone.cycle("sdirk2", 360)
        self.start = self.alone.memory.copy(), self.alone.end
        self.oil = self.alone.bore.memory.out[:, OIL].copy()
        self.fine = self.alone.cycle("esdirk3", FINE)

    def cycle(self, films, integrator, steps):
        """A cycle of some of the films from the common start."""
        films.memory[:], films.end = self.start
        return films.cycle(integrator, steps)

    def missing(self, found):
        """Oil that a cycle has lost or made, over the film's oil."""
        return float(np.abs((found.content[-1] - self.oil - found.gained[-1]) / self.oil).max())

    def errors(self, integrator, steps):
        """Mean error of the fill at the end, and largest error of ∫ F dt over its largest value."""
        found, fine = self.cycle(self.alone, integrator, steps), self.fine
        fill = np.abs(np.minimum(found.unknowns, 0.0) - np.minimum(fine.unknowns, 0.0)).mean()
        same = fine.impulses[FINE // steps - 1 :: FINE // steps]
        return float(fill), float(np.abs(found.impulses - same).max() / np.abs(same).max())


@pytest.fixture(scope="module", params=CASES)
def films(request):
    return Films(request.param)


@pytest.mark.parametrize(("integrator", "least", "most"), [("backward-euler", 0.9, 1.1), ("sdirk2", 1.35, 2.6),
                                                           ("esdirk3", 1.35, 2.6)])  # fmt: skip
def test_voids_and_forces_have_the_order_of_the_stages(films, integrator, least, most):
    """Order 1 of backward Euler; about 2 of higher methods, because the fill of a node has a kink at each front."""
    errors = np.array([films.errors(integrator, steps) for steps in STEPS])
    orders = -np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    assert (orders > least).all() and (orders < most).all()


@pytest.mark.parametrize("integrator", ["backward-euler", "sdirk2", "esdirk3"])
@pytest.mark.parametrize("steps", [90, 360])
def test_oil_is_conserved_over_a_cycle(films, integrator, steps):
    """To 1e-9 by the solver of single films in doubles, to 1e-6 in lanes of singles; fills stay above nothing."""
    found = films.cycle(films.alone, integrator, steps)
    assert found.switched * steps > 192
    assert films.missing(found) < 1.0e-9
    assert -1.0 < found.unknowns.min() < 0.0
    assert films.missing(films.cycle(films.lanes, integrator, steps)) < 1.0e-6


def test_films_that_follow_the_stages_are_far_nearer_than_by_backward_euler(films):
    """At steps of 8 degrees: fill and impulses."""
    for euler, stages in some(zip(films.errors("backward-euler", 90), films.errors("esdirk3", 90), strict=True)):
        assert stages < 0.1 * euler
