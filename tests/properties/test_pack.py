"""Bodies, frames and connections without an engine, packed and run in time like one: against closed forms.

A line of discs on torsion springs, J θ̈ = −K θ, moves as the sum of its modes; SI.
"""

import numpy as np
import pytest
from scipy.linalg import block_diag
from tests.bodies import joined

import cranktrain as ct
from cranktrain.core.build_mark import build_mark
from cranktrain.core.run_entries import RunEntries
from cranktrain.dynamics import run_record
from cranktrain.dynamics.model import numbers as to
from cranktrain.dynamics.model import state as at
from cranktrain.dynamics.model.pack import pack
from cranktrain.dynamics.model.records import dimensions
from cranktrain.dynamics.model.slots import N_STAGES, OTHER_INPUTS
from cranktrain.dynamics.model.state import offset, state_size
from cranktrain.dynamics.model.workspace import make_work
from cranktrain.dynamics.outputs.register import Outputs
from cranktrain.dynamics.run_record import COLUMNS
from cranktrain.dynamics.time.integrators import INTEGRATORS
from cranktrain.dynamics.time.status import OK
from cranktrain.dynamics.time.step_control import STEPPING_SPEED
from cranktrain.dynamics.time.table import coefficients

USUAL = "esdirk47"
FORM = ("trapezoidal", "hht", "generalised-alpha")


def disc(name, inertia, frame="rest"):
    shape = np.diag([0.6 * inertia, 0.6 * inertia, inertia])
    return ct.Body(name, ct.rigid_body(name, 5.0, shape, (0.0, 0.0, 0.0), {"hub": (0.0, 0.0, 0.0)}), frame)


class Line:
    """Discs of ``inertia`` (d,) on springs of ``stiffness`` (d − 1,), N m/rad; the first one on ``ground``, N m/rad."""

    def __init__(self, inertia, stiffness, ground=0.0, frame=None):
        self.inertia, d = np.array(inertia), len(inertia)
        own = "rest" if frame is None else frame.name
        links = [
            joined(f"shaft{k}", "coupling", f"disc{k}.hub disc{k + 1}.hub", stiffness=s)
            for k, s in enumerate(stiffness)
        ]
        if ground:
            links.append(joined("hold", "spring", "disc0.hub", turning_stiffness=(0.0, 0.0, ground)))
        bodies = tuple(disc(f"disc{k}", j, own) for k, j in enumerate(inertia))
        self.topology = ct.Topology(() if frame is None else (frame,), bodies, tuple(links))
        twists = np.diff(np.eye(d), axis=0)
        self.stiffness = twists.T @ np.diag(stiffness) @ twists + np.diag([ground] + [0.0] * (d - 1))
        root = np.sqrt(self.inertia)
        squares, shapes = np.linalg.eigh(self.stiffness / np.outer(root, root))
        self.omega, self.shapes = np.sqrt(np.maximum(squares, 0.0)), shapes / root[:, None]
        self.omega[self.omega < 1e-6 * self.omega[-1]] = 0.0

    def motion(self, start, rate, time):
        """Rotation, rate and acceleration (3, d) at a time after rotations ``start`` (d,) and rates (d,)."""
        w = self.omega
        q, v = (self.shapes.T @ (self.inertia * given) for given in (start, rate))
        sin = np.where(w > 0.0, np.sin(w * time) / np.where(w > 0.0, w, 1.0), time)
        place = q * np.cos(w * time) + v * sin
        return np.stack([self.shapes @ one for one in (place, v * np.cos(w * time) - q * w**2 * sin, -(w**2) * place)])

    def energy(self, motion):
        place, rate = motion
        return 0.5 * (self.inertia @ rate**2 + place @ self.stiffness @ place)


class Packed:
    """A topology packed without an engine, at rest; steps of ``h`` (s), frames turn at ``speed`` (rad/s)."""

    def __init__(self, topology, h, method=USUAL, speed=0.0, adaptive=0.0):
        self.h, self.method, self.model = h, method, pack(topology)
        size = dimensions(self.model)
        self.n, self.state = size.modes, np.zeros(state_size(size.modes, size.ports, size.films, size.passes))
        numbers, inputs = np.zeros(to.NUMBERS), np.zeros(OTHER_INPUTS)
        numbers[[to.SET_METHOD, to.SET_NEWTON_TOLERANCE]] = list(INTEGRATORS).index(method), 1e-10
        numbers[[to.SET_ADAPTIVE, to.SET_TOLERANCE]] = adaptive, 1e-4
        numbers[to.SET_STEP], inputs[0] = h * max(speed, STEPPING_SPEED), speed
        self.work = make_work(self.model, self.state.size, integrators=True)
        outputs = Outputs(np.zeros((0, COLUMNS), dtype=np.int64), np.zeros(0), build_mark())
        run = run_record.Run(self.model, self.work, self.state, inputs, outputs, numbers, np.zeros(0))
        self.entries = RunEntries("cranktrain", run, run_record)
        assert self.entries.prepare() == OK

    def block(self, which):
        first = offset(which, self.n)
        return self.state[first : first + self.n]

    def begin(self, path):
        """Start on a ``path``: modal place, velocity and acceleration (3, n) by time; what a method carries as well."""
        for block, value in zip((at.POSITION, at.VELOCITY, at.ACCELERATION), path(0.0), strict=True):
            self.block(block)[:] = value
        if self.method in FORM:
            self.block(at.AUXILIARY)[:] = path(0.0)[2]
        if self.method == "bdf2":
            self.block(at.AUXILIARY)[:], self.block(at.HISTORY)[:] = path(-self.h)[:2]

    def turn(self, line, start, rate):
        """Begin with the discs' rotations ``start`` and their rates, (d,)."""
        bodies = self.model.bodies
        unit = block_diag(*bodies.euler_load.reshape(len(start), -1)).T
        self.turned = block_diag(*bodies.turn.reshape(len(start), -1))
        self.begin(lambda time: line.motion(start, rate, time) @ unit.T)

    @property
    def motion(self):
        """Rotation of all discs and its rate, (2, d)."""
        return np.stack([self.turned @ self.block(block) for block in (at.POSITION, at.VELOCITY)])

    def run(self, end, every=0.05):
        """Run to a time, s, in communication steps of about ``every``; the last motion."""
        for time in np.linspace(0.0, end, max(1, round(end / every)) + 1)[1:]:
            assert self.entries.advance(time) == OK


SHORT = Line((0.4, 0.1), (2e4,))
HELD = Line((0.4, 0.1), (2e4,), ground=5e4)
LONG = Line(np.linspace(0.05, 0.4, 12), np.linspace(4e5, 1e5, 11))
LINES = {"two discs": SHORT, "two discs on the ground": HELD, "twelve discs": LONG}


def wound(line):
    """Rotations and rates from which a line starts: every mode takes part, and all discs turn."""
    d = len(line.inertia)
    return 0.02 * np.cos(1.0 + 2.0 * np.arange(d)), 3.0 + np.sin(np.arange(d))


def after(line, periods, part, method=USUAL):
    """Run over some periods of a line's fastest mode in steps of a ``part`` of one, and the exact motion at its end."""
    period = 2.0 * np.pi / line.omega[-1]
    run, given = Packed(line.topology, period / part, method), wound(line)
    run.turn(line, *given)
    run.run(periods * period, every=0.5 * periods * period)
    return run, line.motion(*given, periods * period)[:2]


@pytest.mark.parametrize("line", LINES.values(), ids=LINES)
@pytest.mark.parametrize("method", INTEGRATORS)
def test_errors_fall_with_the_step_as_the_order_says(method, line):
    order, errors = INTEGRATORS[method].order, []
    for part in (40, 80) if order > 1 else (640, 1280):
        run, exact = after(line, 2, part, method)
        errors.append(np.sqrt(line.energy(run.motion - exact)))
    assert np.log2(errors[0] / errors[1]) > order - 0.1


@pytest.mark.parametrize("line", [SHORT, LONG], ids=["two discs", "twelve discs"])
@pytest.mark.parametrize("method", INTEGRATORS)
def test_a_free_line_keeps_its_momentum_to_rounding(method, line):
    """A stage's acceleration (q − Q)/c_q has five roundings of q over c_q, which may all go one way."""
    run, exact = after(line, 10, 40, method)
    c_q, c_v = coefficients(run.model.stages, run.h)
    rounding = 2.5 * np.finfo(float).eps * (line.inertia @ np.abs(run.motion[0])) * c_v / c_q
    drift = line.inertia @ (run.motion[1] - exact[1])
    assert abs(drift) < run.work.counters[N_STAGES] * rounding


@pytest.mark.parametrize("ratio", [1.0, -2.0])
def test_a_line_in_a_turning_frame_swings_as_at_rest(ratio):
    turning = Line(SHORT.inertia, (2e4,), frame=ct.Frame("f", ratio, axis=(0.1, 0.0)))
    found = []
    for line, speed in ((SHORT, 0.0), (turning, 150.0)):
        run = Packed(line.topology, 1e-4, speed=speed)
        run.turn(line, *wound(line))
        run.run(0.02)
        found.append(run.motion)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)


@pytest.mark.parametrize("ratio", [1.0, -2.0])
def test_a_free_disc_beside_its_axis_stays_where_it_is_while_its_frame_turns(ratio):
    """A disc that moves evenly in space, described in a turning frame: gyroscopic and centrifugal terms alone."""
    frame, speed = ct.Frame("f", ratio), 100.0
    run = Packed(ct.Topology((frame,), (disc("disc", 0.1, "f"),)), 1e-4, speed=speed)
    across = run.model.bodies.translation[:2].T  # modal motion by a unit displacement, times the root of the mass
    turn = abs(ratio) * speed

    def path(time):
        cos, sin = np.cos(turn * time), np.sin(turn * time)
        place = 1e-3 * np.array([cos, -sin])
        rate = 1e-3 * turn * np.array([-sin, -cos])
        return np.stack([across @ one for one in (place, rate, -(turn**2) * place)])

    run.begin(path)
    end = 0.05
    run.run(end)
    assert run.state[at.SHAFT_ANGLE] == pytest.approx(speed * end, rel=1e-12)
    np.testing.assert_allclose(run.block(at.POSITION), path(end)[0], rtol=0, atol=1e-6 * np.abs(path(end)[0]).max())


def test_adaptive_control_has_nothing_to_judge_without_an_engine():
    found = []
    for adaptive in (0.0, 1.0):
        run = Packed(LONG.topology, 1e-5, adaptive=adaptive)
        run.turn(LONG, *wound(LONG))
        run.run(0.002)
        found.append(run.motion)
    np.testing.assert_array_equal(*found)


def test_what_only_an_engine_has_is_refused():
    link = ct.Connection("c", "coupling", (ct.End("disc", "hub"), ct.End("crank", "flywheel")), {"stiffness": 1e4})
    with pytest.raises(ct.InputError, match=r"connection 'c': there is no crank here"):
        pack(ct.Topology((), (disc("disc", 0.1),), (link,)))
