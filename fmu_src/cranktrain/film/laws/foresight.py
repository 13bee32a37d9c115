"""Initial guess of an elastic film at a new stage, extrapolated from earlier stages.

Node unknowns and rates of shapes are extrapolated by a parabola through the step's start, the solved stage nearest in
time and one about half-way between. The first stage uses the slope at the end of the last step, which the state holds.
A node that changed between full and ruptured keeps its last value. The guess saves iterations; solutions stay within
their tolerance.
"""

from cranktrain.core.kernel import inlined_kernel, kernel
from cranktrain.film.laws.films import ELAPSED, GAIN, STAGE

APART = 1.0e-3
"""Least distance between two times of a parabola, as a fraction of the later time."""
JUST_VOID = 1.0e-6
"""Initial guess of the void fraction of a node that is predicted to rupture."""


@kernel
def keep_stage(own, i, numbers):
    """Store the solution of film i at a stage, for later guesses."""
    stage = int(numbers[STAGE])
    own.times[i, stage] = numbers[ELAPSED]
    for f in range(own.slopes.shape[1]):
        own.solved[stage, i, f] = own.unknowns[i, f]


@kernel
def foresee(own, i, numbers):
    """Set unknowns and shapes of film i to the initial guess of a stage."""
    t = numbers[ELAPSED]
    near, middle = _points(own.times[i], t)
    # Indices are clipped to 0, because a stage that was not solved (−1) has zero weight.
    at_near = max(near, 0)
    at_middle = max(middle, 0)
    of_start, of_near, of_middle = _weights(own.times[i], near, middle, t)
    by_slope = t if near < 0 else 0.0
    for f in range(own.slopes.shape[1]):
        first = own.start[i, f]
        last = own.solved[at_near, i, f] if near >= 0 else first
        other = own.solved[at_middle, i, f] if middle >= 0 else last
        guess = of_start * first + of_near * last + of_middle * other + by_slope * own.slopes[i, f]
        own.unknowns[i, f] = _on_its_side(guess, first, last, other)
    for k in range(own.shapes.shape[1]):
        rate = of_start * own.start_rates[i, k] + of_near * own.rates[at_near, i, k]
        rate += of_middle * own.rates[at_middle, i, k]
        own.shapes[i, k] = own.known[i, k] + numbers[GAIN] * rate


@kernel
def end_slopes(own, i, stage):
    """Compute time rates (1/s) of the unknowns of film i at the end of a step, whose last stage is ``stage``."""
    end = own.times[i, stage]
    _, middle = _points(own.times[i], end)
    t = own.times[i, max(middle, 0)]
    for f in range(own.slopes.shape[1]):
        first = own.start[i, f]
        last = own.unknowns[i, f]
        slope = (last - first) / end
        other = last
        if middle >= 0:
            other = own.solved[middle, i, f]
            slope += ((last - other) / (end - t) - slope) * end / t
        same = (first >= 0.0) == (last >= 0.0) and (first >= 0.0) == (other >= 0.0)
        own.slopes[i, f] = slope if same else 0.0


@inlined_kernel
def _points(times, t):
    """Return two solved stages, nearest to time t and to half the time of the first stage found; −1 stands for none."""
    near = -1
    for s in range(times.shape[0]):
        if times[s] > 0.0 and (near < 0 or abs(times[s] - t) < abs(times[near] - t)):
            near = s
    middle = -1
    if near >= 0:
        half = 0.5 * times[near]
        for s in range(times.shape[0]):
            apart = abs(times[s] - times[near]) > APART * times[near]
            if times[s] > 0.0 and apart and (middle < 0 or abs(times[s] - half) < abs(times[middle] - half)):
                middle = s
    return near, middle


@inlined_kernel
def _weights(times, near, middle, t):
    """Return the weights, at time t, of the values at the step's start, at stage ``near`` and at stage ``middle``."""
    if near < 0:
        return 1.0, 0.0, 0.0
    a = times[near]
    if middle < 0:
        return 1.0 - t / a, t / a, 0.0
    b = times[middle]
    return (t - a) * (t - b) / (a * b), t * (t - b) / (a * (a - b)), t * (t - a) / (b * (b - a))


@inlined_kernel
def _on_its_side(guess, first, last, other):
    """Return a ``guess`` limited in sign for a node that was always full or always void; else the last value."""
    if first >= 0.0 and last >= 0.0 and other >= 0.0:
        return guess if guess >= 0.0 else -JUST_VOID
    if first < 0.0 and last < 0.0 and other < 0.0:
        return max(guess, -1.0) if guess < 0.0 else 0.0
    return last
