"""Bad tables of bodies and connections, by the command line: exit code 2 and one line that names what is wrong."""

from __future__ import annotations

import pytest
from rods import FOUR

from cranktrain.cli.main import main


def table(kind, **keys):
    """An array table of an engine file; a value with a unit is a pair."""
    rows = [
        f'{key} = {{ value = {value[0]}, unit = "{value[1]}", origin = "chosen" }}' if isinstance(value, tuple)
        else f"{key} = {value}"
        for key, value in keys.items()
    ]  # fmt: skip
    return "\n".join(("", f"[[{kind}]]", *rows, "")).replace("'", '"')


def frame(name, ratio, axis):
    return table("frame", name=f"'{name}'", ratio=(ratio, "1"), axis=(axis, "mm"))


def disc(name, frame, x=-40, y=-100):
    """A disc with the one interface ``hub``."""
    place = {key: ([value], "mm") for key, value in (("x", x), ("y", y), ("z", 100))}
    return table(
        "body", name=f"'{name}'", frame=f"'{frame}'", mass=(2, "kg"), inertia=([1e-3] * 3, "kg m^2"),
        centre=([x, y, 100], "mm"), interfaces="['hub']", **place,
    )  # fmt: skip


def joined(name, law, *ends, **data):
    return table("connection", name=f"'{name}'", law=f"'{law}'", ends=str(list(ends)), **data)


MESH = {"stiffness": (1.5e8, "N/m"), "damping": (3e3, "N s/m")}
ROUND = {"stiffness": (1e5, "N m/rad"), "damping": (10, "N m s/rad")}
FILM = {
    "diameter": (30, "mm"), "width": (20, "mm"), "clearance": (20, "um"), "contact_height": (1, "um"),
    "contact_pressure": (300, "MPa"),
}  # fmt: skip
BELT = {"radius": (30, "mm"), "stiffness": (4e5, "N/m"), "damping": (60, "N s/m"), "tension": (500, "N")}
HOLD = {"stiffness": ([1e8] * 3, "N/m"), "turning_stiffness": ([1e5, 1e5, 0], "N m/rad")}
BACK = frame("back", -2, [-40, -100]) + disc("w", "back")
PAIR = BACK + frame("on", 2, [40, -100]) + disc("v", "on", 40)
HELD = "".join(joined(f"hold {name}", "spring", f"{name}.hub", "ground", **HOLD) for name in "wv")
ALONG = frame("sun", 1, [0, 0]) + disc("w", "sun", 0, 0) + frame("arm", 0.5, [0, 0]) + disc("v", "arm", 0, 0) + HELD
PLANETARY = joined("set", "planetary", "w.hub", "ground", "v.hub", teeth_sun=(30, "1"), teeth_ring=(70, "1"))
ROD = table("frame", name="'r'", motion="'rod'", cylinder=(1, "1")) + disc("w", "r", 0, 43)
LOOSE = "body 'w': no connection holds it"
CASES = {
    "nothing": (BACK, f"{LOOSE} along x, along y, along z, against tilting about x"),
    "a gear alone": (
        BACK + joined("mesh", "gear_mesh", "crank.main[3]", "w.hub", **MESH),
        f"{LOOSE} along x, along y, along z, against tilting",
    ),
    "a film alone": (
        BACK + joined("bearing", "film", "w.hub", "block.bore[2]", **FILM),
        f"{LOOSE} along z, against tilting about x, against tilting about y; add one, such as",
    ),
    "a load alone": (BACK + joined("load", "load", "w.hub", "ground", force=([1, 0, 0], "N")), LOOSE),
    "a rod without its piston": (
        ROD,
        "frame 'r'.cylinder: the engine's own rod, piston and gas of cylinder 1 are left",
    ),
    "a rod about its pin": (
        ROD.replace("cylinder = { value = 1", "length = { value = 144")
        .replace('144, unit = "1"', '144, unit = "mm"')
        .replace('motion = "rod"', 'motion = "rod"\npin = { value = [0, 43], unit = "mm", origin = "chosen" }')
        + joined("pin", "spring", "crank.pin[1]", "w.hub", **HOLD),
        f"{LOOSE} against turning; add one",
    ),
    "coupling of two speeds": (
        BACK + joined("c", "coupling", "crank.main[3]", "w.hub", **ROUND),
        "connection 'c': a coupling joins bodies that turn alike, but its ends turn",
    ),
    "film at rest": (
        disc("w", "rest") + joined("c", "film", "w.hub", "ground", **FILM),
        "connection 'c': the first end of a bearing is its journal, which turns; exchange the ends",
    ),
    "gear on the ground": (
        BACK + joined("c", "gear_mesh", "w.hub", "ground", **MESH),
        "connection 'c': gears need two frames that turn",
    ),
    "belt to a body at rest": (
        disc("w", "rest") + joined("c", "belt", "crank.pulley", "w.hub", **BELT),
        "connection 'c': a belt needs two frames that turn, with axes apart; give the frames ratio and axis",
    ),
    "teeth against ratios": (
        ALONG + PLANETARY,
        "connection 'set': its ends' frames have the ratios 1, 0, 0.5, which its teeth do not allow; give the frame of "
        "end 3 the ratio 0.3",
    ),
    "pulleys in each other": (
        frame("half", 0.5, [0, 300])
        + disc("w", "half", 0, 300)
        + joined("c", "belt", "crank.pulley", "w.hub", **BELT | {"radius": (110, "mm")}),
        "connection 'c': pulleys of 110 and 220 mm radius have no room on axes 300 mm apart; give a smaller radius",
    ),
    "carrier beside the sun": (
        ALONG.replace("ratio = { value = 0.5", "ratio = { value = 0.3", 1).replace(
            "value = [0, 0]", "value = [9, 0]", 1
        )
        + PLANETARY,
        "connection 'set': frame 'arm' has another axis than frame 'sun', but a planetary gear has one",
    ),
    "a body without its file": (
        table("body", name="'w'", frame="'rest'", file="'none.h5'") + joined("c", "spring", "w.hub", "ground", **HOLD),
        "none.h5 is not a reduced body; write one by 'cranktrain reduce'",
    ),
    "two rigid gears of two shafts": (
        PAIR + HELD + joined("one", "rigid_gear", "w.hub", "v.hub") + joined("two", "rigid_gear", "v.hub", "w.hub"),
        "connection 'two': rigid gears turn its bodies with this ratio already; leave it out, or take a gear_mesh",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_tables_are_refused_in_one_line(tmp_path, capsys, case):
    tables, said = CASES[case]
    path = tmp_path / "four.toml"
    path.write_text(FOUR.read_text(encoding="utf-8").split("# Two shafts")[0] + tables, encoding="utf-8")
    assert main(["simulate", str(path), "--speed", "1500", "--crank", "beam"]) == 2
    (line,) = filter(None, capsys.readouterr().err.splitlines())
    assert said in line
