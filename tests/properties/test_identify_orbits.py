"""Orbits of main journals as data: clearance and oil temperature found again, what is refused, in one line each."""

import math
from dataclasses import replace

import numpy as np
import pytest
from identified import identified, places, stated, write_orders
from one_line import one_line
from refusals import refused_files

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError
from cranktrain.core.threads import one_thread
from cranktrain.core.units import RPM
from cranktrain.dynamics.model.settings import Settings
from cranktrain.engine.file import load_engine
from cranktrain.results.orders.harmonics import CYCLE
from cranktrain.structure.assembly import assemble
from cranktrain.studies.run_up.steady import Job, SteadyRuns
from cranktrain_lab.identification.model import TorsionalModel
from cranktrain_lab.identification.orbit_runs import HIGHEST, OrbitModel, Series
from cranktrain_lab.identification.orbits import read_orbits
from cranktrain_lab.identification.tables import OrbitTable

SPEED, WARM, WIDER = 2500.0, 368.15, 1.15
ANGLES = np.linspace(0.0, CYCLE, 360, endpoint=False)
PARAMETERS = """[parameters]
"main_bearing.clearance" = { low = "-40 %", high = "+60 %" }
"oil.temperatures" = { low = "60 degC", high = "120 degC" }
"""
ORBIT = f'[[orbit]]\nfile = "orbit.csv"\nbearing = "main[2]"\nrpm = {SPEED:g}\n'


@pytest.fixture(scope="module")
def single(tmp_path_factory):
    return stated("single_petrol", tmp_path_factory.mktemp("single"))


@pytest.fixture(scope="module")
def orbit(single):
    """Orbit of main 2, m, of the single with a wider clearance and warm oil, on films of level impedance."""
    return orbit_of(wider(load_engine(single)), 2)


def wider(engine):
    """The engine with a wider clearance and oil of one temperature."""
    bearing = replace(engine.main_bearing, clearance=WIDER * engine.main_bearing.clearance)
    oil = replace(engine.oil, temperatures=len(engine.oil.temperatures) * (WARM,))
    return replace(engine.without_additions, main_bearing=bearing, oil=oil)


def clearance_of(name):
    """The true clearance, um."""
    return 1e6 * WIDER * load_engine(name).main_bearing.clearance


def orbit_of(engine, bearing, **levels):
    """Displacement x + i y, m, of a main at the angles of a cycle."""
    names = [f"bearing[{bearing}].position.{axis}" for axis in "xy"]
    with one_thread():
        made = assemble(engine, Settings(crank="beam", **levels))
        own = SteadyRuns(Job(made, None, 1e-5, HIGHEST, tuple(names))).at(SPEED * RPM)
    mean = complex(*(own.extremes[name][1] for name in names))
    return Series(mean, np.array([own.amplitudes[name] for name in names])).at(ANGLES)


def write_orbit(folder, orbit, noise=0.5, seed=1, unit="um", factor=1e6, place=9.0 - 5.0j, angles=ANGLES, turn=0.0):
    """Table of an orbit with noise and an unknown place of the probes, um."""
    real, imaginary = np.random.default_rng(seed).normal(size=(2, orbit.size))
    own = factor * np.exp(-1j * turn) * (orbit + 1e-6 * (noise * (real + 1j * imaginary) + place))
    lines = [f"{math.degrees(a):.4f},{z.real:.9g},{z.imag:.9g}" for a, z in zip(angles, own, strict=True)]
    path = folder / "orbit.csv"
    path.write_text("\n".join([f"crank_angle [deg],x [{unit}],y [{unit}]", *lines]) + "\n", "utf-8")
    return path


def in_time(engine, folder, text, **more):
    """Rows of the parameters by key, and the report, by runs in time of a beam crank."""
    return identified(engine, folder / "measured.toml", text, method="time", crank="beam", profile=True, **more)


def read(engine, folder, **more):
    """The orbit as the study reads it."""
    table = OrbitTable(**{"file": "orbit.csv", "bearing": "main[2]", "rpm": SPEED} | more)
    return read_orbits(load_engine(engine), [table], folder / "measured.toml", [])[0]


@pytest.mark.parametrize("seed", [1, 2])
def test_an_orbit_knows_clearance_and_temperature_where_its_place_is_unknown(single, orbit, tmp_path, seed):
    """Noise of 0.5 um on an orbit of some 20 um: both values within their intervals, and those narrow."""
    write_orbit(tmp_path, orbit, seed=seed)
    found, report = in_time(single, tmp_path, PARAMETERS + ORBIT)
    clearance, warm, own = found["main_bearing.clearance"], found["oil.temperatures"], clearance_of(single)
    assert clearance["low"] <= own <= clearance["high"] and clearance["value"] == pytest.approx(own, rel=0.01)
    assert warm["low"] <= WARM - 273.15 <= warm["high"]
    # Noise alone would leave 1 K; better films would move it by some two.
    assert warm["high"] - warm["low"] < 10.0
    (row,) = report["orbits"]
    assert row["bearing"] == "main[2]" and row["centre_free"] and not row["systematic"]
    assert row["over_noise"] == pytest.approx(1.0, abs=0.1)
    # Each of 180 points is the mean of two samples.
    assert report["bias"]["orbit"]["noise"] == pytest.approx(0.5e-6 / math.sqrt(2.0), rel=0.1)
    assert [step["level"] for step in report["levels"]] == ["time"] and not report["orders"]


def test_the_level_above_is_an_error_that_intervals_hold_and_the_report_names(single, tmp_path):
    """Films by Reynolds' equation: residuals hardly show them, but one run of them says how far they would move."""
    write_orbit(tmp_path, orbit_of(wider(load_engine(single)), 2, bearings="reynolds"), noise=0.1)
    found, report = in_time(single, tmp_path, PARAMETERS + ORBIT)
    clearance, own = found["main_bearing.clearance"], clearance_of(single)
    assert clearance["value"] == pytest.approx(own, rel=0.1)
    assert clearance["low"] <= own <= clearance["high"]
    away = 100.0 * math.log(own / clearance["value"])
    assert clearance["next_level_percent"] == pytest.approx(away, abs=0.5 * abs(away))
    assert report["orbits"][0]["over_noise"] < 2.0


def test_viscosity_and_clearance_of_one_orbit_beside_its_gain(single, orbit, tmp_path):
    """A gain of 0.9 of the probes is not a clearance: with a known place of the bore all three are told apart."""
    write_orbit(tmp_path, orbit, place=0.0, noise=0.2, factor=0.9e6)
    text = '[parameters]\n"main_bearing.clearance" = {}\n"oil.temperatures" = { low = "60 degC", high = "120 degC" }\n'
    found, _ = in_time(single, tmp_path, text + '"scale.orbit" = {}\n' + ORBIT + 'centre = "bore"\n')
    true = {"scale.orbit": 0.9, "main_bearing.clearance": clearance_of(single), "oil.temperatures": WARM - 273.15}
    for key, value in true.items():
        assert found[key]["low"] <= value <= found[key]["high"], key
        assert found[key]["value"] == pytest.approx(value, rel=0.05), key


def test_orders_and_an_orbit_are_fitted_together(single, orbit, tmp_path, monkeypatch):
    """The load from orders of the pulley, the clearance from the orbit, in one file: each by the set that knows it.

    A crank above that answers as the fitted one moves nothing beyond the step to better films.
    """
    by_crank = TorsionalModel.in_time
    monkeypatch.setattr(
        TorsionalModel, "in_time",
        lambda self, values, crank, settle, tell, cycles=None: by_crank(self, values, "beam", settle, tell, cycles),
    )  # fmt: skip
    made = assemble(wider(load_engine(single)), Settings(crank="beam"))
    speeds = np.array([1500.0, 2000.0, 2500.0, 3000.0, 3500.0]) * RPM
    with one_thread():
        runs = SteadyRuns(Job(made, None, 1e-4, 12.0, ("pulley.torsion",)))
        values = [runs.at(speed).amplitudes["pulley.torsion"][:3] for speed in speeds.tolist()]
    write_orders(tmp_path / "orders.csv", places(speeds, (0.5, 1.0, 1.5)), np.transpose(values))
    write_orbit(tmp_path, orbit)
    text = PARAMETERS + 'load = { low = 0.8, high = 1.2 }\n[[orders]]\nfile = "orders.csv"\n' + ORBIT
    found, report = in_time(single, tmp_path, text, above="next")
    films, solid = report["above"]
    assert (films["level"], solid["level"]) == ("films by reynolds", "solid in time")
    assert solid["values"] == pytest.approx(films["values"], rel=1e-3)
    assert [step["level"] for step in report["levels"]] == ["linear", "harmonic-balance", "time"]
    assert found["load"]["value"] == pytest.approx(1.0, rel=0.01)
    assert found["main_bearing.clearance"]["value"] == pytest.approx(clearance_of(single), rel=0.01)
    assert len(report["orders"]) == 3 and len(report["orbits"]) == 1


def test_units_probes_cycles_and_columns_give_the_same_orbit(single, orbit, tmp_path):
    """In mm, by probes at 45 degrees, over three cycles, from the second revolution on, in columns of other names."""
    write_orbit(tmp_path, orbit, noise=0.0)
    own = read(single, tmp_path)
    assert own.speeds.size == 180 and abs(own.values.mean()) < 1e-9 * abs(own.values).max()
    write_orbit(tmp_path, orbit, noise=0.0, unit="mm", factor=1e3)
    assert read(single, tmp_path).values == pytest.approx(own.values, abs=1e-13)
    write_orbit(tmp_path, orbit, noise=0.0, turn=math.radians(45.0))
    for angle in ("45 deg", 45.0):
        assert read(single, tmp_path, probe_angle=angle).values == pytest.approx(own.values, abs=1e-13)
    write_orbit(tmp_path, np.tile(orbit, 3), noise=0.0, angles=np.tile(ANGLES, 3))
    thrice = read(single, tmp_path, noise="0.6 um")
    assert thrice.values == pytest.approx(own.values, abs=1e-13)
    assert thrice.noise == pytest.approx(0.6e-6 / math.sqrt(6.0))  # stated of a sample; a point is the mean of six
    write_orbit(tmp_path, np.roll(orbit, -180), noise=0.0, angles=ANGLES + 0.5 * CYCLE)
    assert read(single, tmp_path).values == pytest.approx(own.values, abs=1e-13)
    path = tmp_path / "orbit.csv"
    path.write_text(path.read_text("utf-8").replace("x [um],y [um]", "probe A [um],probe B [um]"), "utf-8")
    columns = ["crank_angle", "probe A", "probe B"]
    assert read(single, tmp_path, columns=columns).values == pytest.approx(own.values, abs=1e-13)


def test_an_orbit_may_lie_a_twentieth_beyond_the_engines_speeds(single, orbit, tmp_path):
    write_orbit(tmp_path, orbit)
    low, high = (speed / RPM for speed in load_engine(single).speeds)
    assert [read(single, tmp_path, rpm=rpm).speed / RPM for rpm in (0.96 * low, 1.04 * high)]
    for rpm in (0.94 * low, 1.06 * high):
        with pytest.raises(InputError, match="lies outside the speeds"):
            read(single, tmp_path, rpm=rpm)


@pytest.mark.parametrize(("key", "value", "said"), refused_files()["identify"]["orbits"])
def test_a_table_that_cannot_be_used_is_refused_in_one_line(single, orbit, tmp_path, key, value, said):
    write_orbit(tmp_path, orbit)
    keys = {"file": '"orbit.csv"', "bearing": '"main[2]"', "rpm": "2500", key: value}
    text = "".join(f"{name} = {stated}\n" for name, stated in keys.items() if stated)
    refused(single, tmp_path, f"{PARAMETERS}[[orbit]]\n{text}", said)


LOAD = "[parameters]\nload = {}\n"
NO_ORBITS = [
    (PARAMETERS, lambda z: 4.0 * z, ANGLES, "um", "times the largest sought diametral clearance of main[2]"),
    (LOAD, lambda z: 4.0 * z, ANGLES, "um", "times the diametral clearance of main[2], "),
    (PARAMETERS, lambda z: 1e-9 * z, ANGLES, "um", "the journal does not move: its orbit is "),
    (PARAMETERS, lambda z: z[:270], ANGLES[:270], "um", "its crank angles cover 0.75 cycles of 720 deg"),
    (PARAMETERS, lambda z: np.tile(z, 2)[:540], np.append(ANGLES, ANGLES[:180]), "um", "cover 1.5 cycles of 720 deg"),
    (PARAMETERS, lambda z: z[::10], ANGLES[::10], "um", "its crank angles are up to 20 deg apart"),
    (PARAMETERS, lambda z: z[::-1], ANGLES[::-1], "um", "does not rise at sample 2; sort the samples"),
    (PARAMETERS, lambda z: z, ANGLES, "bar", "column 'x' is in 'bar', no length"),
    (PARAMETERS, lambda z: z, ANGLES, "", "column 'x' states no unit, no length; write 'x [um]' in its header"),
]


@pytest.mark.parametrize(("parameters", "change", "angles", "unit", "said"), NO_ORBITS)
def test_files_that_are_no_orbit_of_the_bearing_are_refused(
    single, orbit, tmp_path, parameters, change, angles, unit, said
):
    """Orbits wider than the clearance, of parts of a cycle, with wide steps, in other units, without unit."""
    path = write_orbit(tmp_path, change(orbit), noise=0.0, unit=unit, angles=angles)
    path.write_text(path.read_text("utf-8").replace(" []", ""), "utf-8")
    refused(single, tmp_path, parameters + ORBIT, said)


def test_levels_without_films_and_rollers_are_refused(single, orbit, tmp_path):
    write_orbit(tmp_path, orbit)
    text, said = PARAMETERS + ORBIT, "method 'linear' has no oil films; an orbit takes"
    refused(single, tmp_path, text, said, method="linear", crank=None)
    refused(single, tmp_path, text, "crank level 'torsional' are of level 'held'", crank=None)
    text, said = text.replace("main_bearing", "big_end_bearing"), "runs on rollers, whose orbit no oil film determines"
    refused("diesel_v8", tmp_path, text, f"main[2] of 'diesel_v8' {said}")


def test_an_interrupt_before_the_first_orbit_is_answered_keeps_what_orders_gave(single, orbit, tmp_path, monkeypatch):
    """With no other data nothing was found; the command ends with the code of an interrupt and no report."""

    def in_time(self, values):
        raise KeyboardInterrupt

    monkeypatch.setattr(OrbitModel, "in_time", in_time)
    write_orbit(tmp_path, orbit)
    path = tmp_path / "measured.toml"
    path.write_text(PARAMETERS + ORBIT, "utf-8")
    command = ["identify", str(single), str(path), "--method", "time", "--crank", "beam", "--json"]
    assert main(command) == 130


def refused(engine, folder, text, said, **levels):
    """One line with these words."""
    levels = {key: value for key, value in ({"method": "time", "crank": "beam"} | levels).items() if value}
    path = folder / "measured.toml"
    with one_line(said):
        identified(engine, path, text, **levels)
