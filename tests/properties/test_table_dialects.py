"""One table, written in sixty dialects, is read alike to the last digit; what cannot be read is named by its line."""

import random

import pytest
from table_dialects import Column, dialects

from cranktrain.engine.torsional_chain import read_chain
from cranktrain.loads.pressure_points import read_points
from cranktrain.results.orders.measured import read_measured_orders

DIALECTS = dialects()
IDS = [f"{k}" for k in range(len(DIALECTS))]
ANGLE = Column(("Crank angle", "Kurbelwinkel"), ("deg", "°KW", "°", "°CA", "Grad"))
PRESSURE = Column(("Cylinder pressure", "Zylinderdruck"), ("bar",))
VOLUME = Column(("V", "Volumen"), ("cm3", "cm³", "ccm"))


def trace():
    """Angles and pressures with all digits, above and below a thousand."""
    rng = random.Random(4)
    return [(-360.0 + 7.5 * k, rng.uniform(1.0, 3200.0), rng.uniform(50.0, 2000.0)) for k in range(97)]


@pytest.mark.parametrize("dialect", DIALECTS, ids=IDS)
def test_pressures_are_alike_to_the_last_digit(dialect, tmp_path):
    rows = trace()
    path = tmp_path / "p.CSV"
    path.write_bytes(dialect.written([ANGLE, VOLUME, PRESSURE], [(a, v, p) for a, p, v in rows]))
    points = read_points(path, None, 6)
    ((angle, pressure),) = points.parts()
    assert angle.tolist() == [row[0] for row in rows] and pressure[:, 0].tolist() == [row[1] for row in rows]
    assert points.units == ["bar"]


@pytest.mark.parametrize("dialect", DIALECTS, ids=IDS)
def test_orders_are_alike_to_the_last_digit(dialect, tmp_path):
    rng = random.Random(5)
    rows = [(1600.0 + 100.0 * k, 0.5 * (k % 5 + 1), rng.uniform(0.0, 0.3), "deg") for k in range(20)]
    columns = (
        Column(("speed_rpm", "Drehzahl")), Column(("order", "Ordnung")), Column(("amplitude", "Amplitude")),
        Column(("unit", "Einheit")),
    )  # fmt: skip
    plain, path = tmp_path / "plain.csv", tmp_path / "orders.Txt"
    lines = [",".join(map(str, row)) for row in rows]
    plain.write_text("speed_rpm,order,amplitude,unit\n" + "\n".join(lines))
    path.write_bytes(dialect.written(columns, rows))
    expected, found = read_measured_orders(plain), read_measured_orders(path)
    assert expected.keys() == found.keys()
    for output, orders in expected.items():
        assert orders.keys() == found[output].keys()
        for order, pair in orders.items():
            for one, other in zip(pair, found[output][order], strict=True):
                assert one.tolist() == other.tolist()


@pytest.mark.parametrize("dialect", DIALECTS, ids=IDS)
def test_drive_lines_are_alike_to_the_last_digit(dialect, tmp_path):
    rng = random.Random(6)
    columns = (
        Column(("disc", "Scheibe")), Column(("inertia", "Trägheitsmoment"), ("kg m^2", "kg m²", "kg*m^2")),
        Column(("damping", "Dämpfung"), ("N m s/rad", "Nms/rad")), Column(("to", "nach")),
        Column(("stiffness", "Steifigkeit"), ("N m/rad", "Nm/rad", "N·m/rad")),
        Column(("loss_factor", "Verlustfaktor")),
    )  # fmt: skip
    rows = [(f"m{k}", rng.uniform(1e-3, 2.0), 0.0, None, rng.uniform(1e4, 1e6), rng.uniform(0, 0.1)) for k in range(6)]
    rows += [("m6", 0.25, 0.0, "m1", 2e5, None)]
    path, plain = tmp_path / "line.TSV", tmp_path / "plain.csv"
    lines = [",".join("" if cell is None else str(cell) for cell in row) for row in rows]
    plain.write_text("disc,inertia,damping,to,stiffness,loss_factor\n" + "\n".join(lines))
    path.write_bytes(dialect.written(columns, rows))
    assert read_chain(path) == read_chain(plain)
