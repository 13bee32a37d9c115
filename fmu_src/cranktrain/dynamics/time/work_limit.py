"""A bound on the work of a communication step, for runs in real time.

Work is counted in Newton iterations: each evaluates every force law once, which is most of the cost of a step. Below
the limit the results are identical to those without it. Above, the step is finished with less accuracy:

* sub-steps are no longer halved for films that close, events or an error too large;
* a stage ends if its estimated error is below LOOSE and its last Newton step below ROUGH, in clearances, or at its own
  tolerance;
* after LAST_ITERATIONS it ends with its linearised forces, which are in balance, if they lead no journal further than
  one iteration may (JOURNAL_STEP of the stage solver).

Else the stage fails, and the communication step fails with it at once. So no step takes more iterations than the limit
plus LAST_ITERATIONS for each stage that is not solved when the limit is reached. With fewer, journals that turn round
are thrown by stages that end too early, and after some steps a film is lost (docs/decisions/0025-native-fmu.md).
"""

from cranktrain.core.kernel import inlined_kernel
from cranktrain.dynamics.model import slots as at

LAST_ITERATIONS = 12
LOOSE, ROUGH = 1.0e-3, 1.0e-2


@inlined_kernel
def spent(model, work):
    """True if the communication step has reached its work limit."""
    return model.choices[at.WORK_LIMIT] > 0.0 and work.counters[at.N_WORK] >= model.choices[at.WORK_LIMIT]


@inlined_kernel
def cut_short(model, work):
    """True if the work limit is reached with more work to do; the communication step then counts as cut short."""
    if spent(model, work):
        work.counters[at.N_CUT] = 1.0
        return True
    return False
