"""Cranks as STEP files, of an engine's own geometry or drawn otherwise. Run in a process of its own: the CAD kernel."""

import json
import math
import re
import subprocess
import sys
from pathlib import Path

MILLI = r"#(\d+) = \( LENGTH_UNIT\(\) NAMED_UNIT\(\*\) SI_UNIT\(\.MILLI\.,\.METRE\.\) \);"
INCH = """#{n} = ( CONVERSION_BASED_UNIT('INCH',#990001) LENGTH_UNIT() NAMED_UNIT(#990002) );
#990001 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#990003);
#990002 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
#990003 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );"""


def step(path, **how):
    """STEP file made by :func:`make` in another process; its path."""
    path = Path(path)
    command = [sys.executable, __file__, str(path), json.dumps(how)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return path


def make(path, how):
    """Write a crank.

    ``engine``: its own geometry, or ``other``: arguments of :func:`other_crank`; ``turn`` and ``move`` it; ``inch`` as
    unit, or only ``tagged`` so; ``cut`` keeps what lies below z; ``half`` what lies at x > 0; ``twice`` adds a box;
    ``shells`` leaves faces.
    """
    from netgen import occ

    if "engine" in how:
        from cranktrain.engine.file import load_engine
        from cranktrain.structure.crank.shape import crankshaft_shape

        shape = crankshaft_shape(load_engine(how["engine"]).crankshaft).Scale(occ.Pnt(0, 0, 0), 1000)
    elif "box" in how:
        shape = occ.Box(occ.Pnt(0, 0, 0), occ.Pnt(50, 60, 70))
    else:
        shape = other_crank(occ, **how.get("other", {}))
    far = 5000.0
    if "cut" in how:
        shape = shape * occ.Box(occ.Pnt(-far, -far, -far), occ.Pnt(far, far, how["cut"]))
    if how.get("half"):
        shape = shape * occ.Box(occ.Pnt(0, -far, -far), occ.Pnt(far, far, far))
    if "turn" in how:
        *axis, angle = how["turn"]
        shape = shape.Rotate(occ.Axis(occ.Pnt(10, 20, 30), occ.gp_Dir(*axis)), angle)
    if "move" in how:
        shape = shape.Move(occ.Vec(*how["move"]))
    if how.get("twice"):
        shape = occ.Compound([shape, occ.Box(occ.Pnt(300, 0, 0), occ.Pnt(340, 50, 60))])
    if how.get("shells"):
        shape = occ.Compound(list(shape.faces)[:12])
    scale = 1.0 / 25.4 if how.get("inch") else how.get("scale", 1.0)
    shape.Scale(occ.Pnt(0, 0, 0), scale).WriteStep(path)
    if how.get("inch") or how.get("tagged"):
        text = Path(path).read_text()
        found = re.search(MILLI, text)
        Path(path).write_text(text.replace(found[0], INCH.format(n=found[1])))


def other_crank(
    occ, angles=(0, 180, 180, 0), web="rectangle", nose=True, flange=True, split=False, holes=False, pins=()
):
    """A crank in mm that is drawn otherwise: webs of plain outline, no fillets, cylinders in halves, bores.

    ``pins``: diameters, else 50 mm of all.
    """
    throw, main, main_width, pin_width, thickness = 40.0, 30.0, 28.0, 26.0, 18.0
    pins = pins or len(angles) * (50.0,)

    def cylinder(x, y, z, height, radius):
        return occ.Cylinder(occ.Pnt(x, y, z), occ.Z, r=radius, h=height)

    def cheek(z, angle):
        if web == "rectangle":
            plate = occ.Box(occ.Pnt(-38, -55, z), occ.Pnt(38, throw + 35, z + thickness))
        elif web == "disc":
            plate = cylinder(0, 0, z, thickness, 75.0)
        else:
            axes = occ.Axes((0, 0.5 * throw - 12, z), occ.Z, occ.Y)
            plate = occ.WorkPlane(axes).Ellipse(75, 45).Face().Extrude(thickness * occ.Z)
        return plate.Rotate(occ.Axis(occ.Pnt(0, 0, 0), occ.Z), angle)

    pieces = [cylinder(0, 0, -50, 50, 20)] if nose else []
    pieces.append(cylinder(0, 0, 0, main_width, main))
    z = main_width
    for angle, pin in zip(angles, pins, strict=True):
        turn = math.radians(angle)
        pieces.append(cheek(z, angle))
        pieces.append(cylinder(-throw * math.sin(turn), throw * math.cos(turn), z + thickness, pin_width, 0.5 * pin))
        z += thickness + pin_width
        pieces.append(cheek(z, angle))
        pieces.append(cylinder(0, 0, z + thickness, main_width, main))
        z += thickness + main_width
    if flange:
        pieces.append(cylinder(0, 0, z, 15, 45))
        z += 15.0
    solid = pieces[0]
    for piece in pieces[1:]:
        solid = solid + piece
    if holes:
        solid = solid - cylinder(0, 0, z - 30, 60, 9)
        for k in range(6):
            x, y = 36 * math.cos(k), 36 * math.sin(k)
            solid = solid - cylinder(x, y, z - 15, 30, 4)
        solid = solid - occ.Box(occ.Pnt(-3, 15, -60), occ.Pnt(3, 30, -20))
        solid = solid - occ.Cylinder(occ.Pnt(0, -40, 14), occ.gp_Dir(0, 70, 45), r=3, h=150)
    if split:
        side = occ.Box(occ.Pnt(-900, -900, -900), occ.Pnt(3, 900, 900))
        solid = (solid * side) + (solid - side)
    return solid


if __name__ == "__main__":
    make(sys.argv[1], json.loads(sys.argv[2]))
