"""Runs that end when their outputs repeat: against long plain runs, and what they say is left against what is."""

import math
from dataclasses import replace

import entry
import numpy as np
import pytest
from bodies import free_six, rigid_crank, six, started, whole_six
from box_block import box_block
from scipy.linalg import expm

from cranktrain.core.errors import InputError
from cranktrain.dynamics.cycle_run import output_judge
from cranktrain.dynamics.outputs.register import output_counts
from cranktrain.dynamics.settled.collar import NOTHING_LEFT, Collar, Learned
from cranktrain.dynamics.settled.cycles import TRIED, Expected, Recorder, settled_cycles
from cranktrain.dynamics.settled.free_mode import FreeMode
from cranktrain.dynamics.settled.judging import Judge
from cranktrain.dynamics.settled.longer_periods import PLAINLY, parting
from cranktrain.dynamics.settled.motion import Motion
from cranktrain.dynamics.settled.slow_modes import DriveLine, SlowModes, exponential
from cranktrain.dynamics.simulation import Parts, Settings, simulate
from cranktrain.film.laws import thrust

RPM = math.pi / 30


def last_cycles(run):
    """Outputs of each cycle, (cycles, samples, outputs), and what judges them."""
    rows = np.stack(list(run.outputs.values()), axis=1)[1:]
    judge = output_judge(output_counts(six()[0]), {name: k for k, name in enumerate(run.outputs)})
    return rows.reshape(-1, run.per_cycle, rows.shape[1]), judge


@pytest.mark.parametrize("rpm", [1000, 1600, 2000])
def test_a_run_ends_at_the_cycle_of_a_long_one(rpm):
    """With its axial path: without one the collar of this crank goes from side to side with no period."""
    engine, body = whole_six()
    settled = simulate(engine, body, Settings(), rpm * RPM)
    assert settled.settling.repeats == 1 and settled.settling.cycles <= 7
    assert settled.time.size == settled.per_cycle + 1 and settled.time[0] == 0.0
    plain, judge = last_cycles(simulate(engine, body, Settings(), rpm * RPM, 40))
    exact, found = plain[-1], last_cycles(settled)[0][-1]
    truth = judge.left(exact, found)
    assert max(truth.values()) < 1e-3
    # A cycle that has settled is no better than its tolerance by chance: plain running leaves more at that count.
    assert judge.left(exact, plain[settled.settling.cycles - 1])["pulley.torsion"] > 3 * truth["pulley.torsion"]


@pytest.mark.parametrize("cycles", [None, 4, 6, 9])
def test_what_is_left_is_told_from_above(cycles):
    """At most four times the truth, and not below it; speeds of films, which decay by other modes, up to 8 times."""
    (engine, body), settings = whole_six(), Settings(step=math.radians(2.5))
    long, judge = last_cycles(simulate(engine, body, settings, 1600 * RPM, 40))
    run = simulate(engine, body, settings, 1600 * RPM, cycles)
    truth = judge.left(long[-1], last_cycles(run)[0][-1])
    assert 1.0 < run.settling.worst[1] / max(truth.values()) < 4.0
    for family, left in truth.items():
        if left > 0.1 * max(truth.values()):
            high = 8.0 if family.startswith("bearing.speed") else 4.0
            assert 0.8 < run.settling.left[family] / left < high, family


def test_the_collar_bounces_because_its_film_ruptures(monkeypatch):
    """A film that pulls as well as it pushes keeps the collar off its stops, and the motion has the engine's period."""
    engine, body = six()
    bouncing = simulate(engine, body, Settings(), 2200 * RPM)
    assert bouncing.settling.repeats != 1
    monkeypatch.setattr(thrust, "AMBIENT", 1e9)
    pulled = simulate(engine, body, Settings(), 2200 * RPM)
    assert pulled.settling.repeats == 1
    bounced, held = (np.ptp(run.outputs["thrust.displacement"]) for run in (bouncing, pulled))
    assert held < 0.75 * engine.thrust.clearance < 0.9 * engine.thrust.clearance < bounced


def test_cycles_are_exactly_those_asked_for():
    engine = free_six()
    given = engine, rigid_crank(engine), Settings(crank="rigid", bearings="linear"), 2000 * RPM
    for cycles in (1, 3):
        run = simulate(*given, cycles)
        assert run.time.size == cycles * run.per_cycle + 1 and run.settling.cycles == cycles
        assert bool(run.settling.left) == (cycles > 1) != ("unknown after 1 cycle;" in run.settling.text)
    with pytest.raises(InputError, match="settling error must lie between 0 and 1"):
        simulate(*given, settle=0.0)


def test_a_free_speed_is_never_called_periodic():
    engine = free_six()
    settings = Settings(crank="rigid", bearings="linear", boundary="torque")
    run = simulate(engine, rigid_crank(engine), settings, 2000 * RPM)
    assert not run.settling.steady and "the speed is free" in run.settling.text


@pytest.mark.parametrize(("joint", "rpm"), [("spline", 1400), ("spline", 2600), ("bolted", 1000)])
def test_an_engine_that_creeps_along_its_axis_ends_where_plain_running_does(joint, rpm):
    """At 1400 rev/min the spline lets it go 0.5 mm on its mounts, 20 um a cycle, before it stays."""
    engine, body = whole_six()
    engine = replace(engine, axial_path=replace(engine.axial_path, joint=joint))
    parts, settings = Parts(block=box_block(engine)), Settings(block="flexible")
    settled = simulate(engine, body, settings, rpm * RPM, parts=parts, settle=1e-4)
    assert settled.settling.repeats == 1 and settled.settling.cycles <= 24
    plain, judge = last_cycles(simulate(engine, body, settings, rpm * RPM, 150, parts=parts))
    assert max(judge.left(plain[-1], last_cycles(settled)[0][-1]).values()) < 1e-3
    assert max(judge.left(plain[-1], plain[settled.settling.cycles - 1]).values()) > 0.05


def test_the_block_moves_in_space_and_the_crank_with_it():
    """What moves freely in space has the velocity and the acceleration of its path as the turning frame sees it."""
    engine = free_six()
    simulation = started(2000 * RPM, engine, Parts(block=box_block(engine)), block="flexible")
    block = SlowModes(simulation.model, 2000 * RPM).block
    units = np.eye(simulation.parts.block.n_modes)
    carried = np.column_stack([entry.carried(simulation.model, unit) for unit in units])
    crank, sweep = entry.modes(simulation, "crank"), np.zeros((len(carried),) * 2)
    sweep[crank, crank] = 2000 * RPM * simulation.body.gyroscopic
    y = np.random.default_rng(2).normal(size=12)
    y[6:] *= 1e3

    def seen(time):
        return expm(-time * sweep) @ carried[:, :6] @ (expm(time * block.matrix) @ y)[:6]

    step, motion = 1e-4, block.lift(y)
    before, now, after = seen(-step), seen(0.0), seen(step)
    size = np.abs(motion.acceleration).max()
    assert motion.place == pytest.approx(now)
    assert motion.velocity == pytest.approx((after - before) / (2 * step), abs=1e-3 * np.abs(motion.velocity).max())
    assert motion.acceleration == pytest.approx((after - 2 * now + before) / step**2, abs=1e-3 * size)


class Toy:
    """A system whose amplitude follows x → r x (1 − x) from cycle to cycle: it repeats after 1 to 6, or never."""

    def __init__(self, r):
        self.model, self.state = entry.bare_run()
        self.inputs, self.outputs, self.r = np.array([4 * math.pi]), np.zeros(1), r
        entry.motion(self)[0, 0] = 0.49

    def series(self, step, first, rows):
        for k in range(len(rows)):
            time = (first + k) * step
            place = entry.motion(self)[0]
            rows[k] = self.outputs[0] = place[0] * math.sin(2 * math.pi * time)
            if abs(time - round(time)) < 1e-9:
                place *= self.r * (1.0 - place)
        return len(rows)


PERIODS = [(2.8, 1), (3.2, 2), (3.8319, 3), (3.5, 4), (3.739, 5), (3.6277, 6), (3.9, 0)]


@pytest.mark.parametrize(("r", "repeats"), PERIODS)
def test_motions_that_repeat_less_often_than_the_engine(r, repeats):
    recorded = settled_cycles(Recorder(Toy(r), 0.05, 20), Judge({"toy": [0]}, frozenset()))
    settling = recorded.settling
    assert settling.repeats == repeats
    said = {1: "periodic after", 0: "no period after"}.get(repeats, f"repeats every {repeats} cycles")
    assert said in settling.text
    assert len(recorded.rows) == repeats * 20 + 1 or not repeats
    if not repeats:  # ends early and says why
        assert settling.cycles <= 20
        assert settling.parting > 1.0 and "difference of similar cycles grows" in settling.text
        assert settling.as_dict()["cycles_part_by"] == settling.attributes["cycles_part_by"] == settling.parting


@pytest.mark.parametrize(
    ("r", "doubtful", "repeats"), [(2.5, False, 1), (3.2, True, 2), (3.2, False, 0), (3.9, True, 0)]
)
def test_a_first_try_looks_for_a_longer_period_only_where_a_neighbour_had_one(r, doubtful, repeats):
    expected = Expected(doubtful, tries=True)
    judge = Judge({"toy": [0]}, frozenset())
    settling = settled_cycles(Recorder(Toy(r), 0.05, 20), judge, expected=expected).settling
    assert settling.repeats == repeats and settling.cycles <= TRIED


def of_sizes(sizes):
    """Cycles of one wave in these sizes."""
    return np.array(sizes)[:, None, None] * np.sin(np.linspace(0.0, 2.0 * math.pi, 20, endpoint=False))[:, None]


def test_cycles_part_by_the_largest_lyapunov_exponent_and_come_together_as_they_settle():
    """Of the logistic map at 4 it is ln 2; a motion that settles to one cycle or two does so by its multiplier."""
    judge, sizes = Judge({"toy": [0]}, frozenset()), [0.3]
    for _ in range(300):
        sizes.append(4.0 * sizes[-1] * (1.0 - sizes[-1]))
    assert parting(judge, of_sizes(sizes)) == pytest.approx(2.0, rel=0.1)
    k = np.arange(PLAINLY)
    for period, multiplier in ((1, 0.8), (2, 0.5)):
        settling = 1.0 + 0.5 * np.cos(2.0 * math.pi * k / period) + 0.1 * multiplier**k
        assert parting(judge, of_sizes(settling)) == pytest.approx(multiplier, rel=0.02)


def test_a_mode_that_decays_freely_is_taken_off_at_once_and_learned_from_what_a_cycle_leaves():
    """Of three masses' mode in two coordinates; a motion of another mode stays."""
    time, decay = 0.075, complex(-37.0, 2.0 * math.pi * 248.0)
    shape = np.array([0.6, 0.8j, 0.0])
    mode = FreeMode(decay, shape)

    def motion(z, exponent=decay):
        return Motion(z.real, (exponent * z).real, (exponent**2 * z).real, 0.0, 0.0)

    start = motion((0.3 - 0.5j) * shape)
    end = motion(np.exp(decay * time) * (0.3 - 0.5j) * shape)
    settled = end.plus(mode.correction(end.minus(start), time))
    assert np.abs(settled.place).max() < 1e-12 and np.abs(settled.velocity).max() < 1e-9
    other = motion(np.array([0.0, 0.0, 1.0 + 0.0j]))
    assert np.abs(mode.correction(other, time).place).max() < 1e-12
    near = FreeMode(decay + 2j * math.pi * 0.5, shape)
    learned = near.learned(start, end, time)
    assert abs(learned.decay - decay) == pytest.approx(0.5 * abs(near.decay - decay), rel=0.01)
    assert near.learned(other, other, time) is near


def test_the_collar_learns_from_two_changes_what_a_cycle_makes_of_it_and_takes_it_off():
    """In two directions at right angles, one after the other; the motion that is left repeats at once."""
    truth = np.array([[0.1, 0.02], [-0.3, -0.25]])
    simulation = started(2000 * RPM)
    collar = Collar(simulation.model, np.array(NOTHING_LEFT))
    for y in (np.array([2.0, 1.0]), np.array([-1.0, 2.0])):
        collar.learn(collar.lift(y), collar.lift(truth @ y))
    assert collar.over_cycle == pytest.approx(truth)
    start, periodic = np.array([0.3, -0.2]), np.array([0.05, 0.07])
    end = periodic + truth @ (start - periodic)
    corrected = end + collar.split(collar.correction(collar.lift(end - start), 1))
    assert corrected == pytest.approx(periodic)
    modes = SlowModes(simulation.model, 2000 * RPM, Learned(FreeMode(-30.0 + 1500j, np.ones(6) + 0j), truth))
    assert np.abs(np.concatenate(modes.rest(collar.lift(start))[:2])).max() < 1e-12


def test_a_motion_that_is_not_stable_is_not_held_by_corrections():
    collar = Collar(started(2000 * RPM).model, np.array([[0.1, 0.0], [0.0, -1.2]]))
    assert not np.any(collar.correction(collar.lift(np.array([1.0, 1.0])), 1).velocity)


def test_the_drive_line_is_what_its_formula_says():
    simulation = started(2000 * RPM)
    line = DriveLine(simulation.model, 2000 * RPM)
    y = np.array([1e-3, 0.2, 4e-4, -0.03])
    assert line.split(line.lift(y)) == pytest.approx(y, rel=1e-9)
    assert exponential(0.06 * line.matrix) == pytest.approx(expm(0.06 * line.matrix), rel=1e-10, abs=1e-12)
    drive = simulation.engine.drive_line
    assert np.abs(np.linalg.eigvals(line.matrix)).max() == pytest.approx(
        math.sqrt(drive.stiffness / line.inertia.item())
    )
    # The frame follows the crank as fast as it can without overshoot: a double root at -2/τ, τ two revolutions.
    lead = line.matrix[2:, 2:]
    assert np.linalg.eigvals(lead) == pytest.approx(-2.0 / (4.0 * math.pi / (2000 * RPM)), rel=1e-6)
