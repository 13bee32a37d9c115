"""What a script gives of another kind than it should, and names that collide: one line, never a traceback."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from one_line import one_line

import cranktrain as ct
from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import rigid_body
from cranktrain.dynamics.simulation import simulate
from cranktrain.engine.file import load_engine
from cranktrain.results.summary import run_summary

FOUR = Path(__file__).parents[2] / "examples" / "four_with_balancers.toml"
DISC = rigid_body("w", 1.0, np.diag([0.1, 0.1, 0.1]), (0.0, 0.0, 0.0), {"a": (0.0, 0.0, 0.0)})
ENDS = ct.End("w", "a"), ct.End("ground")
SPRING = {"stiffness": (1e5, 1e5, 1e5), "turning_stiffness": (1e3, 1e3, 1e3)}
HELD = ct.Connection("s", "spring", ENDS, SPRING)


def spring(**changed):
    held = ct.Connection("s", "spring", ENDS, SPRING | changed)
    return ct.topology_modes(ct.Topology((), (ct.Body("w", DISC),), (held,)))


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: spring(stiffness="soft"), r"stiffness is 'soft'"),
        (lambda: spring(stiffness=1e5), r"stiffness is 100000.0; give a list"),
        (lambda: spring(stiffness=(math.nan, 1.0, 1.0)), r"stiffness\[1\] is nan"),
        (lambda: ct.Connection("s", "spring", ("w.a", "ground")), r"an end is 'w.a', a str; give ct.End"),
        (lambda: ct.Connection("s", None, ENDS), r"law is None"),
        (lambda: ct.Connection("s\na", "spring", ENDS), r"is no name"),
        (lambda: ct.Body(3, DISC), r"body: 3 is no name"),
        (lambda: ct.Body("w", "w.npz"), r"reduced is 'w.npz', a str"),
        (lambda: ct.Body("w", DISC, ct.Frame("f", 1.0)), r"give the frame's name"),
        (lambda: ct.Topology((), ct.Body("w", DISC)), r"give a tuple of ct.Body"),
        (lambda: ct.Frame("f", "2"), r"ratio is '2', no number"),
        (lambda: ct.Frame("f", math.nan), r"ratio is nan"),
        (lambda: ct.Frame("f", 1.0, axis=(0.0, 0.0, 0.0)), r"axis has 3 values; give 2"),
        (lambda: ct.Slider((0.0, 0.05), math.nan), r"length is nan"),
        (lambda: ct.End("w", "a", (0.0, math.inf, 0.0)), r"offset\[2\] is inf"),
        (lambda: rigid_body("w", "1", np.eye(3), (0.0, 0.0, 0.0), {"a": (0.0, 0.0, 0.0)}), r"mass is '1'"),
        (lambda: rigid_body("w", math.inf, np.eye(3), (0.0, 0.0, 0.0), {"a": (0.0, 0.0, 0.0)}), r"mass is inf"),
        (lambda: rigid_body("w", 1.0, np.ones(3), (0.0, 0.0, 0.0), {"a": (0.0, 0.0, 0.0)}), r"no tensor of 3 x 3"),
        (lambda: rigid_body("w", 1.0, np.eye(3), (0.0, 0.0), {"a": (0.0, 0.0, 0.0)}), r"centre has 2 values"),
        (lambda: rigid_body("w", 1.0, np.eye(3), (0.0, 0.0, 0.0), {"a": (0.0, 0.0)}), r"interface 'a' has 2 values"),
        (lambda: rigid_body("w", 1.0, np.eye(3), (0.0, 0.0, 0.0), [(0.0, 0.0, 0.0)]), r"give a dictionary"),
        (lambda: ct.Topology((), (ct.Body("w", DISC),), (ct.Connection("s", "spring", (ENDS[0], ENDS[0]), SPRING),)),
         r"all its ends are at one place"),
        (lambda: ct.topology_modes(ct.Topology((), (ct.Body("w", DISC),), (HELD, ct.Connection("l", "load", ENDS)))),
         r"a load needs a force or a torque"),
    ],
)  # fmt: skip
def test_values_of_another_kind_are_told_in_one_line(made, said):
    with one_line(match=said):
        made()
    assert spring(stiffness=np.full(3, 1e5)) is not None  # arrays serve as lists


def beside_the_four(bodies, connections, **settings):
    chosen = ct.Settings(crank="rigid", bearings="linear", block="ground", **settings)
    made = ct.assemble(load_engine(FOUR).without_additions, chosen)
    parts = made.parts._replace(topology=ct.Topology((ct.Frame("f", 1.0, axis=(0.2, 0.1)),), bodies, connections))
    return simulate(made.engine, made.body, made.settings, 200.0, parts=parts, settle=1e-6)


@pytest.mark.parametrize("name", ["engine", "bearing[1]", "big_end[2]"])
def test_a_body_whose_outputs_bear_the_engines_names_is_refused(name):
    held = replace(HELD, ends=(ct.End(name, "a"), ct.End("ground")))
    with pytest.raises(InputError, match=r"there are two outputs"):
        beside_the_four((ct.Body(name, DISC),), (held,))


def test_the_work_of_a_load_on_a_turning_body_is_in_the_energy_balance():
    """A torque, and a force beside the axis, drive the crank through a coupling: with their work the balance closes."""
    places = {"a": (0.0, 0.0, 0.0), "b": (0.0, 0.05, 0.0)}
    off = rigid_body("w", 1.0, np.diag([0.1, 0.1, 0.1]), (0.0, 0.0, 0.0), places)
    data = {"stiffness": (1e7,) * 3, "damping": (1e3,) * 3, "turning_stiffness": (1e5, 1e5, 0.0)}
    joined = ct.Connection("c", "coupling", (ct.End("crank", "flywheel"), ct.End("w", "a")),
                           {"stiffness": 2e3, "damping": 5.0})  # fmt: skip
    torque = ct.Connection("t", "load", ENDS, {"torque": (0.0, 0.0, 40.0)})
    force = ct.Connection("p", "load", (ct.End("w", "b"), ct.End("ground")), {"force": (300.0, 0.0, 0.0), "order": 1.0})
    run = beside_the_four((ct.Body("w", off, "f"),), (replace(HELD, data=data), joined, torque, force))
    energy = run_summary(run, "")["energy"]
    work = -energy["losses_j"]["connections"]
    # F cos θ along x at 50 mm, which turns with θ: the mean of −F r cos² θ.
    assert work == pytest.approx((40.0 - 0.5 * 300.0 * 0.05) * 4.0 * math.pi, rel=2e-2)
    assert abs(energy["residual_j"]) < 1e-4 * work


def test_what_joins_block_and_ground_carries_nothing_where_the_block_is_the_ground():
    """Its outputs are there, and zero; those behind it stay where their names say."""
    strut = replace(HELD, name="strut", ends=(ct.End("block", "mount[1]"), ct.End("ground")))
    run = beside_the_four((ct.Body("w", DISC),), (strut, HELD))
    assert not run.outputs["connection[strut].force.y"].any()
    assert run.outputs["connection[s].force.y"].mean() == pytest.approx(9.80665, rel=1e-6)


def test_ends_that_lie_apart_are_told():
    far = replace(HELD, name="far", ends=(ct.End("w", "a"), ct.End("v", "a")))
    other = rigid_body("v", 1.0, np.diag([0.1, 0.1, 0.1]), (0.0, 0.0, 0.2), {"a": (0.0, 0.0, 0.2)})
    with pytest.warns(UserWarning, match=r"its ends are 200 mm apart"):
        ct.topology_modes(ct.Topology((), (ct.Body("w", DISC), ct.Body("v", other)), (far, HELD)))
