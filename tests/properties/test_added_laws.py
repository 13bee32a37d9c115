"""Added shafts on an engine's own laws: rollers, axial bearing, torsional damper, films of every level."""

import math
from dataclasses import fields, replace

import entry
import numpy as np
import pytest
from bodies import series
from one_line import one_line
from scipy.optimize import brentq, fsolve
from started import at_speed, shown
from tests.film_tables import RATIO, coarse_table
from tests.rods import FOUR, beside, part, plain_engine

import cranktrain as ct
from cranktrain.core.reduced_body import rigid_body
from cranktrain.dynamics.model.settings import Settings, resolved
from cranktrain.dynamics.simulation import Parts, simulate
from cranktrain.dynamics.topology.values import REST
from cranktrain.engine.additions import ConnectionTable
from cranktrain.engine.connections import Film, RingDamper, Roller, Thrust
from cranktrain.engine.file import load_engine
from cranktrain.engine.lubricant import oil_temperature, viscosity
from cranktrain.film.elastic.bore_compliance import RIGID_BORE, BoreCompliance
from cranktrain.film.laws.bearings import Bearings, bearing_parameters, law_films
from cranktrain.film.laws.film_solution import GROUPS, IN_DOUBLES
from cranktrain.film.laws.register import PLAIN, bearing_law
from cranktrain.film.laws.thrust import thrust_force, thrust_force_tilted, thrust_parameters
from cranktrain.loads.damper import damper_parameters, damper_temperature, damping_coefficient
from cranktrain.results.files import output_unit
from cranktrain.results.summary import run_summary
from cranktrain.store import film_tables
from cranktrain.structure import assembly

GRAVITY = 9.80665
SPEED = 1500.0 * math.pi / 30.0
ROLLER = {
    "rollers": 9, "roller_diameter": 6e-3, "roller_length": 8e-3, "pitch_diameter": 31e-3, "clearance": 12e-6,
    "stiffness": 1e8, "tilt_stiffness": 1e3, "damping": 2e3, "tilt_damping": 0.1,
}  # fmt: skip
COLLAR = {
    "clearance": 2e-4, "inner_diameter": 0.03, "outer_diameter": 0.05, "pads": 4, "pad_fraction": 0.8, "taper": 2e-5,
    "contact_height": 2e-6, "contact_stiffness": 1e9, "damping": 1e4,
}  # fmt: skip
FREE = {"stiffness": (0.0, 0.0, 1e6), "damping": (0.0, 0.0, 1e3)}
LEVEL = {"turning_stiffness": (1e6, 1e6, 0.0), "turning_damping": (1e3, 1e3, 0.0)}


def rotor(ratio, mass=4.0, centre=0.0, inertia=0.02):
    """A frame beside the engine and a rotor in it, whose centre of mass lies ``centre`` (m) along its axis."""
    frame = ct.Frame("f", ratio, axis=(0.4, -0.2))
    places = {"front": (0, 0, -0.1), "middle": (0, 0, 0), "rear": (0, 0, 0.1)}
    body = rigid_body("r", mass, np.diag([0.6 * inertia, 0.6 * inertia, inertia]), (0.0, 0.0, centre), places)
    return frame, ct.Body("r", body, "f")


def link(name, law, data, interface="middle", other=None):
    """A connection of the rotor to the ground."""
    return ct.Connection(name, law, (ct.End("r", interface), other or ct.End("ground")), data)


@pytest.mark.parametrize("collar", ["square", "tilting"])
@pytest.mark.parametrize("own_oil", [0.02, 0.0])
def test_a_rotor_on_an_axial_bearing_sits_where_its_films_carry_the_load(collar, own_oil):
    """F(z) of both rows of pads at the rotor's speed balances the load; with the engine's oil at its temperature."""
    load, ratio = 400.0, 2.0
    frame, body = rotor(ratio)
    links = (
        link("t", "thrust", COLLAR | {"collar": collar, "viscosity": own_oil}),
        link("a", "roller", ROLLER, "front"), link("b", "roller", ROLLER, "rear"),
        link("push", "load", {"force": (0.0, 0.0, load)}),
    )  # fmt: skip
    run = beside(ct.Topology((frame,), (body,), links), SPEED)
    oil = plain_engine()[0].oil
    parameters = thrust_parameters(Thrust(**COLLAR).bearing, own_oil or viscosity(oil, oil_temperature(oil, SPEED)))
    half = 0.5 * COLLAR["clearance"]
    exact = brentq(lambda z: thrust_force(z, 0.0, ratio * SPEED, parameters)[0] + load, 0.0, half, xtol=1e-15)
    found = series(run, 12 * 288, 288)
    assert found["connection[t].force.z"][-1] == pytest.approx(-load, rel=2e-3)
    assert found["connection[t].position.z"][-1] == pytest.approx(exact, rel=1e-3)
    for name in "ab":  # rollers share the weight
        force = np.hypot(*(found[f"connection[{name}].force.{way}"][-288:] for way in "xy"))
        np.testing.assert_allclose(force, 0.5 * 4.0 * GRAVITY, rtol=2e-3)


def test_a_tilting_collar_leans_as_its_pads_carry_a_moment():
    """Force and moments of the pads' law at rest in space against load and torque, both along axes of the engine."""
    load, torque, ratio = 300.0, 0.4, 2.0
    frame, body = rotor(ratio)
    # Nothing else takes moments.
    links = (
        link("t", "thrust", COLLAR | {"collar": "tilting", "viscosity": 0.02}),
        link("across", "spring", {"stiffness": (1e8, 1e8, 0.0), "damping": (1e4, 1e4, 0.0)}),
        link("push", "load", {"force": (0.0, 0.0, load), "torque": (torque, 0.0, 0.0)}),
    )  # fmt: skip
    run = beside(ct.Topology((frame,), (body,), links), SPEED)
    parameters, out = thrust_parameters(Thrust(**COLLAR).bearing, 0.02), np.zeros(21)

    def missing(place):
        thrust_force_tilted(*place, 0.0, 0.0, 0.0, ratio * SPEED, parameters, out)
        return out[0] + load, (out[1] + torque) * 1e3, out[2] * 1e3

    exact = fsolve(missing, (5e-5, 1e-4, 0.0), xtol=1e-12)
    found = series(run, 24 * 288, 288)
    tilt = np.hypot(*(found[f"connection[t].rotation.{way}"][-1] for way in "xy"))
    assert found["connection[t].position.z"][-1] == pytest.approx(exact[0], rel=2e-3)
    assert tilt == pytest.approx(np.hypot(*exact[1:]), rel=5e-3)
    moment = np.hypot(*(found[f"connection[t].moment.{way}"][-1] for way in "xy"))
    assert moment == pytest.approx(torque, rel=5e-3)


def ring_data(damper):
    """Data of a law 'damper' as an engine's damper has them."""
    return values_of(damper, RingDamper) | {"fluid": damper.law}


@pytest.mark.parametrize("ratio", [1.0, -2.0])
@pytest.mark.parametrize(("kind", "law"), [("viscous", "newtonian"), ("viscous", "complex-modulus"), ("rubber", "")])
def test_a_ring_against_its_housing_swings_out_as_a_spring_and_damper(ratio, kind, law):
    """ψ̈ + c/J ψ̇ + k/J ψ = 0 with 1/J = 1/J₁ + 1/J₂; k and c of the law at the table's temperature."""
    engine = load_engine("diesel_i6")
    damper = replace(engine.damper, kind=kind, law=law or engine.damper.law)
    inertias, frame, hub = {"housing": 1.0, "ring": 2.0}, ct.Frame("f", ratio, axis=(0.4, -0.2)), {"hub": (0, 0, 0)}
    bodies = {name: rigid_body(name, 5.0, np.diag([0.6 * own, 0.6 * own, own]), (0, 0, 0), hub)
              for name, own in inertias.items()}  # fmt: skip
    held = {"stiffness": (1e8, 1e8, 1e8), "damping": (1e4, 1e4, 1e4)} | LEVEL
    links = [ct.Connection(name, "spring", (ct.End(name, "hub"), ct.End("ground")), held) for name in bodies]
    joint = ct.Connection("d", "damper", (ct.End("housing", "hub"), ct.End("ring", "hub")), ring_data(damper))
    added = tuple(ct.Body(name, body, "f") for name, body in bodies.items())
    run = beside(ct.Topology((frame,), added, (*links, joint)), SPEED)
    state, turn = run.state, bodies["ring"].shapes[0, 5]
    part(run, state, "ring")[1] += 10.0 * turn / (turn @ turn)
    run.state = state
    found = series(run, 144, 288)
    parameters = damper_parameters(damper, damper_temperature(damper, SPEED))
    together = sum(1.0 / own for own in inertias.values())
    c, k = damping_coefficient(parameters) * together, parameters[0] * together
    # From a step on after which accelerations fit the velocity that was given to the ring.
    twist, rate = (found[f"connection[d].{name}"][4:] for name in ("twist", "twist_rate"))
    time = 4.0 * math.pi / SPEED / 288 * np.arange(twist.size)
    root = np.sqrt(complex(0.25 * c * c - k))
    size = (rate[0] + 0.5 * c * twist[0]) / root
    exact = (np.exp(-0.5 * c * time) * (twist[0] * np.cosh(root * time) + size * np.sinh(root * time))).real
    assert np.ptp(exact) > 1e-3
    assert np.abs(twist - exact).max() < 1e-4 * np.ptp(exact)
    power = found["connection[d].heat"][4:]
    torque = found["connection[d].torque"][4:] + parameters[0] * twist
    np.testing.assert_allclose(power, -torque * rate, atol=1e-9 * power.max())


def doubled(engine, links, steps, **settings):
    """Outputs over the first steps of a run whose added connections hold the crank beside its own bearings."""
    made = ct.assemble(engine, ct.Settings(crank="beam", block="ground", **settings), inherit=False)
    topology = ct.Topology((), (), links)
    run = at_speed(SPEED, made.engine, made.body, made.settings, None, made.parts._replace(topology=topology))
    found = series(run, steps, 288)
    return found, run


def alike(found, one, two, close, *outputs):
    """Whether force, by its size, and further outputs of two parts differ by less than a share of the largest."""
    pairs = [[np.hypot(*(found[f"{name}.force.{way}"] for way in "xy")) for name in (one, two)]]
    for first, second in (*pairs, *([found[f"{name}.{output}"] for name in (one, two)] for output in outputs)):
        assert np.abs(first - second).max() < close * np.abs(first).max()


def on_crank(name, law, interface, data):
    return ct.Connection(name, law, (ct.End("crank", interface), ct.End("ground")), data)


def values_of(part, kind):
    """Values of an engine's part that a connection's data have as well."""
    own = {entry.name for entry in fields(kind)}
    return {entry.name: getattr(part, entry.name) for entry in fields(part) if entry.name in own}


@pytest.mark.parametrize(("law", "steps"), [("palmgren", 200), ("iso16281", 100), ("linear", 100)])
@pytest.mark.parametrize("variable", [False, True])
def test_rollers_beside_a_main_on_rollers_carry_what_it_carries(law, variable, steps):
    engine = load_engine("diesel_v8")
    rollers = replace(engine.main_roller, law=law, variable=variable)
    data = {entry.name: getattr(rollers, entry.name)[2] for entry in fields(Roller) if entry.name in
            ROLLER or entry.name == "profile"}  # fmt: skip
    data |= {"contact": law, "variable": variable}
    found, run = doubled(
        replace(engine, main_roller=rollers), (on_crank("c", "roller", "main[3]", data),), steps, bearings="roller"
    )
    alike(found, "bearing[3]", "connection[c]", 1e-9)
    # So do moments: their work on the tilt is what the tilt's own forces do.
    np.testing.assert_allclose(entry.law(run, "c").place, entry.law(run, "main[3]").place, rtol=1e-9, atol=1e-18)


FILM = "friction_torque", "oil_flow", "pressure_max"


def film_data(engine, level):
    return values_of(engine.main_bearing, Film) | {"level": level}


@pytest.mark.parametrize(("level", "steps"), [("linear", 100), ("impedance", 200), ("reynolds", 40)])
def test_a_film_beside_a_main_bearings_carries_what_it_carries(level, steps):
    engine = load_engine("diesel_i6")
    found, _ = doubled(engine, (on_crank("c", "film", "main[3]", film_data(engine, level)),), steps, bearings=level)
    alike(found, "bearing[3]", "connection[c]", 1e-9, *(FILM if level != "linear" else ()))


TABLED = {
    "diameter": 0.04, "width": 0.04 * RATIO, "clearance": 4e-5, "contact_height": 1e-6, "contact_pressure": 3e8,
    "relief_depth": 6e-6, "roughness": 4e-7, "level": "table", "viscosity": 0.01,
}  # fmt: skip


def rotor_on(film, load=1.5e3):
    frame, body = rotor(2.0)
    films = tuple(link(name, "film", film, name) for name in ("front", "rear"))
    loads = [
        link(f"push_{name}", "load", {"force": (share * load, load, 0.0), "order": 0.5}, name)
        for name, share in (("middle", 0.3), ("front", -0.1))
    ]
    return ct.Topology((frame,), (body,), (*films, link("z", "spring", FREE), *loads))


def test_added_films_read_the_table_of_their_proportions():
    """As the law of the mains does at the same place, tilt and velocities; near to the film that is solved."""
    tables = (coarse_table(),)
    run = beside(rotor_on(TABLED), SPEED, tables)
    found = series(run, 144, 288)
    rear, film = entry.law(run, "rear"), Film(**TABLED)
    rows = bearing_parameters(film, film.viscosity)[None]
    films = law_films(bearing_law("table"), PLAIN, Bearings(rows, film, parts={"table": tables[0]}))
    assert np.abs(rear.place[2:]).max() > 1e-8  # the shaft is tilted
    answer = entry.Law(films)(rear.place, rear.velocity, "OBSERVE", speed=found["r.speed"][-1])
    for k, way in enumerate("xy"):
        assert found[f"connection[rear].force.{way}"][-1] == pytest.approx(answer.force[k], rel=1e-6)
    assert found["connection[rear].pressure_max"][-1] == pytest.approx(answer.pressure, rel=1e-6)
    solved = series(beside(rotor_on(TABLED | {"level": "reynolds"}), SPEED), 144, 288)
    for way in "xy":
        one, two = found[f"r.position.{way}"], solved[f"r.position.{way}"]
        assert np.abs(one - two).max() < 0.02 * np.ptp(two)


def test_tables_are_made_once_for_films_of_the_same_proportions(monkeypatch):
    made = []
    monkeypatch.setattr(film_tables, "film_table", lambda settings, **_: [made.append(settings) or settings])
    narrow = TABLED | {"width": 0.9 * TABLED["width"]}  # proportions of which no other test has made the table
    found = ct.film_tables(rotor_on(narrow), resolution="coarse")
    assert len(found) == len(made) == 1 and made[0].length_ratio == pytest.approx(narrow["width"] / narrow["diameter"])
    assert ct.film_tables(rotor_on(TABLED | {"level": "reynolds"})) == ()


def test_films_that_lack_a_table_or_a_bore_are_told():
    needs = "connection 'front': level 'table' needs a film table of L/D "
    film = {key: value for key, value in TABLED.items() if key != "level"} | {"level": "ehd"}
    engine = load_engine(FOUR)
    tables = [replace(one, film=replace(one.film, level="ehd")) if one.film else one for one in engine.connection]
    on_ehd = replace(engine, connection=tuple(tables))
    for call, said in (
        (lambda: beside(rotor_on(TABLED), SPEED), needs + "0.35"),
        (lambda: beside(rotor_on(TABLED | {"width": 0.016}), SPEED, (coarse_table(),)), needs + "0.4"),
        (lambda: beside(rotor_on(film), SPEED), "connection 'front': level 'ehd' knows the elastic bores of the"),
        (lambda: assembly.checked(on_ehd, ct.Settings()), "connection 'front_1': level 'ehd' knows"),
    ):
        with one_line(said):
            call()


def soft_bore():
    """A bore with three made-up shapes: it widens, and becomes oval both ways."""
    forms = np.zeros((3, 5, 2))
    forms[0, 0, 0] = forms[1, 3, 0] = forms[2, 4, 0] = 1.0
    return BoreCompliance(forms, np.array([6e-10, 5e-10, 4e-10]), np.zeros((3, 4)), np.ones(3), 1.0)


@pytest.mark.parametrize("bore", ["rigid", "elastic"])
@pytest.mark.parametrize(("tolerance", "close"), [(IN_DOUBLES, 1e-9), (None, 3e-6)])
def test_a_film_with_a_memory_beside_a_mains_carries_what_it_carries(bore, tolerance, close):
    """Level ehd: oil and bore's form are remembered by both, in the state; films in lanes are of single precision."""
    engine, compliance = load_engine("diesel_i6"), RIGID_BORE if bore == "rigid" else soft_bore()
    made = ct.assemble(engine, ct.Settings(crank="beam", block="ground", bearings="impedance"), inherit=False)
    links = (on_crank("c", "film", "main[3]", film_data(engine, "ehd") | {"bore": bore}),)
    parts = Parts(bore=compliance, topology=ct.Topology((), (), links))
    settings = ct.Settings(crank="beam", block="ground", bearings="ehd", newton_tolerance=tolerance)
    run = at_speed(SPEED, engine, made.body, settings, None, parts)
    found = series(run, 24, 288)
    alike(found, "bearing[3]", "connection[c]", close, *FILM)
    in_lanes = entry.film_record(run).memory.calls[:, GROUPS].sum()
    assert (in_lanes > 0.0) == (tolerance is None)


EHD = {
    "diameter": 0.03, "width": 0.015, "clearance": 2e-5, "contact_height": 1e-6, "contact_pressure": 3e8,
    "level": "ehd", "bore": "rigid", "viscosity": 0.01,
}  # fmt: skip


def rotor_on_oil(ratio=2.0, load=1.5e3, interfaces=("front", "rear"), **film):
    """A rotor on films that a force loads at an order of the crank angle."""
    frame, body = rotor(ratio)
    films = tuple(link(name, "film", EHD | film, name) for name in interfaces)
    push = link("push", "load", {"force": (0.0, load, 0.0), "order": 3.0})
    return ct.Topology((frame,), (body,), (*films, link("z", "spring", FREE | LEVEL), push))


def after_half_a_cycle(steps, start=None):
    """Run of the rotor on its remembered oil that has gone on from a state for half a cycle in so many steps each."""
    run = beside(
        rotor_on_oil(level="ehd:fine"), SPEED, step=4.0 * math.pi / steps, film_change=1e9, newton_tolerance=1e-9,
        integrator=bearing_law("ehd:fine").integrator,
    )  # fmt: skip
    if start is not None:
        run.state = start
    begin, h = run.time, 4.0 * math.pi / SPEED / steps
    for k in range(steps // 2):
        run.step(begin + (k + 1) * h)
    return run


def test_a_film_with_a_memory_converges_with_the_step():
    """Its voids follow the stages: the error falls faster than by a method of first order, whose slope would be 1.2."""
    start = after_half_a_cycle(576).state.copy()
    runs = [after_half_a_cycle(steps, start) for steps in (144, 288, 576, 2304)]
    places = [np.array([shown(run)[f"r.position.{way}"] for way in "xy"]) for run in runs]
    errors = [float(np.hypot(*(place - places[-1]))) for place in places[:-1]]
    assert errors[0] < 0.05 * float(np.hypot(*places[-1]))
    assert errors[0] > errors[1] > errors[2]
    assert math.log2(errors[0] / errors[2]) / 2.0 > 1.5


@pytest.mark.parametrize("law", ["film", "axial_joint"])
def test_a_state_holds_what_connections_remember(law):
    """Going on from a copy of the state gives the same outputs to the bit."""
    topology = rotor_on_oil() if law == "film" else sliding(SPLINE, 4.0)
    run = beside(topology, SPEED)
    series(run, 29, 288)
    state = run.state
    h = 4.0 * math.pi / SPEED / 288
    begin, rows = round(run.time / h), np.zeros((2, 40, run.outputs.size))
    for found in rows:
        run.state = state
        assert run.series(h, begin + 1, found) == 40
    assert np.array_equal(rows[0], rows[1])
    assert np.ptp(rows[0], axis=0).max() > 0.0
    kept = {connection.name: entry.memory(run, connection.name).size for connection in topology.connections}
    if law == "axial_joint":
        assert sum(kept.values()) == 2
    else:
        assert kept.pop("front") == kept.pop("rear") > 2 and not any(kept.values())


SPLINE = {
    "joint": "spline", "joint_stiffness": 1e7, "joint_damping": 2e3, "turning_stiffness": 4e4, "turning_damping": 60.0,
    "spline_radius": 0.02, "friction": 0.08,
}  # fmt: skip
CARRIED = 100.0
HOLDS = SPLINE["friction"] * CARRIED / SPLINE["spline_radius"]


def sliding(joint, share):
    """Two rotors that a joint joins, one held; a torque on the other one, and a force of ``share`` friction limits."""
    frame, body = rotor(2.0)
    places = {"middle": (0, 0, 0.0)}
    other = rigid_body("o", 6.0, np.diag([0.02, 0.02, 0.03]), (0, 0, 0), places)
    held = {"stiffness": (1e8, 1e8, 1e9), "damping": (1e4, 1e4, 1e4), "turning_stiffness": (1e6, 1e6, 1e6),
            "turning_damping": (1e3, 1e3, 1e2)}  # fmt: skip
    across = {"stiffness": (1e8, 1e8, 0.0), "damping": (1e4, 1e4, 0.0)} | LEVEL
    links = (
        ct.Connection("o", "spring", (ct.End("o", "middle"), ct.End("ground")), held),
        link("r", "spring", across),
        ct.Connection("j", "axial_joint", (ct.End("r", "middle"), ct.End("o", "middle")), joint),
        link("push", "load", {"force": (0.0, 0.0, share * HOLDS), "torque": (0.0, 0.0, CARRIED)}),
    )
    return ct.Topology((frame,), (body, ct.Body("o", other, "f")), links)


def test_a_joint_that_holds_is_a_spring_along_the_axis():
    run = beside(sliding(SPLINE, 0.02), SPEED)
    found = series(run, 4 * 288, 288)
    assert found["connection[j].torque"][-1] == pytest.approx(-CARRIED, rel=1e-6)
    assert found["connection[j].force.z"][-1] == pytest.approx(-0.02 * HOLDS, rel=1e-4)
    bolted = beside(sliding(SPLINE | {"joint": "bolted"}, 5.0), SPEED)
    found = series(bolted, 4 * 288, 288)
    assert found["connection[j].slip"][-1] == pytest.approx(5.0 * HOLDS / SPLINE["joint_stiffness"], rel=1e-3)


def test_a_joint_that_slides_leaves_the_force_beyond_friction():
    """m v̇ = F − μ |T|/r from when it slides; the friction follows the torque that it carries."""
    run = beside(sliding(SPLINE, 3.0), SPEED)
    found = series(run, 144, 288)
    friction = -found["connection[j].force.z"][36:]
    torque = found["connection[j].torque"][36:]
    np.testing.assert_allclose(friction, np.abs(torque) * SPLINE["friction"] / SPLINE["spline_radius"], rtol=2e-2)
    speed, h = found["connection[j].slip_velocity"], 4.0 * math.pi / SPEED / 288
    gained = np.diff(speed[36:]).sum() / (h * (speed.size - 37))
    assert gained == pytest.approx(2.0 * HOLDS / 4.0, rel=1e-2)
    assert speed[-1] > 1.0


FAST = 4000.0 * math.pi / 30.0


def on_other_bearings(engine, tables):
    """The in-line four with balancer shafts whose films and axial springs are other connections."""
    kept = []
    for table in engine.connection:
        law, data = tables.get(table.law, (table.law, table.data))
        kept.append(ConnectionTable(table.name, law, table.ends, table.place, **{law: data}))
    return replace(engine, connection=tuple(kept))


OF_BALANCERS = {
    "diameter": 0.032, "width": 0.02, "clearance": 3e-5, "contact_height": 1e-6, "contact_pressure": 3e8,
}  # fmt: skip
"""Films of the shafts as the file has them."""
BALANCERS = {
    "films solved online": {"film": ("film", Film(**OF_BALANCERS | {"level": "reynolds"}))},
    "rollers": {"film": ("roller", Roller(**ROLLER))},
    "rollers that go round": {"film": ("roller", Roller(**ROLLER | {"variable": True}))},
    "axial bearings": {"spring": ("thrust", Thrust(**COLLAR))},
    "rollers and tilting collars": {
        "film": ("roller", Roller(**ROLLER)), "spring": ("thrust", Thrust(**COLLAR | {"collar": "tilting"})),
    },
}  # fmt: skip


@pytest.mark.parametrize("tables", BALANCERS)
@pytest.mark.parametrize(("block", "left"), [("ground", 1e-5), ("flexible", 5e-5)])
def test_energy_of_balancers_on_the_engines_laws_closes(tables, block, left):
    """Over a cycle that repeats, as with films; in a block that shakes, moments of second order are left out."""
    engine = on_other_bearings(load_engine(FOUR), BALANCERS[tables])
    settings = ct.Settings(crank="beam", bearings="impedance", block=block, step=math.radians(1.25))
    closed(engine, settings, left)


@pytest.mark.slow
def test_energy_of_balancers_on_oil_that_is_remembered_closes():
    """Level ehd in a rigid bore, in doubles: rounding of singles changes the oil's flow from cycle to cycle by 5e-6."""
    tables = {"film": ("film", Film(**OF_BALANCERS | {"level": "ehd", "bore": "rigid"}))}
    engine = on_other_bearings(load_engine(FOUR), tables)
    chosen = {"block": "flexible", "step": math.radians(1.25), "newton_tolerance": IN_DOUBLES}
    assert resolved(ct.Settings(bearings="impedance"), engine).film_change == bearing_law("ehd").film_change
    closed(engine, ct.Settings(crank="beam", bearings="impedance", **chosen), 1e-4)


def closed(engine, settings, left):
    """The energy balance of a settled cycle leaves less than a fraction of the gas work."""
    made = ct.assemble(engine, settings, inherit=False)
    run = simulate(made.engine, made.body, made.settings, FAST, parts=made.parts, settle=1e-6)
    assert run.settling.repeats == 1  # whatever carries rounding alone, as a collar that nothing tilts
    assert abs(run_summary(run, "")["energy"]["residual_of_gas_work"]) < left


RING = {
    "kind": "rubber", "stiffness": 9e4, "loss_factor": 0.25, "frequency": 200.0, "temperature_speeds": (100.0,),
    "temperatures": (340.0,), "lowest_temperature": 250.0, "highest_temperature": 420.0,
}  # fmt: skip
WRONG = [
    ("roller", ROLLER | {"roller_diameter": 40e-3}, REST, "pitch_diameter: 31 mm leaves no journal"),
    ("roller", ROLLER | {"rollers": 20}, REST, "rollers: 20 of 6 mm overlap"),
    ("roller", ROLLER | {"clearance": 1e-3}, REST, "clearance: clearance of 1000 um is larger"),
    ("roller", ROLLER, ct.Frame("g", 1.0, axis=(0.4, -0.2)), "outer ring, which does not turn"),
    ("roller", ROLLER | {"contact": "hertz"}, REST, "unknown law 'hertz'; valid: linear, palmgren, iso16281"),
    ("thrust", COLLAR | {"inner_diameter": 0.06}, REST, "inner_diameter: 60 mm is not less"),
    ("thrust", COLLAR | {"contact_height": 1.5e-4}, REST, "contact_height: two of 0.15 mm"),
    ("thrust", COLLAR, ct.Frame("g", 1.0, axis=(0.4, -0.2)), "row of pads, which does not turn"),
    ("thrust", {key: COLLAR[key] for key in COLLAR if key != "pads"}, REST, "needs 'pads'"),
    ("damper", RING, REST, "one end is at rest; join the other to a body that turns with the crank"),
    ("damper", RING | {"temperatures": (430.0,)}, ct.Frame("g", 2.0), "hotter than the damper's law is valid"),
    ("damper", RING | {"kind": "viscous"}, ct.Frame("g", 2.0), "viscosity: is missing"),
    ("damper", RING | {"loss_factr": 0.1}, ct.Frame("g", 2.0), "has no 'loss_factr'; did you mean 'loss_factor'"),
]  # fmt: skip


@pytest.mark.parametrize(("law", "data", "second", "said"), WRONG)
def test_data_that_describe_no_bearing_are_told(law, data, second, said):
    connection = ct.Connection("c", law, (ct.End("a"), ct.End("b")), data)
    with one_line("connection 'c'", said):
        entry.law_outputs(connection, ct.Frame("f", 2.0, axis=(0.4, -0.2)), second)


@pytest.mark.parametrize(("law", "data"), [("roller", ROLLER), ("thrust", COLLAR)])
def test_a_journal_that_does_not_turn_is_told(law, data):
    with one_line("exchange the ends"):
        entry.law_outputs(ct.Connection("c", law, (ct.End("a"), ct.End("b")), data), REST, ct.Frame("f", 2.0))


@pytest.mark.parametrize("law", ["roller", "thrust", "damper", "axial_joint", "film"])
def test_outputs_of_the_laws_have_units(law):
    data = {"roller": ROLLER, "thrust": COLLAR | {"collar": "tilting"}, "damper": RING, "axial_joint": SPLINE,
            "film": EHD}  # fmt: skip
    other = ct.Frame("f", 2.0) if law in ("damper", "axial_joint") else REST
    connection = ct.Connection("c", law, (ct.End("a"), ct.End("b")), data[law])
    names = entry.law_outputs(connection, ct.Frame("f", 2.0), other)
    units = {name: output_unit(f"connection[c].{name}") for name in names}
    assert all(units.values())
    known = {"force.z": "N", "position.z": "m", "moment.x": "N m", "rotation.y": "rad", "heat": "W", "slip": "m",
             "slip_velocity": "m/s", "torque": "N m", "twist_rate": "rad/s", "pressure_max": "Pa"}  # fmt: skip
    assert all(units[name] == unit for name, unit in known.items() if name in units)


def test_a_run_goes_on_at_another_speed_with_its_added_bodies():
    """The engine of the library with balancer shafts: what its workspace calls stays; it ended the process before."""
    engine = load_engine("four_petrol")
    settings = Settings(crank="rigid", bearings="linear", block="ground", pistons="rigid")
    made = assembly.assemble(engine, settings)
    simulation = at_speed(200.0, made.engine, made.body, made.settings, parts=made.parts)
    simulation.go_on_at(210.0)
    simulation.state = simulation.state
    simulation.step(1e-4)
    assert np.isfinite(simulation.outputs).all()
