"""A bound on the work of a communication step, for runs in real time.

Work is counted in Newton iterations: each evaluates every force law once, which is most of what a step costs. Up to the
limit nothing differs, to the bit. Once it is reached, a step goes on to its end at less accuracy:

* sub-steps are halved no more, not for films that close, events or an error too large;
* a stage makes its Newton matrix once, and takes LAST_ITERATIONS at most;
* it ends where its estimated error is below LOOSE, in clearances, if its own tolerance is smaller.

A stage that does not get there fails, and the communication step with it, at once. So no step takes more iterations
than the limit and LAST_ITERATIONS for each stage that is not solved when it is reached.
"""

from __future__ import annotations

from cranktrain.core.kernel import inlined_kernel
from cranktrain.dynamics.model import slots as at

LAST_ITERATIONS = 2
LOOSE = 1.0e-3


@inlined_kernel
def spent(model, work):
    """Whether the communication step has used up its work."""
    return model.choices[at.WORK_LIMIT] > 0.0 and work.counters[at.N_WORK] >= model.choices[at.WORK_LIMIT]


@inlined_kernel
def cut_short(model, work):
    """Whether that is so where more work would follow; then the step counts as one that was cut short."""
    if spent(model, work):
        work.counters[at.N_CUT] = 1.0
        return True
    return False
