"""The library's face: what ``import cranktrain as ct`` offers, in engineering units, equal to the command line."""

import json
import math
import subprocess
import sys

import numpy as np
import pytest
from one_line import one_line

import cranktrain as ct
from cranktrain.store.hdf5 import read_result

RIGID = {"speed_rpm": 2000, "cycles": 1, "crank": "rigid", "bearings": "linear", "step_deg": 5}


@pytest.fixture(scope="module")
def run():
    return ct.simulate("diesel_i6", **RIGID)


def test_importing_it_loads_nothing_heavy():
    code = "import sys, cranktrain as ct; dir(ct); print([m for m in %r if m in sys.modules])"
    heavy = ["numpy", "numba", "scipy", "h5py", "skfem", "matplotlib", "cranktrain.core"]
    done = subprocess.run([sys.executable, "-c", code % heavy], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_name_is_there():
    for name in ct.__all__:
        assert getattr(ct, name) is not None
    with pytest.raises(AttributeError, match="simulat"):
        ct.simulat  # noqa: B018


def test_a_run_is_that_of_the_command_line(run, tmp_path, run_json):
    options = ["--speed", "2000", "--cycles", "1", "--crank", "rigid", "--bearings", "linear", "--step-deg", "5"]
    printed = run_json("simulate", "diesel_i6", *options, "--output", str(tmp_path / "a.h5"))
    found = run.summary(tmp_path / "a.h5")
    for timed in ("seconds", "real_time_factor"):
        del printed[timed], found[timed]
    assert json.loads(json.dumps(found)) == printed
    run.save(tmp_path / "b.h5")
    (first, about), (second, same) = (read_result(tmp_path / name) for name in ("a.h5", "b.h5"))
    assert about == same and first.keys() == second.keys()
    assert all(np.array_equal(first[name][0], second[name][0]) for name in first)


def test_a_run_tells_of_its_outputs(run, tmp_path):
    assert run["shaft.torque"].shape == run.time.shape == run.angle.shape
    assert "bearing[1].force.x" in run.names
    with pytest.raises(ct.InputError, match=r"did you mean 'pulley.torsion'"):
        run["pulley.torson"]
    angle, values = run.last_cycle("shaft.torque")
    assert angle[0] == 0.0 and angle[-1] == pytest.approx(4.0 * math.pi, rel=0.01) and values.shape == angle.shape
    orders = run.orders("shaft.torque", highest=6)
    assert list(orders) == [0.5 * k for k in range(1, 13)]
    figure = run.plot("shaft.torque", tmp_path / "torque.png")
    assert (tmp_path / "torque.png").stat().st_size > 10_000
    (tmp_path / "foreign.png").write_bytes(b"not ours")
    for name, told in (("foreign.png", "exists and is no picture"), ("torque.pdf", r"end with .png or .svg")):
        with pytest.raises(ct.InputError, match=told):
            run.plot("shaft.torque", tmp_path / name)
    assert (tmp_path / "foreign.png").read_bytes() == b"not ours"
    assert all("deg" in ax.get_xlabel() or "order" in ax.get_xlabel() for ax in figure.axes)
    assert all("N m" in ax.get_ylabel() for ax in figure.axes)


def test_xarray_is_used_where_it_is_there(run):
    try:
        import xarray  # noqa: F401
    except ImportError:
        with pytest.raises(ct.InputError, match="pip install xarray"):
            run.to_xarray()
    else:
        data = run.to_xarray()
        assert data["shaft.torque"].attrs["units"] == "N m" and data["angle"].dims == ("time",)


@pytest.mark.parametrize(
    ("choices", "says"),
    [
        ({"speed_rmp": 2000}, r"unknown keyword 'speed_rmp'; did you mean 'speed_rpm'"),
        ({}, "speed_rpm is missing"),
        ({"speed_rpm": 2000, "crank": "beem"}, r"crank 'beem' does not exist; did you mean 'beam'"),
        ({"speed_rpm": 10}, r"speed_rpm 10 is not within 20"),
    ],
)
def test_wrong_keywords_are_refused_in_one_line(choices, says):
    with one_line(match=says):
        ct.simulate("diesel_i6", **choices)


def test_an_assembly_runs_at_several_speeds(run):
    made = ct.assemble(ct.load_engine("diesel_i6"), ct.Settings(crank="rigid", bearings="linear"))
    assert made.settings.integrator == "esdirk47" and made.body.n_modes == 6
    again = ct.simulate(made, speed_rpm=2000, cycles=1, step_deg=5)
    assert all(np.array_equal(again[name], run[name]) for name in run.names)
    with pytest.raises(ct.InputError, match="'crank' is fixed by the assembly"):
        ct.simulate(made, speed_rpm=2000, crank="beam")


def test_a_bearing_is_that_of_the_command_line(run_json):
    bearing = ct.Bearing(diameter_mm=100, width_mm=50, clearance_um=50, speed_rpm=3000, viscosity_mpas=10)
    found = bearing.equilibrium(load_n=5000)
    options = ["--diameter-mm", "100", "--width-mm", "50", "--clearance-um", "50", "--speed", "3000"]
    printed = run_json("bearing", "plain", *options, "--viscosity", "0.01", "--load-n", "5000")
    del printed["seconds"]
    assert printed == found
    with pytest.raises(ct.InputError, match="given by one of viscosity_mpas"):
        ct.Bearing(diameter_mm=100, width_mm=50, clearance_um=50, speed_rpm=3000).equilibrium(5000)
